// From a hit point and its material to a pixel.
struct Appearance { color_rough: vec4f, other_metal: vec4f, pattern: vec4f };

fn pixel_color(position: vec3f, normal: vec3f, to_eye: vec3f, object: vec3f, object_normal: vec3f, s: f32, pixel: vec2f, place: vec3f, appearance: Appearance) -> vec3f {
    let width = footprint_at(s) / max(sqrt(abs(dot(normal, to_eye))), 0.15);
    let base = base_of(object, object_normal, place, width, appearance.color_rough, appearance.other_metal.xyz, appearance.pattern);
    if (SURFACE >= 100u) { return base.color; }
    let surface = Surface(position, normal, to_eye, pixel, base, appearance.other_metal.w);
    if (!REFLECTIONS) { return tone(shade_simply(surface)); }
    return tone(shade(surface));
}

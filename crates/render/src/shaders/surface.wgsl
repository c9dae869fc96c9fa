// From a hit point and its material to a pixel.
struct Look { color_rough: vec4f, other_metal: vec4f, pattern: vec4f };

fn pixel_color(position: vec3f, normal: vec3f, to_eye: vec3f, object: vec3f, object_normal: vec3f, s: f32, pixel: vec2f, place: vec3f, look: Look) -> vec3f {
    let width = footprint_at(s) / max(sqrt(abs(dot(normal, to_eye))), 0.15);
    let base = base_of(object, object_normal, place, width, look.color_rough, look.other_metal.xyz, look.pattern);
    if (SURFACE >= 100u) { return base.color; }
    let surface = Surface(position, normal, to_eye, pixel, base, look.other_metal.w);
    if (!REFLECTIONS) { return tone(shade_simply(surface)); }
    return tone(shade(surface));
}

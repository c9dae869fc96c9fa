// From a hit point and its material to a pixel.
struct Look { color_rough: vec4f, other_metal: vec4f, pattern: vec4f };

fn pixel_color(position: vec3f, normal: vec3f, to_eye: vec3f, object: vec3f, object_normal: vec3f, s: f32, pixel: vec2f, look: Look) -> vec3f {
    let width = footprint_at(s) / max(sqrt(abs(dot(normal, to_eye))), 0.15);
    let base = base_of(object, object_normal, width, look.color_rough, look.other_metal.xyz, look.pattern);
    if (SURFACE >= 100u) { return base.color; }
    return tone(shade(Surface(position, normal, to_eye, pixel, base, look.other_metal.w)));
}

// Edges of ray-cast spheres and capsules as whole pixels, for interfaces that cannot write a sample
// mask (OpenGL).
struct SpherePixel {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
};

fn sphere_pixel(color: vec4f, depth: f32, mask: u32) -> SpherePixel {
    return SpherePixel(color, depth);
}

fn sample_mask(sphere: vec4f, pixel: vec2f) -> u32 {
    return select(0u, 15u, inside(sphere, pixel) >= 0.0);
}

fn capsule_mask(sphere: vec4f, axis: vec4f, pixel: vec2f) -> u32 {
    return select(0u, 15u, inside_capsule(sphere, axis, pixel) >= 0.0);
}

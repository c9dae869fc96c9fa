// Edges of ray-cast spheres and capsules: each sample is tested against the exact outline.
struct SpherePixel {
    @location(0) color: vec4f,
    @builtin(frag_depth) depth: f32,
    @builtin(sample_mask) mask: u32,
};

fn sphere_pixel(color: vec4f, depth: f32, mask: u32) -> SpherePixel {
    return SpherePixel(color, depth, mask);
}

fn sample_mask(sphere: vec4f, pixel: vec2f) -> u32 {
    // the four standard sample positions
    var mask = 0u;
    if (inside(sphere, pixel + vec2f(-0.125, -0.375)) >= 0.0) { mask |= 1u; }
    if (inside(sphere, pixel + vec2f(0.375, -0.125)) >= 0.0) { mask |= 2u; }
    if (inside(sphere, pixel + vec2f(-0.375, 0.125)) >= 0.0) { mask |= 4u; }
    if (inside(sphere, pixel + vec2f(0.125, 0.375)) >= 0.0) { mask |= 8u; }
    return mask;
}

fn capsule_mask(sphere: vec4f, axis: vec4f, pixel: vec2f) -> u32 {
    var mask = 0u;
    if (inside_capsule(sphere, axis, pixel + vec2f(-0.125, -0.375)) >= 0.0) { mask |= 1u; }
    if (inside_capsule(sphere, axis, pixel + vec2f(0.375, -0.125)) >= 0.0) { mask |= 2u; }
    if (inside_capsule(sphere, axis, pixel + vec2f(-0.375, 0.125)) >= 0.0) { mask |= 4u; }
    if (inside_capsule(sphere, axis, pixel + vec2f(0.125, 0.375)) >= 0.0) { mask |= 8u; }
    return mask;
}

// A viewpoint: the camera or a light. Depth is reversed: 1 at the near plane, 0 at the far plane.
struct View {
    clip_from_world: mat4x4f,
    // The ray through a point of the picture (normalized device coordinates): origin and direction
    // are affine in it. The direction has view depth 1, so a ray parameter is a view depth.
    origin_0: vec4f, origin_x: vec4f, origin_y: vec4f,
    dir_0: vec4f, dir_x: vec4f, dir_y: vec4f,
    // depth = (x s + y) / (z s + w) at view depth s
    depth: vec4f,
    // width, height, and their inverses, in pixels
    size: vec4f,
    // x: 1 for perspective, 0 for parallel; y: meters per pixel per meter of view depth; z: meters
    // per pixel (parallel)
    lens: vec4f,
    // x, y: index of the first pixel, for noise that continues across pictures; z: largest reach of
    // occlusion, pixels
    grid: vec4f,
};
@group(0) @binding(0) var<uniform> view: View;

struct Ray { origin: vec3f, dir: vec3f };

fn ndc_of(pixel: vec2f) -> vec2f {
    return vec2f(2.0, -2.0) * pixel * view.size.zw + vec2f(-1.0, 1.0);
}

fn ray_at(pixel: vec2f) -> Ray {
    let n = ndc_of(pixel);
    return Ray(
        view.origin_0.xyz + n.x * view.origin_x.xyz + n.y * view.origin_y.xyz,
        view.dir_0.xyz + n.x * view.dir_x.xyz + n.y * view.dir_y.xyz,
    );
}

fn depth_of(s: f32) -> f32 {
    return (view.depth.x * s + view.depth.y) / (view.depth.z * s + view.depth.w);
}

// Behind the eye; a parallel view has none.
fn behind(s: f32) -> bool {
    return view.lens.x > 0.5 && s <= 0.0;
}

fn view_depth_of(depth: f32) -> f32 {
    return (view.depth.y - depth * view.depth.w) / (depth * view.depth.z - view.depth.x);
}

// View depth of a point; 1 for a parallel view, whose footprints are all equal.
fn view_depth_at(p: vec3f) -> f32 {
    return (view.clip_from_world * vec4f(p, 1.0)).w;
}

fn footprint_at(s: f32) -> f32 {
    return view.lens.y * s + view.lens.z;
}

// Ambient occlusion in screen space, after McGuire, Mara and Luebke, "Scalable Ambient Obscurance",
// 2012: A = max(0, 1 - 5 k / (r^6 n) * sum max(0, r^2 - v.v)^3 max(0, (v.n - b) / (v.v + e))), v
// from the point to its neighbors.
@group(1) @binding(0) var depth_map: texture_2d<f32>;
@group(1) @binding(1) var<uniform> reach: vec4f; // x: radius in meters
@group(1) @binding(2) var raw: texture_2d<f32>;

const TAPS = 20u;
// Cosine and sine of the golden angle, by which each tap is rotated against the previous one.
const GOLDEN = vec2f(-0.73736886, 0.67549032);

@vertex fn vs_whole(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

fn depth_at(p: vec2i) -> f32 {
    return textureLoad(depth_map, clamp(p, vec2i(0), vec2i(view.size.xy) - 1), 0).x;
}

fn point_at(p: vec2i) -> vec3f {
    let q = clamp(p, vec2i(0), vec2i(view.size.xy) - 1);
    let ray = ray_at(vec2f(q) + 0.5);
    return ray.origin + ray.dir * view_depth_of(textureLoad(depth_map, q, 0).x);
}

// The smaller of the two differences along one axis: the one that stays on the surface.
fn step_along(p: vec2i, d: vec2i, middle: vec3f) -> vec3f {
    let a = point_at(p + d) - middle;
    let b = middle - point_at(p - d);
    return select(b, a, dot(a, a) < dot(b, b));
}

@fragment fn fs_occlusion(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2i(at.xy);
    let depth = depth_at(p);
    if (depth <= 0.0) { return vec4f(1.0); }
    let here = point_at(p);
    let s = view_depth_of(depth);
    var n = normalize(cross(step_along(p, vec2i(1, 0), here), step_along(p, vec2i(0, 1), here)));
    if (dot(n, ray_at(at.xy).dir) > 0.0) { n = -n; }
    let r = reach.x;
    let r2 = r * r;
    // in steps of a sixteenth of an octave: taps are rounded to pixels, and the last bits of a
    // depth, which differ between facets, must not decide to which
    let pixels = min(exp2(floor(16.0 * log2(r / footprint_at(s))) / 16.0), view.grid.z);
    if (pixels < 1.0) { return vec4f(1.0); }
    // 16 rotations in a 4 x 4 tile; the blur averages them
    let tile = (u32(p.x) + u32(view.grid.x)) % 4u + 4u * ((u32(p.y) + u32(view.grid.y)) % 4u);
    let turn = 6.2831853 * f32((tile * 7u) % 16u) / 16.0;
    let least = 0.004 * r + 0.002 * footprint_at(s);
    var way = vec2f(cos(turn), sin(turn)) * (pixels / f32(TAPS));
    var sum = 0.0;
    for (var i = 0u; i < TAPS; i++) {
        let q = clamp(p + vec2i(round(way * (f32(i) + 0.5))), vec2i(0), vec2i(view.size.xy) - 1);
        way = vec2f(way.x * GOLDEN.x - way.y * GOLDEN.y, way.x * GOLDEN.y + way.y * GOLDEN.x);
        let z = textureLoad(depth_map, q, 0).x;
        let ray = ray_at(vec2f(q) + 0.5);
        let v = ray.origin + ray.dir * view_depth_of(z) - here;
        let vv = dot(v, v);
        let fall = max(r2 - vv, 0.0);
        // the far plane is empty
        sum += select(0.0, fall * fall * fall * max((dot(v, n) - least) / (vv + 0.01 * r2), 0.0), z > 0.0);
    }
    let open = max(0.0, 1.0 - sum * 3.0 * r / (r2 * r2 * r2 * f32(TAPS)));
    return vec4f(open);
}

@fragment fn fs_blur(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let p = vec2i(at.xy);
    let depth = depth_at(p);
    if (depth <= 0.0) { return vec4f(1.0); }
    let s = view_depth_of(depth);
    var sum = 0.0;
    var weight = 0.0;
    for (var y = -2; y <= 2; y++) {
        for (var x = -2; x <= 2; x++) {
            let q = p + vec2i(x, y);
            let z = depth_at(q);
            if (z <= 0.0) { continue; }
            let w = max(0.0, 1.0 - abs(view_depth_of(z) - s) / (0.35 * reach.x)) * select(1.0, 0.5, abs(x) == 2 || abs(y) == 2);
            sum += w * textureLoad(raw, clamp(q, vec2i(0), vec2i(view.size.xy) - 1), 0).x;
            weight += w;
        }
    }
    return vec4f(sum / max(weight, 1e-6));
}

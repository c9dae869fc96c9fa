// Strokes with a width in pixels, tapered for arrow heads, round for points; edges are smoothed by
// coverage.
struct StrokeIn {
    @location(0) start: vec4f, // w: width at the start, pixels
    @location(1) end: vec4f,
    @location(2) color: vec4f, // linear, alpha
    @location(3) kind: vec4f,  // x: 1 for a dot
};
struct StrokeOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(linear) across: vec2f, // pixels from the middle line; dots: both axes
    @location(1) @interpolate(linear) half: f32,
    @location(2) @interpolate(flat) color: vec4f,
    @location(3) @interpolate(flat) dot_kind: f32,
};

// The part of a to b in front of the near plane, in clip space (reversed depth: z <= w there).
fn clipped(a: vec4f, b: vec4f) -> vec4f {
    let fa = a.w - a.z;
    let fb = b.w - b.z;
    if (fa < 0.0 && fb > 0.0) { return mix(a, b, fa / (fa - fb) + 1e-4); }
    return a;
}

@vertex fn vs_line(in: StrokeIn, @builtin(vertex_index) index: u32) -> StrokeOut {
    let a0 = view.clip_from_world * vec4f(in.start.xyz, 1.0);
    let b0 = view.clip_from_world * vec4f(in.end.xyz, 1.0);
    let a = clipped(a0, b0);
    let b = clipped(b0, a0);
    let at_end = (index & 2u) != 0u;
    let side = select(-1.0, 1.0, (index & 1u) != 0u);
    let here = select(a, b, at_end);
    let px = 0.5 * view.size.xy;
    var along = (b.xy / b.w - a.xy / a.w) * px;
    along = select(vec2f(1.0, 0.0), normalize(along), dot(along, along) > 1e-12);
    let half = 0.5 * select(in.start.w, in.end.w, at_end);
    let reach = half + 1.0;
    var offset = vec2f(-along.y, along.x) * side * reach;
    var out: StrokeOut;
    out.across = vec2f(side * reach, 0.0);
    if (in.kind.x > 0.5) {
        let end_side = select(-1.0, 1.0, at_end);
        offset = vec2f(side, end_side) * reach;
        out.across = offset;
    }
    // slightly closer to the eye, so that lines on a surface are visible
    out.clip = vec4f(here.xy + offset / px * here.w, here.z + 2e-4 * max(here.z, 0.0), here.w);
    out.half = half;
    out.color = in.color;
    out.dot_kind = in.kind.x;
    return out;
}

@fragment fn fs_line(in: StrokeOut) -> @location(0) vec4f {
    let cover = clamp(in.half + 0.5 - length(in.across), 0.0, 1.0);
    let alpha = in.color.w * cover;
    return vec4f(in.color.xyz * alpha, alpha);
}

// A picture of fewer pixels, drawn larger: between the centers of its pixels the colors are mixed.
@group(0) @binding(0) var small: texture_2d<f32>;
@group(0) @binding(1) var between: sampler;

struct Corner {
    @builtin(position) at: vec4f,
    @location(0) place: vec2f,
};

@vertex fn vs_enlarge(@builtin(vertex_index) index: u32) -> Corner {
    let x = select(0.0, 2.0, index == 1u);
    let y = select(0.0, 2.0, index == 2u);
    return Corner(vec4f(2.0 * x - 1.0, 1.0 - 2.0 * y, 0.0, 1.0), vec2f(x, y));
}

@fragment fn fs_enlarge(corner: Corner) -> @location(0) vec4f {
    return textureSampleLevel(small, between, corner.place, 0.0);
}

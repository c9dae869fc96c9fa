// Places one eye's picture in the whole: mirrored, darkened, warped. The steps are those on the CPU
// (`facet/warp.rs`, `facet/blend.rs`).
struct Place {
    at: vec4f,   // left and top edge in the whole; 1 if left and right, top and bottom are swapped
    size: vec4f, // width and height; pixels of rim around the source; 1 if there is a warp
};
@group(0) @binding(0) var<uniform> place: Place;
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var warp: texture_2d<f32>;   // source of each pixel, centers at whole numbers; below -1e8 for black
@group(0) @binding(3) var shares: texture_2d<f32>; // fraction of its light that each pixel keeps; one texel if there is no mask

@vertex fn vs_place(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

fn texel(p: vec2i) -> vec3f {
    return textureLoad(source, clamp(p, vec2i(0), vec2i(place.size.xy) - 1) + i32(place.size.z), 0).xyz;
}

fn between(at: vec2f) -> vec3f {
    let base = floor(at);
    let f = at - base;
    let p = vec2i(base);
    let above = mix(texel(p), texel(p + vec2i(1, 0)), f.x);
    let below = mix(texel(p + vec2i(0, 1)), texel(p + vec2i(1, 1)), f.x);
    return mix(above, below, f.y);
}

@fragment fn fs_place(@builtin(position) at: vec4f) -> @location(0) vec4f {
    var p = vec2i(at.xy) - vec2i(place.at.xy);
    let last = vec2i(place.size.xy) - 1;
    if (place.at.z > 0.5) { p.x = last.x - p.x; }
    if (place.at.w > 0.5) { p.y = last.y - p.y; }
    var color = vec3f(0.0);
    if (place.size.w > 0.5) {
        let from_here = textureLoad(warp, p, 0).xy;
        if (from_here.x > -1e8) { color = between(from_here); }
    } else {
        color = texel(p);
    }
    let share = textureLoad(shares, min(p, vec2i(textureDimensions(shares)) - 1), 0).xyz;
    return vec4f(color * share, 1.0);
}

// Copies a picture into a window, pixel by pixel.
struct Place {
    how: vec4f, // x: 1 if the target stores numbers unconverted and needs sRGB; y, z: the picture's upper left corner, pixels
};
@group(0) @binding(0) var<uniform> place: Place;
@group(0) @binding(1) var picture: texture_2d<f32>;

@vertex
fn vs_place(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0, 0.0, 1.0);
}

fn srgb(c: vec3f) -> vec3f {
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

@fragment
fn fs_place(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let c = textureLoad(picture, vec2i(at.xy - place.how.yz), 0);
    return vec4f(select(c.rgb, srgb(c.rgb), place.how.x > 0.5), c.a);
}

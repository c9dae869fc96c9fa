// Places one eye's picture in the whole: mirrored, bent, blended, in the colors of its projector. The steps are those on
// the CPU (`facet/warp.rs`, `facet/cube.rs`, `facet/color.rs`).
struct Place {
    at: vec4f,    // left and top edge in the whole; 1 if left and right, top and bottom are swapped
    size: vec4f,  // width and height; pixels of rim around the source; 1 if there is a warp
    eye: vec4f,   // the eye in the cave; pixels of 90 degrees of a cube of pictures
    cube: vec4f,  // pixels beyond each edge of a face of the cube; written pixels: (y x + z y) mod 2 = w
    gain: vec4f,  // factors of light after the blend; 1 / gamma of the projector, 0 for sRGB
    lift: vec4f,  // light that is added where the mask allows it; nodes along an edge of the table of colors, 0 for none
};
@group(0) @binding(0) var<uniform> place: Place;
@group(0) @binding(1) var source: texture_2d<f32>;
@group(0) @binding(2) var warp: texture_2d<f32>;   // source of each pixel, centers at whole numbers, below -1e8 for black; or what it shows
@group(0) @binding(3) var shares: texture_2d<f32>; // fraction of its light that each pixel keeps, and of the lift; one texel if there is no mask
@group(0) @binding(4) var table: texture_2d<f32>;  // colors by red (right), green (down) and blue (in blocks, down)

@vertex fn vs_place(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0);
}

// The pixel of this picture that is finished here.
fn pixel(at: vec4f) -> vec2i {
    var p = vec2i(at.xy) - vec2i(place.at.xy);
    let last = vec2i(place.size.xy) - 1;
    if (place.at.z > 0.5) { p.x = last.x - p.x; }
    if (place.at.w > 0.5) { p.y = last.y - p.y; }
    return p;
}

// Whether a pixel of the whole belongs to this eye.
fn is_mine(at: vec4f) -> bool {
    let p = vec2i(at.xy) - vec2i(place.at.xy);
    return ((i32(place.cube.y) * p.x + i32(place.cube.z) * p.y) & 1) == i32(place.cube.w);
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

// The picture of the cube in a direction.
fn around(d: vec3f) -> vec3f {
    let size = abs(d);
    var face = 0.0;
    var a = 0.0;
    var b = d.z;
    var most = size.x;
    if (size.x >= size.y && size.x >= size.z) {
        face = select(0.0, 1.0, d.x < 0.0);
        a = select(-d.y, d.y, d.x < 0.0);
    } else if (size.y >= size.z) {
        face = select(2.0, 3.0, d.y < 0.0);
        a = select(d.x, -d.x, d.y < 0.0);
        most = size.y;
    } else {
        face = select(4.0, 5.0, d.z < 0.0);
        a = d.x;
        b = select(-d.y, d.y, d.z < 0.0);
        most = size.z;
    }
    let n = place.eye.w;
    let tile = n + 2.0 * place.cube.x;
    let corner = vec2f(face % 3.0, floor(face / 3.0)) * tile;
    let at = place.cube.x + vec2f(0.5 + 0.5 * a / most, 0.5 - 0.5 * b / most) * n - 0.5;
    let base = floor(at);
    let f = at - base;
    let p = vec2i(corner + base);
    let above = mix(textureLoad(source, p, 0).xyz, textureLoad(source, p + vec2i(1, 0), 0).xyz, f.x);
    let below = mix(textureLoad(source, p + vec2i(0, 1), 0).xyz, textureLoad(source, p + vec2i(1, 1), 0).xyz, f.x);
    return mix(above, below, f.y);
}

fn encoded(light: vec3f) -> vec3f {
    return select(1.055 * pow(light, vec3f(1.0 / 2.4)) - 0.055, 12.92 * light, light <= vec3f(0.0031308));
}

fn decoded(code: vec3f) -> vec3f {
    return select(pow((code + 0.055) / 1.055, vec3f(2.4)), code / 12.92, code <= vec3f(0.04045));
}

fn node(i: vec3i, n: i32) -> vec3f {
    return textureLoad(table, vec2i(i.x, i.y + n * i.z), 0).xyz;
}

// The color of the table between its nodes.
fn looked_up(code: vec3f) -> vec3f {
    let n = i32(place.lift.w);
    let at = clamp(code, vec3f(0.0), vec3f(1.0)) * f32(n - 1);
    let i = min(vec3i(at), vec3i(n - 2));
    let f = at - vec3f(i);
    let o = vec2i(0, 1);
    let near = mix(mix(node(i, n), node(i + o.yxx, n), f.x), mix(node(i + o.xyx, n), node(i + o.yyx, n), f.x), f.y);
    let far = mix(mix(node(i + o.xxy, n), node(i + o.yxy, n), f.x), mix(node(i + o.xyy, n), node(i + o.yyy, n), f.x), f.y);
    return mix(near, far, f.z);
}

// Light for a projector: blended, lifted, in its transfer curve. The target encodes as sRGB.
fn finished(color: vec3f, p: vec2i) -> vec4f {
    let share = textureLoad(shares, min(p, vec2i(textureDimensions(shares)) - 1), 0);
    let light = clamp(color * share.xyz * place.gain.xyz + place.lift.xyz * share.w, vec3f(0.0), vec3f(1.0));
    if (place.gain.w == 0.0 && place.lift.w == 0.0) { return vec4f(light, 1.0); }
    var code = encoded(light);
    if (place.gain.w > 0.0) { code = pow(light, vec3f(place.gain.w)); }
    if (place.lift.w > 0.0) { code = looked_up(code); }
    return vec4f(decoded(clamp(code, vec3f(0.0), vec3f(1.0))), 1.0);
}

@fragment fn fs_place(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if (!is_mine(at)) { discard; }
    let p = pixel(at);
    var color = vec3f(0.0);
    if (place.size.w > 0.5) {
        let from_here = textureLoad(warp, p, 0).xy;
        if (from_here.x > -1e8) { color = between(from_here); }
    } else {
        color = texel(p);
    }
    return finished(color, p);
}

@fragment fn fs_surface(@builtin(position) at: vec4f) -> @location(0) vec4f {
    if (!is_mine(at)) { discard; }
    let p = pixel(at);
    let shown = textureLoad(warp, p, 0);
    var color = vec3f(0.0);
    if (shown.w >= 0.0) { color = around(shown.xyz - shown.w * place.eye.xyz); }
    return finished(color, p);
}

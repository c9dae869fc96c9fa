// Procedural patterns over a base color, in the object's frame. `w` is the width of a pixel there,
// for filtering.
struct Base { color: vec3f, roughness: f32, coat: f32, sheen: f32 };

// Integral of a square wave that is -1 and 1 over halves of its period of 2.
fn triangle_wave(x: f32) -> f32 {
    return abs(fract(x * 0.5) * 2.0 - 1.0);
}

// The square wave averaged over [x - w/2, x + w/2].
fn square_wave(x: f32, w: f32) -> f32 {
    let h = max(w, 1e-5);
    return (triangle_wave(x - 0.5 * h) - triangle_wave(x + 0.5 * h)) / h;
}

// Fraction of [x - w/2, x + w/2] covered by lines of `width` centered on the integers.
fn line_cover(x: f32, width: f32, w: f32) -> f32 {
    let h = max(w, 1e-5);
    let a = x - 0.5 * h + 0.5 * width;
    let b = x + 0.5 * h + 0.5 * width;
    return (floor(b) * width + min(fract(b), width) - floor(a) * width - min(fract(a), width)) / h;
}

// One of 2^24 numbers for a sum of products of the coordinates of a corner.
fn corner(n: u32) -> f32 {
    let h = (n ^ (n >> 15u)) * 739982445u;
    return f32((h ^ (h >> 13u)) >> 8u);
}

// Smooth noise of patterns, 0 to 1. With cheap light it is that of a plane, along a direction that no face of a
// box has, with one short hash for each of four corners instead of three for each of eight: another grain, of
// the same size and about the same contrast.
fn grain(p: vec3f) -> f32 {
    if (REFLECTIONS) { return noise3(p); }
    let q = p.xy + vec2f(0.37, 0.91) * p.z;
    let base = floor(q);
    let i = vec2u(vec2i(clamp(base, vec2f(-1e9), vec2f(1e9)))) * vec2u(2376512323u, 3625334849u);
    let j = i + vec2u(2376512323u, 3625334849u);
    let f = q - base;
    let u = f * f * (3.0 - 2.0 * f);
    let a = mix(corner(i.x + i.y), corner(j.x + i.y), u.x);
    let b = mix(corner(i.x + j.y), corner(j.x + j.y), u.x);
    return 0.1 + 0.8 * mix(a, b, u.y) / 16777216.0;
}

// Smooth noise along a line through the middles of the cells of row `row`. Four corners have the half of the
// deviation of one.
fn drift(x: f32, row: i32) -> f32 {
    if (REFLECTIONS) { return noise3(vec3f(x, f32(row) + 0.5, 0.5)); }
    let base = floor(x);
    let i = u32(i32(clamp(base, -1e9, 1e9))) * 2376512323u + u32(row) * 3625334849u;
    let f = x - base;
    return 0.25 + 0.5 * mix(corner(i), corner(i + 2376512323u), f * f * (3.0 - 2.0 * f)) / 16777216.0;
}

fn checker(p: vec3f, w: vec3f) -> f32 {
    return 0.5 + 0.5 * square_wave(p.x, w.x) * square_wave(p.y, w.y) * square_wave(p.z, w.z);
}

fn segment_distance(p: vec2f, a: vec2f, b: vec2f) -> f32 {
    let d = b - a;
    return length(p - a - d * clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0));
}

// Distance to a digit made of strokes in a box of 1 x 2 around the origin.
fn digit_distance(p: vec2f, digit: u32) -> f32 {
    var masks = array<u32, 10>(63u, 6u, 91u, 79u, 102u, 109u, 125u, 7u, 127u, 111u);
    let bits = masks[min(digit, 9u)];
    let x = 0.5;
    var d = 1e9;
    if ((bits & 1u) != 0u) { d = min(d, segment_distance(p, vec2f(-x, 1.0), vec2f(x, 1.0))); }
    if ((bits & 2u) != 0u) { d = min(d, segment_distance(p, vec2f(x, 1.0), vec2f(x, 0.0))); }
    if ((bits & 4u) != 0u) { d = min(d, segment_distance(p, vec2f(x, 0.0), vec2f(x, -1.0))); }
    if ((bits & 8u) != 0u) { d = min(d, segment_distance(p, vec2f(-x, -1.0), vec2f(x, -1.0))); }
    if ((bits & 16u) != 0u) { d = min(d, segment_distance(p, vec2f(-x, 0.0), vec2f(-x, -1.0))); }
    if ((bits & 32u) != 0u) { d = min(d, segment_distance(p, vec2f(-x, 1.0), vec2f(-x, 0.0))); }
    if ((bits & 64u) != 0u) { d = min(d, segment_distance(p, vec2f(-x, 0.0), vec2f(x, 0.0))); }
    return d;
}

fn number_distance(p: vec2f, number: u32) -> f32 {
    if (number < 10u) { return digit_distance(p, number); }
    let wide = p * 1.15;
    return min(digit_distance(wide + vec2f(0.85, 0.0), number / 10u), digit_distance(wide - vec2f(0.85, 0.0), number % 10u));
}

const IVORY = vec3f(0.87, 0.84, 0.76);
const INK = vec3f(0.012, 0.012, 0.014);

// A solid or striped billiard ball, or the cue ball; `d` is the direction from the center, `w` the
// angle of a pixel.
fn billiard_ball(color: vec3f, d: vec3f, w: f32, number: u32, stripe: bool) -> vec3f {
    if (number == 0u && !stripe) {
        let off = 1.0 - max(max(abs(d.x), abs(d.y)), abs(d.z));
        let r = 0.0135;
        return mix(vec3f(0.55, 0.02, 0.02), color, smoothstep(r - 0.15 * w - 0.002, r + 0.15 * w + 0.002, off));
    }
    var c = color;
    if (stripe) { c = mix(color, IVORY, smoothstep(-w, w, abs(asin(clamp(d.z, -1.0, 1.0))) - 0.56)); }
    if (number == 0u) { return c; }
    let angle = acos(clamp(abs(d.x), 0.0, 1.0));
    let spot = 0.50;
    let flat_d = vec2f(select(-d.y, d.y, d.x > 0.0), d.z);
    let ink = number_distance(flat_d / spot * 2.3, number) * spot / 2.3;
    let face = mix(INK, IVORY, smoothstep(-w, w, ink - 0.042));
    return mix(face, c, smoothstep(-w, w, angle - spot));
}

// Growth rings around an axis along x, cut into boards `board` wide; `dark` tints the late wood.
fn wood(color: vec3f, dark: vec3f, p: vec3f, ring: f32, board: f32, w: f32) -> vec3f {
    var q = p;
    var tint = 0.0;
    var joint = 0.0;
    var bold = 0.75;
    if (board > 0.0) {
        let row = floor(p.y / board);
        let id = i32(clamp(row, -1e9, 1e9));
        tint = hash3(vec3i(id, 11, 5)) - 0.5;
        q.y = p.y - (row + 0.5) * board + (hash3(vec3i(id, 3, 7)) - 0.5) * 6.0 * ring;
        q.x = p.x + hash3(vec3i(id, 1, 2)) * 40.0 * ring * 10.0;
        q.z = p.z + hash3(vec3i(id, 8, 2)) * 4.0 * ring;
        bold = 0.38;
        joint = line_cover(p.y / board, 0.035, w / board);
    }
    // the pith lies below the cut and varies slowly, so that rings open into long arches
    let wander = vec2f(drift(q.x / (ring * 60.0), 3), drift(q.x / (ring * 45.0), 7)) - 0.5;
    let radial = vec2f(q.y * 0.8, q.z + ring * 3.0) + wander * ring * 7.0;
    let rough = grain(vec3f(q.x / (ring * 25.0), q.y / (ring * 2.0), q.z / (ring * 2.0))) - 0.5;
    let phase = length(radial) / ring + rough * 0.9;
    let saw = fract(phase);
    let visible = 1.0 - smoothstep(0.25, 1.2, w / ring);
    let late = mix(0.35, smoothstep(0.15, 0.85, saw) * (1.0 - smoothstep(0.88, 1.0, saw)), visible);
    let fiber_at = vec3f(q.x / (ring * 9.0), q.y / (ring * 0.12), q.z / (ring * 0.12));
    let fiber_visible = 1.0 - smoothstep(0.05, 0.5, w / ring);
    let fiber = (grain(fiber_at) - 0.5) * fiber_visible;
    let c = mix(color, dark, clamp(bold * late + 0.28 * fiber + 0.18 * rough * visible, 0.0, 1.0)) * (1.0 + 0.34 * tint);
    return mix(c, dark * 0.35, 0.75 * clamp(joint, 0.0, 1.0));
}

@group(2) @binding(0) var albedo: texture_2d<f32>;
@group(2) @binding(1) var albedo_sampler: sampler;

// The texture at a point. Its coordinates come from the mesh (repeat below 0), go once around a
// sphere (0), or are projected from the side that the surface faces most. The mipmap level is that
// of a pixel `w` wide.
fn texture_at(p: vec3f, n: vec3f, place: vec3f, w: f32, repeat: f32) -> vec3f {
    let texels = vec2f(textureDimensions(albedo));
    let side = abs(n);
    var uv = vec2f(atan2(n.y, n.x) / 6.2831853 + 0.5, 0.5 - asin(clamp(n.z, -1.0, 1.0)) / 3.1415927);
    var across = w / max(6.2831853 * length(p), 1e-6);
    if (repeat > 0.0) {
        var q = vec2f(p.x, -p.y);
        if (side.x > side.y && side.x > side.z) { q = vec2f(p.y * sign(n.x), -p.z); }
        else if (side.y > side.z) { q = vec2f(-p.x * sign(n.y), -p.z); }
        uv = q / repeat;
        across = w / repeat;
    } else if (repeat < 0.0) {
        uv = place.xy;
        across = w * place.z;
    }
    return textureSampleLevel(albedo, albedo_sampler, uv, log2(max(across * max(texels.x, texels.y), 1.0))).xyz;
}

fn base_of(p: vec3f, n: vec3f, place: vec3f, w: f32, color_rough: vec4f, other: vec3f, pattern: vec4f) -> Base {
    var base = Base(color_rough.xyz, color_rough.w, pattern.x, 0.0);
    let size = max(pattern.zw, vec2f(1e-6));
    switch SURFACE % 100u {
        case 1u: {
            // a face in a plane of the lattice would flicker, so the sample is slightly inside
            let q = (p - n * 1e-3 * size.x) / size.x;
            base.color = mix(other, color_rough.xyz, checker(q, vec3f(w / size.x) * (1.0 - n * n * 0.999)));
        }
        case 2u: {
            let q = p.xy / size.x;
            let h = w / size.x;
            let fine = max(line_cover(q.x, size.y / size.x, h), line_cover(q.y, size.y / size.x, h));
            let tenth = max(line_cover(q.x * 0.1, 0.2 * size.y / size.x, h * 0.1), line_cover(q.y * 0.1, 0.2 * size.y / size.x, h * 0.1));
            base.color = mix(color_rough.xyz, other, clamp(max(0.7 * fine, tenth), 0.0, 1.0));
        }
        case 3u: {
            base.color = billiard_ball(color_rough.xyz, normalize(p), w / max(length(p), 1e-6), u32(pattern.z), pattern.w > 0.5);
        }
        case 4u: {
            // boards continue over the sides that they would lie flat in
            let beside = abs(n.y) > max(abs(n.x), abs(n.z));
            base.color = wood(color_rough.xyz, other, select(p, p.xzy, beside), size.x, pattern.w, w);
        }
        case 5u: {
            let q = p / size.x;
            let visible = 1.0 - smoothstep(0.3, 1.5, w / size.x);
            let weave = (grain(q * vec3f(1.0, 0.25, 1.0)) + grain(q * vec3f(0.25, 1.0, 1.0) + 17.0) - 1.0) * visible;
            let worn = grain(p * 9.0) + 0.5 * grain(p * 31.0) - 0.75;
            base.color = color_rough.xyz * (1.0 + 0.55 * weave + 0.10 * worn);
            base.sheen = 0.35;
        }
        case 6u: {
            let width = pattern.w - pattern.z;
            let one = smoothstep(-w, w, 0.5 * width - abs(p.z - pattern.z - 0.5 * width));
            let two = smoothstep(-w, w, 0.5 * width - abs(p.z - pattern.z - 2.0 * width));
            base.color = mix(color_rough.xyz, other, max(one, two));
        }
        case 7u: {
            let q = p / size.x;
            let bent = q + 1.6 * vec3f(grain(q + 7.3), grain(q + 19.1), grain(q + 31.7));
            let fine = (grain(bent * 4.0) - 0.5) * (1.0 - smoothstep(0.1, 0.5, w / size.x));
            let ridge = abs(grain(bent) - 0.5) * 2.0 + 0.25 * fine;
            base.color = mix(other, color_rough.xyz, smoothstep(0.0, 0.45, ridge));
        }
        default: {}
    }
    if (TEXTURED) { base.color *= texture_at(p, n, place, w, pattern.y); }
    return base;
}

// Spheres by ray casting inside a tight square. Each sample of a pixel is tested against the exact
// outline, so edges are as smooth as those of triangles. Color and depth are those of the pixel's
// center.
struct SphereIn {
    @location(0) sphere: vec4f, // center, radius
    @location(1) turn: vec4f, // quaternion x, y, z, w: object to world
    @location(2) color_rough: vec4f,
    @location(3) other_metal: vec4f,
    @location(4) pattern: vec4f,
};
struct SphereOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) sphere: vec4f,
    @location(1) @interpolate(flat) turn: vec4f,
    @location(2) @interpolate(flat) color_rough: vec4f,
    @location(3) @interpolate(flat) other_metal: vec4f,
    @location(4) @interpolate(flat) pattern: vec4f,
    //KEPT 5
};
struct Hit { s: f32, position: vec3f, normal: vec3f, to_eye: vec3f };

fn corner_of(index: u32) -> vec2f {
    return vec2f(select(-1.0, 1.0, (index & 1u) != 0u), select(-1.0, 1.0, (index & 2u) != 0u));
}

// A square around the sphere's outline, in the plane through its center c perpendicular to the
// direction to the eye. The outline is a circle there: its radius is h² = r² d² / (d² - r²) at the
// distance d in perspective, and h = r in a parallel view. If the eye is too near, the square is
// the whole picture.
struct Cover {
    clip: vec4f,
    plane: vec2f,    // place in the plane, m from the center
    numbers: vec3f,  // d², d² - r², h²
    near: bool,
    depth: f32,      // of the plane
};

fn clip_row(i: u32) -> vec3f {
    let m = view.clip_from_world;
    return vec3f(m[0][i], m[1][i], m[2][i]);
}

// Whether a sphere lies entirely to a side of the picture: the planes of the sides are w + x = 0, w
// - x = 0, w + y = 0 and w - y = 0.
fn beside(middle: vec4f, radius: f32) -> bool {
    let x = clip_row(0u);
    let y = clip_row(1u);
    let w = clip_row(3u);
    let way = vec4f(middle.w) + vec4f(middle.x, -middle.x, middle.y, -middle.y);
    let reach = vec4f(length(w + x), length(w - x), length(w + y), length(w - y));
    return any(way < -1.001 * radius * reach);
}

fn cover(sphere: vec4f, index: u32) -> Cover {
    let corner = corner_of(index);
    let middle = view.clip_from_world * vec4f(sphere.xyz, 1.0);
    let aside = beside(middle, sphere.w);
    let whole = Cover(select(vec4f(corner, 0.5, 1.0), NOWHERE, aside), vec2f(0.0), vec3f(0.0), !aside, select(1.0, NOWHERE.z, aside));
    var axis = view.dir_0.xyz;
    let r2 = sphere.w * sphere.w;
    var numbers = vec3f(1.0, 1.0, r2);
    if (view.lens.x > 0.5) {
        axis = sphere.xyz - view.origin_0.xyz;
        let d2 = dot(axis, axis);
        if (d2 < 2.0 * r2) { return whole; }
        numbers = vec3f(d2, d2 - r2, r2 * d2 / (d2 - r2));
    }
    let half = sqrt(numbers.z);
    axis = normalize(axis);
    let side = normalize(cross(axis, select(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), abs(axis.z) > 0.9)));
    let up = cross(side, axis);
    // w is affine in the corner; its smallest value decides whether a corner lies behind the eye
    let row = clip_row(3u);
    let least = middle.w - half * (abs(dot(row, side)) + abs(dot(row, up)));
    if (view.lens.x > 0.5 && least < 1e-3 * half) {
        if (middle.w < -1.5 * half) { return Cover(NOWHERE, vec2f(0.0), numbers, false, NOWHERE.z); }
        return whole;
    }
    let reach = half * 1.002 * corner;
    let clip = view.clip_from_world * vec4f(sphere.xyz + side * reach.x + up * reach.y, 1.0);
    return Cover(vec4f(clip.xy, 0.5 * clip.w, clip.w), reach, numbers, false, clip.z / clip.w);
}

// Outside the picture.
const NOWHERE = vec4f(0.0, 0.0, 2.0, 1.0);

@vertex fn vs_shell(in: SphereIn, @builtin(vertex_index) index: u32) -> SphereOut {
    let c = cover(in.sphere, index);
    return SphereOut(vec4f(c.clip.xy / c.clip.w, c.clip.z / c.clip.w, 1.0), in.sphere, in.turn, in.color_rough, in.other_metal, in.pattern /*KEPT*/);
}

// A sphere that may be visible, and its index.
struct BoundsIn { @location(0) sphere: vec4f, @location(1) id: u32 };

// One of the four texels that describe a sphere: center and radius; colors, roughness and metallic,
// two per word; orientation; the rest of its appearance.
fn sphere_texel(id: u32, i: u32) -> vec4u {
    return textureLoad(sphere_data, vec2i(vec2u((id % 256u) * 4u + i, id / 256u)), 0);
}

fn read_appearance(id: u32) -> Appearance {
    let t = sphere_texel(id, 1u);
    return Appearance(
        vec4f(unpack2x16unorm(t.x), unpack2x16unorm(t.y)),
        vec4f(unpack2x16unorm(t.z), unpack2x16unorm(t.w)),
        bitcast<vec4f>(sphere_texel(id, 3u)),
    );
}

@vertex fn vs_sphere(in: BoundsIn, @builtin(vertex_index) index: u32) -> SphereOut {
    let c = cover(in.sphere, index);
    let appearance = read_appearance(in.id);
    return SphereOut(vec4f(c.clip.xy / c.clip.w, c.clip.z / c.clip.w, 1.0), in.sphere, bitcast<vec4f>(sphere_texel(in.id, 2u)), appearance.color_rough, appearance.other_metal, appearance.pattern /*KEPT*/);
}

// With d the ray's direction, of length 1, and c the vector to the center: m = c - (c·d) d is the
// vector from the closest point of the ray to the center. The ray enters q = sqrt(r² - m²) before
// that point, and the normal there is -(m + q d) / r.
struct Crossing { room: f32, before: f32, miss: vec3f, dir: vec3f, per_length: f32 };

fn cross_sphere(sphere: vec4f, pixel: vec2f) -> Crossing {
    let ray = ray_at(pixel);
    let per_length = inverseSqrt(dot(ray.dir, ray.dir));
    let dir = ray.dir * per_length;
    let to = sphere.xyz - ray.origin;
    let before = dot(to, dir);
    let miss = to - before * dir;
    return Crossing(sphere.w * sphere.w - dot(miss, miss), before, miss, dir, per_length);
}

// View depth at which the ray enters; if it just misses, that of its closest point.
fn entry(c: Crossing) -> f32 {
    return (c.before - sqrt(max(c.room, 0.0))) * c.per_length;
}

// Square of the radius less the square of the ray's distance from the center.
fn inside(sphere: vec4f, pixel: vec2f) -> f32 {
    return cross_sphere(sphere, pixel).room;
}

fn hit(sphere: vec4f, pixel: vec2f) -> Hit {
    let c = cross_sphere(sphere, pixel);
    let n = -(c.miss + sqrt(max(c.room, 0.0)) * c.dir) / sqrt(sphere.w * sphere.w - min(c.room, 0.0));
    return Hit(entry(c), sphere.xyz + n * sphere.w, n, -c.dir);
}

fn unturn(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(-q.xyz, v);
    return v + q.w * t + cross(-q.xyz, t);
}

@fragment fn fs_sphere(in: SphereOut) -> SpherePixel {
    //TAKE
    let pixel = in.clip.xy;
    let mask = sample_mask(in.sphere, pixel);
    let h = hit(in.sphere, pixel);
    let depth = depth_of(h.s);
    if (mask == 0u || behind(h.s) || depth > 1.0 || depth < 0.0) { discard; }
    let object_normal = unturn(in.turn, h.normal);
    let color = pixel_color(h.position, h.normal, h.to_eye, object_normal * in.sphere.w, object_normal, h.s, pixel, vec3f(0.0),
        Appearance(in.color_rough, in.other_metal, in.pattern));
    return sphere_pixel(vec4f(color, 1.0), depth, mask);
}

// Depth alone needs less. Let t = u / d be the place in the plane of the cover as a tangent, k = r²
// / d², and w the view depth of that place. The ray through it enters at the view depth s with 1 /
// s = (1 + sqrt(k - (1 - k) t²)) / (w (1 - k)). Everything in 1 / s = W + sqrt(S² - T²),   W = 1 /
// (w (1 - k)),   S = sqrt(k) W,   T = t / (w sqrt(1 - k)) is affine in the picture, and depth is
// affine in 1 / s. In a parallel view -s = W + sqrt(S² - T²) with W = -(view depth of the center),
// S = r, T = u.
struct BoundsOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(linear) at: vec4f, // T, W, S
    @location(1) @interpolate(flat) id: u32,
    @location(2) @interpolate(flat) line: vec2f, // depth = x + y (W + sqrt(S² - T²))
};

@vertex fn vs_bounds(in: BoundsIn, @builtin(vertex_index) index: u32) -> BoundsOut {
    let c = cover(in.sphere, index);
    let per_w = 1.0 / c.clip.w;
    var at = vec4f(c.plane, 0.0, sqrt(c.numbers.z));
    if (view.lens.x > 0.5) {
        let k = in.sphere.w * in.sphere.w / c.numbers.x;
        let far = per_w * c.numbers.x / c.numbers.y; // 1 / (w (1 - k))
        at = vec4f(c.plane * (per_w * inverseSqrt(c.numbers.y)), far, sqrt(k) * far);
    } else {
        at.z = -dot(in.sphere.xyz - view.origin_0.xyz, view.dir_0.xyz) / dot(view.dir_0.xyz, view.dir_0.xyz);
    }
    let line = select(vec2f(view.depth.y, -view.depth.x), view.depth.xy, view.lens.x > 0.5);
    return BoundsOut(select(vec4f(c.clip.xyz * per_w, 1.0), NOWHERE, c.near), at, in.id, line);
}

fn bounds_depth(at: vec4f, line: vec2f) -> f32 {
    let room = at.w * at.w - dot(at.xy, at.xy);
    let depth = line.x + line.y * (at.z + sqrt(max(room, 0.0)));
    if (room < 0.0 || depth > 1.0 || depth < 0.0) { discard; }
    return depth;
}

@fragment fn fs_bounds_depth(in: BoundsOut) -> @builtin(frag_depth) f32 {
    return bounds_depth(in.at, in.line);
}

struct BoundsPixel { @location(0) id: u32, @builtin(frag_depth) depth: f32 };

// Index of the nearest sphere, from 1 on.
@fragment fn fs_bounds_id(in: BoundsOut) -> BoundsPixel {
    return BoundsPixel(in.id + 1u, bounds_depth(in.at, in.line));
}

// Spheres too near to the eye, drawn over the whole picture.
struct NearOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) sphere: vec4f,
    @location(1) @interpolate(flat) id: u32,
};

@vertex fn vs_near(in: BoundsIn, @builtin(vertex_index) index: u32) -> NearOut {
    let c = cover(in.sphere, index);
    return NearOut(select(NOWHERE, c.clip, c.near), in.sphere, in.id);
}

fn near_depth(sphere: vec4f, pixel: vec2f) -> f32 {
    let c = cross_sphere(sphere, pixel);
    let s = entry(c);
    let depth = depth_of(s);
    if (c.room < 0.0 || behind(s) || depth > 1.0 || depth < 0.0) { discard; }
    return depth;
}

@fragment fn fs_near_depth(in: NearOut) -> @builtin(frag_depth) f32 {
    //TAKE view
    return near_depth(in.sphere, in.clip.xy);
}

@fragment fn fs_near_id(in: NearOut) -> BoundsPixel {
    //TAKE view
    return BoundsPixel(in.id + 1u, near_depth(in.sphere, in.clip.xy));
}

struct SeenOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) range: vec2u,
    //KEPT 1
};

// All spheres of one surface at once, if the nearest is known: each pixel is lit once.
@fragment fn fs_sphere_seen(in: SeenOut) -> @location(0) vec4f {
    //TAKE
    let at = in.clip;
    let range = in.range;
    let id = textureLoad(seen_id, vec2i(at.xy), 0).x - 1u;
    if (id < range.x || id >= range.y) { discard; }
    let sphere = bitcast<vec4f>(sphere_texel(id, 0u));
    let turn = bitcast<vec4f>(sphere_texel(id, 2u));
    let appearance = read_appearance(id);
    let h = hit(sphere, at.xy);
    let object_normal = unturn(turn, h.normal);
    return vec4f(pixel_color(h.position, h.normal, h.to_eye, object_normal * sphere.w, object_normal, h.s, at.xy, vec3f(0.0), appearance), 1.0);
}

// The whole picture, for a range of sphere indices.
@vertex fn vs_seen(@location(0) range: vec2u, @builtin(vertex_index) index: u32) -> SeenOut {
    return SeenOut(vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0), range /*KEPT*/);
}

// A translucent shell: clear in the middle, denser at the rim.
@fragment fn fs_shell(in: SphereOut) -> SpherePixel {
    //TAKE
    let pixel = in.clip.xy;
    let mask = sample_mask(in.sphere, pixel);
    let h = hit(in.sphere, pixel);
    let depth = depth_of(h.s);
    if (mask == 0u || behind(h.s) || depth > 1.0 || depth < 0.0) { discard; }
    let rim = 1.0 - clamp(dot(h.normal, h.to_eye), 0.0, 1.0);
    let alpha = in.color_rough.w * mix(0.25, 1.0, rim * rim);
    return sphere_pixel(vec4f(in.color_rough.xyz * alpha, alpha), depth, mask);
}

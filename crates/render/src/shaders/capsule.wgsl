// Capsules by ray casting inside a tight box. The far sides of the box are drawn, so the eye may be
// inside it.
//
// A capsule contains all points within r of the segment c + u a, |u| <= h. Let o be the point of
// the ray nearest to c, D its direction with view depth 1, and a' = a less its part along D. The
// ray is closest to the segment at u = -(c - o)·a' / a'·a', clamped to the segment. It enters the
// round wall at t² A + 2 t B + C = 0 with A = D·D - (D·a)²,  B = (o - c)·D - (D·a) ((o - c)·a),  C
// = |o - c|² - ((o - c)·a)² - r², and beyond an end it enters the sphere around that end.
struct CapsuleIn {
    @location(0) sphere: vec4f, // center, radius
    @location(1) turn: vec4f, // quaternion x, y, z, w: object to world; the axis is z
    @location(2) color_rough: vec4f,
    @location(3) other_metal: vec4f,
    @location(4) pattern: vec4f,
    @location(5) half_length: vec4f, // x: of the segment
};
struct CapsuleOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) sphere: vec4f,
    @location(1) @interpolate(flat) turn: vec4f,
    @location(2) @interpolate(flat) color_rough: vec4f,
    @location(3) @interpolate(flat) other_metal: vec4f,
    @location(4) @interpolate(flat) pattern: vec4f,
    @location(5) @interpolate(flat) axis: vec4f, // a, h
    //KEPT 6
};

fn turned(q: vec4f, v: vec3f) -> vec3f {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// Corners of a cube's sides as a strip of triangles that face outward.
const STRIP = array<u32, 14>(6u, 7u, 2u, 3u, 1u, 7u, 5u, 6u, 4u, 2u, 0u, 1u, 4u, 5u);

// A corner of the box, and the axis of the capsule.
struct CapsuleCorner { clip: vec4f, axis: vec4f };

fn capsule_corner(in: CapsuleIn, index: u32) -> CapsuleCorner {
    var strip = STRIP;
    let k = strip[index];
    let corner = vec3f(select(-1.0, 1.0, (k & 1u) != 0u), select(-1.0, 1.0, (k & 2u) != 0u), select(-1.0, 1.0, (k & 4u) != 0u));
    let r = 1.001 * in.sphere.w;
    let at = in.sphere.xyz + turned(in.turn, corner * vec3f(r, r, r + in.half_length.x));
    var clip = view.clip_from_world * vec4f(at, 1.0);
    // far sides beyond the far plane are drawn on it
    clip.z = max(clip.z, 0.0);
    return CapsuleCorner(clip, vec4f(turned(in.turn, vec3f(0.0, 0.0, 1.0)), in.half_length.x));
}

@vertex fn vs_capsule(in: CapsuleIn, @builtin(vertex_index) index: u32) -> CapsuleOut {
    let c = capsule_corner(in, index);
    return CapsuleOut(c.clip, in.sphere, in.turn, in.color_rough, in.other_metal, in.pattern, c.axis /*KEPT*/);
}

struct CapsuleDepthOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) sphere: vec4f,
    @location(1) @interpolate(flat) axis: vec4f,
};

@vertex fn vs_capsule_depth(in: CapsuleIn, @builtin(vertex_index) index: u32) -> CapsuleDepthOut {
    let c = capsule_corner(in, index);
    return CapsuleDepthOut(c.clip, in.sphere, c.axis);
}

// The ray, its parameter nearest to the middle, the vector from there to the middle, and the
// closest place on the segment.
struct Passing { ray: Ray, nearest: f32, to: vec3f, u: f32, room: f32 };

fn pass_capsule(sphere: vec4f, axis: vec4f, pixel: vec2f) -> Passing {
    let ray = ray_at(pixel);
    let per = 1.0 / dot(ray.dir, ray.dir);
    let whole = sphere.xyz - ray.origin;
    let nearest = dot(whole, ray.dir) * per;
    let to = whole - nearest * ray.dir;
    let across = axis.xyz - dot(axis.xyz, ray.dir) * per * ray.dir;
    let u = clamp(-dot(to, across) / max(dot(across, across), 1e-9), -axis.w, axis.w);
    let miss = to + u * across;
    return Passing(ray, nearest, to, u, sphere.w * sphere.w - dot(miss, miss));
}

fn inside_capsule(sphere: vec4f, axis: vec4f, pixel: vec2f) -> f32 {
    return pass_capsule(sphere, axis, pixel).room;
}

fn hit_capsule(sphere: vec4f, axis: vec4f, pixel: vec2f) -> Hit {
    let p = pass_capsule(sphere, axis, pixel);
    let d = p.ray.dir;
    let a = axis.xyz;
    let d_a = dot(d, a);
    let o = -p.to;
    let o_a = dot(o, a);
    let o_d = dot(o, d);
    let wide = max(dot(d, d) - d_a * d_a, 1e-9);
    let half = o_d - d_a * o_a;
    var t = (-half - sqrt(max(half * half - wide * (dot(o, o) - o_a * o_a - sphere.w * sphere.w), 0.0))) / wide;
    var u = o_a + t * d_a;
    if (p.room <= 0.0) {
        // at the rim the ray may just miss: the normal is that of the closest point
        u = p.u;
        t = dot(p.to + u * a, d) / dot(d, d);
    } else if (abs(u) > axis.w) {
        u = clamp(u, -axis.w, axis.w);
        let end = p.to + u * a;
        let per = 1.0 / dot(d, d);
        let near = dot(end, d) * per;
        let miss = end - near * d;
        t = near - sqrt(max(sphere.w * sphere.w - dot(miss, miss), 0.0) * per);
    }
    let n = normalize(t * d - p.to - u * a);
    return Hit(p.nearest + t, sphere.xyz + u * a + n * sphere.w, n, -normalize(d));
}

fn capsule_depth(in: CapsuleDepthOut) -> f32 {
    let p = inside_capsule(in.sphere, in.axis, in.clip.xy);
    let h = hit_capsule(in.sphere, in.axis, in.clip.xy);
    let depth = depth_of(h.s);
    if (p < 0.0 || behind(h.s) || depth > 1.0 || depth < 0.0) { discard; }
    return depth;
}

@fragment fn fs_capsule_depth(in: CapsuleDepthOut) -> @builtin(frag_depth) f32 {
    //TAKE view
    return capsule_depth(in);
}

// The index of the nearest sphere: none.
@fragment fn fs_capsule_no_id(in: CapsuleDepthOut) -> BoundsPixel {
    //TAKE view
    return BoundsPixel(0u, capsule_depth(in));
}

@fragment fn fs_capsule(in: CapsuleOut) -> SpherePixel {
    //TAKE
    let pixel = in.clip.xy;
    let mask = capsule_mask(in.sphere, in.axis, pixel);
    let h = hit_capsule(in.sphere, in.axis, pixel);
    let depth = depth_of(h.s);
    if (mask == 0u || behind(h.s) || depth > 1.0 || depth < 0.0) { discard; }
    let color = pixel_color(h.position, h.normal, h.to_eye, unturn(in.turn, h.position - in.sphere.xyz), unturn(in.turn, h.normal), h.s, pixel, vec3f(0.0),
        Appearance(in.color_rough, in.other_metal, in.pattern));
    // slightly nearer than in the depth pass, if there was one
    return sphere_pixel(vec4f(color, 1.0), min(depth * 1.000001, 1.0), mask);
}

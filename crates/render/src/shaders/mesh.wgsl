struct MeshIn {
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) row_x: vec4f, // rows of the 3 x 4 matrix from object to world
    @location(3) row_y: vec4f,
    @location(4) row_z: vec4f,
    @location(5) color_rough: vec4f,
    @location(6) other_metal: vec4f,
    @location(7) pattern: vec4f,
    @location(8) place: vec3f, // texture coordinates, and repetitions per meter
};
// Interpolated at a point inside the triangle (centroid). At the center of a pixel that a thin
// triangle only touches, the values would be extrapolated. llvmpipe still multiplies by the w of
// the pixel's center there, which is wrong by a factor: centimeters, far from the origin, and
// speckled shadows on meshes finer than a pixel. A member with the value 1 is interpolated with the
// rest and returns that factor.
struct MeshOut {
    @invariant @builtin(position) clip: vec4f,
    @location(0) @interpolate(perspective, centroid) offset_one: vec4f,
    @location(1) @interpolate(perspective, centroid) normal: vec3f,
    @location(2) @interpolate(perspective, centroid) object: vec3f,
    @location(3) @interpolate(perspective, centroid) object_normal: vec3f,
    @location(4) @interpolate(flat) color_rough: vec4f,
    @location(5) @interpolate(flat) other_metal: vec4f,
    @location(6) @interpolate(flat) pattern: vec4f,
    @location(7) @interpolate(flat) origin_side: vec4f,
    @location(8) @interpolate(perspective, centroid) place: vec3f,
    //KEPT 9
};

fn world_of(in: MeshIn) -> vec3f {
    let p = vec4f(in.position, 1.0);
    return vec3f(dot(in.row_x, p), dot(in.row_y, p), dot(in.row_z, p));
}

@vertex fn vs_mesh(in: MeshIn) -> MeshOut {
    var out: MeshOut;
    out.clip = view.clip_from_world * vec4f(world_of(in), 1.0);
    // width times its inverse, so that no compiler treats it as a constant
    let one = view.size.x * view.size.z;
    out.offset_one = vec4f(dot(in.row_x.xyz, in.position), dot(in.row_y.xyz, in.position), dot(in.row_z.xyz, in.position), one);
    let cx = vec3f(in.row_x.x, in.row_y.x, in.row_z.x);
    let cy = vec3f(in.row_x.y, in.row_y.y, in.row_z.y);
    let cz = vec3f(in.row_x.z, in.row_y.z, in.row_z.z);
    // normals transform by the cofactor matrix
    let side = sign(dot(cx, cross(cy, cz)));
    out.normal = (cross(cy, cz) * in.normal.x + cross(cz, cx) * in.normal.y + cross(cx, cy) * in.normal.z) * side;
    out.object = in.position * vec3f(length(cx), length(cy), length(cz));
    out.object_normal = in.normal;
    out.color_rough = in.color_rough;
    out.other_metal = in.other_metal;
    out.pattern = in.pattern;
    out.origin_side = vec4f(in.row_x.w, in.row_y.w, in.row_z.w, side);
    out.place = vec3f(in.place.x, 1.0 - in.place.y, in.place.z / max(length(cx), 1e-9));
    //KEPT out
    return out;
}

@vertex fn vs_mesh_depth(in: MeshIn) -> @invariant @builtin(position) vec4f {
    return view.clip_from_world * vec4f(world_of(in), 1.0);
}

// The index of the nearest sphere: none.
@fragment fn fs_no_id() -> @location(0) u32 { return 0u; }

// Depth only, in a pass that has a color.
@fragment fn fs_nothing() {}

fn mesh_color(in: MeshOut, front: bool) -> vec3f {
    let one = in.offset_one.w;
    let world = in.origin_side.xyz + in.offset_one.xyz / one;
    let s = view_depth_at(world);
    let to_eye = -normalize(ray_at(in.clip.xy).dir);
    var normal = normalize(in.normal) * in.origin_side.w;
    // a back face; triangles thinner than a pixel may be rounded inside out, so the normal must
    // agree
    if (!front && dot(normal, to_eye) < 0.0) { normal = -normal; }
    return pixel_color(world, normal, to_eye, in.object / one, normalize(in.object_normal), s, in.clip.xy, in.place / one,
        Appearance(in.color_rough, in.other_metal, in.pattern));
}

@fragment fn fs_mesh(in: MeshOut, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    //TAKE
    return vec4f(mesh_color(in, front), 1.0);
}

// The floor fades into the background. It is hit by the ray through the pixel's center and not
// interpolated between the corners of its triangles. These are cut at the edges of the view, so
// their edges differ from picture to picture, and a pixel across one would show another place. A
// ray that misses the floor, by rounding at the horizon, shows the background.
struct GroundOut {
    @invariant @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) color_rough: vec4f,
    @location(1) @interpolate(flat) other_metal: vec4f,
    @location(2) @interpolate(flat) pattern: vec4f,
    //KEPT 3
};

@vertex fn vs_ground(in: MeshIn) -> GroundOut {
    return GroundOut(view.clip_from_world * vec4f(world_of(in), 1.0), in.color_rough, in.other_metal, in.pattern /*KEPT*/);
}

@fragment fn fs_ground(in: GroundOut) -> @location(0) vec4f {
    //TAKE
    let ray = ray_at(in.clip.xy);
    let s = (scene.floor.w - ray.origin.z) / ray.dir.z;
    let place = vec3f(ray.origin.xy + s * ray.dir.xy, scene.floor.w);
    let dir = ray.dir * inverseSqrt(dot(ray.dir, ray.dir));
    let up = vec3f(0.0, 0.0, 1.0);
    let normal = vec3f(0.0, 0.0, select(-1.0, 1.0, dir.z < 0.0));
    let color = pixel_color(place, normal, -dir, place, up, s, in.clip.xy, vec3f(0.0), Appearance(in.color_rough, in.other_metal, in.pattern));
    let away = length(place.xy - scene.floor.xy) / scene.floor.z;
    let fade = select(1.0, smoothstep(0.15, 0.95, away), s > 0.0 && s < 1e6);
    return vec4f(mix(color, backdrop_at(dir), fade), 1.0);
}

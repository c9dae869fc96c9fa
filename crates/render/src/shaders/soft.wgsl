// Soft spheres: transparent ones whose density is 1 - |x|² in radii from the center. With m the ray's
// distance from the center in radii, q² = 1 - m² and s along the ray from its closest point, the ray meets
//
//     3/4 ∫ (q² - s²) ds = q³              from s = -q to q
//
// of the density on a line through the center, and light passes by (1 - opacity) to that power (Beer and
// Lambert). So `opacity` is that of the middle, and the rim has no edge. An eye inside a sphere sees the
// part in front of it. Depth is that of the plane through the center across the line of sight.
struct SoftOut {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) sphere: vec4f,
    @location(1) @interpolate(flat) color_opacity: vec4f,
    @location(2) @interpolate(flat) lit: f32,
    //KEPT 3
};

@vertex fn vs_soft(in: SphereIn, @builtin(vertex_index) index: u32) -> SoftOut {
    let c = cover(in.sphere, index);
    return SoftOut(vec4f(c.clip.xy / c.clip.w, c.depth, 1.0), in.sphere, in.color_rough, in.other_metal.x /*KEPT*/);
}

// Light that a sphere scatters to the eye: a point with the normal n gets light from half around.
fn scattered(position: vec3f, n: vec3f) -> vec3f {
    var out = sky_irradiance(n) * scene.horizon.w;
    if (LIGHTS > 0u) { out += scattered_of(position, n, scene.lights[0]); }
    if (LIGHTS > 1u) { out += scattered_of(position, n, scene.lights[1]); }
    if (LIGHTS > 2u) { out += scattered_of(position, n, scene.lights[2]); }
    if (LIGHTS > 3u) {
        for (var i = 3u; i < u32(scene.zenith.w); i++) { out += scattered_of(position, n, scene.lights[i]); }
    }
    return out;
}

fn scattered_of(position: vec3f, n: vec3f, light: Light) -> vec3f {
    var l = light.at.xyz;
    var radiance = light.color.xyz;
    if (light.at.w > 0.5) {
        let d = light.at.xyz - position;
        let d2 = max(dot(d, d), 1e-6);
        l = d * inverseSqrt(d2);
        radiance /= d2;
    }
    return radiance * (0.5 + 0.5 * dot(n, l));
}

@fragment fn fs_soft(in: SoftOut) -> @location(0) vec4f {
    //TAKE
    let c = cross_sphere(in.sphere, in.clip.xy);
    if (c.room <= 0.0) { discard; }
    let r = in.sphere.w;
    let q2 = c.room / (r * r);
    let q = sqrt(q2);
    let start = select(-q, clamp(-c.before / r, -q, q), view.lens.x > 0.5);
    let met = 0.75 * (q2 * (q - start) - (q2 * q - start * start * start) / 3.0);
    let alpha = 1.0 - pow(max(1.0 - in.color_opacity.w, 1e-6), met);
    var color = in.color_opacity.xyz;
    if (in.lit > 0.5) {
        let n = normalize(-(c.miss + q * r * c.dir));
        color = tone(color * scattered(in.sphere.xyz, n));
    }
    return vec4f(color * alpha, alpha);
}

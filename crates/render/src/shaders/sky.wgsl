struct SkyOut {
    @builtin(position) clip: vec4f,
    //KEPT 0
};

@vertex fn vs_sky(@builtin(vertex_index) index: u32) -> SkyOut {
    return SkyOut(vec4f(select(-1.0, 3.0, index == 1u), select(-1.0, 3.0, index == 2u), 0.0, 1.0) /*KEPT*/);
}

@fragment fn fs_sky(in: SkyOut) -> @location(0) vec4f {
    //TAKE
    let at = in.clip;
    let c = backdrop_at(normalize(ray_at(at.xy).dir));
    if (scene.backdrop.w > 0.5) { return vec4f(c, 1.0); }
    // half a step of 8-bit sRGB, so that the gradient shows no bands: the slope of its curve, within a quarter above 0.03
    let grain = f32(hash_u(u32(at.x + view.grid.x) + 16384u * u32(at.y + view.grid.y)) >> 8u) / 16777216.0 - 0.5;
    return vec4f(c + grain / 255.0 * 2.1 * sqrt(max(c, vec3f(1e-3))), 1.0);
}

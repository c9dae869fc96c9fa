// Deterministic noise from integer hashing.
fn hash_u(x: u32) -> u32 {
    var h = x * 747796405u + 2891336453u;
    h = ((h >> ((h >> 28u) + 4u)) ^ h) * 277803737u;
    return (h >> 22u) ^ h;
}

fn hash3(p: vec3i) -> f32 {
    let h = hash_u(u32(p.x) + hash_u(u32(p.y) + hash_u(u32(p.z))));
    return f32(h >> 8u) / 16777216.0;
}

// Smooth noise on the integer lattice, 0 to 1.
fn noise3(p: vec3f) -> f32 {
    let base = floor(p);
    let i = vec3i(clamp(base, vec3f(-1e9), vec3f(1e9)));
    let f = p - base;
    let u = f * f * (3.0 - 2.0 * f);
    let a = mix(hash3(i), hash3(i + vec3i(1, 0, 0)), u.x);
    let b = mix(hash3(i + vec3i(0, 1, 0)), hash3(i + vec3i(1, 1, 0)), u.x);
    let c = mix(hash3(i + vec3i(0, 0, 1)), hash3(i + vec3i(1, 0, 1)), u.x);
    let d = mix(hash3(i + vec3i(0, 1, 1)), hash3(i + vec3i(1, 1, 1)), u.x);
    return mix(mix(a, b, u.y), mix(c, d, u.y), u.z);
}

// Light on a surface: GGX with lamps and soft shadows; the sky as ambient light and reflection.
//
// Microfacets: Walter et al. 2007 (GGX), Heitz 2014 (height-correlated masking), Schlick 1994
// (Fresnel); environment term: the analytic fit by Karis, 2014; soft shadows: Fernando 2005
// (percentage closer). Unit of radiance: a white surface under perpendicular light of intensity 1
// reflects 1.
struct Light {
    at: vec4f,      // w = 0: direction to the light; w = 1: position
    color: vec4f,   // linear color times intensity; w: angular radius, or radius of the lamp
    shadow: vec4f,  // x: layer of its shadow map or -1; y: 6 if there is one for each side of a cube
};
struct Shadow {
    clip_from_world: mat4x4f,
    world_from_clip: mat4x4f,
    depth: vec4f,   // as in View
    scale: vec4f,   // x, y: map widths per meter (times view depth if perspective); z: 1 for perspective; w: meters per texel likewise
};
struct Scene {
    lights: array<Light, 8>,
    shadows: array<Shadow, 12>,
    zenith: vec4f,   // w: number of lights
    horizon: vec4f,  // w: ambient factor
    ground: vec4f,   // w: softbox
    backdrop: vec4f, // w: 1 for a flat backdrop
    tone: vec4f,     // exposure, 1 for the filmic curve, unused, side of the shadow maps
    floor: vec4f,    // middle x, y, reach and height of the ground
    bounce: vec4f,   // radiance from below
};
@group(1) @binding(0) var<uniform> scene: Scene;
@group(1) @binding(1) var shadow_maps: texture_depth_2d_array;
@group(1) @binding(2) var shadow_sampler: sampler_comparison;
@group(1) @binding(3) var occlusion: texture_2d<f32>;
@group(1) @binding(4) var shadow_depths: texture_2d_array<f32>; // the same maps as numbers (OpenGL reads no depth texture)
@group(1) @binding(5) var seen_id: texture_2d<u32>;     // index of the nearest sphere from 1 on, if that was drawn first
@group(1) @binding(6) var sphere_data: texture_2d<u32>; // four texels per sphere, 256 spheres per row

struct Surface {
    position: vec3f,
    normal: vec3f,
    to_eye: vec3f,
    pixel: vec2f,
    base: Base,
    metallic: f32,
};

const PI = 3.14159265;
// Widest penumbra, as a fraction of the shadow map.
const WIDEST = 0.08;

// x to the power of 2.5, and of 5.
fn fall(x: f32) -> f32 { return x * x * sqrt(x); }
fn fifth(x: f32) -> f32 { let x2 = x * x; return x2 * x2 * x; }

// Radiance of the surroundings, blurred for rough reflections.
fn sky_radiance(dir: vec3f, blur: f32) -> vec3f {
    let rise = clamp(dir.z, 0.0, 1.0);
    let above = mix(scene.horizon.xyz, scene.zenith.xyz, mix(1.0 - fall(1.0 - rise), 0.5, 0.6 * blur));
    let below = mix(mix(scene.bounce.xyz, scene.horizon.xyz, 0.4), scene.bounce.xyz, smoothstep(0.0, 0.35, -dir.z));
    let width = 0.015 + 0.6 * blur;
    var c = mix(below, above, smoothstep(-width, width, dir.z));
    if (SOFTBOX && dir.z > 0.02) {
        let p = abs(dir.xy / dir.z - vec2f(0.25, 0.1));
        let soft = 0.06 + 2.2 * blur;
        let inside = (1.0 - smoothstep(0.75 - 0.5 * soft, 0.75 + soft, p.x)) * (1.0 - smoothstep(0.4 - 0.5 * soft, 0.4 + soft, p.y));
        c += scene.ground.w * inside / (1.0 + 6.0 * blur) * vec3f(1.0, 0.97, 0.92);
    }
    return c;
}

// Desaturates the light of a sky, as clouds, walls and the eye's adaptation do: shade is not as
// blue as the zenith.
fn desaturated(c: vec3f) -> vec3f {
    return mix(vec3f(dot(c, vec3f(0.2126, 0.7152, 0.0722))), c, 0.3);
}

fn sky_irradiance(n: vec3f) -> vec3f {
    let up = 0.5 + 0.5 * n.z;
    let sky = 0.55 * scene.zenith.xyz + 0.45 * scene.horizon.xyz;
    return mix(scene.bounce.xyz, desaturated(sky), up) * (1.0 + 0.03 * scene.ground.w * max(n.z, 0.0));
}

fn backdrop_at(dir: vec3f) -> vec3f {
    let rise = clamp(dir.z, 0.0, 1.0);
    let above = mix(scene.horizon.xyz, scene.zenith.xyz, 1.0 - fall(1.0 - rise));
    return select(mix(scene.ground.xyz, above, smoothstep(-0.7, 0.0, dir.z)), scene.backdrop.xyz, scene.backdrop.w > 0.5);
}

// Points spread evenly over the unit disc: each is rotated by the golden angle against the previous
// one, and the i-th of n is at the radius sqrt((i + 1/2) / n).
const GOLDEN = vec2f(-0.73736886, 0.67549032);

fn next_way(way: vec2f) -> vec2f {
    return vec2f(way.x * GOLDEN.x - way.y * GOLDEN.y, way.x * GOLDEN.y + way.y * GOLDEN.x);
}

fn shadow_depth_to_s(sh: Shadow, depth: f32) -> f32 {
    return (sh.depth.y - depth * sh.depth.w) / (depth * sh.depth.z - sh.depth.x);
}

// The map that shows `p`: of six, in the order +x -x +y -y +z -z, the one of the side that `p` is
// on.
fn shadow_layer(light: Light, p: vec3f) -> i32 {
    var layer = i32(light.shadow.x);
    if (light.shadow.y > 1.5) {
        let d = p - light.at.xyz;
        let far = abs(d);
        if (far.x >= far.y && far.x >= far.z) { layer += select(0, 1, d.x < 0.0); }
        else if (far.y >= far.z) { layer += select(2, 3, d.y < 0.0); }
        else { layer += select(4, 5, d.z < 0.0); }
    }
    return layer;
}

// Fraction of the light that reaches `p`.
fn light_visibility(index: i32, p: vec3f, n: vec3f, size: f32, pixel: vec2f) -> f32 {
    let sh = scene.shadows[index];
    let texels = scene.tone.w;
    let clip0 = sh.clip_from_world * vec4f(p, 1.0);
    let s0 = mix(1.0, clip0.w, sh.scale.z);
    let clip = sh.clip_from_world * vec4f(p + n * (select(1.2, 2.0, SHADOWS == 1u) * sh.scale.w * s0), 1.0);
    if (clip.w <= 0.0) { return 1.0; }
    let ndc = clip.xyz / clip.w;
    let uv = ndc.xy * vec2f(0.5, -0.5) + 0.5;
    // penumbrae reach beyond the map, and its edge is empty
    if (any(uv <= vec2f(-WIDEST)) || any(uv >= vec2f(1.0 + WIDEST))) { return 1.0; }
    // behind the map's far plane, every shadow caster is in front
    let depth = clamp(ndc.z, 1e-6, 1.0);
    if (SHADOWS == 1u) {
        let outside = any(uv <= vec2f(0.0)) || any(uv >= vec2f(1.0));
        return select(textureSampleCompareLevel(shadow_maps, shadow_sampler, uv, index, depth + 1e-5), 1.0, outside);
    }
    // depth along the surface's plane is affine in the map; its slope keeps wide filters free of
    // acne
    let plane = transpose(sh.world_from_clip) * vec4f(n, -dot(n, p));
    var slope = vec2f(0.0);
    if (abs(plane.z) > 1e-9) { slope = -plane.xy / plane.z * vec2f(2.0, -2.0); }
    slope = select(clamp(slope, vec2f(-8.0), vec2f(8.0)), vec2f(0.0), ndc.z < 1e-6);
    let bias = 1e-5 + (abs(slope.x) + abs(slope.y)) * 0.75 / texels;

    let turn = 6.2831853 * fract(52.9829189 * fract(dot(floor(pixel) + view.grid.xy, vec2f(0.06711056, 0.00583715))));
    let s = select(shadow_depth_to_s(sh, ndc.z), clip.w, sh.scale.z > 0.5);
    let per_meter = sh.scale.xy / mix(1.0, s, sh.scale.z);
    let s_near = shadow_depth_to_s(sh, 1.0);
    let reach = select(size * (s - s_near), size * (s - s_near) / s_near, sh.scale.z > 0.5);
    let smallest = vec2f(1.5 / texels);
    let search = clamp(reach * per_meter, smallest, vec2f(WIDEST));
    // the empty map is at depth 0, so no filter may reach below it
    var sum = 0.0;
    var count = 0.0;
    let first = vec2f(cos(turn), sin(turn));
    var way = first;
    for (var i = 0u; i < 16u; i++) {
        let d = way * sqrt((f32(i) + 0.5) / 16.0) * search;
        way = next_way(way);
        let at = vec2i(clamp((uv + d) * texels, vec2f(0.0), vec2f(texels - 1.0)));
        let z = textureLoad(shadow_depths, at, index, 0).x;
        if (z > max(depth + dot(slope, d) + bias, 1e-6)) { sum += z; count += 1.0; }
    }
    if (count == 0.0) { return 1.0; }
    if (count == 16.0) { return 0.0; }
    let s_block = shadow_depth_to_s(sh, sum / count);
    let gap = max(s - s_block, 0.0);
    let width = select(size * gap, size * gap / max(s_block, 1e-6), sh.scale.z > 0.5);
    let filter_uv = clamp(width * per_meter, smallest, search);
    var lit = 0.0;
    way = first;
    for (var i = 0u; i < 32u; i++) {
        let d = way * sqrt((f32(i) + 0.5) / 32.0) * filter_uv;
        way = next_way(way);
        lit += textureSampleCompareLevel(shadow_maps, shadow_sampler, uv + d, index, clamp(depth + dot(slope, d) + bias, 1e-6, 1.0));
    }
    return lit / 32.0;
}

fn ggx(n_h: f32, n_v: f32, n_l: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let q = n_h * n_h * (a2 - 1.0) + 1.0;
    let d = a2 / (PI * q * q);
    let v = n_l * sqrt(n_v * n_v * (1.0 - a2) + a2) + n_v * sqrt(n_l * n_l * (1.0 - a2) + a2);
    return d * 0.5 / max(v, 1e-6);
}

fn schlick(f0: vec3f, v_h: f32) -> vec3f {
    return f0 + (1.0 - f0) * fifth(1.0 - v_h);
}

// Reflectance of a rough surface under uniform surroundings: scale and offset of f0.
fn environment_term(roughness: f32, n_v: f32) -> vec2f {
    let r = roughness * vec4f(-1.0, -0.0275, -0.572, 0.022) + vec4f(1.0, 0.0425, 1.04, -0.04);
    let a = min(r.x * r.x, exp2(-9.28 * n_v)) * r.x + r.y;
    return vec2f(-1.04, 1.04) * a + r.zw;
}

// A cheap approximation for slow devices: highlights after Karis, 2013 ("a² / (q² 4 max(0.1,
// (v·h)²) (r + 1/2))", with h = l + v not normalized, so that n·h = n·l + n·v and h² = 2 + 2 l·v),
// the sky as a gradient, no clear coat.
struct Simple { diffuse: vec3f, f0: vec3f, rough: f32, n_v: f32 };

fn lit_simply(s: Surface, m: Simple, l: vec3f, light: Light) -> vec3f {
    let way = dot(s.normal, l);
    var n_l = max(way, 0.0);
    if (SHADOWS > 0u && light.shadow.x >= 0.0) { n_l *= light_visibility(shadow_layer(light, s.position), s.position, s.normal, light.color.w, s.pixel); }
    let r2 = m.rough * m.rough;
    let a2 = r2 * r2;
    let h2 = 2.0 + 2.0 * dot(l, s.to_eye);
    let n_h = way + m.n_v;
    let q = n_h * n_h * (a2 - 1.0) + h2;
    let lobe = a2 * h2 * h2 / (q * q * max(h2, 0.4) * (m.rough + 0.5) + 1e-6);
    return (m.diffuse + m.f0 * lobe) * light.color.xyz * n_l;
}

// A lamp or a distant light.
fn lit_simply_by(s: Surface, m: Simple, given: Light) -> vec3f {
    var light = given;
    var l = light.at.xyz;
    if (light.at.w > 0.5) {
        let d = light.at.xyz - s.position;
        let near = inverseSqrt(max(dot(d, d), 1e-6));
        l = d * near;
        light.color = vec4f(light.color.xyz * (near * near), light.color.w);
    }
    return lit_simply(s, m, l, light);
}

fn shade_simply(s: Surface) -> vec3f {
    let n = s.normal;
    let v = s.to_eye;
    let n_v = dot(n, v);
    let rough = max(s.base.roughness, 0.2);
    let diffuse = s.base.color * (1.0 - s.metallic);
    let f0 = mix(vec3f(0.04), s.base.color, s.metallic);
    let grazing = 1.0 - clamp(n_v, 0.0, 1.0);
    let grazing2 = grazing * grazing;
    let sheen = s.base.color * (s.base.sheen * grazing * grazing2);
    let simple = Simple(diffuse + sheen, f0, rough, n_v);
    var out = vec3f(0.0);
    if (ONE_SUN) {
        out = lit_simply(s, simple, scene.lights[0].at.xyz, scene.lights[0]);
    } else {
        if (LIGHTS > 0u) { out += lit_simply_by(s, simple, scene.lights[0]); }
        if (LIGHTS > 1u) { out += lit_simply_by(s, simple, scene.lights[1]); }
        if (LIGHTS > 2u) { out += lit_simply_by(s, simple, scene.lights[2]); }
        if (LIGHTS > 3u) {
            for (var i = 3u; i < u32(scene.zenith.w); i++) { out += lit_simply_by(s, simple, scene.lights[i]); }
        }
    }
    var open = 1.0;
    if (OCCLUSION) { open = textureLoad(occlusion, vec2i(s.pixel), 0).x; }
    let up = 2.0 * n_v * n.z - v.z;
    let mirrored = mix(scene.bounce.xyz, mix(scene.horizon.xyz, scene.zenith.xyz, clamp(up, 0.0, 1.0)), clamp(0.5 + up, 0.0, 1.0));
    let edge = (1.0 - rough) * grazing2 * grazing2;
    return out + (diffuse * sky_irradiance(n) + (f0 * (1.0 - 0.4 * rough) + edge) * mirrored) * (open * scene.horizon.w);
}

fn shade(s: Surface) -> vec3f {
    let n = s.normal;
    let v = s.to_eye;
    let n_v = max(dot(n, v), 1e-3);
    let grazing = 1.0 - n_v;
    let rough = clamp(s.base.roughness, 0.04, 1.0);
    let alpha = rough * rough;
    let diffuse = s.base.color * (1.0 - s.metallic);
    let f0 = mix(vec3f(0.04), s.base.color, s.metallic);
    let coat = s.base.coat;
    let coat_alpha = 0.006;

    var out = vec3f(0.0);
    for (var i = 0u; i < u32(scene.zenith.w); i++) {
        let light = scene.lights[i];
        var l = light.at.xyz;
        var radiance = light.color.xyz;
        var angle = light.color.w;
        if (light.at.w > 0.5) {
            let d = light.at.xyz - s.position;
            let d2 = max(dot(d, d), 1e-6);
            l = d * inverseSqrt(d2);
            radiance /= d2;
            angle = light.color.w * inverseSqrt(d2);
        }
        let n_l = dot(n, l);
        if (n_l <= 0.0) { continue; }
        var visible = 1.0;
        if (SHADOWS > 0u && light.shadow.x >= 0.0) { visible = light_visibility(shadow_layer(light, s.position), s.position, n, light.color.w, s.pixel); }
        if (visible <= 0.0) { continue; }
        let h = normalize(l + v);
        let v_h = max(dot(v, h), 0.0);
        let n_h = max(dot(n, h), 0.0);
        // an extended source widens the lobe and keeps its energy
        let wide = clamp(alpha + 0.5 * angle, 0.0, 1.0);
        let specular = schlick(f0, v_h) * (ggx(n_h, n_v, n_l, wide) * alpha * alpha / (wide * wide) * PI);
        var coat_f = 0.0;
        var coat_lobe = 0.0;
        if (COAT) {
            let coat_wide = coat_alpha + 0.5 * angle;
            coat_f = coat * schlick(vec3f(0.04), v_h).x;
            coat_lobe = coat_f * min(ggx(n_h, n_v, n_l, coat_wide), 60.0) * PI * 0.5;
        }
        let sheen = s.base.sheen * s.base.color * grazing * grazing * grazing;
        out += ((diffuse * (1.0 - schlick(f0, v_h)) + specular + sheen) * (1.0 - coat_f) + coat_lobe) * radiance * (n_l * visible);
    }

    var open = 1.0;
    if (OCCLUSION) { open = textureLoad(occlusion, vec2i(s.pixel), 0).x; }
    let env = environment_term(rough, n_v);
    let mirror = reflect(-v, n);
    let horizon_open = clamp(open * open + 0.15 * open, 0.0, 1.0);
    // light bounced between bright surfaces keeps their creases from turning gray
    let bounced = vec3f(open) + (1.0 - open) * open * s.base.color;
    var ambient = diffuse * sky_irradiance(n) * bounced * (1.0 + s.base.sheen * grazing * grazing * grazing)
        + (f0 * env.x + env.y) * sky_radiance(mirror, rough) * horizon_open;
    if (COAT) {
        let coat_env = coat * (0.04 + 0.96 * fifth(grazing));
        ambient = ambient * (1.0 - coat_env) + coat_env * sky_radiance(mirror, 0.02) * horizon_open;
    }
    return out + ambient * scene.horizon.w;
}

// Converts scene light to display light.
fn tone(c: vec3f) -> vec3f {
    let x = max(c * scene.tone.x, vec3f(0.0));
    // filmic curve (the rational fit by Narkowicz, 2016, to ACES), scaled so that middle gray stays
    let y = x * 0.72;
    let filmic = (y * (2.51 * y + 0.03)) / (y * (2.43 * y + 0.59) + 0.14);
    return min(select(filmic, x, scene.tone.y < 0.5), vec3f(1.0));
}

// Advances free particles by whole frames; see gpu/particles.rs.

// A place, m, or a velocity, m/s: whole/16 + rest. Integers add without rounding, and no compiler reorders them.
struct Fixed {
    whole: vec3<i32>,
    rest: vec3<f32>,
}

struct Particle {
    place: vec3<i32>,
    // frames that are left of its life
    frames: u32,
    place_rest: vec3<f32>,
    pad_0: u32,
    speed: vec3<i32>,
    pad_1: u32,
    speed_rest: vec3<f32>,
    pad_2: u32,
}

// kind: 0 half-space, normal in `x_axis`; 1 sphere; 2 box
struct Obstacle {
    place: vec3<i32>,
    kind: u32,
    place_rest: vec3<f32>,
    radius: f32,
    x_axis: vec3<f32>,
    restitution: f32,
    y_axis: vec3<f32>,
    friction: f32,
    z_axis: vec3<f32>,
    pad_0: u32,
    half: vec3<f32>,
    pad_1: u32,
}

struct Settings {
    gravity: vec3<f32>,
    // length of a frame, s
    dt: f32,
    wind: vec3<f32>,
    linear: f32,
    quadratic: f32,
    radius: f32,
    // phi_1 and phi_2 of a frame with linear drag alone
    one: f32,
    two: f32,
    count: u32,
    obstacles: u32,
    frames: u32,
    pad: u32,
}

struct Path {
    v: vec3<f32>,
    pull: vec3<f32>,
    gamma: f32,
}

struct Gap {
    gap: f32,
    normal: vec3<f32>,
}

struct Hit {
    time: f32,
    obstacle: i32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> obstacles: array<Obstacle>;
@group(0) @binding(2) var<storage, read_write> particles: array<Particle>;

const UNIT: f32 = 0.0625;
const IMPACTS: i32 = 8;
const STEPS: i32 = 48;
// gap of a particle that lies on a surface, m
const TOUCHING: f32 = 4e-7;
// gap at which a particle has left a surface that it slid on, m
const LEFT: f32 = 1e-5;
// gap at which a surface is reached, m
const REACHED: f32 = 1e-8;
const NEVER: f32 = -1.0;

fn plus(a: Fixed, d: vec3<f32>) -> Fixed {
    let sum = a.rest + d;
    let whole = vec3<i32>(round(sum / UNIT));
    return Fixed(a.whole + whole, sum - vec3<f32>(whole) * UNIT);
}

fn number(a: Fixed) -> vec3<f32> {
    return vec3<f32>(a.whole) * UNIT + a.rest;
}

fn beyond(a: Fixed, o: i32) -> vec3<f32> {
    return vec3<f32>(a.whole - obstacles[o].place) * UNIT + (a.rest - obstacles[o].place_rest);
}

// (1 - e^-z)/z and (z - 1 + e^-z)/z^2
fn phi(z: f32) -> vec2<f32> {
    if z < 0.5 {
        let two = 0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z * (1.0 / 720.0 - z / 5040.0))));
        return vec2<f32>(1.0 - z * two, two);
    }
    let one = (1.0 - exp(-z)) / z;
    return vec2<f32>(one, (1.0 - one) / z);
}

fn path_phi(path: Path, t: f32) -> vec2<f32> {
    if t == settings.dt && settings.quadratic == 0.0 && path.gamma != 0.0 {
        return vec2<f32>(settings.one, settings.two);
    }
    return phi(path.gamma * t);
}

fn way(path: Path, t: f32) -> vec3<f32> {
    return t * (path.v + t * path_phi(path, t).y * path.pull);
}

fn gain(path: Path, t: f32) -> vec3<f32> {
    return t * path_phi(path, t).x * path.pull;
}

fn drag(v: vec3<f32>) -> f32 {
    return settings.linear + settings.quadratic * length(settings.wind - v);
}

fn path_of(v: vec3<f32>, h: f32) -> Path {
    var gamma = drag(v);
    if settings.quadratic > 0.0 {
        let first = Path(v, settings.gravity + gamma * (settings.wind - v), gamma);
        gamma = drag(v + gain(first, 0.5 * h));
    }
    return Path(v, settings.gravity + gamma * (settings.wind - v), gamma);
}

// the gap of a point, relative to the place of an obstacle
fn gap_at(o: i32, p: vec3<f32>) -> Gap {
    let kind = obstacles[o].kind;
    let radius = settings.radius;
    if kind == 0u {
        let normal = obstacles[o].x_axis;
        return Gap(dot(normal, p) - radius, normal);
    }
    if kind == 1u {
        let distance = length(p);
        return Gap(distance - obstacles[o].radius - radius, p / max(distance, 1e-30));
    }
    let x = obstacles[o].x_axis;
    let y = obstacles[o].y_axis;
    let z = obstacles[o].z_axis;
    let local = vec3<f32>(dot(x, p), dot(y, p), dot(z, p));
    let sides = select(vec3<f32>(-1.0), vec3<f32>(1.0), local >= vec3<f32>(0.0));
    let q = abs(local) - obstacles[o].half;
    let outside = max(q, vec3<f32>(0.0));
    let distance = length(outside);
    if distance > 0.0 {
        let n = sides * outside / distance;
        return Gap(distance - radius, n.x * x + n.y * y + n.z * z);
    }
    if q.x >= q.y && q.x >= q.z {
        return Gap(q.x - radius, sides.x * x);
    }
    if q.y >= q.z {
        return Gap(q.y - radius, sides.y * y);
    }
    return Gap(q.z - radius, sides.z * z);
}

// a time of a path: gap, m, its rate, m/s, and the most that this falls, m/s^2
struct Instant {
    gap: f32,
    rate: f32,
    fall: f32,
}

fn instant(o: i32, start: vec3<f32>, path: Path, t: f32) -> Instant {
    let at = gap_at(o, start + way(path, t));
    let gained = gain(path, t);
    let pull = path.pull - path.gamma * gained;
    return Instant(at.gap, dot(path.v + gained, at.normal), max(0.0, -dot(pull, at.normal)));
}

// the time to where a particle meets the plane of the closest point, s, or later than `length`
fn to_plane(at: Instant, length_s: f32) -> f32 {
    let gap = max(at.gap, 0.0);
    let root = sqrt(at.rate * at.rate + 2.0 * at.fall * gap);
    if at.rate < 0.0 {
        return 2.0 * gap / (root - at.rate);
    }
    if at.rate + root >= at.fall * length_s {
        return 2.0 * length_s;
    }
    return (at.rate + root) / at.fall;
}

// the time at which a path meets an obstacle first, s; NEVER if it does not within `length`. All obstacles are convex: each is behind the
// plane of its closest point, so no step to that plane passes it
fn meets(o: i32, start: vec3<f32>, path: Path, length_s: f32) -> f32 {
    var low = instant(o, start, path, 0.0);
    let bound = length(path.v) + length_s * length(path.pull);
    if low.gap > bound * length_s {
        return NEVER;
    }
    var t = 0.0;
    let lifts = low.rate > 0.0 && low.rate * low.rate > 2.0 * low.fall * TOUCHING;
    let presses = !lifts && (low.rate < 0.0 || low.fall > 0.0);
    if low.gap < -TOUCHING || (low.gap <= TOUCHING && presses) {
        return 0.0;
    }
    for (var k = 0; k < STEPS; k++) {
        let next_t = t + to_plane(low, length_s);
        if next_t >= length_s {
            return NEVER;
        }
        if next_t == t {
            break;
        }
        t = next_t;
        low = instant(o, start, path, t);
        if low.gap <= REACHED {
            break;
        }
    }
    return t;
}

// the time at which a slide has left the surface, s, which it has at `late`: by halves
fn leaving(o: i32, start: vec3<f32>, v: vec3<f32>, late: f32) -> f32 {
    var low = 0.0;
    var high = late;
    for (var k = 0; k < 24; k++) {
        let t = 0.5 * (low + high);
        if gap_at(o, start + t * v).gap < LEFT {
            low = t;
        } else {
            high = t;
        }
    }
    return low;
}

fn first_hit(x: Fixed, path: Path, length_s: f32, except: i32) -> Hit {
    var hit = Hit(length_s, -1);
    for (var o = 0; o < i32(settings.obstacles); o++) {
        if o == except {
            continue;
        }
        let time = meets(o, beyond(x, o), path, hit.time);
        if time >= 0.0 && (time < hit.time || hit.obstacle < 0) {
            hit = Hit(time, o);
        }
    }
    return hit;
}

fn shorten(v: vec3<f32>, by: f32) -> vec3<f32> {
    let size = length(v);
    if size > by {
        return v * (by / size);
    }
    return v;
}

fn fly(x_in: Fixed, v_in: Fixed, out_v: ptr<function, Fixed>) -> Fixed {
    var x = x_in;
    var v = v_in;
    var time = 0.0;
    for (var k = 0; k < IMPACTS; k++) {
        let left = settings.dt - time;
        if left <= 0.0 {
            break;
        }
        let path = path_of(number(v), left);
        let hit = first_hit(x, path, left, -1);
        x = plus(x, way(path, hit.time));
        v = plus(v, gain(path, hit.time));
        time += hit.time;
        if hit.obstacle < 0 {
            break;
        }
        let o = hit.obstacle;
        let at = gap_at(o, beyond(x, o));
        let n = at.normal;
        if at.gap < 0.0 {
            x = plus(x, -at.gap * n);
        }
        let a = path.pull;
        let u = number(v);
        let along = dot(u, n);
        var bounced = true;
        if along > 0.0 {
            if along * along <= -2.0 * dot(a, n) * TOUCHING {
                v = plus(v, -along * n);
                bounced = false;
            }
        } else {
            var e = obstacles[o].restitution;
            if -along <= abs(dot(a, n)) * settings.dt {
                e = 0.0;
            }
            let across = u - along * n;
            let grip = obstacles[o].friction * (1.0 + e) * -along;
            v = plus(v, -(1.0 + e) * along * n - shorten(across, grip));
            bounced = e > 0.0;
        }
        let rest = settings.dt - time;
        if !bounced && rest > 0.0 {
            let moving = number(v);
            let press = max(-dot(a, n), 0.0);
            let ease = a + press * n;
            let pushed = moving + rest * ease;
            let grip = obstacles[o].friction * press;
            let end = pushed - shorten(pushed, grip * rest);
            var mean = 0.5 * (moving + end);
            if all(end == vec3<f32>(0.0)) && length(ease) * rest < 1e-5 * length(moving) {
                mean = moving * (0.5 * length(moving) / grip / rest);
            }
            let slide = first_hit(x, Path(mean, vec3<f32>(0.0), 0.0), rest, o);
            let stops = slide.obstacle >= 0 && slide.time > 0.0;
            var took = select(rest, slide.time, stops);
            let wide = gap_at(o, beyond(x, o) + took * mean).gap;
            var leaves = false;
            if wide > LEFT {
                let early = leaving(o, beyond(x, o), mean, took);
                let fall = took - early;
                leaves = wide > 0.5 * press * fall * fall;
                took = select(took, early, leaves);
            }
            x = plus(x, took * mean);
            v = plus(v, took / rest * (end - moving));
            time += took;
            if !stops && !leaves {
                let over = gap_at(o, beyond(x, o));
                if over.gap < 0.0 {
                    x = plus(x, -over.gap * over.normal);
                }
            }
        }
    }
    *out_v = v;
    return x;
}

@compute @workgroup_size(64)
fn advance(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let index = id.x + id.y * groups.x * 64u;
    if index >= settings.count {
        return;
    }
    let particle = particles[index];
    var x = Fixed(particle.place, particle.place_rest);
    var v = Fixed(particle.speed, particle.speed_rest);
    let frames = min(settings.frames, particle.frames);
    for (var k = 0u; k < frames; k++) {
        var next_v = v;
        x = fly(x, v, &next_v);
        v = next_v;
    }
    particles[index].place = x.whole;
    particles[index].place_rest = x.rest;
    particles[index].speed = v.whole;
    particles[index].speed_rest = v.rest;
    particles[index].frames = particle.frames - frames;
}

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

// the time at which a path meets an obstacle, s; NEVER if it does not within `length`
fn meets(o: i32, start: vec3<f32>, path: Path, length_s: f32) -> f32 {
    let begin = gap_at(o, start);
    var low = vec2<f32>(0.0, begin.gap);
    let bound = length(path.v) + length_s * length(path.pull);
    if low.y > bound * length_s {
        return NEVER;
    }
    var high = vec2<f32>(length_s, gap_at(o, start + way(path, length_s)).gap);
    if low.y <= TOUCHING {
        let rate = dot(path.v, begin.normal);
        if high.y >= 0.0 {
            return select(NEVER, 0.0, low.y < -TOUCHING && rate < 0.0);
        }
        if rate <= 0.0 {
            return 0.0;
        }
        // a bounce that begins here may end within the stretch
        let pull = dot(path.pull, begin.normal);
        var apex = 0.5 * length_s;
        if pull < 0.0 {
            apex = min(apex, -rate / pull);
        }
        low = vec2<f32>(apex, gap_at(o, start + way(path, apex)).gap);
        if low.y <= TOUCHING {
            return 0.0;
        }
    }
    if high.y >= 0.0 {
        for (var k = 0; k < STEPS; k++) {
            if low.y <= 0.0 || low.y + high.y >= bound * (high.x - low.x) {
                return NEVER;
            }
            let t = low.x + max(low.y / bound, 1e-5 * length_s);
            if t >= high.x {
                return NEVER;
            }
            let next = vec2<f32>(t, gap_at(o, start + way(path, t)).gap);
            if next.y < 0.0 {
                high = next;
                break;
            }
            low = next;
        }
        if high.y >= 0.0 {
            return NEVER;
        }
    }
    var ends = vec2<f32>(low.y, high.y);
    var last = 0;
    for (var k = 0; k < STEPS; k++) {
        var t = (low.x * ends.y - high.x * ends.x) / (ends.y - ends.x);
        if !(t < high.x) {
            t = 0.5 * (low.x + high.x);
        }
        if !(t > low.x && t < high.x) {
            break;
        }
        let value = gap_at(o, start + way(path, t)).gap;
        let side = select(-1, 1, value >= 0.0);
        let share = select(1.0, 0.5, side == last);
        if side > 0 {
            low = vec2<f32>(t, value);
            ends = vec2<f32>(value, share * ends.y);
        } else {
            high = vec2<f32>(t, value);
            ends = vec2<f32>(share * ends.x, value);
        }
        last = side;
        if low.y < 1e-8 {
            break;
        }
    }
    return low.x;
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
            let took = select(rest, slide.time, stops);
            x = plus(x, took * mean);
            v = plus(v, took / rest * (end - moving));
            time += took;
            if !stops {
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

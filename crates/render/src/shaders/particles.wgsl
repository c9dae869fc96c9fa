// Advances free particles by whole frames; see gpu/particles. The text before it, particles_single.wgsl or particles_double.wgsl, has
// the numbers: `real`, `Fixed` (a place, m, or a velocity, m/s), the buffers, and the tolerances.

struct Path {
    v: real3,
    pull: real3,
    gamma: real,
}

struct Gap {
    gap: real,
    normal: real3,
}

struct Hit {
    time: real,
    obstacle: i32,
}

@group(0) @binding(0) var<uniform> settings: Settings;
@group(0) @binding(1) var<storage, read> obstacles: array<Obstacle>;
@group(0) @binding(2) var<storage, read_write> particles: array<Particle>;

const IMPACTS: i32 = 8;
const STEPS: i32 = 48;
const NEVER: real = -1.0;

fn path_phi(path: Path, t: real) -> real2 {
    if t == settings.dt && settings.quadratic == 0.0 && path.gamma != 0.0 {
        return real2(settings.one, settings.two);
    }
    return phi(path.gamma * t);
}

fn way(path: Path, t: real) -> real3 {
    return t * (path.v + t * path_phi(path, t).y * path.pull);
}

fn gain(path: Path, t: real) -> real3 {
    return t * path_phi(path, t).x * path.pull;
}

fn drag(v: real3) -> real {
    return settings.linear + settings.quadratic * length(settings.wind - v);
}

fn path_of(v: real3, h: real) -> Path {
    var gamma = drag(v);
    if settings.quadratic > 0.0 {
        let first = Path(v, settings.gravity + gamma * (settings.wind - v), gamma);
        gamma = drag(v + gain(first, 0.5 * h));
    }
    return Path(v, settings.gravity + gamma * (settings.wind - v), gamma);
}

// the gap of a point, relative to the place of an obstacle
fn gap_at(o: i32, p: real3) -> Gap {
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
    let local = real3(dot(x, p), dot(y, p), dot(z, p));
    let sides = select(real3(-1.0), real3(1.0), local >= real3(0.0));
    let q = abs(local) - obstacles[o].half;
    let outside = max(q, real3(0.0));
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
    gap: real,
    rate: real,
    fall: real,
}

fn instant(o: i32, start: real3, path: Path, t: real) -> Instant {
    let at = gap_at(o, start + way(path, t));
    let gained = gain(path, t);
    let pull = path.pull - path.gamma * gained;
    return Instant(at.gap, dot(path.v + gained, at.normal), max(0.0, -dot(pull, at.normal)));
}

// the time to where a particle meets the plane of the closest point, s, or later than `length`
fn to_plane(at: Instant, length_s: real) -> real {
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
fn meets(o: i32, start: real3, path: Path, length_s: real) -> real {
    var low = instant(o, start, path, 0.0);
    let bound = length(path.v) + length_s * length(path.pull);
    if low.gap > bound * length_s {
        return NEVER;
    }
    var t: real = 0.0;
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
fn leaving(o: i32, start: real3, v: real3, late: real) -> real {
    var low: real = 0.0;
    var high = late;
    for (var k = 0; k < HALVINGS; k++) {
        let t = 0.5 * (low + high);
        if gap_at(o, start + t * v).gap < LEFT {
            low = t;
        } else {
            high = t;
        }
    }
    return low;
}

fn first_hit(x: Fixed, path: Path, length_s: real, except: i32) -> Hit {
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

fn shorten(v: real3, by: real) -> real3 {
    let size = length(v);
    if size > by {
        return v * (by / size);
    }
    return v;
}

fn fly(x_in: Fixed, v_in: Fixed, out_v: ptr<function, Fixed>) -> Fixed {
    var x = x_in;
    var v = v_in;
    var time: real = 0.0;
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
            if all(end == real3(0.0)) && length(ease) * rest < EASY * length(moving) {
                mean = moving * (0.5 * length(moving) / grip / rest);
            }
            let slide = first_hit(x, Path(mean, real3(0.0), 0.0), rest, o);
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
    var x = position_of(index);
    var v = velocity_of(index);
    let left = particles[index].frames;
    let frames = min(settings.frames, left);
    for (var k = 0u; k < frames; k++) {
        var next_v = v;
        x = fly(x, v, &next_v);
        v = next_v;
    }
    store(index, x, v, left - frames);
}

// The numbers of particles.wgsl in double precision, for devices that have it.

alias real = f64;
alias real2 = vec2<f64>;
alias real3 = vec3<f64>;
alias Fixed = vec3<f64>;

struct Particle {
    position: vec3<f64>,
    // frames that are left of its life
    frames: u32,
    velocity: vec3<f64>,
    pad: u32,
}

// kind: 0 half-space, normal in `x_axis`; 1 sphere; 2 box
struct Obstacle {
    position: vec3<f64>,
    radius: f64,
    x_axis: vec3<f64>,
    restitution: f64,
    y_axis: vec3<f64>,
    friction: f64,
    z_axis: vec3<f64>,
    kind: u32,
    half: vec3<f64>,
    pad: u32,
}

struct Settings {
    gravity: vec3<f64>,
    // length of a frame, s
    dt: f64,
    wind: vec3<f64>,
    linear: f64,
    quadratic: f64,
    radius: f64,
    // phi_1 and phi_2 of a frame with linear drag alone
    one: f64,
    two: f64,
    count: u32,
    obstacles: u32,
    frames: u32,
    pad: u32,
}

// the meaning of these is in particles_single.wgsl
const TOUCHING: f64 = 1e-10;
const LEFT: f64 = 1e-5;
const REACHED: f64 = 1e-14;
const EASY: f64 = 1e-9;
const HALVINGS: i32 = 52;

fn plus(a: Fixed, d: vec3<f64>) -> Fixed {
    return a + d;
}

fn number(a: Fixed) -> vec3<f64> {
    return a;
}

fn beyond(a: Fixed, o: i32) -> vec3<f64> {
    return a - obstacles[o].position;
}

fn position_of(index: u32) -> Fixed {
    return particles[index].position;
}

fn velocity_of(index: u32) -> Fixed {
    return particles[index].velocity;
}

fn store(index: u32, x: Fixed, v: Fixed, frames: u32) {
    particles[index].position = x;
    particles[index].velocity = v;
    particles[index].frames = frames;
}

// phi_2 by its series, of z up to 0.5: the last term is below 1e-17
fn series(z: f64) -> f64 {
    var sum: f64 = 0.0;
    for (var k = 14; k >= 0; k--) {
        sum = (1.0 - z * sum) / f64(k + 2);
    }
    return sum;
}

// (1 - e^-z)/z and (z - 1 + e^-z)/z^2. Shaders have no exponential in double precision: e^-z is that of z/2^n, squared n times
fn phi(z: f64) -> vec2<f64> {
    if z < 0.5 {
        let two = series(z);
        return vec2<f64>(1.0 - z * two, two);
    }
    var part = z;
    var squares = 0;
    for (; part > 0.5 && squares < 12; squares++) {
        part *= 0.5;
    }
    var decay: f64 = 0.0;
    if part <= 0.5 {
        decay = 1.0 - part * (1.0 - part * series(part));
        for (var k = 0; k < squares; k++) {
            decay *= decay;
        }
    }
    let one = (1.0 - decay) / z;
    return vec2<f64>(one, (1.0 - one) / z);
}


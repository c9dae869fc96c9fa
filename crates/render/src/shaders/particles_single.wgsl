// The numbers of particles.wgsl in single precision.

alias real = f32;
alias real2 = vec2<f32>;
alias real3 = vec3<f32>;

// A place, m, or a velocity, m/s: whole/16 + rest. Integers add without rounding, and no compiler reorders them.
struct Fixed {
    whole: vec3<i32>,
    rest: vec3<f32>,
}

struct Particle {
    place: vec3<i32>,
    pad_0: u32,
    place_rest: vec3<f32>,
    // frames that are left of its life
    frames: u32,
    speed: vec3<i32>,
    pad_1: u32,
    speed_rest: vec3<f32>,
    pad_2: u32,
}

// kind: 0 half-space, normal in `x_axis`; 1 sphere; 2 box
struct Obstacle {
    place: vec3<i32>,
    pad_0: u32,
    place_rest: vec3<f32>,
    radius: f32,
    x_axis: vec3<f32>,
    restitution: f32,
    y_axis: vec3<f32>,
    friction: f32,
    z_axis: vec3<f32>,
    kind: u32,
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

const UNIT: f32 = 0.0625;
// gap of a particle that lies on a surface, m
const TOUCHING: f32 = 4e-7;
// gap at which a particle has left a surface that it slid on, m
const LEFT: f32 = 1e-5;
// gap at which a surface is reached, m
const REACHED: f32 = 1e-8;
// change of velocity that counts as none, as a part of the velocity
const EASY: f32 = 1e-5;
// bisections, as many as the numbers have bits
const HALVINGS: i32 = 24;

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

fn position_of(index: u32) -> Fixed {
    return Fixed(particles[index].place, particles[index].place_rest);
}

fn velocity_of(index: u32) -> Fixed {
    return Fixed(particles[index].speed, particles[index].speed_rest);
}

fn store(index: u32, x: Fixed, v: Fixed, frames: u32) {
    particles[index].place = x.whole;
    particles[index].place_rest = x.rest;
    particles[index].speed = v.whole;
    particles[index].speed_rest = v.rest;
    particles[index].frames = frames;
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


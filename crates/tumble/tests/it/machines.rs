//! Claims of the pages of the pendulums, the chain and the engine, checked by closed forms and
//! conservation laws.

use std::f64::consts::{PI, TAU};
use tumble::collide::Vec3;
use tumble::dynamics::{ArticulatedBody, PartState, World};
use tumble::scene::{SceneFile, resolve_scene};

const G: f64 = 9.81;

fn load(name: &str) -> SceneFile {
    resolve_scene(name, &[]).unwrap().load().unwrap()
}

fn build(scene: &SceneFile) -> World {
    scene.build().unwrap().0
}

/// A link's frame: its joint.
fn link<'w>(world: &'w World, object: &str, link: &str) -> &'w PartState {
    let id = world.find(object).unwrap();
    let index = world.get::<ArticulatedBody>(id).unwrap().model().link(link).unwrap();
    world.part_state(id, index).unwrap()
}

fn turned(part_state: &PartState, v: Vec3) -> Vec3 {
    part_state.pose.rotation * v
}

/// Complete elliptic integral of the first kind of modulus `k`, by the arithmetic-geometric mean.
fn elliptic_k(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    for _ in 0..10 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    PI / (2.0 * a)
}

/// `4·√(L/g)·K(sin(θ₀/2))`.
fn period(reduced_length: f64, amplitude_deg: f64) -> f64 {
    4.0 * (reduced_length / G).sqrt() * elliptic_k((0.5 * amplitude_deg.to_radians()).sin())
}

/// Angle of a hanging link about +y, rad, and its rate.
fn swing(part_state: &PartState) -> (f64, f64) {
    let down = turned(part_state, -Vec3::z());
    ((-down.x).atan2(-down.z), part_state.angular_velocity.y)
}

/// Zero of the cubic through two states `(θ, θ̇)`, `h` apart, as a fraction of `h`.
fn crossing(a: (f64, f64), b: (f64, f64), h: f64) -> f64 {
    let at = |s: f64| {
        let (p, q) = (1.0 + 2.0 * s, 3.0 - 2.0 * s);
        (1.0 - s).powi(2) * (p * a.0 + s * h * a.1) + s * s * (q * b.0 - (1.0 - s) * h * b.1)
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if at(middle) * a.0 > 0.0 { low = middle } else { high = middle }
    }
    low
}

#[test]
fn pendulum_the_bob_and_the_rod_swing_in_the_time_of_the_elliptic_integral() {
    let (scene, names) = (load("pendulum"), ["bob", "rod"]);
    let mut world = build(&scene);
    let (h, start) = (scene.world.dt_s, world.energy().total());
    let mut crossings = [Vec::new(), Vec::new()];
    for _ in 0..(30.0 / h) as usize {
        let before = names.map(|name| swing(link(&world, name, name)));
        let t = world.time();
        world.step().unwrap();
        for ((found, a), name) in crossings.iter_mut().zip(before).zip(names) {
            let b = swing(link(&world, name, name));
            if a.0 * b.0 < 0.0 && a.0.abs() < 1.0 {
                found.push(t + h * crossing(a, b, h));
            }
        }
    }
    // sphere: L + 2r²/5L; bar: 2l/3 + w²/6l
    let lengths = [1.0 + 0.4 * 0.07 * 0.07, 0.6 + 0.05 * 0.05 / 5.4];
    let stated = [2.1549834512555384, 2.7393315102684546];
    for (k, degrees) in [60.0, 150.0].into_iter().enumerate() {
        let (times, exact) = (&crossings[k], period(lengths[k], degrees));
        assert!((exact / stated[k] - 1.0).abs() < 1e-12, "the page says {} s, it is {exact} s", stated[k]);
        assert!(times.len() > 20, "{} crossings", times.len());
        assert!((times[0] / (0.25 * exact) - 1.0).abs() < 1e-6, "{}: first at {} s", names[k], times[0]);
        let measured = 2.0 * (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
        assert!((measured / exact - 1.0).abs() < 1e-8, "{}: {measured} s, by hand {exact} s", names[k]);
    }
    let drift = world.energy().total() / start - 1.0;
    assert!(drift.abs() < 1e-8, "energy is off by {drift:e} of all after 30 s");
}

/// The conical pendulum and the top precess steadily: same tilt, and the azimuth grows as `Ω·t`.
#[test]
fn pendulum_the_cone_and_the_top_go_round_as_their_quadratics_say() {
    let scene = load("pendulum");
    let mut world = build(&scene);
    let cone = (G / (0.8 * 35f64.to_radians().cos())).sqrt();
    let (a, c, turn) = (0.0014 + 0.5 * 0.12 * 0.12, 0.0025 * 100.0, 20f64.to_radians().cos());
    let top = (c - (c * c - 4.0 * a * turn * 0.5 * G * 0.12).sqrt()) / (2.0 * a * turn);
    let mut worst = [0.0f64; 4];
    for _ in 0..(10.0 / scene.world.dt_s) as usize {
        world.step().unwrap();
        for (k, (name, axis, tilt, rate)) in
            [("cone", -Vec3::z(), 35.0, cone), ("top", Vec3::z(), 20.0, top)].into_iter().enumerate()
        {
            let arm = turned(link(&world, name, name), axis);
            let lean = arm.xy().norm().atan2(arm.z.abs()) - f64::to_radians(tilt);
            // both start in the plane y = 0, the cone towards -x
            let begin = if name == "cone" { PI } else { 0.0 };
            let behind = (arm.y.atan2(arm.x) - begin - rate * world.time()).rem_euclid(TAU);
            worst[2 * k] = worst[2 * k].max(lean.abs());
            worst[2 * k + 1] = worst[2 * k + 1].max(behind.min(TAU - behind));
        }
    }
    println!("tilt and azimuth of the cone, then of the top, are off by at most {worst:?} rad");
    assert!(worst.iter().all(|x| *x < 1e-6), "{worst:?}");
}

#[test]
fn pendulum_twins_a_millionth_apart_part() {
    let scene = load("pendulum");
    let mut world = build(&scene);
    let apart = |world: &World| {
        let [a, b] = ["twin_a", "twin_b"].map(|name| turned(link(world, name, "lower"), Vec3::z()));
        a.dot(&b).clamp(-1.0, 1.0).acos()
    };
    let (mut first, mut most) = (f64::NAN, 0.0f64);
    for _ in 0..(scene.world.duration_s / scene.world.dt_s) as usize {
        world.step().unwrap();
        most = most.max(apart(&world));
        if first.is_nan() && most > 0.1 {
            first = world.time();
        }
        assert!(world.time() > 1.0 || most < 1e-3, "{most} rad apart after {} s", world.time());
    }
    println!("0.1 rad apart after {first} s, {most} rad at most");
    assert!(most > 1.5, "{most}");
}

const HOOK: Vec3 = Vec3::new(0.0, 0.0, 3.4);

fn ring(k: usize) -> String {
    if k == 0 { "shackle".into() } else { format!("ring_{k}") }
}

/// Moment of gravity about the hook on the chain and the ball, N·m.
fn weight_moment(world: &World) -> Vec3 {
    let ball = world.part_state(world.find("ball").unwrap(), 0).unwrap().position();
    let mut moment = (ball - HOOK) * 6.0;
    for k in 0..32 {
        let part_state = link(world, "chain", &ring(k));
        moment += (part_state.position() + turned(part_state, Vec3::new(0.0, 0.0, -0.046)) - HOOK) * 0.2;
    }
    moment.cross(&Vec3::new(0.0, 0.0, -G))
}

#[test]
fn chain_stays_joined_loses_energy_and_balances_its_impulses_about_the_hook() {
    let scene = load("chain");
    let mut world = build(&scene);
    let (h, ball) = (scene.world.dt_s, world.find("ball").unwrap());
    let about_hook = |world: &World| world.momentum().angular - HOOK.cross(&world.momentum().linear);
    let (start, mut before) = (world.energy().total(), world.energy().total());
    assert!((start - (6.0 * 0.5 * 7.25 + 6.0 * G * 1.6 + 6.4 * G * (3.4 - 16.0 * 0.092))).abs() < 1e-9, "{start}");
    let (mut expected, begin) = (about_hook(&world), about_hook(&world).norm());
    let (mut met, mut rise, mut off, mut open, mut depth) = (f64::NAN, 0.0f64, 0.0f64, 0.0f64, 0.0f64);
    let mut landed = false;
    for _ in 0..(scene.world.duration_s / h) as usize {
        let moment = weight_moment(&world);
        let report = world.step().unwrap();
        depth = depth.max(report.max_penetration);
        expected += 0.5 * h * (moment + weight_moment(&world));
        let energy = world.energy().total();
        rise = rise.max(energy - before);
        before = energy;
        let x = world.part_state(ball, 0).unwrap().position();
        landed |= x.z < 0.26;
        if !landed {
            off = off.max((about_hook(&world) - expected).norm());
        }
        if met.is_nan() && !world.contacts().is_empty() {
            met = world.time();
        }
        if met.is_nan() {
            let t = world.time();
            let flight = Vec3::new(-1.0 + 2.5 * t, 0.03, 1.6 + t - 0.5 * G * t * t);
            assert!((x - flight).norm() < 1e-12, "the ball flies {:e} m off its parabola", (x - flight).norm());
        }
        for k in 0..31 {
            let (a, b) = (link(&world, "chain", &ring(k)), link(&world, "chain", &ring(k + 1)));
            open = open.max((a.position() + turned(a, Vec3::new(0.0, 0.0, -0.092)) - b.position()).norm());
        }
        open = open.max((link(&world, "chain", "shackle").position() - HOOK).norm());
    }
    println!(
        "met after {met} s; joints open by {open:e} m; energy rose by {rise:e} J; moment about the hook off by {off:e} of {begin}; depth {depth:e}"
    );
    assert!((met - 0.28865).abs() < 2.0 * h, "the ball meets the chain after {met} s");
    assert!(open < 1e-12, "joints open by {open:e} m");
    assert!(rise < 1e-12 * start, "energy rises by {rise:e} J in a frame");
    assert!(off < 1e-3 * begin, "the moment about the hook is off by {off:e} N·m·s");
    let away = (0..32)
        .map(|k| (link(&world, "chain", &ring(k)).position() - world.part_state(ball, 0).unwrap().position()).norm());
    assert!(away.fold(f64::INFINITY, f64::min) > 0.5, "the ball has come off the chain");
}

/// `x = r·cos ψ + √(l² − r²·sin² ψ)` of each piston, `ψ` the crank's angle from its cylinder, for a
/// minute with `TUMBLE_SLOW=1`.
#[test]
fn piston_follows_the_slider_crank_formula_without_drift_full_length() {
    let slow = std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1");
    for (stepper, seconds) in [
        (tumble::scene::Stepper::TimeStepping, if slow { 60.0 } else { 5.0 }),
        (tumble::scene::Stepper::Backtracking, 1.0),
    ] {
        let mut scene = load("piston");
        scene.world.stepper = stepper;
        let mut world = build(&scene);
        let (r, l, shaft) = (0.06, 0.2, Vec3::new(0.0, 0.0, 0.55));
        let (mut late, mut off, mut open) = ([0.0f64; 2], [0.0f64; 2], 0.0f64);
        let frames = (seconds / scene.world.dt_s).round() as usize;
        for frame in 1..=frames {
            world.step().unwrap();
            let pin = turned(link(&world, "engine", "crank"), Vec3::x());
            let angle = pin.z.atan2(pin.x);
            let lag = (angle - 2.0 * TAU * world.time()).rem_euclid(TAU);
            let half = usize::from(2 * frame > frames);
            late[half] = late[half].max(lag.min(TAU - lag));
            for k in 0..5 {
                let cylinder = PI / 2.0 + f64::from(k) * TAU / 5.0;
                let psi = angle - cylinder;
                let x = r * psi.cos() + (l * l - (r * psi.sin()).powi(2)).sqrt();
                let piston = link(&world, "engine", &format!("piston_{}", k + 1)).position();
                let at = shaft + x * Vec3::new(cylinder.cos(), 0.0, cylinder.sin());
                off[half] = off[half].max((piston - at).norm());
                let rod = link(&world, "engine", &format!("rod_{}", k + 1));
                let end = rod.position() + turned(rod, Vec3::new(l, 0.0, 0.0));
                open = open.max((end - piston - Vec3::new(0.0, end.y - piston.y, 0.0)).norm());
            }
        }
        let method = world.stepper_name();
        println!(
            "{method}, {seconds} s: pistons off by {off:?} m in each half, rods by {open:e} m, crank by {late:?} rad"
        );
        assert!(off[0].max(off[1]) < 1e-6, "{method}: {off:?} m");
        // the drive holds a velocity at the ends of frames, and no row holds the angle
        assert!(late[0].max(late[1]) < 5e-6, "{method}: the crank is {late:?} rad from 4π·t");
    }
}

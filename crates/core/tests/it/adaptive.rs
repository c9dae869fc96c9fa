//! The adaptive integrator: its order, its tolerance, its dense output, and the step size that it
//! carries from frame to frame.

use crate::common::*;
use tumble_core::collide::{Mat3, Pose, Quat, Vec3};
use tumble_core::*;

/// A force (N) at the center and a torque (N·m) on one body, as functions of time and orientation.
#[derive(Clone)]
struct Drive(ObjectId, fn(f64, &Quat) -> (Vec3, Vec3));

impl Object for Drive {
    fn name(&self) -> &str {
        "drive"
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Drive {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let (Some(part_state), Some(state_range)) = (view.part_state(self.0, 0), view.state_range(self.0)) else {
            return;
        };
        let (force, torque) = (self.1)(view.time, &part_state.pose.rotation);
        out.wrenches[state_range.parts.start].force += force;
        out.wrenches[state_range.parts.start].torque += torque;
    }
}

/// A spring of `k` N/m and a damper of `c` N·s/m between the center of a body and a point.
#[derive(Clone)]
struct Spring {
    name: String,
    on: ObjectId,
    to: Vec3,
    k: f64,
    c: f64,
}

impl Object for Spring {
    fn name(&self) -> &str {
        &self.name
    }
    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Spring {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        let (Some(part_state), Some(state_range)) = (view.part_state(self.on, 0), view.state_range(self.on)) else {
            return;
        };
        out.wrenches[state_range.parts.start].force +=
            self.k * (self.to - part_state.position()) - self.c * part_state.velocity;
    }
}

fn adaptive(dt: f64, tolerance: f64) -> World {
    let mut world = no_gravity(world("backtracking", dt));
    set(&mut world, |s| (s.integrator, s.integrator_tolerance) = (Integrator::DormandPrince, tolerance));
    world
}

fn set(world: &mut World, change: impl Fn(&mut Settings)) {
    let mut settings = *world.settings();
    change(&mut settings);
    world.set_settings(settings).unwrap();
}

fn run(world: &mut World, seconds: f64) {
    let frames = (seconds / world.settings().dt).round() as usize;
    (0..frames).for_each(|_| {
        world.step().unwrap();
    });
}

const MOMENTS: [f64; 3] = [1.0, 2.0, 3.0];

/// Adds a body with I = (1, 2, 3) kg·m² that spins about its unstable axis.
fn top(world: &mut World) -> ObjectId {
    let body = RigidBody::new(sphere(1.0))
        .with_name("top")
        .with_mass_and_inertia(1.0, Mat3::from_diagonal(&Vec3::from(MOMENTS)));
    world.add(body.with_angular_velocity(Vec3::new(0.01, 5.0, 0.01))).unwrap()
}

/// Returns a torque that depends on time and attitude, and a force.
fn torque(t: f64, q: &Quat) -> (Vec3, Vec3) {
    (Vec3::new(0.3, (2.0 * t).sin(), 0.0), Vec3::new((3.0 * t).cos(), 0.5, -0.4) + 2.0 * (q * Vec3::x()))
}

fn attitude(world: &World, id: ObjectId) -> Quat {
    world.part_state(id, 0).unwrap().pose.rotation
}

/// Returns attitude and position at 2 s, computed with one inner step per frame of `dt`.
fn one_step_a_frame(dt: f64, driven: bool) -> (Quat, Vec3) {
    let mut world = adaptive(dt, 0.1);
    let id = top(&mut world);
    if driven {
        world.add(Drive(id, torque)).unwrap();
    }
    for _ in 0..(2.0 / dt).round() as usize {
        assert_eq!(world.step().unwrap().inner_steps, 1);
    }
    (attitude(&world, id), position(&world, id))
}

/// Returns the same, computed with RK4 and steps of 1/4096 s.
fn reference(driven: bool) -> (Quat, Vec3) {
    let mut world = no_gravity(world("backtracking", 1.0 / 4096.0));
    set(&mut world, |s| s.integrator = Integrator::Rk4);
    let id = top(&mut world);
    if driven {
        world.add(Drive(id, torque)).unwrap();
    }
    run(&mut world, 2.0);
    (attitude(&world, id), position(&world, id))
}

/// Returns the angle between two attitudes, rad; exact for small angles.
fn angle(a: &Quat, b: &Quat) -> f64 {
    2.0 * (a.inverse() * b).imag().norm().asin()
}

#[test]
fn it_is_of_fifth_order_on_a_free_and_on_a_driven_body() {
    for driven in [false, true] {
        let exact = reference(driven);
        let error = |dt: f64| {
            let (q, x) = one_step_a_frame(dt, driven);
            (angle(&q, &exact.0), (x - exact.1).norm())
        };
        let (coarse, middle, fine) = (error(1.0 / 16.0), error(1.0 / 32.0), error(1.0 / 64.0));
        let (first, second) = ((coarse.0 / middle.0).log2(), (middle.0 / fine.0).log2());
        println!("driven {driven}: {coarse:?} {middle:?} {fine:?}; orders {first} {second}");
        assert!(
            (second - 5.0).abs() < 0.3 && fine.0 < 1e-6,
            "driven {driven}: order {first}, {second} ({coarse:?}, {middle:?}, {fine:?})"
        );
    }
}

/// Returns the final state of two links on spherical joints, the first on a floating base: every
/// kind of joint that rotates in space.
fn tangle(dt: f64, integrator: Integrator) -> Vec<f64> {
    let mut world = world("backtracking", dt);
    set(&mut world, |s| (s.integrator, s.integrator_tolerance) = (integrator, 0.1));
    let mass = |i: [f64; 3]| LinkMass {
        mass: 1.0,
        center: Vec3::new(0.05, 0.1, -0.2),
        inertia: Mat3::from_diagonal(&(0.02 * Vec3::from(i))),
    };
    let mut builder = ModelBuilder::new();
    let base = builder.link("base", None, Joint::Floating, Pose::identity(), mass([1.0, 2.0, 3.0 - 0.1]));
    let arm =
        builder.link("arm", Some(base), Joint::Spherical, Pose::translation(0.1, 0.0, -0.4), mass([2.0, 1.5, 1.0]));
    builder.link("hand", Some(arm), Joint::Spherical, Pose::translation(0.0, 0.2, -0.3), mass([1.0, 1.0, 0.5]));
    let spins = [0.5, 1.0, -0.7, 0.1, 0.2, 0.3, -2.0, 0.4, 1.0, 1.5, -1.0, 2.0];
    let id =
        world.add(ArticulatedBody::new("tangle", builder.build().unwrap()).with_velocities(&spins).unwrap()).unwrap();
    for _ in 0..(1.0 / dt).round() as usize {
        let report = world.step().unwrap();
        assert!(report.inner_steps <= 1 && report.tries == 1);
    }
    world.state_of(id).unwrap().to_vec()
}

#[test]
fn it_is_of_fifth_order_on_ball_joints_and_floating_bases() {
    let exact = tangle(1.0 / 4096.0, Integrator::Rk4);
    let error = |dt: f64| {
        tangle(dt, Integrator::DormandPrince).iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let (coarse, middle, fine) = (error(1.0 / 32.0), error(1.0 / 64.0), error(1.0 / 128.0));
    let orders = ((coarse / middle).log2(), (middle / fine).log2());
    println!("{coarse:e} {middle:e} {fine:e}: {orders:?}");
    assert!((orders.1 - 5.0).abs() < 0.4, "orders {orders:?}: {coarse:e} {middle:e} {fine:e}");
}

/// The state variables conserve angular momentum exactly, and energy within the tolerance.
#[test]
fn it_keeps_angular_momentum_and_energy_of_the_free_body() {
    for tolerance in [1e-6, 1e-9] {
        let mut world = adaptive(1.0 / 60.0, tolerance);
        top(&mut world);
        let (e0, l0) = (world.energy().kinetic, world.momentum().angular);
        let (mut e, mut l, mut steps) = (0.0f64, 0.0f64, 0);
        for _ in 0..20 * 60 {
            steps += world.step().unwrap().inner_steps;
            e = e.max((world.energy().kinetic / e0 - 1.0).abs());
            l = l.max((world.momentum().angular - l0).norm() / l0.norm());
        }
        println!("tolerance {tolerance:e}: energy {e:e}, angular momentum {l:e}, {steps} steps");
        assert!(l < 1e-13 && e < 20.0 * tolerance, "tolerance {tolerance:e}: energy {e:e}, angular momentum {l:e}");
    }
}

/// `x = sin(10·t)`, `v = 10·cos(10·t)` for 10 s: the error falls with the tolerance, and the steps
/// grow as its fifth root.
#[test]
fn the_error_of_an_oscillator_goes_with_the_tolerance() {
    let at = |tolerance: f64| {
        let mut world = adaptive(1.0 / 10.0, tolerance);
        let id = world
            .add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_velocity(Vec3::new(10.0, 0.0, 0.0)))
            .unwrap();
        world.add(Spring { name: "spring".into(), on: id, to: Vec3::zeros(), k: 100.0, c: 0.0 }).unwrap();
        let (mut steps, mut worst) = (0, 0.0f64);
        for frame in 1..=100 {
            steps += world.step().unwrap().inner_steps;
            let t = frame as f64 / 10.0;
            let off =
                (position(&world, id).x - (10.0 * t).sin()).hypot((velocity(&world, id).x / 10.0) - (10.0 * t).cos());
            worst = worst.max(off);
        }
        (worst, steps)
    };
    let found: Vec<(f64, u32)> = [1e-4, 1e-6, 1e-8, 1e-10].iter().map(|t| at(*t)).collect();
    println!("{found:?}");
    for (pair, tolerance) in found.windows(2).zip([1e-6, 1e-8, 1e-10]) {
        let (coarse, fine) = (pair[0], pair[1]);
        // a hundredth of the tolerance: 2.5 times the steps, and with order five a hundredth of the
        // error
        let (gain, steps) = (coarse.0 / fine.0, fine.1 as f64 / coarse.1 as f64);
        assert!(
            gain > 40.0 && (2.0..3.0).contains(&steps),
            "at {tolerance:e}: error {gain} times less in {steps} times the steps"
        );
        assert!(fine.0 < 200.0 * tolerance, "at {tolerance:e}: error {:e}", fine.0);
    }
}

/// The weights integrate polynomials of degree four exactly if forces are evaluated at the times of
/// the stages: `P = t⁵` under `F = 5t⁴`.
#[test]
fn forces_are_taken_at_the_time_of_their_stage() {
    let mut world = adaptive(0.25, 0.1);
    let id = world.add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0)).unwrap();
    world.add(Drive(id, |t, _| (Vec3::new(5.0 * t.powi(4), 0.0, 0.0), Vec3::zeros()))).unwrap();
    for frame in 1..=8 {
        let steps = world.step().unwrap().inner_steps;
        let exact = (0.25 * frame as f64).powi(5);
        let off = (velocity(&world, id).x - exact).abs();
        assert!(
            off < 1e-14 * exact.max(1.0),
            "frame {frame} in {steps} steps: momentum {} off by {off:e}",
            velocity(&world, id).x
        );
    }
}

/// Between a spring and a wall, at `e = 1`: the phase runs from `−φ` to `φ`, `cos φ = −½`, and
/// jumps back at every stroke.
#[test]
fn strokes_against_a_wall_are_located_within_inner_steps() {
    let mut world = adaptive(0.1, 1e-10);
    let wall = Pose::new(Vec3::new(0.6, 0.0, 0.0), Vec3::new(0.0, -std::f64::consts::FRAC_PI_2, 0.0));
    world
        .add_static(
            RigidBody::fixed(tumble_core::collide::Shape::half_space())
                .with_name("wall")
                .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
                .with_pose(wall),
        )
        .unwrap();
    let body = RigidBody::new(sphere(0.1))
        .with_name("ball")
        .with_mass(2.0)
        .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
        .with_pose(Pose::translation(-1.0, 0.0, 0.0));
    let id = world.add(body).unwrap();
    world.add(Spring { name: "spring".into(), on: id, to: Vec3::zeros(), k: 50.0, c: 0.0 }).unwrap();
    // x = −cos(5t) up to 0.5 at 5t = 2π/3; then from phase −2π/3 again
    let reach = 2.0 * std::f64::consts::PI / 3.0;
    let (mut strokes, mut worst, mut tries) = (0, 0.0f64, 0);
    for frame in 1..=100 {
        let report = *world.step().unwrap();
        (strokes, tries) = (strokes + report.impact_passes.min(1), tries.max(report.tries));
        let phase = (5.0 * world.time() + reach) % (2.0 * reach) - reach;
        let off = (position(&world, id).x + phase.cos()).hypot(velocity(&world, id).x / 5.0 - phase.sin());
        assert!(
            report.max_penetration <= world.settings().contact_tolerance,
            "frame {frame}: {:e} m deep",
            report.max_penetration
        );
        worst = worst.max(off);
    }
    println!("{strokes} strokes, worst {worst:e}, {tries} tries");
    // 50 rad at 2·reach each: 12 strokes; each is located to 1e-7 m, at 4.3 m/s
    assert_eq!(strokes, 12);
    assert!(worst < 12.0 * 1e-7 && tries < 20, "off by {worst:e} m, at most {tries} tries a frame");
}

/// Pushed away from the middle between two walls, `x = ¼·cosh(κt)`. The parabola from the start of
/// a step predicts a late stroke, so every stroke is found in the dense output. At `e = 1` the way
/// back is the same. `κ` is such that an inner step is as long as a frame.
#[test]
fn a_stroke_that_comes_early_is_found_in_the_dense_output() {
    let (k, rate) = (50.0, 5.0);
    for tolerance in [1e-3, 1e-6] {
        let mut world = adaptive(0.1, tolerance);
        let wall = Pose::new(Vec3::new(0.6, 0.0, 0.0), Vec3::new(0.0, -std::f64::consts::FRAC_PI_2, 0.0));
        world
            .add_static(
                RigidBody::fixed(tumble_core::collide::Shape::half_space())
                    .with_name("wall")
                    .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
                    .with_pose(wall),
            )
            .unwrap();
        let body = RigidBody::new(sphere(0.1))
            .with_name("ball")
            .with_mass(2.0)
            .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
            .with_pose(Pose::translation(0.25, 0.0, 0.0));
        let id = world.add(body).unwrap();
        world.add(Spring { name: "spring".into(), on: id, to: Vec3::zeros(), k: -k, c: 0.0 }).unwrap();
        let stroke = 2f64.acosh() / rate;
        let (mut worst, mut strokes) = (0.0f64, 0);
        for _ in 0..12 {
            let report = *world.step().unwrap();
            strokes += report.impact_passes.min(1);
            assert!(report.max_penetration <= world.settings().contact_tolerance && report.tries < 20, "{report:?}");
            let from_rest = (world.time() + stroke) % (2.0 * stroke) - stroke;
            worst = worst.max((position(&world, id).x - 0.25 * (rate * from_rest).cosh()).abs());
        }
        println!("tolerance {tolerance:e}: {strokes} strokes, off by {worst:e}");
        // an error at a stroke grows by up to e^(2·1.317) = 14 until the next
        assert!(
            strokes == 2 && worst < 2.0 * tolerance,
            "tolerance {tolerance:e}: {strokes} strokes, off by {worst:e}"
        );
    }
}

/// Two equal discs that collide off center exchange their velocities along the line of centers.
#[test]
fn balls_collide_at_the_right_place_and_time() {
    let mut world = adaptive(1.0 / 60.0, 1e-6);
    let ball = |name: &str| {
        RigidBody::new(sphere(0.1)).with_name(name).with_mass(1.0).with_material(Material {
            restitution: 1.0,
            friction: 0.0,
            ..Material::default()
        })
    };
    let a = world
        .add(ball("a").with_velocity(Vec3::new(3.0, 0.0, 0.0)).with_angular_velocity(Vec3::new(0.0, 9.0, 4.0)))
        .unwrap();
    let b = world.add(ball("b").with_pose(Pose::translation(1.0, 0.12, 0.0))).unwrap();
    run(&mut world, 1.0);
    // centers 0.2 apart at x = 1 − √(0.04 − 0.0144) = 0.84: the normal is (0.8, 0.6)
    let (n, time) = (Vec3::new(0.8, 0.6, 0.0), 0.28);
    let (vb, va) = (n * n.x * 3.0, Vec3::new(3.0, 0.0, 0.0) - n * n.x * 3.0);
    let (xa, xb) = (Vec3::new(0.84, 0.0, 0.0) + va * (1.0 - time), Vec3::new(1.0, 0.12, 0.0) + vb * (1.0 - time));
    // the time of impact is accurate to 1e-7 m / 2.4 m/s
    for (id, x, v) in [(a, xa, va), (b, xb, vb)] {
        assert!(
            (position(&world, id) - x).norm() < 1e-6 && (velocity(&world, id) - v).norm() < 1e-6,
            "{} with {}",
            position(&world, id),
            velocity(&world, id)
        );
    }
}

/// A ball that bounces (`e = 1`) keeps its height, and an impact does not change the length of its
/// frame.
#[test]
fn a_bouncing_ball_keeps_its_height_and_frames_their_length() {
    let mut world = world("backtracking", 1.0 / 60.0);
    set(&mut world, |s| s.integrator = Integrator::DormandPrince);
    ground(&mut world, 1.0, 0.0);
    let body = RigidBody::new(sphere(0.1))
        .with_name("ball")
        .with_mass(1.0)
        .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
        .with_pose(Pose::translation(0.0, 0.0, 1.1));
    let id = world.add(body).unwrap();
    let (fall, mut time) = ((2.0 / G).sqrt(), 0.0f64);
    for _ in 0..600 {
        world.step().unwrap();
        time += 1.0 / 60.0;
        assert_eq!(world.time(), time);
        let flight = (time + fall) % (2.0 * fall) - fall;
        let height = 1.1 - 0.5 * G * flight * flight;
        assert!(
            (position(&world, id).z - height).abs() < 1e-5,
            "at {time} s: {} m, by hand {height}",
            position(&world, id).z
        );
    }
}

/// Spinning, sprung, damped and bouncing bodies in gravity.
fn lively() -> World {
    let mut world = world("backtracking", 1.0 / 60.0);
    set(&mut world, |s| s.integrator = Integrator::DormandPrince);
    ground(&mut world, 0.6, 0.3);
    for i in 0..4 {
        let shape = if i % 2 == 0 {
            sphere(0.2)
        } else {
            tumble_core::collide::Shape::cuboid(Vec3::new(0.2, 0.4, 0.6)).unwrap()
        };
        let body = RigidBody::new(shape)
            .with_name(format!("body{i}"))
            .with_mass(1.0 + i as f64)
            .with_material(Material { restitution: 0.6, friction: 0.3, ..Material::default() });
        let id = world
            .add(
                body.with_pose(Pose::translation(0.9 * i as f64, 0.0, 1.0 + 0.2 * i as f64))
                    .with_angular_velocity(Vec3::new(3.0, 7.0, i as f64)),
            )
            .unwrap();
        let to = Vec3::new(0.9 * i as f64, 0.3, 1.0);
        world.add(Spring { name: format!("spring{i}"), on: id, to, k: 40.0 * (i + 1) as f64, c: 0.5 }).unwrap();
    }
    world
}

#[test]
fn save_restore_run_and_fork_give_the_same_bytes() {
    for frames in [1, 7, 40] {
        let mut first = lively();
        (0..frames).for_each(|_| {
            first.step().unwrap();
        });
        let saved = first.save();
        let mut forked = first.fork();
        let mut restored = lively();
        restored.restore(&saved).unwrap();
        assert!(restored.save() == saved);
        for frame in 0..40 {
            let steps: Vec<u32> =
                [&mut first, &mut forked, &mut restored].into_iter().map(|w| w.step().unwrap().inner_steps).collect();
            assert_eq!(steps, [steps[0]; 3], "frame {frame} after {frames}");
            assert!(first.save() == forked.save(), "frame {frame} after {frames}: the fork goes another way");
            assert!(
                first.save() == restored.save(),
                "frame {frame} after {frames}: the restored world goes another way"
            );
        }
    }
}

/// The inner step is carried over: a frame in the middle of the run rejects no step. The spring's
/// 100 rad/s need about seven steps per frame.
#[test]
fn the_inner_step_is_carried_from_frame_to_frame() {
    let mut world = adaptive(1.0 / 60.0, 1e-6);
    let id = world
        .add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_velocity(Vec3::new(10.0, 0.0, 0.0)))
        .unwrap();
    world.add(Spring { name: "spring".into(), on: id, to: Vec3::zeros(), k: 1e4, c: 0.0 }).unwrap();
    let first = world.step().unwrap().inner_steps;
    run(&mut world, 1.0);
    let saved = world.save();
    let carried = world.step().unwrap().inner_steps;
    // the last eight bytes are the inner step: without it, the frame begins like the first one
    let mut without = saved.clone();
    let end = without.len() - 8;
    without[end..].fill(0);
    world.restore(&without).unwrap();
    let anew = world.step().unwrap().inner_steps;
    assert!(carried < anew, "{carried} carried, {anew} anew, {first} in the first frame");
    world.restore(&saved).unwrap();
    assert_eq!(world.step().unwrap().inner_steps, carried);
}

#[test]
fn a_far_object_changes_nothing_but_the_steps() {
    let end = |crowded: bool| {
        let mut world = adaptive(1.0 / 60.0, 1e-8);
        let id = top(&mut world);
        world.add(Drive(id, torque)).unwrap();
        if crowded {
            let far = RigidBody::new(sphere(0.1))
                .with_name("far")
                .with_mass(1.0)
                .with_pose(Pose::translation(1000.0, 0.0, 0.0))
                .with_velocity(Vec3::x());
            let far = world.add(far).unwrap();
            world
                .add(Spring { name: "spring".into(), on: far, to: Vec3::new(1000.0, 1.0, 0.0), k: 2000.0, c: 0.0 })
                .unwrap();
        }
        let mut steps = 0;
        (0..120).for_each(|_| steps += world.step().unwrap().inner_steps);
        (attitude(&world, id), position(&world, id), steps)
    };
    let (alone, crowded) = (end(false), end(true));
    let (turned, moved) = (angle(&alone.0, &crowded.0), (alone.1 - crowded.1).norm());
    println!("{turned:e} {moved:e} {} {}", alone.2, crowded.2);
    assert!(crowded.2 > 2 * alone.2, "the far body needs more steps: {} against {}", crowded.2, alone.2);
    assert!(turned < 1e-6 && moved < 1e-6, "turned {turned:e}, moved {moved:e}");
}

/// A kinematic body keeps its velocity and acts on others: a body coupled to it by a damper alone
/// follows `v·(1 − e^{−ct/m})`.
#[test]
fn a_kinematic_body_keeps_its_velocity() {
    let mut world = adaptive(0.1, 1e-8);
    let body = world
        .add(
            RigidBody::new(sphere(0.2))
                .with_name("body")
                .with_mass_and_inertia(1.0, Mat3::from_diagonal(&Vec3::from(MOMENTS))),
        )
        .unwrap();
    world.set_mode(body, Mode::Kinematic).unwrap();
    let (v, w) = (Vec3::new(0.5, 0.0, 0.2), Vec3::new(0.3, 2.0, -0.4));
    world.set_velocity(body, v, w).unwrap();
    let ball = world
        .add(RigidBody::new(sphere(0.1)).with_name("ball").with_mass(2.0).with_pose(Pose::translation(5.0, 0.0, 0.0)))
        .unwrap();
    world.add(Spring { name: "spring".into(), on: ball, to: Vec3::new(5.0, 1.0, 0.0), k: 30.0, c: 0.1 }).unwrap();
    run(&mut world, 2.0);
    let part_state = *world.part_state(body, 0).unwrap();
    assert!((part_state.position() - 2.0 * v).norm() < 1e-14 && (part_state.velocity - v).norm() < 1e-15);
    assert!((part_state.angular_velocity - w).norm() < 1e-13, "it turns with {}", part_state.angular_velocity);
    assert!(angle(&part_state.pose.rotation, &Quat::from_scaled_axis(2.0 * w)) < 1e-13);
}

#[test]
fn what_it_cannot_follow_is_an_error_with_a_name_and_changes_nothing() {
    // 1e9 rad/s need some 1e7 steps per frame
    let mut world = adaptive(1.0 / 60.0, 1e-6);
    let id = world.add(RigidBody::new(sphere(0.1)).with_name("calm").with_mass(1.0)).unwrap();
    world.add(Spring { name: "soft".into(), on: id, to: Vec3::x(), k: 1.0, c: 0.0 }).unwrap();
    let id = world
        .add(RigidBody::new(sphere(0.1)).with_name("wild").with_mass(1.0).with_pose(Pose::translation(5.0, 3.0, 0.0)))
        .unwrap();
    world.add(Spring { name: "stiff".into(), on: id, to: Vec3::new(0.0, 3.0, 0.0), k: 1e18, c: 0.0 }).unwrap();
    let before = world.save();
    let error = world.step().unwrap_err();
    assert!(matches!(&error, StepError::Tolerance { object, steps: 100_000, .. } if object == "wild"), "{error}");
    assert!(world.save() == before);
    // no step is short enough for this blow
    let mut world = adaptive(1.0 / 60.0, 1e-6);
    let id = world.add(RigidBody::new(sphere(0.1)).with_name("struck").with_mass(1.0)).unwrap();
    world
        .add(Drive(id, |t, _| (if t > 0.009 { Vec3::new(1e20, 0.0, 0.0) } else { Vec3::zeros() }, Vec3::zeros())))
        .unwrap();
    let error = world.step().unwrap_err();
    let StepError::Tolerance { object, time, step, .. } = &error else { panic!("{error}") };
    assert!(object == "struck" && (time - 0.009).abs() < 1e-9 && *step <= 1e-12 / 60.0, "{error}");
    // NaN is found at once
    let mut world = adaptive(1.0 / 60.0, 1e-6);
    let id = world.add(RigidBody::new(sphere(0.1)).with_name("lost").with_mass(1.0)).unwrap();
    world.add(Drive(id, |_, _| (Vec3::new(f64::NAN, 0.0, 0.0), Vec3::zeros()))).unwrap();
    assert!(matches!(world.step().unwrap_err(), StepError::NotFinite { object, .. } if object == "lost"));
}

#[test]
fn the_tolerance_has_a_range() {
    let refused = |tolerance: f64| World::new(Settings::default().with_integrator_tolerance(tolerance)).is_err();
    assert!(refused(0.9e-14) && refused(0.11) && refused(f64::NAN) && !refused(1e-14) && !refused(0.1));
}

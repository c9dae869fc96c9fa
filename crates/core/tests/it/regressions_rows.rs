//! Regression tests of constraint rows, refusals and failed steps.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::rows::RowSet;
use tumble_core::*;

/// One row on a body's center along x.
#[derive(Clone)]
struct AlongX {
    body: ObjectId,
    target: RowTarget,
}

impl Object for AlongX {
    fn name(&self) -> &str {
        "along x"
    }
    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

impl Constraint for AlongX {
    fn rows(&self, _me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder) {
        let p = view.part_state(self.body, 0).unwrap().position();
        let mut target = self.target;
        match (&mut target.set, level) {
            // a force; over a step it is an impulse
            (RowSet::Interval { lo, hi }, Level::Velocity { h }) => (*lo, *hi) = (*lo * h, *hi * h),
            (RowSet::HalfLine, _) => target.error = p.x,
            _ => {}
        }
        out.row(target).on_point(self.body, 0, &p, &Vec3::x(), 1.0);
    }
}

fn unit_ball(world: &mut World, name: &str, at: [f64; 3], v: [f64; 3]) -> ObjectId {
    let ball = RigidBody::new(sphere(0.1))
        .with_name(name)
        .with_mass(1.0)
        .with_material(Material { friction: 0.0, ..Material::default() })
        .with_pose(Pose::translation(at[0], at[1], at[2]));
    world.add(ball.with_velocity(Vec3::from(v))).unwrap()
}

fn bits(world: &World) -> Vec<u64> {
    world.state().iter().map(|x| x.to_bits()).collect()
}

#[test]
fn a_velocity_motor_moves_by_velocity_times_time() {
    // From rest the motor takes up to one frame to reach 1 m/s, in which it covers 0 to h·v: x =
    // v·t less at most one frame's displacement. Thereafter each frame covers h·v exactly. The
    // row's position error is 0: it prescribes no position.
    let h = 1.0 / 60.0;
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, h));
        let ball = unit_ball(&mut world, "ball", [0.0; 3], [0.0; 3]);
        let target = RowTarget { velocity: 1.0, ..RowTarget::new(RowSet::Equality, 0.0) };
        world.add(AlongX { body: ball, target }).unwrap();
        for frame in 1..=60 {
            world.step().unwrap();
            let (x, t) = (position(&world, ball).x, frame as f64 * h);
            assert!((velocity(&world, ball).x - 1.0).abs() < 1e-9, "{stepper} frame {frame}");
            assert!((t - h - 1e-9..t + 1e-9).contains(&x), "{stepper} frame {frame}: x = {x}, v·t = {t}");
        }
    }
}

#[test]
fn a_motor_of_6_newtons_gives_its_impulse_whatever_bounces_elsewhere() {
    // 6 N on 1 kg for 1/60 s: 0.1 m/s. During impacts of other bodies, the force must not act twice
    // or be lost.
    for stepper in STEPPERS {
        for bounces in [false, true] {
            let mut world = no_gravity(world(stepper, 1.0 / 60.0));
            let ball = unit_ball(&mut world, "ball", [0.0, 10.0, 10.0], [0.0; 3]);
            let target = RowTarget { velocity: 100.0, ..RowTarget::new(RowSet::Interval { lo: -6.0, hi: 6.0 }, 0.0) };
            world.add(AlongX { body: ball, target }).unwrap();
            ground(&mut world, 1.0, 0.0);
            let far = RigidBody::new(sphere(0.1))
                .with_name("far")
                .with_mass(1.0)
                .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
                .with_pose(Pose::translation(0.0, 0.0, 0.15));
            let down = Vec3::new(0.0, 0.0, if bounces { -6.0 } else { 0.0 });
            let far = world.add(far.with_velocity(down)).unwrap();
            world.step().unwrap();
            assert!((velocity(&world, far) + down).norm() < 1e-9, "{stepper}: the other one bounced with e = 1");
            let v = velocity(&world, ball).x;
            assert!((v - 0.1).abs() < 1e-12, "{stepper} bounces {bounces}: {v}");
        }
    }
}

#[test]
fn a_row_with_nan_is_an_error_and_not_a_panic() {
    for stepper in STEPPERS {
        for mode in [Mode::Static, Mode::Dynamic] {
            let mut world = world(stepper, 1.0 / 60.0);
            let ball = unit_ball(&mut world, "ball", [0.0; 3], [1.0, 0.0, 0.0]);
            world.set_mode(ball, mode).unwrap();
            let bad = world.add(AlongX { body: ball, target: RowTarget::new(RowSet::Equality, f64::NAN) }).unwrap();
            let before = bits(&world);
            let error = world.step().unwrap_err();
            assert!(matches!(&error, StepError::Row { object, .. } if object == "along x"), "{stepper}: {error}");
            assert!(error.to_string().contains("finite"), "{error}");
            assert_eq!((bits(&world), world.time(), world.frame()), (before, 0.0, 0), "{stepper}");
            world.remove(bad).unwrap();
            world.step().unwrap();
        }
    }
}

#[test]
fn a_snapshot_with_a_hostile_counter_is_refused_and_objects_can_still_be_added() {
    // Every byte except the magic is overwritten in turn by 0xffff_ffff as a variable-length
    // number. Whichever counter is hit, the outcome is an error that changes nothing, or a world
    // that still works (a counter at its maximum overflows when the next object is added).
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    unit_ball(&mut world, "ball", [0.0; 3], [0.0; 3]);
    let saved = world.save();
    let before = bits(&world);
    let mut refused = 0;
    for at in 0..saved.len() {
        let hostile = [&saved[..at], &[0xff, 0xff, 0xff, 0xff, 0x0f], &saved[at + 1..]].concat();
        if world.restore(&hostile).is_err() {
            refused += 1;
            assert_eq!(bits(&world), before, "byte {at}: refused, and yet changed");
        }
        let added = world
            .add(
                RigidBody::new(sphere(0.1))
                    .with_name("more")
                    .with_mass(1.0)
                    .with_pose(Pose::translation(5.0, 0.0, 0.0)),
            )
            .unwrap();
        let _ = world.step(); // a state of 1e300 may end in an error, never in a panic
        world.remove(added).unwrap();
        world.restore(&saved).unwrap();
    }
    assert!(refused > saved.len() / 2, "only {refused} of {} refused", saved.len());
}

#[test]
fn moving_to_a_pose_that_is_not_a_number_is_refused() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let ball = unit_ball(&mut world, "ball", [0.0; 3], [0.0; 3]);
        world.set_mode(ball, Mode::Kinematic).unwrap();
        let before = bits(&world);
        for pose in [Pose::rotation(Vec3::new(f64::NAN, 0.0, 0.0)), Pose::translation(0.0, f64::INFINITY, 0.0)] {
            assert_eq!(world.move_to(ball, pose), Err(WorldError::NotFinite("ball".into())));
            assert!(matches!(world.set_pose(ball, pose), Err(WorldError::BadState(_))));
            assert_eq!(bits(&world), before);
        }
        world.step().unwrap();
    }
}

#[test]
fn numbers_that_are_no_state_of_a_body_are_refused() {
    // thirteen zeros contain a quaternion of length 0; three numbers are too few
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let ball = unit_ball(&mut world, "ball", [0.0; 3], [0.0; 3]);
    let before = bits(&world);
    for bad in [&[0.0; 13][..], &[0.0; 3], &[]] {
        assert_eq!(world.write_state_of(ball, bad), Err(WorldError::BadState("ball".into())));
        assert_eq!(bits(&world), before);
    }
    world.step().unwrap();
}

#[test]
fn a_failed_step_leaves_time_state_and_contact_forces_as_they_were() {
    // A resting ball is supported by m·g; the force on another one overflows. Afterwards nothing of
    // the failed frame may act: not the overflow, not the supporting force. Lifted to 5 m, the ball
    // falls freely: −g·h after one frame, and z = 5 − g·h²/2 (both steppers are exact on a
    // parabola).
    let h = 1.0 / 60.0;
    for failing in STEPPERS {
        for next in STEPPERS {
            let mut world = world(failing, h);
            ground(&mut world, 0.0, 0.5);
            let rests = unit_ball(&mut world, "rests", [0.0, 0.0, 0.1], [0.0; 3]);
            let light = RigidBody::new(sphere(0.1))
                .with_name("light")
                .with_mass(1e-3)
                .with_pose(Pose::translation(5.0, 0.0, 5.0));
            let light = world.add(light).unwrap();
            (0..10).for_each(|_| {
                world.step().unwrap();
            });
            let (resting, before) = (world.save(), (bits(&world), world.time().to_bits(), world.frame()));
            world.apply_force(light, 0, Vec3::new(1e308, 0.0, 0.0), &Vec3::new(5.0, 0.0, 5.0)).unwrap();
            let pushed = world.save();
            assert!(matches!(world.step(), Err(StepError::NotFinite { .. })), "{failing}");
            assert_eq!((bits(&world), world.time().to_bits(), world.frame()), before, "{failing}");
            assert!(world.save() == pushed && pushed != resting, "{failing}: the force is still applied");
            world.clear_applied();
            assert!(world.save() == resting, "{failing}");
            assert!(
                (velocity(&world, light).z + 10.0 * G * h).abs() < 1e-12,
                "{failing}: the sites are those of the state"
            );
            world.step().unwrap();
            assert!((position(&world, rests).z - 0.1).abs() < 1e-9, "{failing}: still rests");
            world.remove(light).unwrap();
            world.set_pose(rests, Pose::translation(0.0, 0.0, 5.0)).unwrap();
            world.set_velocity(rests, Vec3::zeros(), Vec3::zeros()).unwrap();
            world.set_stepper(stepper_by_name(next).unwrap());
            world.step().unwrap();
            assert!(
                (velocity(&world, rests).z + G * h).abs() < 1e-12,
                "{failing} then {next}: {}",
                velocity(&world, rests).z / h
            );
            assert!((position(&world, rests).z - (5.0 - 0.5 * G * h * h)).abs() < 1e-12, "{failing} then {next}");
        }
    }
}

#[test]
fn a_failed_step_names_the_body_whose_force_overflowed() {
    // 1e308 N is finite, 1e308 N / 1 g is not. The ball that rests 5 m away is not affected.
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        ground(&mut world, 0.0, 0.5);
        unit_ball(&mut world, "rests", [0.0, 0.0, 0.1], [0.0; 3]);
        let light =
            RigidBody::new(sphere(0.1)).with_name("light").with_mass(1e-3).with_pose(Pose::translation(5.0, 0.0, 5.0));
        let light = world.add(light).unwrap();
        world.apply_force(light, 0, Vec3::new(1e308, 0.0, 0.0), &Vec3::new(5.0, 0.0, 5.0)).unwrap();
        let error = world.step().unwrap_err();
        assert!(matches!(&error, StepError::NotFinite { object, .. } if object == "light"), "{stepper}: {error}");
    }
}

#[test]
fn a_velocity_that_is_not_finite_is_no_state() {
    // p = 1e308/60 N·s is finite, v = p/m = 1.7e309 m/s is not: the step fails, or its result can
    // be read.
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let light = world.add(RigidBody::new(sphere(0.1)).with_name("light").with_mass(1e-3)).unwrap();
        world.apply_force(light, 0, Vec3::new(1e308, 0.0, 0.0), &Vec3::zeros()).unwrap();
        let outcome = world.step().copied();
        assert!(
            outcome.is_err() || velocity(&world, light).norm().is_finite(),
            "{stepper}: {outcome:?}, v = {:?}",
            velocity(&world, light)
        );
    }
}

#[test]
fn a_limit_is_not_passed_between_two_looks_at_it() {
    // x ≥ 0, from 50 mm at −10 m/s: 167 mm per frame. It stops at 0 and stays.
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let ball = unit_ball(&mut world, "ball", [0.05, 0.0, 0.0], [-10.0, 0.0, 0.0]);
        world.add(AlongX { body: ball, target: RowTarget::new(RowSet::HalfLine, 0.0) }).unwrap();
        for frame in 0..10 {
            world.step().unwrap();
            assert!(position(&world, ball).x > -1e-9, "{stepper} frame {frame}: x = {:e}", position(&world, ball).x);
        }
        let (x, v) = (position(&world, ball).x, velocity(&world, ball).x);
        assert!(x.abs() < 1e-7 && v.abs() < 1e-9, "{stepper}: ends at {x} with {v}");
    }
}

/// A rod's end, pinned at (0.5, 0, 0).
#[derive(Clone)]
struct Pin(ObjectId);

const END: Vec3 = Vec3::new(0.5, 0.0, 0.0);

impl Object for Pin {
    fn name(&self) -> &str {
        "pin"
    }
    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

impl Constraint for Pin {
    fn rows(&self, _me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let part_state = view.part_state(self.0, 0).unwrap();
        let (arm, spin) = (part_state.pose.rotation * END, part_state.angular_velocity);
        let p = part_state.position() + arm;
        let centripetal = spin.cross(&spin.cross(&arm));
        for k in 0..3 {
            let target =
                RowTarget { bias_acceleration: centripetal[k], ..RowTarget::new(RowSet::Equality, (p - END)[k]) };
            out.row(target).on_point(self.0, 0, &p, &Vec3::ith(k, 1.0), 1.0);
        }
    }
}

struct Spun {
    /// Largest |E/E0 − 1|.
    energy: f64,
    /// Largest distance of the end from the pin, m.
    drift: f64,
    /// Largest speed of the end, m/s.
    speed: f64,
}

/// Simulates two seconds of a rod with three different principal inertias that spins about its
/// pinned end. There is no gravity and the pin is fixed, so energy is conserved.
fn spin_pinned_rod(stepper: &str, dt: f64) -> Spun {
    let mut world = no_gravity(world(stepper, dt));
    let rod = RigidBody::new(Shape::cuboid(Vec3::new(1.0, 0.2, 0.4)).unwrap()).with_name("rod").with_mass(1.0);
    let rod = world.add(rod).unwrap();
    let spin = Vec3::new(0.0, 6.0, 6.0);
    world.set_velocity(rod, spin.cross(&-END), spin).unwrap();
    world.add(Pin(rod)).unwrap();
    let start = world.energy().total();
    let mut worst = Spun { energy: 0.0, drift: 0.0, speed: 0.0 };
    for _ in 0..(2.0 / dt).round() as usize {
        world.step().unwrap();
        let part_state = world.part_state(rod, 0).unwrap();
        let p = part_state.position() + part_state.pose.rotation * END;
        worst.energy = worst.energy.max((world.energy().total() / start - 1.0).abs());
        worst.drift = worst.drift.max((p - END).norm());
        worst.speed = worst.speed.max(part_state.velocity_at(&p).norm());
    }
    println!(
        "{stepper} at {dt:.6} s: energy off by {:.3e}, drift {:.3e} m, pin speed {:.3e} m/s",
        worst.energy, worst.drift, worst.speed
    );
    worst
}

fn assert_pin_holds(stepper: &str) {
    for rate in [240.0, 480.0, 960.0] {
        let spun = spin_pinned_rod(stepper, 1.0 / rate);
        // joints do no work at any step; the rest is that of ends which are closed to 1e-9 m
        assert!(spun.energy < 1e-8, "{stepper}: energy off by {:e} at 1/{rate}", spun.energy);
        // joints are closed to 1e-9 m and 1e-9 m/s along each axis
        assert!(spun.drift < 3f64.sqrt() * 1e-9, "{stepper}: drift {:e} m", spun.drift);
        assert!(spun.speed < 3f64.sqrt() * 1e-9, "{stepper}: the end moves at {:e} m/s", spun.speed);
    }
}

#[test]
fn a_pin_holds_a_spinning_rod_in_backtracking() {
    assert_pin_holds("backtracking");
}

#[test]
fn a_pin_holds_a_spinning_rod_in_time_stepping() {
    assert_pin_holds("time_stepping");
}

//! Velocity limits of joints; cone, dry friction and damping of spherical loop joints; forces of joints asleep.

use crate::common::*;
use tumble_core::articulated::Drive;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::solver::NAMES;
use tumble_core::*;

/// Calls `check` with a world of each stepper, solver and step.
fn worlds(gravity: Vec3, check: impl Fn(&str, f64, World)) {
    for stepper in STEPPERS {
        for solver in NAMES {
            for dt in [1.0 / 60.0, 1.0 / 240.0] {
                let mut world = world(stepper, dt);
                world.set_settings(world.settings().with_gravity(gravity)).unwrap();
                world.set_solver(solver::by_name(solver).unwrap());
                check(&format!("{stepper} {solver} {dt:.4}"), dt, world);
            }
        }
    }
}

/// `v = min(g·t, v_max)`, `z = g·t²/2` until `t₁ = v_max/g` and `v_max·(t − t₁/2)` from there. In the step with `t₁` the
/// limit acts over the whole step, which changes the way by `g·h²/8` at most.
fn follows_the_limit(what: &str, dt: f64, [way, speed]: [f64; 2], time: f64, most: f64) {
    let first = most / G;
    let (at, v) = if time < first { (0.5 * G * time * time, G * time) } else { (most * (time - 0.5 * first), most) };
    assert!((way - at).abs() < 0.126 * G * dt * dt, "{what} at {time}: {way}, expected {at}");
    assert!((speed - v).abs() < 1e-9, "{what} at {time}: {speed}, expected {v}");
}

#[test]
fn a_falling_link_keeps_its_velocity_limit() {
    worlds(Vec3::z() * -G, |what, dt, mut world| {
        let slide = LinkBuilder::new("slide", Joint::prismatic(-Vec3::z()));
        let slide = slide.with_shape(sphere(0.1), Pose::identity()).with_mass(2.0).with_max_velocity(1.5);
        let id = world.add(ArticulationBuilder::new("fall").link(slide).build().unwrap()).unwrap();
        for _ in 0..(0.5 / dt) as usize {
            world.step().unwrap();
            let x = world.state_of(id).unwrap();
            follows_the_limit(what, dt, [x[0], x[1]], world.time(), 1.5);
        }
    });
}

#[test]
fn a_falling_loop_joint_keeps_its_velocity_limit() {
    worlds(Vec3::z() * -G, |what, dt, mut world| {
        let id = world.add(RigidBody::new(sphere(0.1)).with_mass(2.0)).unwrap();
        let slide = LoopJoint::prismatic_at("slide", &world, Some((id, 0)), None, Vec3::zeros(), -Vec3::z()).unwrap();
        let slide = world.add(slide.with_max_velocity(1.5).unwrap()).unwrap();
        for _ in 0..(0.5 / dt) as usize {
            world.step().unwrap();
            let [way, speed] = world.get::<LoopJoint>(slide).unwrap().position(&world.view()).unwrap();
            follows_the_limit(what, dt, [way, speed], world.time(), 1.5);
        }
        // what brakes the fall carries the weight
        assert!((world.joint_force(slide).unwrap().force.z - 2.0 * G).abs() < 1e-6, "{what}");
    });
}

#[test]
fn a_drive_beyond_the_velocity_limit_is_braked_and_a_strike_exceeds_it_for_no_step() {
    worlds(Vec3::zeros(), |what, dt, mut world| {
        let wheel = LinkBuilder::new("wheel", Joint::revolute(Vec3::z())).with_max_velocity(3.0);
        let wheel = wheel.with_shape(cube(0.2), Pose::identity()).with_mass(2.0);
        let drive = Drive::Velocity { target: -9.0, limit: 0.5 };
        let id = world.add(ArticulationBuilder::new("wheel").link(wheel.with_drive(drive)).build().unwrap()).unwrap();
        // I = m·a²/6
        let inertia = 2.0 * 0.04 / 6.0;
        for _ in 0..(0.2 / dt) as usize {
            world.step().unwrap();
            let expected = -(0.5 / inertia * world.time()).min(3.0);
            let rate = world.state_of(id).unwrap()[1];
            assert!((rate - expected).abs() < 1e-9, "{what}: {rate}, expected {expected}");
        }
        world.apply_generalized(id, &[-1e3]).unwrap();
        world.step().unwrap();
        let rate = world.state_of(id).unwrap()[1];
        assert!((rate + 3.0).abs() < 1e-9, "{what}: {rate}");
    });
}

/// A drive of any strength turns at the limit, of a link and of a loop joint.
#[test]
fn a_drive_without_a_largest_force_keeps_the_velocity_limit() {
    worlds(Vec3::zeros(), |what, _, mut world| {
        let drive = Drive::Velocity { target: -9.0, limit: f64::INFINITY };
        let wheel = LinkBuilder::new("wheel", Joint::revolute(Vec3::z())).with_max_velocity(3.0);
        let wheel = wheel.with_shape(cube(0.2), Pose::identity()).with_mass(2.0).with_drive(drive.clone());
        let id = world.add(ArticulationBuilder::new("wheel").link(wheel).build().unwrap()).unwrap();
        let ball = world.add(RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(Pose::translation(2.0, 0.0, 0.0)));
        let side = Some((ball.unwrap(), 0));
        let joint = LoopJoint::revolute_at("axle", &world, side, None, Vec3::x() * 2.0, Vec3::z()).unwrap();
        let dof = DofSettings { max_velocity: 3.0, drive, ..DofSettings::default() };
        let joint = world.add(joint.with_dof(dof).unwrap()).unwrap();
        for _ in 0..20 {
            world.step().unwrap();
        }
        let [_, loop_rate] = world.get::<LoopJoint>(joint).unwrap().position(&world.view()).unwrap();
        for rate in [world.state_of(id).unwrap()[1], loop_rate] {
            assert!((rate + 3.0).abs() < 1e-9, "{what}: {rate}");
        }
    });
}

/// A ball that turns about its center, with the joint's axis along z.
fn pinned(world: &mut World, joint: impl FnOnce(LoopJoint) -> LoopJoint, spin: Vec3) -> (ObjectId, ObjectId) {
    let ball = RigidBody::new(sphere(0.5)).with_mass(4.0).with_angular_velocity(spin);
    let ball = world.add(ball).unwrap();
    let pin = LoopJoint::spherical_at("pin", world, Some((ball, 0)), None, Vec3::zeros()).unwrap();
    (ball, world.add(joint(pin)).unwrap())
}

/// The spin of a ball of 4 kg and 0.5 m: `I = 2/5·m·r²`.
const INERTIA: f64 = 0.4;

#[test]
fn a_cone_stops_the_swing_and_leaves_the_momentum_about_its_axis() {
    worlds(Vec3::zeros(), |what, dt, mut world| {
        let (ball, pin) = pinned(&mut world, |pin| pin.with_cone(0.5).unwrap(), Vec3::new(1.0, 0.0, 0.6));
        let swing = |world: &World| world.get::<LoopJoint>(pin).unwrap().position(&world.view()).unwrap()[0];
        let (mut energy, mut most) = (f64::INFINITY, 0.0f64);
        for _ in 0..(3.0 / dt) as usize {
            world.step().unwrap();
            let turning = world.part_state(ball, 0).unwrap().angular_velocity;
            if world.time() < 0.49 {
                assert!((swing(&world) - world.time() * swing_rate(world.time())).abs() < 1e-3, "{what}");
            }
            assert!((turning.z - 0.6).abs() < 1e-6, "{what} at {}: {}", world.time(), turning.z);
            assert!(swing(&world) < 0.5 + 1e-5, "{what} at {}: {}", world.time(), swing(&world));
            let now = 0.5 * INERTIA * turning.norm_squared();
            assert!(now < energy + 1e-9, "{what} at {}: {now} J after {energy} J", world.time());
            energy = now;
            most = most.max(swing(&world));
        }
        // it strikes the cone, follows it or swings back, and strikes it again
        assert!(most > 0.4999 && energy < 0.5 * INERTIA * 1.36 - 0.01, "{what}: {most}, {energy} J");
    });
}

/// Mean rate of the swing of a body that turns at `(1, 0, 0.6)`: its z axis turns about that axis.
fn swing_rate(time: f64) -> f64 {
    let axis = Vec3::new(1.0, 0.0, 0.6);
    let turned = collide::Quat::from_scaled_axis(axis * time) * Vec3::z();
    turned.z.acos() / time
}

#[test]
fn dry_friction_of_a_spherical_joint_brakes_at_a_constant_rate() {
    worlds(Vec3::zeros(), |what, dt, mut world| {
        let dof = DofSettings { friction: 0.3, ..DofSettings::default() };
        let (ball, _) = pinned(&mut world, |pin| pin.with_dof(dof).unwrap(), Vec3::new(0.0, 1.2, 0.0));
        for _ in 0..(2.0 / dt) as usize {
            world.step().unwrap();
            let turning = world.part_state(ball, 0).unwrap().angular_velocity;
            let expected = Vec3::y() * (1.2 - 0.3 / INERTIA * world.time()).max(0.0);
            assert!((turning - expected).norm() < 1e-9, "{what} at {}: {turning:?}", world.time());
        }
    });
}

#[test]
fn damping_of_a_spherical_joint_decays_exponentially() {
    for stepper in STEPPERS {
        let error = |dt: f64| {
            let mut world = no_gravity(world(stepper, dt));
            let dof = DofSettings { damping: 0.2, ..DofSettings::default() };
            let (ball, _) = pinned(&mut world, |pin| pin.with_dof(dof).unwrap(), Vec3::new(0.3, 1.2, -0.5));
            let steps = (1.0 / dt).round() as usize;
            (0..steps).for_each(|_| _ = world.step().unwrap());
            let expected = Vec3::new(0.3, 1.2, -0.5) * (-0.2 / INERTIA * world.time()).exp();
            (world.part_state(ball, 0).unwrap().angular_velocity - expected).norm()
        };
        let errors = [error(1.0 / 60.0), error(1.0 / 240.0)];
        println!("{stepper}: {errors:?}");
        assert!(errors[0] < 5e-3 && errors[1] < errors[0] / 3.9, "{stepper}: {errors:?}");
    }
}

#[test]
fn wrong_settings_of_a_spherical_joint_and_wrong_velocity_limits_are_refused() {
    let mut world = world("time_stepping", 0.01);
    let id = world.add(RigidBody::new(sphere(0.1))).unwrap();
    let pin = || LoopJoint::spherical_at("pin", &world, Some((id, 0)), None, Vec3::zeros()).unwrap();
    let why = |joint: Result<LoopJoint, LoopJointError>| joint.unwrap_err().to_string();
    assert!(why(pin().with_limits([-0.1, 0.5])).contains("it has a cone and limits of its twist"));
    assert!(why(pin().with_cone(-0.5)).contains("the cone is -0.5"));
    assert!(why(pin().with_twist_limits([1.0, 0.0])).contains("the lower limit of the twist is 1"));
    assert!(why(pin().with_armature(-1.0)).contains("the armature is -1"));
    assert!(why(pin().with_max_velocity(0.0)).contains("above 0"));
    assert!(why(pin().with_dof_at(3, DofSettings::default())).contains("a spherical joint has 3, from 0"));
    let hinge = LoopJoint::revolute_at("hinge", &world, Some((id, 0)), None, Vec3::zeros(), Vec3::x()).unwrap();
    assert!(why(hinge.clone().with_cone(0.5)).contains("cone"));
    assert!(why(hinge.clone().with_twist_limits([0.0, 1.0])).contains("a revolute joint has no twist"));
    let far = JointPlace::between(Vec3::zeros(), Vec3::x());
    let rope = LoopJoint::joining("rope", LoopJointKind::Rope, &world, Some((id, 0)), None, far).unwrap();
    assert!(why(rope.with_armature(1.0)).contains("a rope joint has no armature"));
    assert!(why(hinge.with_max_velocity(f64::NAN)).contains("above 0"));
}

#[test]
fn a_joint_asleep_keeps_the_force_that_holds_its_body() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        world.set_settings(world.settings().with_sleep(Some(Sleep::default()))).unwrap();
        let lamp = world.add(RigidBody::new(sphere(0.1)).with_mass(2.0)).unwrap();
        let hook = LoopJoint::fixed_at("hook", &world, Some((lamp, 0)), None, Vec3::z() * 0.3).unwrap();
        let hook = world.add(hook).unwrap();
        (0..300).for_each(|_| _ = world.step().unwrap());
        assert!(world.status(lamp).unwrap().enabled && world.report().asleep == 1, "{stepper}");
        let held = |world: &World| world.joint_force(hook).unwrap().force.z;
        assert!((held(&world) - 2.0 * G).abs() < 1e-6, "{stepper}: {}", held(&world));
        // so does a fork, and a world that was restored
        let saved = world.save();
        world.restore(&saved).unwrap();
        assert!((held(&world) - 2.0 * G).abs() < 1e-6 && held(&world.fork()) == held(&world));
        world.set_enabled(hook, false).unwrap();
        assert!(held(&world) == 0.0);
    }
}

//! Couplings of two joints against closed forms.

use crate::common::*;
use std::f64::consts::TAU;
use tumble_core::articulated::{Joint, LinkMass, ModelBuilder};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

/// A ball that does not collide, with a mass and a moment of inertia about every axis.
fn ball(world: &mut World, at: Vec3, mass: f64, moment: f64) -> ObjectId {
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(mass, Mat3::identity() * moment);
    let id = world.add(body.with_pose(Pose::from(nalgebra::Translation3::from(at)))).unwrap();
    world.set_collidable(id, false).unwrap();
    id
}

fn joint(world: &mut World, id: ObjectId, kind: LoopJointKind, axis: Vec3) -> ObjectId {
    let place = JointPlace::on_line(position(world, id), axis);
    world.add(LoopJoint::joining("", kind, world, Some((id, 0)), None, place).unwrap()).unwrap()
}

fn of(world: &World, joint: ObjectId) -> f64 {
    world.get::<LoopJoint>(joint).unwrap().position(&world.view()).unwrap()[0]
}

fn couple(world: &mut World, joints: [JointRef; 2], multiplier: f64, offset: f64) -> ObjectId {
    let mimic = Mimic::between("", world, joints, multiplier, offset).unwrap();
    world.add(mimic).unwrap()
}

/// `α = τ/(I_of + r²·I)`, the follower turns by `r·θ`, and the coupling carries `I·r·α`: at several steps, both steppers.
#[test]
fn two_hinges_turn_in_their_ratio() {
    for stepper in STEPPERS {
        for rate in [60.0, 120.0, 240.0] {
            for ratio in [-2.0, 0.75] {
                let mut world = no_gravity(world(stepper, 1.0 / rate));
                let wheels = [(0.0, 0.5), (1.0, 2.0)].map(|(x, moment)| ball(&mut world, Vec3::x() * x, 1.0, moment));
                let [tilted, leader] = [Vec3::new(0.6, 0.0, 0.8), Vec3::z()];
                let follower = joint(&mut world, wheels[0], LoopJointKind::Revolute, tilted);
                let hinge = joint(&mut world, wheels[1], LoopJointKind::Revolute, leader);
                let pair = [JointRef::LoopJoint(follower), JointRef::LoopJoint(hinge)];
                let mimic = couple(&mut world, pair, ratio, 0.0);
                let alpha = 3.0 / (2.0 + ratio * ratio * 0.5);
                for _ in 0..rate as usize {
                    world.apply_torque(wheels[1], 0, leader * 3.0).unwrap();
                    world.step().unwrap();
                }
                let angle = of(&world, hinge);
                assert!((angle - 0.5 * alpha).abs() < 1e-9, "{stepper}, {rate} Hz: {angle}, expected {}", 0.5 * alpha);
                assert!((of(&world, follower) - ratio * angle).abs() < 1e-9);
                let force = world.mimic_force(mimic).unwrap();
                assert!(
                    (force - 0.5 * ratio * alpha).abs() < 1e-7,
                    "{stepper}: {force}, expected {}",
                    0.5 * ratio * alpha
                );
                let error = world.get::<Mimic>(mimic).unwrap().error(&world.view()).unwrap();
                assert!(error.abs() < 1e-9, "{error}");
            }
        }
    }
}

/// Angles of loop joints pass ±π a hundred times, with a ratio that is no whole number: no turn is lost.
#[test]
fn the_ratio_is_exact_over_a_hundred_turns() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let wheels = [0.0, 1.0].map(|x| ball(&mut world, Vec3::x() * x, 1.0, 0.5));
        let hinges = wheels.map(|wheel| joint(&mut world, wheel, LoopJointKind::Revolute, Vec3::z()));
        let ratio = 2.0 / 3.0;
        couple(&mut world, [JointRef::LoopJoint(hinges[1]), JointRef::LoopJoint(hinges[0])], ratio, 0.3);
        // the coupling closes its first error of 0.3 rad, then both turn
        (0..480).for_each(|_| _ = world.step().unwrap());
        let mut angles = hinges.map(|hinge| of(&world, hinge));
        assert!((angles[1] - ratio * angles[0] - 0.3).abs() < 1e-9, "{angles:?}");
        while angles[0].abs() < 100.0 * TAU {
            world.apply_torque(wheels[0], 0, Vec3::z() * 20.0).unwrap();
            world.step().unwrap();
            for (angle, hinge) in angles.iter_mut().zip(hinges) {
                let step = (of(&world, hinge) - *angle + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
                *angle += step;
            }
            assert!((angles[1] - ratio * angles[0] - 0.3).abs() < 1e-6, "{stepper}: {angles:?}");
        }
    }
}

/// A carriage of an articulated body hangs on the cord of a drum on a loop joint, `z = r·θ`:
/// `θ̈ = −m·g·r/(I + m·r²)`. The drum turns several times, and both ways of naming which joint follows agree.
#[test]
fn a_joint_of_a_robot_follows_a_loop_joint() {
    let (radius, moment, mass) = (0.05, 0.02, 3.0);
    for stepper in STEPPERS {
        for drum_leads in [true, false] {
            let mut world = world(stepper, 1.0 / 240.0);
            let mut builder = ModelBuilder::new();
            let load = LinkMass { mass, center: Vec3::zeros(), inertia: Mat3::identity() * 0.1 };
            builder.link("carriage", None, Joint::prismatic(Vec3::z()), Pose::identity(), load);
            let lift = world.add(ArticulatedBody::new("lift", builder.build().unwrap())).unwrap();
            let drum = ball(&mut world, Vec3::x(), 5.0, moment);
            let hinge = JointRef::LoopJoint(joint(&mut world, drum, LoopJointKind::Revolute, Vec3::y()));
            let carriage = JointRef::Dof(lift, 0);
            match drum_leads {
                true => couple(&mut world, [carriage, hinge], radius, 0.0),
                false => couple(&mut world, [hinge, carriage], 1.0 / radius, 0.0),
            };
            let alpha = -mass * G * radius / (moment + mass * radius * radius);
            (0..240).for_each(|_| _ = world.step().unwrap());
            let z = world.state_of(lift).unwrap()[0];
            assert!((z - 0.5 * alpha * radius).abs() < 1e-9, "{stepper}: {z}, expected {}", 0.5 * alpha * radius);
            assert!(z.abs() > radius * TAU, "several turns");
            let spin = world.body(drum).unwrap().angular_velocity().y;
            assert!((spin - alpha).abs() < 1e-9, "{stepper}: {spin}, expected {alpha}");
        }
    }
}

/// A balance beam of a robot carries a drum on a loop joint, whose coupling to a second drum holds it against a weight's
/// torque: the sensor in the beam's joint reads the torque of the coupling.
#[test]
fn a_force_sensor_reads_what_a_coupling_does() {
    let mut world = no_gravity(world("time_stepping", 0.002));
    let mut builder = ModelBuilder::new();
    let beam = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() * 0.1 };
    builder.link("beam", None, Joint::revolute(Vec3::z()), Pose::identity(), beam);
    let mut robot = ArticulatedBody::new("robot", builder.build().unwrap());
    let drive = articulated::Drive::Velocity { target: 0.0, limit: f64::INFINITY };
    robot.set_dof(0, DofSettings { drive, ..DofSettings::default() }).unwrap();
    let robot = world.add(robot).unwrap();
    // the joint between beam and drum carries no torque about z, so the beam feels the coupling alone
    let drum = ball(&mut world, Vec3::x(), 1.0, 0.5);
    let hinge = LoopJoint::revolute_at("", &world, Some((drum, 0)), Some((robot, 0)), Vec3::x(), Vec3::z()).unwrap();
    let hinge = world.add(hinge).unwrap();
    couple(&mut world, [JointRef::LoopJoint(hinge), JointRef::Dof(robot, 0)], 1.0, 0.0);
    let sensor = Sensor::new("torque", SensorKind::Torque, Anchor::on(robot, 0, Pose::identity())).unwrap();
    let sensor = world.add(sensor).unwrap();
    for _ in 0..10 {
        world.apply_torque(drum, 0, Vec3::z() * 3.0).unwrap();
        world.step().unwrap();
    }
    // the drum stands still: the coupling holds it with −3 N·m, and the beam's joint holds +3 N·m of its reaction
    let reading = world.reading(sensor).unwrap();
    assert!((reading[2] + 3.0).abs() < 1e-9, "{reading:?}");
}

/// A fork, a snapshot and an archive go on with the same bits, and what the coupling cannot be is refused by name.
#[test]
fn couplings_are_kept_and_their_faults_named() {
    let mut world = world("time_stepping", 0.01);
    let wheels = [0.0, 1.0, 2.0, 3.0].map(|x| ball(&mut world, Vec3::x() * x, 1.0, 0.5));
    let hinges = wheels.map(|wheel| joint(&mut world, wheel, LoopJointKind::Revolute, Vec3::z()));
    let [first, second, third, _] = hinges.map(JointRef::LoopJoint);
    let mimic = couple(&mut world, [first, second], 1.5, 0.2);
    world.apply_torque(wheels[1], 0, Vec3::z()).unwrap();
    (0..20).for_each(|_| _ = world.step().unwrap());
    let (mut fork, saved) = (world.fork(), world.save());
    let mut copy = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    let run = |world: &mut World| {
        (0..50).for_each(|_| _ = world.step().unwrap());
        world.state().to_vec()
    };
    let after = run(&mut world);
    assert!(after == run(&mut fork) && after == run(&mut copy));
    world.restore(&saved).unwrap();
    assert!(after == run(&mut world));
    assert_eq!(copy.get::<Mimic>(copy.ids()[8]).unwrap().ratio(), [1.5, 0.2]);
    // between two steps the ratio can change; an irrational one has no common step of two angles
    world.set_mimic_ratio(mimic, -1.0, 0.0).unwrap();
    let why = world.set_mimic_ratio(mimic, 2f64.sqrt(), 0.0).unwrap_err().to_string();
    assert!(why.contains("multiplier is 1.414") && why.contains("ratio of whole numbers"), "{why}");
    assert_eq!(world.get::<Mimic>(mimic).unwrap().ratio(), [-1.0, 0.0]);
    let refused = |joints, multiplier| Mimic::between("m", &world, joints, multiplier, 0.0).unwrap_err().to_string();
    assert!(refused([first, first], 1.0).contains("to itself"));
    assert!(refused([first, second], 0.0).contains("not 0"));
    assert!(refused([first, second], 1001.0).contains("whole numbers up to 1000"));
    assert!(Mimic::between("m", &world, [first, second], 1000.0 / 999.0, 0.0).is_ok());
    assert!(refused([first, JointRef::LoopJoint(wheels[0])], 1.0).contains("is no joint"));
    let between =
        LoopJoint::revolute_at("", &world, Some((wheels[2], 0)), Some((wheels[3], 0)), Vec3::x() * 2.5, Vec3::z());
    let mut more = world.fork();
    let between = JointRef::LoopJoint(more.add(between.unwrap()).unwrap());
    let why = Mimic::between("m", &more, [first, between], 1.0, 0.0).unwrap_err().to_string();
    assert!(why.contains("3 dynamic objects"), "{why}");
    assert!(Mimic::between("m", &more, [third, between], 1.0, 0.0).is_ok(), "two bodies and the world");
    // a coupling of a joint that is disabled does nothing, and goes with a joint that is removed
    world.set_enabled(hinges[0], false).unwrap();
    world.step().unwrap();
    assert!(world.get::<Mimic>(mimic).unwrap().error(&world.view()).is_none());
    assert_eq!(world.mimic_force(mimic), Some(0.0));
    world.remove(hinges[0]).unwrap();
    world.step().unwrap();
    assert!(world.object(mimic).is_none() && world.mimic_force(mimic).is_none());
}

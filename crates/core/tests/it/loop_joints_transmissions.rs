//! Gears, racks, screws and pulleys against closed forms.

use crate::common::*;
use std::f64::consts::TAU;
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

const DT: f64 = 1.0 / 240.0;

/// A ball that does not collide, with a mass and a moment of inertia about every axis.
fn ball(world: &mut World, at: Vec3, mass: f64, moment: f64) -> ObjectId {
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(mass, Mat3::identity() * moment);
    let id = world.add(body.with_pose(Pose::from(nalgebra::Translation3::from(at)))).unwrap();
    world.set_collidable(id, false).unwrap();
    id
}

fn run(world: &mut World, seconds: f64) {
    (0..(seconds / world.settings().dt).round() as usize).for_each(|_| _ = world.step().unwrap());
}

fn add(
    world: &mut World,
    kind: LoopJointKind,
    ids: [ObjectId; 2],
    place: JointPlace,
    change: impl FnOnce(&mut Transmission),
) -> ObjectId {
    let [a, b] = ids.map(|id| Some((id, 0)));
    let joint = LoopJoint::joining("", kind, world, a, b, place).unwrap();
    world.add(joint.with_transmission(change).unwrap()).unwrap()
}

fn hinge(world: &mut World, id: ObjectId, axis: Vec3) -> ObjectId {
    let at = position(world, id);
    let joint = LoopJoint::revolute_at("", world, Some((id, 0)), None, at, axis).unwrap();
    world.add(joint).unwrap()
}

/// The angle of a wheel with all of its turns, from the angle within a turn.
fn unwrapped(before: f64, now: f64) -> f64 {
    before + (now - before + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU
}

/// `α_A = τ/(I_A + (n_A/n_B)²·I_B)`, and the ratio of the angles is that of the teeth over 100 turns, for
/// parallel axes, bevel gears and a ring gear.
#[test]
fn gears_keep_the_ratio_of_their_teeth() {
    for stepper in STEPPERS {
        for (second, teeth) in [(Vec3::z(), [20, 45]), (Vec3::new(0.6, 0.0, 0.8), [13, 7]), (Vec3::z(), [12, -60])] {
            let mut world = no_gravity(world(stepper, DT));
            let [a, b] = [(0.0, 0.5), (1.0, 2.0)].map(|(x, moment)| ball(&mut world, Vec3::x() * x, 1.0, moment));
            let hinges = [hinge(&mut world, a, Vec3::z()), hinge(&mut world, b, second)];
            let place = JointPlace::on_line(Vec3::zeros(), Vec3::z()).with_second_axis(second);
            let gear = add(&mut world, LoopJointKind::Gear, [a, b], place, |t| t.teeth = teeth);
            let [n, m] = teeth.map(f64::from);
            let inertia = 0.5 + (n / m).powi(2) * 2.0;
            let mut angles = [0.0; 2];
            let mut turn = |world: &mut World, torque: f64| {
                world.apply_torque(a, 0, Vec3::z() * torque).unwrap();
                world.step().unwrap();
                for (angle, hinge) in angles.iter_mut().zip(hinges) {
                    let now = world.get::<LoopJoint>(hinge).unwrap().position(&world.view()).unwrap()[0];
                    *angle = unwrapped(*angle, now);
                }
                assert!((n * angles[0] + m * angles[1]).abs() < 1e-6, "{stepper}, {teeth:?}: {angles:?}");
                angles
            };
            (0..240).for_each(|_| _ = turn(&mut world, 3.0 * inertia));
            let [angle, _] = turn(&mut world, 0.0);
            let expected = 1.5 + 3.0 * DT;
            assert!((angle - expected).abs() < 1e-3, "{stepper}, {teeth:?}: {angle} for {expected}");
            let carried = world.joint_force(gear).unwrap();
            assert!(carried.torque.norm() < 1e-5 && carried.force == Vec3::zeros(), "no load at a constant speed");
            while turn(&mut world, 10.0)[0] < 100.0 * TAU {}
        }
    }
}

/// A pinion of radius r drives a rack of mass m: `a = τ·r/(I + m·r²)`.
#[test]
fn a_pinion_drives_its_rack() {
    let (radius, moment, mass) = (0.2, 0.05, 3.0);
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let pinion = ball(&mut world, Vec3::zeros(), 1.0, moment);
        let rack = ball(&mut world, Vec3::y() * -radius, mass, 1.0);
        hinge(&mut world, pinion, Vec3::z());
        let slide = LoopJoint::prismatic_at("", &world, Some((rack, 0)), None, Vec3::zeros(), Vec3::x()).unwrap();
        world.add(slide).unwrap();
        let place = JointPlace::on_line(Vec3::zeros(), Vec3::z()).with_second_axis(Vec3::x());
        let joint = add(&mut world, LoopJointKind::Rack, [pinion, rack], place, |t| t.radius = radius);
        for _ in 0..480 {
            world.apply_torque(pinion, 0, Vec3::z() * 0.7).unwrap();
            world.step().unwrap();
        }
        let expected = 0.7 * radius / (moment + mass * radius * radius);
        assert!((velocity(&world, rack).x - expected * 2.0).abs() < 1e-6, "{stepper}: {:?}", velocity(&world, rack));
        assert!((position(&world, rack).x - expected * 2.0).abs() < 1e-6);
        // several turns of the pinion: s = r·θ
        assert!(position(&world, rack).x > radius * TAU);
        let carried = world.joint_force(joint).unwrap();
        assert!((carried.torque + Vec3::z() * (mass * expected * radius)).norm() < 1e-6, "{carried:?}");
    }
}

/// A nut that its weight screws down: `a = g·m/(m + I·(2π/p)²)`; a motor of torque τ lifts with `τ·2π/p`.
#[test]
fn a_nut_turns_as_it_falls() {
    let (mass, moment, pitch) = (2.0, 1e-4, 0.04);
    for stepper in STEPPERS {
        for pitch in [pitch, -pitch] {
            let mut world = world(stepper, DT);
            let nut = ball(&mut world, Vec3::zeros(), mass, moment);
            let joint = LoopJoint::joining(
                "",
                LoopJointKind::Screw,
                &world,
                Some((nut, 0)),
                None,
                JointPlace::at(Vec3::zeros()),
            );
            let joint = world.add(joint.unwrap().with_transmission(|t| t.pitch = pitch).unwrap()).unwrap();
            run(&mut world, 1.0);
            let lead = pitch / TAU;
            let expected = -G * mass / (mass + moment / (lead * lead));
            assert!((velocity(&world, nut).z - expected).abs() < 1e-5, "{stepper}: {:?}", velocity(&world, nut));
            assert!((position(&world, nut).z - 0.5 * expected).abs() < 1e-4);
            let spin = world.body(nut).unwrap().angular_velocity();
            assert!((spin.z * lead - velocity(&world, nut).z).abs() < 1e-9, "{stepper}: {spin:?}");
            // at rest again, held by the torque τ = m g p/2π
            world.set_velocity(nut, Vec3::zeros(), Vec3::zeros()).unwrap();
            for _ in 0..240 {
                world.apply_torque(nut, 0, Vec3::z() * (mass * G * lead)).unwrap();
                world.step().unwrap();
            }
            assert!(velocity(&world, nut).norm() < 1e-6, "{stepper}: {:?}", velocity(&world, nut));
            let error = world.get::<LoopJoint>(joint).unwrap().position_error(&world.view()).unwrap();
            assert!(error.distance < 1e-7 && error.angle < 1e-7);
        }
    }
}

/// Atwood's machine with a tackle: `a = g·(m₁ − m₂/r)/(m₁ + m₂/r²)`, and the rope pulls with `m₁·(g − a)`.
#[test]
fn weights_on_a_pulley_fall_as_atwood_says() {
    for stepper in STEPPERS {
        for ratio in [1.0, 2.0] {
            let mut world = world(stepper, DT);
            let [one, two] = [(0.0, 3.0), (1.0, 2.0)].map(|(x, mass)| ball(&mut world, Vec3::x() * x, mass, 1e-6));
            let points = [one, two].map(|id| position(&world, id));
            let place = JointPlace::over(points, points.map(|p| p + Vec3::z() * 5.0));
            let pulley = add(&mut world, LoopJointKind::Pulley, [one, two], place, |t| t.ratio = ratio);
            assert_eq!(world.get::<LoopJoint>(pulley).unwrap().length(), 5.0 + 5.0 * ratio);
            run(&mut world, 0.5);
            let expected = G * (3.0 - 2.0 / ratio) / (3.0 + 2.0 / (ratio * ratio));
            assert!((velocity(&world, one).z + 0.5 * expected).abs() < 1e-6, "{stepper}: {:?}", velocity(&world, one));
            assert!((velocity(&world, two).z - 0.5 * expected / ratio).abs() < 1e-6);
            let pull = world.joint_force(pulley).unwrap().force;
            assert!((pull - Vec3::z() * 3.0 * (G - expected)).norm() < 1e-6, "{stepper}: {pull:?}");
            // lifted, the rope is slack
            world.set_velocity(one, Vec3::z() * 3.0, Vec3::zeros()).unwrap();
            let before = velocity(&world, two).z;
            run(&mut world, 0.1);
            assert!((velocity(&world, two).z - before + 0.1 * G).abs() < 1e-9, "{stepper}");
        }
    }
}

#[test]
fn copies_and_wrong_constants() {
    let mut world = world("time_stepping", DT);
    let ids = [ball(&mut world, Vec3::zeros(), 1.0, 1.0), ball(&mut world, Vec3::x(), 1.0, 1.0)];
    hinge(&mut world, ids[0], Vec3::z());
    hinge(&mut world, ids[1], Vec3::z());
    let gear = add(&mut world, LoopJointKind::Gear, ids, JointPlace::at(Vec3::zeros()), |t| t.teeth = [3, 4]);
    world.set_velocity(ids[0], Vec3::zeros(), Vec3::z()).unwrap();
    let mut copies = [world.fork(), World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()];
    run(&mut world, 1.0);
    for copy in &mut copies {
        run(copy, 1.0);
        assert!(copy.save() == world.save());
    }
    let joint = world.get::<LoopJoint>(gear).unwrap().clone();
    for (change, words) in [
        ((|t| t.teeth[1] = 0) as fn(&mut Transmission), "the number of teeth of b is 0; it must be finite and not 0"),
        (|t| t.radius = 0.0, "the radius is 0"),
        (|t| t.pitch = f64::NAN, "the pitch is NaN"),
        (|t| t.ratio = -1.0, "the ratio is -1; it must be finite and above 0"),
        (|t| t.ground[0].x = f64::INFINITY, "a point or frame of the world is inf"),
    ] {
        let message = joint.clone().with_transmission(change).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
    let alone =
        LoopJoint::joining("j", LoopJointKind::Gear, &world, Some((ids[0], 0)), None, JointPlace::at(Vec3::zeros()));
    assert_eq!(alone.unwrap_err().to_string(), "loop joint 'j': a gear joins two parts, and one side is the world");
}

//! Kinds of loop joints against closed forms, with their forces, settings and breaking.

use crate::common::*;
use std::f64::consts::{PI, TAU};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

const DT: f64 = 1.0 / 240.0;

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

/// A ball of 2 kg that does not collide, with moments of inertia of 0.5 kg·m².
fn ball(world: &mut World, pose: Pose) -> ObjectId {
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(2.0, Mat3::identity() * 0.5).with_pose(pose);
    let id = world.add(body).unwrap();
    world.set_collidable(id, false).unwrap();
    id
}

/// A ball with next to no inertia: a point of 2 kg.
fn point(world: &mut World, at: Vec3) -> ObjectId {
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(2.0, Mat3::identity() * 1e-7);
    let id = world.add(body.with_pose(Pose::from(nalgebra::Translation3::from(at)))).unwrap();
    world.set_collidable(id, false).unwrap();
    id
}

fn join(world: &World, kind: LoopJointKind, a: ObjectId, b: Option<ObjectId>, place: JointPlace) -> LoopJoint {
    LoopJoint::joining("joint", kind, world, Some((a, 0)), b.map(|b| (b, 0)), place).unwrap()
}

fn run(world: &mut World, seconds: f64) {
    (0..(seconds / world.settings().dt).round() as usize).for_each(|_| _ = world.step().unwrap());
}

fn error(world: &World, joint: ObjectId) -> PositionError {
    world.get::<LoopJoint>(joint).unwrap().position_error(&world.view()).unwrap()
}

fn coordinate(world: &World, joint: ObjectId) -> [f64; 2] {
    world.get::<LoopJoint>(joint).unwrap().position(&world.view()).unwrap()
}

/// `x = ½ F/m t²` along the axis and `θ = ½ τ/I t²` about it; nothing across.
#[test]
fn a_cylindrical_joint_leaves_its_axis_free() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let id = ball(&mut world, at(0.0, 0.0, 0.0));
        let axis = Vec3::new(1.0, 2.0, 2.0) / 3.0;
        let joint = join(&world, LoopJointKind::Cylindrical, id, None, JointPlace::on_line(Vec3::zeros(), axis));
        let joint = world.add(joint).unwrap();
        for _ in 0..240 {
            let across = Vec3::new(2.0, -1.0, 0.0);
            world.apply_force(id, 0, 3.0 * axis + across, &position(&world, id)).unwrap();
            world.apply_torque(id, 0, 0.25 * axis + across).unwrap();
            world.step().unwrap();
        }
        assert!((position(&world, id) - 0.75 * axis).norm() < 1e-6, "{stepper}: {:?}", position(&world, id));
        let turned = world.body(id).unwrap().pose().rotation.scaled_axis();
        assert!((turned - 0.25 * axis).norm() < 1e-6, "{stepper}: {turned:?}");
        let [s, rate] = coordinate(&world, joint);
        assert!((s - 0.75).abs() < 1e-6 && (rate - 1.5).abs() < 1e-6);
        let held = world.joint_force(joint).unwrap();
        assert!((held.force - Vec3::new(-2.0, 1.0, 0.0)).norm() < 1e-6, "{stepper}: {held:?}");
        assert!((held.torque - Vec3::new(-2.0, 1.0, 0.0)).norm() < 1e-6, "{stepper}: {held:?}");
    }
}

/// A Cardan shaft: `tan θ_out = tan θ_in / cos β` for the arm of the input in the plane of the bend.
#[test]
fn a_universal_joint_turns_as_cardan_says() {
    let beta = 0.5_f64;
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let (input, output) = (ball(&mut world, at(-1.0, 0.0, 0.0)), ball(&mut world, at(1.0, 0.0, 0.0)));
        let along = Vec3::new(beta.cos(), beta.sin(), 0.0);
        for (name, id, axis) in [("in", input, Vec3::x()), ("out", output, along)] {
            let bearing = LoopJoint::revolute_at(name, &world, Some((id, 0)), None, Vec3::zeros(), axis).unwrap();
            let drive = match name {
                "in" => Drive::Velocity { target: 3.0, limit: f64::INFINITY },
                _ => Drive::None,
            };
            world.add(bearing.with_dof(DofSettings { drive, ..DofSettings::default() }).unwrap()).unwrap();
        }
        // the arm of the input stands across the plane of the bend, that of the output lies in it
        let second = Vec3::new(-beta.sin(), beta.cos(), 0.0);
        let place = JointPlace::on_line(Vec3::zeros(), Vec3::z()).with_second_axis(second);
        let joint = join(&world, LoopJointKind::Universal, input, Some(output), place);
        let joint = world.add(joint).unwrap();
        let [turned_in, turned_out] = ["in", "out"].map(|name| world.find(name).unwrap());
        for step in 0..960 {
            world.step().unwrap();
            let [a, b] = [turned_in, turned_out].map(|id| coordinate(&world, id)[0]);
            // the input's arm turns from z, so tan θ_out = tan θ_in·cos β
            let expected = (a.sin() * beta.cos()).atan2(a.cos());
            let off = (b - expected + PI).rem_euclid(TAU) - PI;
            assert!(off.abs() < 1e-6, "{stepper}, step {step}: {b} for {expected} at {a}");
            assert!(error(&world, joint).angle < 1e-7 && error(&world, joint).distance < 1e-7);
        }
    }
}

/// A puck on an inclined plane: it slides by `½ g sin α t²`, spins freely, and the plane carries `m g cos α`.
#[test]
fn a_planar_joint_carries_the_weight_across_its_plane() {
    let angle = 0.4_f64;
    let (normal, down) = (Vec3::new(angle.sin(), 0.0, angle.cos()), Vec3::new(angle.cos(), 0.0, -angle.sin()));
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let id = ball(&mut world, at(0.0, 0.0, 0.0));
        world.set_velocity(id, Vec3::y(), 2.0 * normal).unwrap();
        let joint = join(&world, LoopJointKind::Planar, id, None, JointPlace::on_line(Vec3::zeros(), normal));
        let joint = world.add(joint).unwrap();
        run(&mut world, 1.0);
        let expected = 0.5 * G * angle.sin() * down + Vec3::y();
        assert!((position(&world, id) - expected).norm() < 1e-6, "{stepper}: {:?}", position(&world, id));
        assert!((world.body(id).unwrap().angular_velocity() - 2.0 * normal).norm() < 1e-6);
        let held = world.joint_force(joint).unwrap();
        assert!((held.force - 2.0 * G * angle.cos() * normal).norm() < 1e-6 && held.torque.norm() < 1e-6, "{held:?}");
    }
}

/// A conical pendulum: `ω² = g/(l cos θ)`, and the rod pulls with `m g / cos θ`. The rod is a distance.
#[test]
fn a_distance_holds_a_conical_pendulum() {
    let (length, angle) = (1.5_f64, 0.6_f64);
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let radius = length * angle.sin();
        let id = point(&mut world, Vec3::new(radius, 0.0, -length * angle.cos()));
        let omega = (G / (length * angle.cos())).sqrt();
        world.set_velocity(id, Vec3::y() * (omega * radius), Vec3::zeros()).unwrap();
        let place = JointPlace::between(position(&world, id), Vec3::zeros());
        let joint = join(&world, LoopJointKind::Distance, id, None, place);
        assert!((joint.length() - length).abs() < 1e-12);
        let joint = world.add(joint).unwrap();
        run(&mut world, 2.0);
        let (s, c) = (2.0 * omega).sin_cos();
        let expected = Vec3::new(radius * c, radius * s, -length * angle.cos());
        assert!((position(&world, id) - expected).norm() < 5e-3, "{stepper}: {:?}", position(&world, id) - expected);
        assert!(error(&world, joint).distance < 1e-8);
        let pull = world.joint_force(joint).unwrap().force;
        assert!((pull.norm() - 2.0 * G / angle.cos()).abs() < 2e-2, "{stepper}: {}", pull.norm());
    }
}

/// A ball falls freely until its rope is taut, stops, and hangs with its weight.
#[test]
fn a_rope_is_slack_until_its_length() {
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let id = point(&mut world, Vec3::new(0.0, 0.0, 0.0));
        let place = JointPlace::between(Vec3::zeros(), Vec3::z() * 0.2);
        let rope = join(&world, LoopJointKind::Rope, id, None, place).with_length(1.2).unwrap();
        let rope = world.add(rope).unwrap();
        let taut = (2.0 * 1.0 / G).sqrt();
        let steps = (taut / DT) as usize - 2;
        for k in 1..=steps {
            world.step().unwrap();
            let t = k as f64 * DT;
            assert!((position(&world, id).z + 0.5 * G * t * t).abs() < 1e-9, "{stepper}: it falls");
            assert_eq!(world.joint_force(rope).unwrap().force, Vec3::zeros());
        }
        run(&mut world, 1.0);
        assert!((position(&world, id).z + 1.0).abs() < 1e-6, "{stepper}: {}", position(&world, id).z);
        assert!(velocity(&world, id).norm() < 1e-6 && error(&world, rope).distance < 1e-6);
        let pull = world.joint_force(rope).unwrap().force;
        assert!((pull - Vec3::z() * 2.0 * G).norm() < 1e-6, "{stepper}: {pull:?}");
    }
}

/// `x = A e^(−ct/2m) cos ω't` of two bodies with the reduced mass, without gravity.
#[test]
fn a_spring_swings_with_the_reduced_mass() {
    let (stiffness, start) = (30.0, 0.2);
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, DT));
        let (a, b) = (point(&mut world, Vec3::zeros()), point(&mut world, Vec3::x()));
        let spring = join(&world, LoopJointKind::Spring, a, Some(b), JointPlace::between(Vec3::zeros(), Vec3::x()));
        let dof = DofSettings { spring: Some(Spring { stiffness, rest: 1.0 - start }), ..DofSettings::default() };
        let spring = world.add(spring.with_dof(dof.clone()).unwrap()).unwrap();
        let omega = (stiffness / 1.0_f64).sqrt();
        let energy = world.energy().total();
        assert!((energy - 0.5 * stiffness * start * start).abs() < 1e-12);
        for k in 1..=(10.0 * TAU / omega / DT) as usize {
            world.step().unwrap();
            let expected = 1.0 - start + start * (omega * k as f64 * DT).cos();
            let [length, _] = coordinate(&world, spring);
            assert!((length - expected).abs() < 3e-3, "{stepper}, step {k}: {length} for {expected}");
            assert!((world.energy().total() - energy).abs() < 2e-3 * energy, "{stepper}: {}", world.energy().total());
        }
        // damped critically, it creeps to its length
        let critical = 2.0 * omega;
        world
            .change_joint(spring, |joint| joint.set_dof(DofSettings { damping: critical, ..dof }).map_err(of))
            .unwrap();
        run(&mut world, 5.0);
        assert!((coordinate(&world, spring)[0] - (1.0 - start)).abs() < 1e-6);
    }
}

fn of(error: LoopJointError) -> WorldError {
    panic!("{error}")
}

/// The implicit midpoint rule is stable at any stiffness: a ball of 2 kg that is let go swings about `m g / k`
/// and hangs there with damping.
#[test]
fn a_stiff_spring_is_stable() {
    for (stiffness, damping) in [(1e9, 0.0), (1e6, 1e4), (1e3, 1e4)] {
        let mut world = world("time_stepping", 1.0 / 60.0);
        let id = point(&mut world, Vec3::zeros());
        let spring = join(&world, LoopJointKind::Spring, id, None, JointPlace::between(Vec3::zeros(), Vec3::z()));
        let dof = DofSettings { spring: Some(Spring { stiffness, rest: 1.0 }), damping, ..DofSettings::default() };
        let spring = world.add(spring.with_dof(dof).unwrap()).unwrap();
        let sag = 2.0 * G / stiffness;
        for _ in 0..1200 {
            world.step().unwrap();
            let off = coordinate(&world, spring)[0] - 1.0 - sag;
            assert!(off.abs() < 1.01 * sag, "{stiffness}: {off}");
        }
        if damping > 0.0 {
            run(&mut world, 100.0);
            assert!((coordinate(&world, spring)[0] - 1.0 - sag).abs() < 1e-4 * sag, "{stiffness}");
            assert!((world.joint_force(spring).unwrap().force - Vec3::z() * 2.0 * G).norm() < 1e-2);
        }
    }
}

fn door(world: &mut World) -> ObjectId {
    ball(world, at(1.0, 0.0, 0.0))
}

fn hinge(world: &World, id: ObjectId, axis: Vec3) -> LoopJoint {
    LoopJoint::revolute_at("hinge", world, Some((id, 0)), None, Vec3::zeros(), axis).unwrap()
}

#[test]
fn limits_stop_a_hinge_also_beyond_half_a_turn() {
    for stepper in STEPPERS {
        for [lower, upper] in [[-0.5, 0.7], [-0.5, 4.0]] {
            let mut world = no_gravity(world(stepper, DT));
            let id = door(&mut world);
            let joint = hinge(&world, id, Vec3::z()).with_limits([lower, upper]).unwrap();
            let joint = world.add(joint).unwrap();
            for (spin, stop) in [(3.0, upper), (-3.0, lower)] {
                world.set_velocity(id, Vec3::z().cross(&position(&world, id)) * spin, Vec3::z() * spin).unwrap();
                run(&mut world, 2.0);
                let [angle, rate] = coordinate(&world, joint);
                assert!((angle - stop).abs() < 1e-6 && rate.abs() < 1e-6, "{stepper}: {angle} for {stop}, {rate}");
            }
        }
    }
}

/// A drive holds an arm at `k (target − θ) = m g r cos θ`; without limits it goes the shorter way.
#[test]
fn drives_reach_their_balance() {
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let id = door(&mut world);
        let (stiffness, target) = (60.0, 0.5);
        let drive = Drive::Position { stiffness, damping: 20.0, target, velocity: 0.0, limit: f64::INFINITY };
        // turning about −y raises the arm
        let joint = hinge(&world, id, -Vec3::y()).with_dof(DofSettings { drive, ..DofSettings::default() }).unwrap();
        let joint = world.add(joint).unwrap();
        run(&mut world, 10.0);
        let [angle, _] = coordinate(&world, joint);
        let torque = stiffness * (target - angle);
        assert!((torque - 2.0 * G * angle.cos()).abs() < 1e-6, "{stepper}: {angle}");
        let carried = world.joint_force(joint).unwrap();
        assert!((carried.drives[0] - torque).abs() < 1e-6, "{stepper}: {carried:?} for {torque}");
        assert!(
            (carried.torque + Vec3::y() * torque).norm() < 1e-6 && (carried.force - Vec3::z() * 2.0 * G).norm() < 1e-6
        );
        // 3.3 rad is nearer behind: −2.98
        let stiffness = 600.0;
        let drive = Drive::Position { stiffness, damping: 100.0, target: 3.3, velocity: 0.0, limit: f64::INFINITY };
        let dof = DofSettings { drive, ..DofSettings::default() };
        world.change_joint(joint, |joint| joint.set_dof(dof).map_err(of)).unwrap();
        run(&mut world, 10.0);
        let [angle, _] = coordinate(&world, joint);
        assert!(angle < -2.8 && (stiffness * (3.3 - TAU - angle) - 2.0 * G * angle.cos()).abs() < 1e-6, "{angle}");
    }
}

#[test]
fn a_weak_drive_and_friction_give_way_at_their_limits() {
    for stepper in STEPPERS {
        for friction in [false, true] {
            let mut world = no_gravity(world(stepper, DT));
            let id = door(&mut world);
            let dof = match friction {
                true => DofSettings { friction: 1.5, ..DofSettings::default() },
                false => DofSettings { drive: Drive::Velocity { target: 0.0, limit: 1.5 }, ..DofSettings::default() },
            };
            let joint = hinge(&world, id, Vec3::z()).with_dof(dof).unwrap();
            let joint = world.add(joint).unwrap();
            // the moment of inertia about the hinge is 0.5 + 2·1²
            for (torque, rate) in [(1.4, 0.0), (4.0, (4.0 - 1.5) / 2.5)] {
                for _ in 0..240 {
                    world.apply_torque(id, 0, Vec3::z() * torque).unwrap();
                    world.step().unwrap();
                }
                // the joint turns the body about a point off its center: second order in the step
                assert!(
                    (coordinate(&world, joint)[1] - rate).abs() < 1e-5,
                    "{stepper}: {:?}",
                    coordinate(&world, joint)
                );
                assert_eq!(world.joint_force(joint).unwrap().drives[0] != 0.0, !friction);
            }
        }
    }
}

/// A cantilever carries `m g` and the moment `m g r`; a piston and a slider carry what is across them.
#[test]
fn reactions_of_a_cantilever() {
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let id = door(&mut world);
        let joint = LoopJoint::fixed_at("joint", &world, Some((id, 0)), None, Vec3::zeros()).unwrap();
        let joint = world.add(joint).unwrap();
        assert_eq!(world.joint_force(joint).unwrap(), JointForce::default());
        run(&mut world, 0.5);
        let JointForce { force, torque, drives: [drive, ..] } = world.joint_force(joint).unwrap();
        // the torque about the point on the wall, on the ball: it turns −y·(r·m·g) of the weight back
        assert!((force - Vec3::z() * 2.0 * G).norm() < 1e-6 && drive == 0.0, "{stepper}: {force:?}");
        assert!((torque + Vec3::y() * 2.0 * G).norm() < 1e-6, "{stepper}: {torque:?}");
        assert_eq!(world.joint_force(id), None);
    }
}

/// A load that grows by 10 N/s: the joint breaks in the step in which `m g + F` exceeds its strength.
#[test]
fn a_joint_breaks_when_its_load_exceeds_its_strength() {
    for stepper in STEPPERS {
        for torque in [false, true] {
            let mut world = world(stepper, DT);
            let id = door(&mut world);
            let strength = 2.0 * G + 5.0;
            let joint = LoopJoint::fixed_at("joint", &world, Some((id, 0)), None, Vec3::zeros()).unwrap();
            let joint = match torque {
                true => joint.with_breaking_torque(strength).unwrap(),
                false => joint.with_breaking_force(strength).unwrap(),
            };
            let joint = world.add(joint).unwrap();
            let mut broke = Vec::new();
            for k in 0..240 {
                let load = 10.0 * k as f64 * DT;
                world.apply_force(id, 0, -Vec3::z() * load, &position(&world, id)).unwrap();
                world.step().unwrap();
                let found = world.events().iter().filter(|e| e.kind == EventKind::JointBroken && e.a == joint);
                broke.extend(found.map(|event| (k, load, event.b)));
                assert_eq!(world.status(joint).unwrap().enabled, broke.is_empty());
            }
            let [(step, load, None)] = broke[..] else { panic!("{stepper}: {broke:?}") };
            assert!((load - 5.0).abs() <= 10.0 * DT + 1e-9, "{stepper}: broke in step {step} under {load} N");
            assert!(position(&world, id).z < -0.5, "it falls");
            assert_eq!(world.joint_force(joint).unwrap(), JointForce::default());
            // mended, it is drawn back into its place
            world.set_enabled(joint, true).unwrap();
            world.change_joint(joint, |joint| joint.set_breaking(f64::INFINITY, f64::INFINITY).map_err(of)).unwrap();
            run(&mut world, 5.0);
            assert!(error(&world, joint).distance < 1e-6, "{stepper}: {:?}", error(&world, joint));
        }
    }
}

/// A ball of 2 kg at 5 m/s that is stopped within one or two steps of 1/240 s pushes with 1200 to 2400 N.
#[test]
fn an_impact_breaks_a_joint() {
    for stepper in STEPPERS {
        for (strength, breaks) in [(1190.0, true), (2410.0, false)] {
            let mut world = no_gravity(world(stepper, DT));
            let bar = ball(&mut world, at(0.0, 0.0, 0.0));
            let joint = LoopJoint::fixed_at("joint", &world, Some((bar, 0)), None, Vec3::zeros()).unwrap();
            let joint = world.add(joint.with_breaking_force(strength).unwrap()).unwrap();
            world.set_collidable(bar, true).unwrap();
            let flying = ball(&mut world, at(1.0, 0.0, 0.0));
            world.set_collidable(flying, true).unwrap();
            world.set_velocity(flying, -Vec3::x() * 5.0, Vec3::zeros()).unwrap();
            run(&mut world, 0.5);
            assert_eq!(world.status(joint).unwrap().enabled, !breaks, "{stepper}, {strength} N");
        }
    }
}

#[test]
fn copies_break_and_swing_alike() {
    for stepper in STEPPERS {
        let mut world = world(stepper, DT);
        let ids: Vec<ObjectId> = (0..4).map(|k| point(&mut world, Vec3::x() * k as f64 * 0.5)).collect();
        for (k, kind) in [LoopJointKind::Distance, LoopJointKind::Spring, LoopJointKind::Rope].into_iter().enumerate() {
            let points = [k, k + 1].map(|k| position(&world, ids[k]));
            let sides = [k, k + 1].map(|k| Some((ids[k], 0)));
            let joint =
                LoopJoint::joining("", kind, &world, sides[0], sides[1], JointPlace::between(points[0], points[1]))
                    .unwrap();
            let spring = Some(Spring { stiffness: 300.0, rest: 0.4 });
            let dof = DofSettings { spring, damping: 0.3, ..DofSettings::default() };
            let joint = if kind == LoopJointKind::Spring { joint.with_dof(dof).unwrap() } else { joint };
            world.add(joint.with_breaking_force(60.0).unwrap()).unwrap();
        }
        let pin = LoopJoint::spherical_at("pin", &world, Some((ids[0], 0)), None, Vec3::zeros()).unwrap();
        world.add(pin).unwrap();
        run(&mut world, 0.2);
        let mut copies = vec![world.fork(), World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap()];
        let saved = world.save();
        let mut restored = world.fork();
        run(&mut restored, 0.3);
        restored.restore(&saved).unwrap();
        copies.push(restored);
        let mut broken = 0;
        for step in 0..240 {
            world.step().unwrap();
            broken += world.events().iter().filter(|e| e.kind == EventKind::JointBroken).count();
            for copy in &mut copies {
                copy.step().unwrap();
                assert_eq!(copy.events(), world.events(), "{stepper}, step {step}");
                assert!(copy.save() == world.save(), "{stepper}, step {step}");
            }
        }
        assert!(broken > 0, "{stepper}: nothing broke");
    }
}

#[test]
fn a_change_of_a_joint_wakes_what_it_joins() {
    let mut world = world("time_stepping", DT);
    world.set_settings(world.settings().with_sleep(Some(Sleep { after: 0.2, within: 1e-4 }))).unwrap();
    let id = point(&mut world, Vec3::zeros());
    let rope = join(&world, LoopJointKind::Rope, id, None, JointPlace::between(Vec3::zeros(), Vec3::z()));
    let rope = world.add(rope).unwrap();
    run(&mut world, 2.0);
    assert!(world.asleep(id));
    world.change_joint(rope, |joint| joint.set_length(1.5).map_err(of)).unwrap();
    run(&mut world, 2.0);
    assert!((position(&world, id).z + 0.5).abs() < 1e-6 && world.asleep(id));
    world.set_enabled(rope, false).unwrap();
    run(&mut world, 1.0);
    assert!(position(&world, id).z < -4.0);
}

#[test]
fn wrong_settings_are_named() {
    let mut world = world("time_stepping", DT);
    let id = ball(&mut world, at(0.0, 0.0, 0.0));
    let other = ball(&mut world, at(3.0, 0.0, 0.0));
    let joint = |kind: LoopJointKind| {
        let place = JointPlace::between(Vec3::zeros(), Vec3::x());
        join(&world, kind, id, None, if kind.has_length() { place } else { JointPlace::at(Vec3::zeros()) })
    };
    let of = |result: Result<LoopJoint, LoopJointError>| result.unwrap_err().to_string();
    let spring = |rest| DofSettings { spring: Some(Spring { stiffness: 10.0, rest }), ..DofSettings::default() };
    // a rope of 5 m on each side
    let ends = JointPlace::between(Vec3::zeros(), Vec3::x() * 3.0);
    let ends = JointPlace { ground: [Vec3::z() * 5.0, Vec3::new(3.0, 0.0, 5.0)], ..ends };
    let pulley = join(&world, LoopJointKind::Pulley, id, Some(other), ends).with_limits([9.0, 12.0]).unwrap();
    for (message, words) in [
        (of(joint(LoopJointKind::Fixed).with_limits([0.0, 1.0])), "a fixed joint has no limits"),
        (of(joint(LoopJointKind::Revolute).with_length(1.0)), "a revolute joint has no length"),
        (of(joint(LoopJointKind::Rope).with_length(-1.0)), "the length is -1; it must be finite and at least 0"),
        (of(joint(LoopJointKind::Revolute).with_limits([1.0, 0.0])), "the lower limit is 1"),
        // the joint is 1 m long
        (
            of(joint(LoopJointKind::Distance).with_limits([2.0, 3.0])),
            "the lower limit of its length is 2; it must be at",
        ),
        (
            of(joint(LoopJointKind::Distance).with_limits([0.0, 0.5])),
            "the upper limit of its length is 0.5; it must be at",
        ),
        (of(joint(LoopJointKind::Rope).with_limits([1.5, 3.0])), "at most the length of the joint"),
        (of(joint(LoopJointKind::Spring).with_limits([-2.0, -1.0])), "the upper limit of its length is -1"),
        (
            of(joint(LoopJointKind::Distance).with_limits([0.0, 1.0]).unwrap().with_length(1.5)),
            "the upper limit of its",
        ),
        (of(joint(LoopJointKind::Revolute).with_limits([-4.0, 4.0])), "the range of its limits is 8"),
        (
            of(joint(LoopJointKind::Spring).with_dof(spring(-1.0))),
            "the length of its spring is -1; it must be at least 0",
        ),
        (of(joint(LoopJointKind::Spherical).with_cone(f64::INFINITY)), "the cone is inf; it must be 0 to π rad"),
        (of(joint(LoopJointKind::Spherical).with_cone(3.15)), "the cone is 3.15; it must be 0 to π rad"),
        (of(joint(LoopJointKind::Spherical).with_twist_limits([1e300; 2])), "a limit of the twist is 1"),
        (of(pulley.with_transmission(|t| t.ratio = 0.1)), "the lower limit of its length is 9"),
        (of(joint(LoopJointKind::Fixed).with_breaking_force(0.0)), "the breaking force is 0; it must be above 0"),
        (of(joint(LoopJointKind::Fixed).with_breaking_torque(f64::NAN)), "the breaking torque is NaN"),
    ] {
        assert!(message.contains(words) && message.contains("'joint'"), "{message}");
    }
    let place = JointPlace::on_line(Vec3::zeros(), Vec3::z()).with_second_axis(Vec3::z() * 2.0);
    let parallel = LoopJoint::joining("joint", LoopJointKind::Universal, &world, Some((id, 0)), None, place);
    assert_eq!(parallel.unwrap_err(), LoopJointError::Parallel("joint".into()));
    for (place, parameter) in [
        (JointPlace::between(Vec3::zeros(), Vec3::x()), "second_point"),
        (JointPlace { ground: [Vec3::z(); 2], ..JointPlace::at(Vec3::zeros()) }, "ground"),
    ] {
        let wrong = LoopJoint::joining("joint", LoopJointKind::Revolute, &world, Some((id, 0)), None, place);
        let kind = LoopJointKind::Revolute;
        assert_eq!(wrong.unwrap_err(), LoopJointError::Parameter { name: "joint".into(), kind, parameter });
    }
    // each constant is of one kind, and a joint of another kind says so
    let (mut taken, mut refused) = (0, 0);
    for (_, kind) in LoopJointKind::NAMES {
        let made = match kind.joins_two_parts() {
            true if kind.has("ground") => join(&world, *kind, id, Some(other), ends),
            true => join(&world, *kind, id, Some(other), JointPlace::at(Vec3::zeros())),
            false => joint(*kind),
        };
        for (parameter, change) in [
            ("teeth", (|t| t.teeth = [3, 4]) as fn(&mut Transmission)),
            ("radius", |t| t.radius = 0.3),
            ("pitch", |t| t.pitch = 0.3),
            ("ratio", |t| t.ratio = 2.0),
        ] {
            let changed = made.clone().with_transmission(change);
            match kind.has(parameter) {
                true => taken += usize::from(changed.is_ok()),
                false => {
                    let words = of(changed);
                    assert!(words.contains(&format!("a {} joint has no {parameter}; kinds with it: ", kind.name())));
                    refused += 1;
                }
            }
        }
    }
    assert_eq!((taken, refused), (4, 4 * 14 - 4));
    let fixed = joint(LoopJointKind::Fixed);
    let changed = world.change_joint(id, |_| Ok::<(), WorldError>(()));
    assert_eq!(changed.unwrap_err().to_string(), format!("'{}' is not a loop joint", world.name(id).unwrap()));
    let fixed = world.add(fixed).unwrap();
    let failed: Result<(), LoopJointError> = world.get_mut::<LoopJoint>(fixed).unwrap().set_breaking(-1.0, 1.0);
    assert!(failed.is_err() && world.get::<LoopJoint>(fixed).unwrap().breaking() == [f64::INFINITY; 2]);
}

//! Revolute loop joints with stops near a whole turn apart: no angle jumps by 2π.

use crate::common::*;
use std::f64::consts::{PI, TAU};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

const MOMENT: f64 = 0.5;

/// A wheel of 0.5 kg·m² on an axle along z, with stops.
fn wheel(stepper: &str, rate: f64, limits: [f64; 2]) -> (World, ObjectId, ObjectId) {
    let mut world = no_gravity(world(stepper, 1.0 / rate));
    let body = RigidBody::new(sphere(0.1)).with_mass_and_inertia(2.0, Mat3::identity() * MOMENT);
    let id = world.add(body.with_pose(Pose::identity())).unwrap();
    world.set_collidable(id, false).unwrap();
    let hinge = LoopJoint::revolute_at("hinge", &world, Some((id, 0)), None, Vec3::zeros(), Vec3::z()).unwrap();
    let hinge = world.add(hinge.with_limits(limits).unwrap()).unwrap();
    (world, id, hinge)
}

fn angle(world: &World, hinge: ObjectId) -> f64 {
    world.get::<LoopJoint>(hinge).unwrap().position(&world.view()).unwrap()[0]
}

/// The angle of the body itself in (−π, π].
fn raw(world: &World, id: ObjectId) -> f64 {
    let x = world.pose(id, 0).unwrap().rotation * Vec3::x();
    x.y.atan2(x.x)
}

/// A wheel that hits a stop at `spin`, is pressed onto it by a torque and sent to the other one keeps to `[lower, upper]`.
/// Its angle, counted from its orientation by steps below π, is that of the joint.
#[test]
fn stops_a_turn_apart_hold() {
    for stepper in STEPPERS {
        for rate in [60.0, 120.0, 240.0] {
            for limits in [[-PI, PI], [-3.1, 3.1], [0.0, TAU], [-PI, 1.7]] {
                for spin in [4.0, 25.0, 80.0] {
                    let (mut world, id, hinge) = wheel(stepper, rate, limits);
                    let middle = 0.5 * (limits[0] + limits[1]);
                    let mut counted = angle(&world, hinge);
                    assert!((counted - middle).abs() <= PI, "{counted}");
                    for (sign, stop) in [(1.0, limits[1]), (-1.0, limits[0]), (1.0, limits[1])] {
                        world.set_velocity(id, Vec3::zeros(), Vec3::z() * sign * spin).unwrap();
                        for _ in 0..(3.0 * rate) as usize {
                            world.apply_torque(id, 0, Vec3::z() * sign * 5.0).unwrap();
                            world.step().unwrap();
                            counted += (raw(&world, id) - counted + PI).rem_euclid(TAU) - PI;
                            let at = angle(&world, hinge);
                            let label = format!("{stepper}, {rate} Hz, {limits:?}, {spin} rad/s: {at}");
                            assert!((at - counted).abs() < 1e-9, "{label}, counted {counted}");
                            assert!(limits[0] - 1e-6 < at && at < limits[1] + 1e-6, "{label}");
                        }
                        let at = angle(&world, hinge);
                        assert!((at - stop).abs() < 1e-6, "{stepper}, {rate} Hz, {limits:?}: {at} for {stop}");
                        let torque = world.joint_force(hinge).unwrap().torque.z;
                        assert!((torque + sign * 5.0).abs() < 1e-6, "{stepper}: {torque}");
                    }
                }
            }
        }
    }
}

/// At its stop a joint is saved, forked and archived with its turn.
#[test]
fn a_turn_is_part_of_the_state() {
    for stepper in STEPPERS {
        let (mut world, id, hinge) = wheel(stepper, 120.0, [-PI, PI]);
        world.set_velocity(id, Vec3::zeros(), Vec3::z() * 25.0).unwrap();
        let press = |world: &mut World, id: ObjectId| {
            for _ in 0..60 {
                world.apply_torque(id, 0, Vec3::z() * 5.0).unwrap();
                world.step().unwrap();
            }
        };
        press(&mut world, id);
        let (mut fork, archive) = (world.fork(), world.archive(&[]).unwrap());
        let mut read = World::from_archive(&archive, &mut |_| None).unwrap();
        press(&mut world, id);
        press(&mut fork, id);
        let other = read.ids()[0];
        press(&mut read, other);
        assert_eq!(world.state(), fork.state());
        assert_eq!(world.state(), read.state());
        assert!((angle(&world, hinge) - PI).abs() < 1e-6);
    }
}

/// Limits that become wide or narrow while a world runs give the angle a place in the state or take it away; objects behind it
/// keep their states.
#[test]
fn limits_change_while_a_world_runs() {
    for stepper in STEPPERS {
        let (mut world, id, hinge) = wheel(stepper, 120.0, [-1.0, 1.0]);
        let behind = RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(Pose::translation(3.0, 0.0, 0.0));
        let behind = world.add(behind).unwrap();
        world.set_velocity(behind, Vec3::x(), Vec3::zeros()).unwrap();
        let length = world.state().len();
        let limit = |world: &mut World, limits: [f64; 2]| {
            let change = |joint: &mut LoopJoint| -> Result<(), WorldError> {
                let dof = DofSettings { limits: Some(limits), ..joint.dof().clone() };
                joint.set_dof(dof).unwrap();
                Ok(())
            };
            world.change_joint(hinge, change).unwrap();
        };
        for (limits, more) in [([-PI, PI], 1), ([-1.0, 1.0], 0), ([-3.1, PI], 1)] {
            limit(&mut world, limits);
            assert_eq!(world.state().len(), length + more);
            world.set_velocity(id, Vec3::zeros(), Vec3::z() * 30.0).unwrap();
            let before = position(&world, behind);
            for _ in 0..120 {
                world.apply_torque(id, 0, Vec3::z() * 5.0).unwrap();
                world.step().unwrap();
            }
            assert!((position(&world, behind) - before - Vec3::x()).norm() < 1e-9);
            let at = angle(&world, hinge);
            assert!((at - limits[1]).abs() < 1e-6, "{stepper}: {at} for {limits:?}");
        }
    }
}

//! Limits on one side of revolute joints: any number of turns on the other.

use crate::common::*;
use std::f64::consts::{PI, TAU};
use tumble_core::articulated::{Joint, LinkMass, ModelBuilder};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

fn position_of(world: &World, joint: ObjectId) -> [f64; 2] {
    world.get::<LoopJoint>(joint).unwrap().position(&world.view()).unwrap()
}

fn loop_joint(world: &mut World, limits: [f64; 2], rate: f64) -> (ObjectId, ObjectId) {
    let body = RigidBody::new(cube(0.2)).with_mass(1.0).with_angular_velocity(Vec3::z() * rate);
    let body = world.add(body).unwrap();
    let joint = LoopJoint::revolute_at("axle", world, Some((body, 0)), None, Vec3::zeros(), Vec3::z()).unwrap();
    (body, world.add(joint.with_limits(limits).unwrap()).unwrap())
}

/// A wheel turns back for more than three turns and returns by the same way to the limit that it left, and stops there.
#[test]
fn a_loop_joint_counts_the_turns_on_its_open_side() {
    for stepper in STEPPERS {
        for (sign, limits) in [(1.0, [f64::NEG_INFINITY, 1.0]), (-1.0, [-1.0, f64::INFINITY])] {
            let mut world = no_gravity(world(stepper, 1.0 / 60.0));
            let (body, joint) = loop_joint(&mut world, limits, -sign * 10.0);
            let angle = |world: &World| sign * position_of(world, joint)[0];
            for _ in 0..120 {
                world.step().unwrap();
            }
            assert!((angle(&world) + 20.0).abs() < 1e-6, "{stepper}: {}", angle(&world));
            let saved = world.save();
            world.set_velocity(body, Vec3::zeros(), Vec3::z() * (sign * 10.0)).unwrap();
            let mut farthest = f64::NEG_INFINITY;
            for _ in 0..180 {
                world.step().unwrap();
                farthest = farthest.max(angle(&world));
            }
            assert!((1.0 - 1e-3..1.0 + 1e-6).contains(&farthest), "{stepper}: {farthest}");
            // the count is a number of the state
            world.restore(&saved).unwrap();
            assert!((angle(&world) + 20.0).abs() < 1e-6);
            let read = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
            let copy = position_of(&read, read.ids()[1])[0];
            assert!((sign * copy + 20.0).abs() < 1e-6, "{stepper}: {copy}");
        }
    }
}

/// A joint with a limit far from 0 starts in the turn that the limit allows and is nearest to 0.
#[test]
fn a_limit_far_from_zero_starts_in_its_turn() {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let (_, joint) = loop_joint(&mut world, [5.0, f64::INFINITY], 0.0);
    world.step().unwrap();
    let [angle, _] = position_of(&world, joint);
    assert!((angle - TAU).abs() < 1e-9, "{angle}");
    let body = RigidBody::new(cube(0.2));
    let body = world.add(body.with_pose(Pose::translation(5.0, 0.0, 0.0))).unwrap();
    let point = Vec3::new(5.0, 0.0, 0.0);
    let joint = LoopJoint::revolute_at("", &world, Some((body, 0)), None, point, Vec3::z()).unwrap();
    let why = joint.clone().with_limits([-2.0 * PI, 2.0 * PI]).unwrap_err().to_string();
    assert!(why.contains("infinite on one side"), "{why}");
    assert!(joint.with_limits([f64::NEG_INFINITY, f64::INFINITY]).is_ok());
    let place = JointPlace::on_line(point, Vec3::z());
    let joint = LoopJoint::joining("", LoopJointKind::Cylindrical, &world, Some((body, 0)), None, place).unwrap();
    let dof = DofSettings { limits: Some([f64::NEG_INFINITY, 1.0]), ..DofSettings::default() };
    let why = joint.with_dof_at(1, dof).unwrap_err().to_string();
    assert!(why.contains("only a revolute joint"), "{why}");
}

/// A program says which of the angles that its frames have a joint starts at.
#[test]
fn a_joint_starts_in_the_turn_that_is_set() {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let (_, joint) = loop_joint(&mut world, [f64::NEG_INFINITY, 1.0], 0.0);
    world.set_turn(joint, -30.0).unwrap();
    world.step().unwrap();
    let [angle, _] = position_of(&world, joint);
    assert!((angle + 5.0 * TAU).abs() < 1e-9, "{angle}");
    assert!(matches!(world.set_turn(joint, f64::NAN), Err(WorldError::BadState(_))));
    let mut other = World::default();
    let (_, free) = loop_joint(&mut other, [-1.0, 1.0], 0.0);
    assert!(matches!(other.set_turn(free, 7.0), Err(WorldError::BadState(_))), "it counts no turns");
}

/// The joint of a link has no turns to count: it stops at the one limit from any distance.
#[test]
fn a_joint_of_a_link_has_a_limit_on_one_side() {
    for stepper in STEPPERS {
        let mut world = no_gravity(world(stepper, 1.0 / 60.0));
        let mut builder = ModelBuilder::new();
        let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() };
        builder.link("wheel", None, Joint::revolute(Vec3::z()), Pose::identity(), mass);
        let body = ArticulatedBody::new("wheel", builder.build().unwrap());
        let mut body = body.with_positions(&[-20.0]).unwrap().with_velocities(&[15.0]).unwrap();
        body.set_dof(0, DofSettings { limits: Some([f64::NEG_INFINITY, 1.0]), ..DofSettings::default() }).unwrap();
        let id = world.add(body).unwrap();
        let mut farthest = f64::NEG_INFINITY;
        for _ in 0..120 {
            world.step().unwrap();
            farthest = farthest.max(world.state_of(id).unwrap()[0]);
        }
        assert!((1.0 - 1e-3..1.0 + 1e-6).contains(&farthest), "{stepper}: {farthest}");
    }
}

//! Drives in snapshots: those that the program has changed come back, and so do those that it changed later.

use crate::common::*;
use std::sync::Arc;
use tumble_core::articulated::{Joint, LinkMass, ModelBuilder};
use tumble_core::collide::{Mat3, Pose, Vec3};
use tumble_core::*;

fn hold(target: f64) -> Drive {
    Drive::Position { stiffness: 50.0, damping: 5.0, target, velocity: 0.0, limit: f64::INFINITY }
}

fn aimed(drive: Drive) -> DofSettings {
    DofSettings { drive, ..DofSettings::default() }
}

fn worlds() -> (World, ObjectId, ObjectId) {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let mut builder = ModelBuilder::new();
    let mass = LinkMass { mass: 1.0, center: Vec3::zeros(), inertia: Mat3::identity() };
    builder.link("wheel", None, Joint::revolute(Vec3::z()), Pose::identity(), mass);
    builder.link("ball", None, Joint::Spherical, Pose::identity(), mass);
    let mut robot = ArticulatedBody::new("robot", builder.build().unwrap());
    let motion = Playback::new(vec![0.0, 10.0], vec![0.0, 1.0]).unwrap();
    robot.set_dof(0, aimed(Drive::Playback { motion: Arc::new(motion), limit: f64::INFINITY })).unwrap();
    let robot = world.add(robot).unwrap();
    let body = world.add(RigidBody::new(cube(0.2)).with_pose(Pose::translation(3.0, 0.0, 0.0))).unwrap();
    let point = Vec3::new(3.0, 0.0, 0.0);
    let joint = LoopJoint::revolute_at("axle", &world, Some((body, 0)), None, point, Vec3::z()).unwrap();
    let joint = world.add(joint.with_dof(aimed(hold(0.1))).unwrap()).unwrap();
    (world, robot, joint)
}

fn drives(world: &World, robot: ObjectId, joint: ObjectId) -> Vec<Drive> {
    let body = world.get::<ArticulatedBody>(robot).unwrap();
    body.dofs().iter().chain([world.get::<LoopJoint>(joint).unwrap().dof()]).map(|dof| dof.drive.clone()).collect()
}

fn set(world: &mut World, joint: ObjectId, drive: Drive) {
    let change = |joint: &mut LoopJoint| joint.set_dof(aimed(drive)).map_err(Box::<dyn std::error::Error>::from);
    world.change_joint(joint, change).unwrap();
}

fn run(world: &mut World) -> Vec<f64> {
    (0..60).for_each(|_| assert!(world.step().is_ok()));
    world.state().to_vec()
}

#[test]
fn a_snapshot_restores_the_drives() {
    let (mut world, robot, joint) = worlds();
    let untouched = (world.save(), drives(&world, robot, joint));
    world.get_mut::<ArticulatedBody>(robot).unwrap().set_dof(0, aimed(hold(0.7))).unwrap();
    world.get_mut::<ArticulatedBody>(robot).unwrap().set_dof(2, aimed(hold(-0.4))).unwrap();
    set(&mut world, joint, Drive::Velocity { target: 2.0, limit: 1.0 });
    run(&mut world);
    let changed = (world.save(), drives(&world, robot, joint));
    let went_on = run(&mut world);
    world.get_mut::<ArticulatedBody>(robot).unwrap().set_dof(2, aimed(Drive::None)).unwrap();
    set(&mut world, joint, hold(5.0));
    world.restore(&changed.0).unwrap();
    assert_eq!(drives(&world, robot, joint), changed.1);
    assert_eq!(run(&mut world), went_on);
    // another world of the same objects gets them too, and so does one of an archive
    let (mut other, robot_there, joint_there) = worlds();
    other.restore(&changed.0).unwrap();
    assert_eq!(drives(&other, robot_there, joint_there), changed.1);
    assert_eq!(run(&mut other), went_on);
    let mut read = World::from_archive(&world.archive(&[]).unwrap(), &mut |_| None).unwrap();
    read.restore(&changed.0).unwrap();
    assert_eq!(run(&mut read), went_on);
    // the snapshot of the untouched world brings back the drives with which the objects were added, the motion too
    for world in [&mut world, &mut other, &mut read] {
        world.restore(&untouched.0).unwrap();
        let (robot, joint) = (world.ids()[0], world.ids()[2]);
        assert_eq!(drives(world, robot, joint), untouched.1);
        assert!(world.save() == untouched.0);
    }
    // bytes of nothing known are refused, and nothing changes
    let mut longer = untouched.0.clone();
    longer.extend([1, 2, 3]);
    assert!(world.restore(&longer).unwrap_err().to_string().contains("3 bytes follow its end"));
    let mut more = changed.0.clone();
    more.push(0);
    assert!(world.restore(&more).is_err());
    let mut cut = changed.0.clone();
    cut.truncate(cut.len() - 4);
    assert!(world.restore(&cut).is_err());
    assert_eq!(drives(&world, robot, joint), untouched.1);
}

#[test]
fn an_access_without_a_change_adds_nothing() {
    let (mut world, robot, _) = worlds();
    let before = world.save();
    world.get_mut::<ArticulatedBody>(robot).unwrap();
    assert!(world.save() == before);
    let mut fork = world.fork();
    fork.get_mut::<ArticulatedBody>(robot).unwrap().set_dof(0, aimed(hold(0.2))).unwrap();
    assert!(fork.save().len() > before.len());
    assert!(fork.fork().save() == fork.save());
}

//! Bodies that joints hold together do not collide, unless a pair material says so.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

fn pair(stepper: &str, kind: LoopJointKind) -> (World, [ObjectId; 2], ObjectId) {
    let mut world = world(stepper, 1.0 / 240.0);
    ground(&mut world, 0.0, 0.5);
    let [one, other] = [("one", 0.0), ("other", 0.5)].map(|(name, x)| {
        let body = RigidBody::new(cube(0.5)).with_name(name).with_mass(1.0);
        world.add(body.with_pose(Pose::new(Vec3::new(x, 0.0, 1.5), Vec3::zeros()))).unwrap()
    });
    let place = JointPlace::on_line(Vec3::new(0.25, 0.0, 1.5), Vec3::y());
    let joint = LoopJoint::joining("joint", kind, &world, Some((one, 0)), Some((other, 0)), place).unwrap();
    let joint = world.add(joint).unwrap();
    (world, [one, other], joint)
}

/// Two boxes face to face that are welded, or hinged, fall on the ground as one thing: without this rule their own contact contradicts the
/// joint, and throws them apart.
#[test]
fn joined_boxes_fall_on_the_ground_and_come_to_rest() {
    for (stepper, kind) in
        STEPPERS.into_iter().flat_map(|s| [LoopJointKind::Fixed, LoopJointKind::Revolute].map(|kind| (s, kind)))
    {
        let (mut world, ids, joint) = pair(stepper, kind);
        for id in ids {
            let center = Vec3::new(0.25, 0.0, 1.5);
            let (spin, p) = (Vec3::new(1.0, 2.0, 3.0), world.part_state(id, 0).unwrap().position());
            world.set_velocity(id, spin.cross(&(p - center)), spin).unwrap();
        }
        let start = world.energy().total();
        for _ in 0..960 {
            world.step().unwrap();
            assert!(world.energy().total() < start + 1e-3, "{stepper} {kind:?}: {} J", world.energy().total());
        }
        let error = world.get::<LoopJoint>(joint).unwrap().position_error(&world.view()).unwrap();
        assert!(error.distance < 1e-6, "{stepper} {kind:?}: open by {} m", error.distance);
        assert!(world.energy().kinetic < 1e-6, "{stepper} {kind:?}: {} J", world.energy().kinetic);
    }
}

/// A free pair turns with the angular momentum that it has.
#[test]
fn joined_boxes_turn_freely_as_one() {
    for stepper in STEPPERS {
        let (mut world, ids, _) = pair(stepper, LoopJointKind::Fixed);
        world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
        for id in ids {
            let (spin, p) = (Vec3::new(1.0, 2.0, 5.0), world.part_state(id, 0).unwrap().position());
            world.set_velocity(id, spin.cross(&(p - Vec3::new(0.25, 0.0, 1.5))), spin).unwrap();
        }
        let start = world.momentum().angular;
        (0..480).for_each(|_| _ = world.step().unwrap());
        let change = (world.momentum().angular - start).norm() / start.norm();
        assert!(change < 1e-5, "{stepper}: {change:e}");
    }
}

#[test]
fn parts_collide_again_when_their_joint_breaks_is_disabled_or_removed_or_a_pair_says_so() {
    let touches = |world: &mut World| {
        world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
        let one = world.find("one").unwrap();
        world.set_velocity(one, Vec3::new(0.1, 0.0, 0.0), Vec3::zeros()).unwrap();
        world.step().unwrap();
        !world.contacts().is_empty()
    };
    for stepper in STEPPERS {
        let (mut world, _, _) = pair(stepper, LoopJointKind::Revolute);
        assert!(!touches(&mut world), "{stepper}: joined");
        let (mut world, ids, _) = pair(stepper, LoopJointKind::Revolute);
        let collides = PairMaterial { collides: Some(true), ..PairMaterial::default() };
        world.set_pair_material(ids[0], ids[1], collides).unwrap();
        assert!(touches(&mut world), "{stepper}: chosen");
        let (mut world, _, joint) = pair(stepper, LoopJointKind::Revolute);
        world.set_enabled(joint, false).unwrap();
        assert!(touches(&mut world), "{stepper}: disabled");
        let saved = world.save();
        world.set_enabled(joint, true).unwrap();
        assert!(!touches(&mut world), "{stepper}: enabled again");
        world.restore(&saved).unwrap();
        assert!(touches(&mut world), "{stepper}: restored");
        let (mut world, _, joint) = pair(stepper, LoopJointKind::Revolute);
        world.remove(joint).unwrap();
        assert!(touches(&mut world), "{stepper}: removed");
        let (mut world, _, _) = pair(stepper, LoopJointKind::Spring);
        assert!(touches(&mut world), "{stepper}: a spring holds nothing together");
        let (mut world, ids, joint) = pair(stepper, LoopJointKind::Revolute);
        world
            .change_joint::<WorldError>(joint, |joint| {
                joint.set_breaking(1e-3, f64::INFINITY).unwrap();
                Ok(())
            })
            .unwrap();
        world.set_settings(world.settings().with_gravity(Vec3::zeros())).unwrap();
        world.set_velocity(ids[0], Vec3::new(-1.0, 0.0, 0.0), Vec3::zeros()).unwrap();
        world.step().unwrap();
        assert!(touches(&mut world), "{stepper}: broken");
    }
}

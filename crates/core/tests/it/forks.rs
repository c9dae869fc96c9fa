//! A fork moves as its world does, bit for bit, in the middle of contacts and limits.

use crate::common::world;
use crate::random_scenes::Random;
use nalgebra::UnitQuaternion;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// Two boxes that a joint with limits connects fall on the ground.
fn falling_pair(kind: LoopJointKind, seed: u64, stepper: &str) -> World {
    let mut random = Random(seed);
    let mut world = world(stepper, 1.0 / 120.0);
    let surface = Material { friction: 0.5, restitution: 0.3, ..Material::default() };
    world.add_static(RigidBody::fixed(Shape::half_space()).with_material(surface)).unwrap();
    let mut add = |size: [f64; 3], mass: f64, at: Vec3, speed: f64| {
        let turn = UnitQuaternion::from_scaled_axis(random.vector(2.0));
        let body = RigidBody::new(Shape::cuboid(size.into()).unwrap()).with_mass(mass).with_material(surface);
        let body = body.with_pose(Pose::from_parts(at.into(), turn)).with_velocity(random.vector(speed));
        world.add(body.with_angular_velocity(random.vector(6.0))).unwrap()
    };
    let a = add([0.3, 0.3, 0.3], 1.0, Vec3::new(0.0, 0.0, 0.5), 0.0);
    let b = add([0.2, 0.3, 0.4], 2.0, Vec3::new(0.5, 0.0, 0.7), 3.0);
    let place = JointPlace::on_line(Vec3::new(0.0, 0.0, 0.5), Vec3::z());
    let joint = LoopJoint::joining("joint", kind, &world, Some((a, 0)), Some((b, 0)), place).unwrap();
    world.add(joint.with_limits([-0.3, 0.3]).unwrap()).unwrap();
    world
}

#[test]
fn a_fork_continues_with_the_same_bits() {
    for kind in [LoopJointKind::Prismatic, LoopJointKind::Revolute] {
        for stepper in ["time_stepping", "backtracking"] {
            for seed in 0..6 {
                let mut world = falling_pair(kind, seed, stepper);
                for frame in 0..120 {
                    let mut fork = world.fork();
                    let (of_world, of_fork) = (world.step().is_ok(), fork.step().is_ok());
                    assert_eq!(of_world, of_fork);
                    if !of_world {
                        break;
                    }
                    let same = world.state().iter().zip(fork.state()).all(|(a, b)| a.to_bits() == b.to_bits());
                    assert!(same, "{kind:?}, {stepper}, seed {seed}: frame {frame} differs");
                }
            }
        }
    }
}

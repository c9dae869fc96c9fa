//! Resting bodies stay at rest to a millionth of a meter per second, and bodies that miss are not
//! affected.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, TreeSettings, TriMesh, Vec3};
use tumble_core::*;

/// A cylinder on a box: its rim has nearly redundant contacts.
#[test]
fn a_standing_cylinder_does_not_creep() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        let block = Shape::cuboid(Vec3::new(1.0, 1.0, 0.2)).unwrap();
        world
            .add_static(
                RigidBody::fixed(block)
                    .with_name("block")
                    .with_material(Material { friction: 0.5, ..Material::default() })
                    .with_pose(Pose::translation(0.0, 0.0, -0.1)),
            )
            .unwrap();
        let cylinder = RigidBody::new(Shape::cylinder(0.05, 0.3).unwrap())
            .with_name("cylinder")
            .with_mass(1.0)
            .with_material(Material { friction: 0.5, ..Material::default() });
        let id = world.add(cylinder.with_pose(Pose::translation(0.03, 0.02, 0.15))).unwrap();
        let start = position(&world, id);
        for _ in 0..480 {
            world.step().unwrap();
            let part_state = world.part_state(id, 0).unwrap();
            let speed = part_state.velocity.norm() + 0.16 * part_state.angular_velocity.norm();
            assert!(speed < 1e-6, "{stepper}: {speed} m/s after {} s", world.time());
        }
        let creep = (position(&world, id) - start).norm();
        assert!(creep < 1e-6, "{stepper}: it crept {creep} m in 2 s");
    }
}

/// Returns two mesh spheres of 0.1 m, A and B, that fly at each other at 50 m/s each, 0.8 m per
/// step, offset by `beside`.
fn fly(beside: f64) -> (World, [ObjectId; 2]) {
    let mut world = no_gravity(world("time_stepping", 1.0 / 60.0));
    let shape = Shape::mesh(TriMesh::icosphere(0.1, 2), &TreeSettings::octree()).unwrap();
    let ids = [(-1.0, 0.0), (1.0, beside)].map(|(x, y)| {
        let ball = RigidBody::new(shape.clone())
            .with_name(format!("ball {x}"))
            .with_mass(1.0)
            .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() });
        world.add(ball.with_pose(Pose::translation(x, y, 0.0)).with_velocity(Vec3::new(-50.0 * x, 0.0, 0.0))).unwrap()
    });
    (world, ids)
}

/// No frictionless elastic impact loses momentum or energy, and no ball passes through another:
/// they are followed to the time of contact.
#[test]
fn meshes_that_fly_at_each_other_bounce() {
    let (mut world, [a, b]) = fly(0.03);
    for _ in 0..6 {
        world.step().unwrap();
        assert!(
            position(&world, a).x < position(&world, b).x,
            "A is at {}, B at {}",
            position(&world, a),
            position(&world, b)
        );
    }
    let (va, vb) = (velocity(&world, a), velocity(&world, b));
    assert!(va.x < 0.0 && vb.x > 0.0, "A leaves at {va}, B at {vb}");
    assert!((va + vb).norm() < 1e-9, "momentum {}", va + vb);
    assert!((world.energy().kinetic / 2500.0 - 1.0).abs() < 1e-9, "energy {} J", world.energy().kinetic);
}

/// 0.22 m apart they miss, and neither is affected.
#[test]
fn meshes_that_fly_past_each_other_are_left_alone() {
    let (mut world, [a, b]) = fly(0.22);
    (0..6).for_each(|_| {
        world.step().unwrap();
    });
    assert_eq!((velocity(&world, a), velocity(&world, b)), (Vec3::new(50.0, 0.0, 0.0), Vec3::new(-50.0, 0.0, 0.0)));
    assert!(position(&world, a).x > 3.9 && position(&world, b).x < -3.9);
}

//! Many contacts at once.

use crate::common::*;
use tumble_core::collide::Pose;
use tumble_core::*;

fn stack(stepper: &str, n: usize, dt: f64) -> (World, Vec<ObjectId>) {
    let mut world = world(stepper, dt);
    ground(&mut world, 0.0, 0.5);
    let ids = (0..n)
        .map(|i| {
            let cube = RigidBody::new(cube(0.5))
                .with_name(format!("box{i}"))
                .with_mass(10.0)
                .with_material(Material { friction: 0.5, ..Material::default() });
            world.add(cube.with_pose(Pose::translation(0.0, 0.0, 0.25 + 0.5 * i as f64))).unwrap()
        })
        .collect();
    (world, ids)
}

#[test]
fn ten_boxes_stand_for_a_minute() {
    let (mut world, ids) = stack("time_stepping", 10, 1.0 / 60.0);
    (0..3600).for_each(|_| {
        world.step().unwrap();
    });
    for (i, id) in ids.iter().enumerate() {
        let p = position(&world, *id);
        let off = (p - tumble_core::collide::Vec3::new(0.0, 0.0, 0.25 + 0.5 * i as f64)).norm();
        assert!(off < 1e-3, "box {i} is {off} m from its place");
    }
}

#[test]
fn ten_boxes_stand_in_the_backtracking_stepper_with_few_tries() {
    let (mut world, ids) = stack("backtracking", 10, 1.0 / 60.0);
    let mut tries = 0;
    for _ in 0..300 {
        tries += world.step().unwrap().tries;
    }
    assert!(tries as f64 / 300.0 < 20.0, "{} tries a frame", tries as f64 / 300.0);
    for (i, id) in ids.iter().enumerate() {
        assert!((position(&world, *id).z - 0.25 - 0.5 * i as f64).abs() < 1e-3, "box {i} at {}", position(&world, *id));
    }
}

/// The ground carries the weight: contact forces of a box that rests sum to m·g.
#[test]
fn contact_forces_of_a_resting_box_carry_its_weight() {
    for stepper in STEPPERS {
        let (mut world, _) = stack(stepper, 1, 1.0 / 60.0);
        (0..30).for_each(|_| {
            world.step().unwrap();
        });
        let force: f64 = world.contacts().iter().map(|c| c.force.z.abs()).sum();
        assert!((force / (10.0 * G) - 1.0).abs() < 1e-6, "{stepper}: {force} N");
    }
}

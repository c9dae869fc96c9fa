//! Reactions of a program to contacts, after a step: push and remove.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

/// A ball without restitution is thrown back by its own rule, twice as fast as it came; another one is removed by what it
/// touches.
#[test]
fn contacts_bounce_and_remove() {
    let mut world = world("time_stepping", false);
    let at = |x: f64, v: f64| {
        let body = RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(Pose::translation(x, 0.0, 0.0));
        body.with_velocity(Vec3::new(v, 0.0, 0.0))
    };
    let wall = RigidBody::fixed(collide::Shape::cuboid(Vec3::new(0.2, 2.0, 2.0)).unwrap());
    let wall = world.add(wall).unwrap();
    let (bumper, shell) = (world.add(at(-1.0, 1.0)).unwrap(), world.add(at(1.5, -1.0)).unwrap());
    let mut removed = None;
    for _ in 0..480 {
        world.step().unwrap();
        let begun: Vec<Event> = world.events().iter().filter(|e| e.kind == EventKind::ContactBegin).copied().collect();
        for event in begun {
            assert_eq!(event.a, wall);
            if event.b == Some(bumper) {
                // the contact has stopped it: the impulse on the wall is its momentum
                assert!((event.impulse - Vec3::x()).norm() < 1e-9, "{}", event.impulse);
                world.apply_impulse(bumper, 0, -2.0 * event.impulse, &event.point).unwrap();
            } else if let Some(other) = event.b {
                assert_eq!(other, shell);
                removed = Some(world.time());
                world.remove(other).unwrap();
            }
        }
    }
    assert!((velocity(&world, bumper) + 2.0 * Vec3::x()).norm() < 1e-9);
    assert!(world.part_state(shell, 0).is_none());
    // 1.3 m at 1 m/s
    assert!((removed.unwrap() - 1.3).abs() < 2.0 * DT, "{removed:?}");
}

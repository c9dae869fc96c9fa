//! Forces, impulses and contacts act on the center of mass alone.

use tumble_behaviors::non_spinning;
use tumble_core::prelude::*;
use tumble_core::{LockedAxes, stepper_by_name};

fn brick() -> RigidBody {
    RigidBody::new(Shape::cuboid(Vec3::new(2.0, 1.0, 0.5)).unwrap()).with_mass(3.0)
}

#[test]
fn off_center_forces_and_impulses_do_not_turn_it() {
    let mut world = crate::world();
    let free = world.add(brick()).unwrap();
    let held = world.add(non_spinning(brick()).with_pose(Pose::translation(0.0, 9.0, 0.0))).unwrap();
    for (id, y) in [(free, 0.0), (held, 9.0)] {
        world.apply_impulse(id, 0, Vec3::new(0.0, 0.0, 6.0), &Vec3::new(1.0, y + 0.5, 0.0)).unwrap();
        let velocity = world.part_state(id, 0).unwrap().velocity;
        assert!((velocity - Vec3::new(0.0, 0.0, 2.0)).norm() < 1e-14, "P/m");
        world.apply_force(id, 0, Vec3::new(30.0, 0.0, 0.0), &Vec3::new(0.0, y, 0.25)).unwrap();
    }
    world.step().unwrap();
    let [free, held] = [free, held].map(|id| *world.part_state(id, 0).unwrap());
    // F·dt/m = 30/120/3
    assert!((held.velocity - Vec3::new(10.0 / 120.0, 0.0, 2.0)).norm() < 1e-14);
    assert_eq!((held.angular_velocity, held.pose.rotation), (Vec3::zeros(), Quat::identity()));
    assert!(free.angular_velocity.norm() > 1.0, "a free body turns");
}

#[test]
fn a_corner_strikes_as_a_point_mass_would() {
    for stepper in tumble_core::STEPPERS {
        let mut world = crate::world();
        world.set_stepper(stepper_by_name(stepper).unwrap());
        let bouncy = Material { restitution: 0.5, friction: 0.0, ..Material::default() };
        world.add(RigidBody::fixed(Shape::half_space()).with_material(bouncy)).unwrap();
        let tilted = Pose::from_parts(Vec3::new(0.0, 0.0, 1.5).into(), Quat::from_euler_angles(0.3, 0.4, 0.0));
        let body = brick().with_pose(tilted).with_velocity(Vec3::new(1.0, 0.0, -4.0)).with_material(bouncy);
        let id = world.add(non_spinning(body)).unwrap();
        let before = world.part_state(id, 0).unwrap().pose.rotation;
        crate::steps(&mut world, 60);
        let state = world.part_state(id, 0).unwrap();
        // e·4 m/s upward; no friction, no torque
        assert!((state.velocity - Vec3::new(1.0, 0.0, 2.0)).norm() < 1e-9, "{stepper}: {}", state.velocity);
        assert_eq!(state.pose.rotation, before, "{stepper}");
    }
}

#[test]
fn locked_translations_stay_locked() {
    let rail = LockedAxes { translation: [false, true, true], rotation: [false; 3] };
    let body = non_spinning(brick().with_locked(rail));
    assert_eq!(body.locked, LockedAxes { translation: [false, true, true], rotation: [true; 3] });
}

//! Coulomb friction against closed forms.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

#[test]
fn a_sliding_box_stops_where_and_when_it_should() {
    for stepper in STEPPERS {
        let (distance, time, gap) = slide(stepper, "gauss_seidel", 1.0 / 240.0);
        assert!((distance / 2.548420 - 1.0).abs() < 1e-4, "{stepper}: stops after {distance} m");
        assert!((time / 1.019368 - 1.0).abs() < 1e-4, "{stepper}: stops after {time} s");
        assert!(gap < 1e-6, "{stepper}: gap {gap}");
    }
}

#[test]
fn a_box_sliding_fast_at_60_hz_is_not_lifted() {
    for stepper in STEPPERS {
        let (_, _, gap) = slide(stepper, "gauss_seidel", 1.0 / 60.0);
        assert!(gap < 1e-4, "{stepper}: lifted by {gap} m");
    }
}

/// Releases a cube at rest on a slope.
fn on_slope(stepper: &str, angle: f64, friction: f64, seconds: f64) -> (World, ObjectId) {
    let mut world = world(stepper, 1.0 / 240.0);
    slope(&mut world, angle, friction);
    let turn = Pose::rotation(Vec3::new(0.0, angle, 0.0));
    let id = world
        .add(
            RigidBody::new(cube(0.2))
                .with_name("box")
                .with_mass(1.0)
                .with_material(Material { friction, ..Material::default() })
                .with_pose(turn * Pose::translation(0.0, 0.0, 0.1)),
        )
        .unwrap();
    (0..(seconds * 240.0) as usize).for_each(|_| {
        world.step().unwrap();
    });
    (world, id)
}

#[test]
fn a_box_on_a_slope_sticks_if_and_only_if_friction_holds_it() {
    for stepper in STEPPERS {
        for degrees in [10.0f64, 20.0, 30.0] {
            let angle = degrees.to_radians();
            let (world, id) = on_slope(stepper, angle, angle.tan() * 1.001, 1.0);
            assert!(
                velocity(&world, id).norm() < 1e-6,
                "{stepper} {degrees}: creeps at {}",
                velocity(&world, id).norm()
            );
            let mu = angle.tan() * 0.8;
            let (world, id) = on_slope(stepper, angle, mu, 1.0);
            let expected = G * (angle.sin() - mu * angle.cos());
            let speed = velocity(&world, id).norm();
            assert!(
                (speed / expected - 1.0).abs() < 1e-6,
                "{stepper} {degrees}: {speed} m/s after 1 s, expected {expected}"
            );
        }
    }
}

#[test]
fn a_resting_box_does_not_creep_on_a_20_degree_slope() {
    for stepper in STEPPERS {
        let (mut world, id) = on_slope(stepper, 20f64.to_radians(), 0.5, 1.0);
        let start = position(&world, id);
        (0..960).for_each(|_| {
            world.step().unwrap();
        });
        let creep = (position(&world, id) - start).norm() / 4.0;
        assert!(creep < 1e-6, "{stepper}: creeps at {creep:e} m/s");
    }
}

#[test]
fn a_sliding_sphere_ends_rolling_at_five_sevenths() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 240.0);
        ground(&mut world, 0.0, 0.3);
        let ball = RigidBody::new(sphere(0.1))
            .with_name("ball")
            .with_mass(1.0)
            .with_material(Material { friction: 0.3, ..Material::default() });
        let id = world
            .add(ball.with_pose(Pose::translation(0.0, 0.0, 0.1)).with_velocity(Vec3::new(3.0, 0.0, 0.0)))
            .unwrap();
        (0..480).for_each(|_| {
            world.step().unwrap();
        });
        let part_state = world.part_state(id, 0).unwrap();
        assert!((part_state.velocity.x / (15.0 / 7.0) - 1.0).abs() < 1e-6, "{stepper}: {} m/s", part_state.velocity.x);
        assert!(
            (part_state.angular_velocity.y * 0.1 / part_state.velocity.x - 1.0).abs() < 1e-6,
            "{stepper}: does not roll"
        );
    }
}

/// The thesis's Fig. 17: a sphere that spins in place stays where it is.
#[test]
fn a_spinning_sphere_does_not_sink() {
    for stepper in STEPPERS {
        let mut world = world(stepper, 1.0 / 60.0);
        ground(&mut world, 0.0, 0.0);
        let ball = RigidBody::new(sphere(0.5))
            .with_name("ball")
            .with_mass(1.0)
            .with_material(Material { friction: 0.0, ..Material::default() });
        let id = world
            .add(ball.with_pose(Pose::translation(0.0, 0.0, 0.5)).with_angular_velocity(Vec3::new(20.0, 0.0, 3.0)))
            .unwrap();
        (0..300).for_each(|_| {
            world.step().unwrap();
        });
        assert!((position(&world, id).z - 0.5).abs() < 1e-8, "{stepper}: center at {}", position(&world, id).z);
        assert!((world.part_state(id, 0).unwrap().angular_velocity.x - 20.0).abs() < 1e-9);
    }
}

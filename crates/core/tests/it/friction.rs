//! Coulomb friction against closed forms.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
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

/// A box falls on a belt: it slides for v/(μ·g) seconds and has then moved by half of what the belt has. A
/// belt that turns with its body moves things along its own axis.
#[test]
fn a_belt_takes_a_box_with_it() {
    let (speed, friction) = (1.5, 0.4);
    let time = speed / (friction * G);
    for stepper in ["time_stepping", "backtracking"] {
        for turn in [0.0, 0.7] {
            let mut world = world(stepper, 1.0 / 240.0);
            let rotation = Quat::from_axis_angle(&Vec3::z_axis(), turn);
            let material = Material { friction, surface_velocity: Vec3::new(speed, 0.0, 5.0), ..Material::default() };
            let belt = RigidBody::fixed(Shape::cuboid(Vec3::new(10.0, 10.0, 0.2)).unwrap()).with_material(material);
            world.add(belt.with_pose(Pose::from_parts(Vec3::new(0.0, 0.0, -0.1).into(), rotation))).unwrap();
            let body = RigidBody::new(cube(0.2)).with_material(Material { friction, ..Material::default() });
            let id = world.add(body.with_pose(Pose::translation(0.0, 0.0, 0.1))).unwrap();
            let along = rotation * Vec3::x();
            let mut reached = None;
            for k in 1..=240 {
                world.step().unwrap();
                let v = velocity(&world, id);
                assert!((v - along * along.dot(&v)).norm() < 1e-6, "{stepper}: {v}");
                assert!(along.dot(&v) < speed + 1e-6, "{stepper}: {v}");
                let gained = friction * G * k as f64 / 240.0;
                if gained < speed {
                    assert!((along.dot(&v) - gained).abs() < 1e-4 * speed, "{stepper}: {v}, expected {gained}");
                }
                if reached.is_none() && along.dot(&v) > speed * (1.0 - 1e-9) {
                    reached = Some(k as f64 / 240.0);
                }
            }
            assert!((reached.unwrap() - time).abs() <= 1.0 / 240.0, "{stepper}: {reached:?}, expected {time}");
            let (way, expected) = (along.dot(&position(&world, id)), speed * (1.0 - 0.5 * time));
            println!("{stepper}, turned by {turn}: {way}, expected {expected}");
            assert!((way - expected).abs() < 1e-4 * expected, "{stepper}: {way}, expected {expected}");
        }
    }
}

/// A belt that runs around a free wheel: action and reaction, no net momentum.
#[test]
fn a_belt_on_a_free_body_keeps_the_momentum() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = no_gravity(world(stepper, 1.0 / 240.0));
        let belt = Material { surface_velocity: Vec3::new(2.0, 0.0, 0.0), ..Material::default() };
        let a = world.add(RigidBody::new(cube(0.4)).with_mass(3.0).with_material(belt)).unwrap();
        let b = RigidBody::new(cube(0.2)).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 0.31));
        let b = world.add(b.with_velocity(Vec3::new(0.0, 0.0, -1.0))).unwrap();
        (0..60).for_each(|_| {
            world.step().unwrap();
        });
        let [va, vb] = [a, b].map(|id| velocity(&world, id));
        assert!((3.0 * va + vb - Vec3::new(0.0, 0.0, -1.0)).norm() < 1e-12, "{stepper}: {va} {vb}");
        assert!(vb.x > 0.1 && va.x < -0.03, "{stepper}: {va} {vb}");
    }
}

//! A world that flies apart ends in an error that names the object.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

const DT: f64 = 1.0 / 240.0;

/// A force that a program computes from the velocity is explicit: v' = v − (c·dt/m)·v overshoots for c·dt/m > 2.
#[test]
fn an_explicit_damper_that_overshoots_is_an_error() {
    for stepper in ["time_stepping", "backtracking"] {
        let mut world = no_gravity(world(stepper, DT));
        world.add(RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("still")).unwrap();
        let body =
            RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("key").with_pose(Pose::translation(1.0, 0.0, 0.0));
        let body = world.add(body.with_velocity(Vec3::y())).unwrap();
        let mass = 4.0 / 3.0 * std::f64::consts::PI * 1e-3 * 1000.0;
        let mut steps = 0;
        let error = loop {
            let (speed, at) = (world.part_state(body, 0).unwrap().velocity, position(&world, body));
            world.apply_force(body, 0, -5.0 * mass / DT * speed, &at).unwrap();
            let before = world.save();
            match world.step() {
                Err(error) => {
                    assert_eq!(world.save(), before, "the world is as before the step");
                    break error;
                }
                Ok(_) => steps += 1,
            }
            assert!(steps < 1000);
        };
        // |v| = 4ⁿ m/s after n steps: 4¹⁴ is below the speed of light, 4¹⁵ above
        assert_eq!(steps, 14, "{stepper}");
        let StepError::Runaway { object, part: 0, value, .. } = &error else { panic!("{error}") };
        assert!(object == "key" && (*value / 4f64.powi(15) - 1.0).abs() < 1e-9, "{error}");
        assert!(error.to_string().contains("'key'") && error.to_string().contains("flies away"), "{error}");
    }
}

/// The rim of a wheel is not faster than light either, and a body is not farther away than its place can be said to a meter.
#[test]
fn a_part_too_fast_or_too_far_is_an_error() {
    let ball = || RigidBody::new(Shape::sphere(0.1).unwrap()).with_name("ball");
    for (body, fails) in [
        (ball().with_angular_velocity(Vec3::z() * 2.9e9), false),
        (ball().with_angular_velocity(Vec3::z() * 3.1e9), true),
        (ball().with_velocity(Vec3::x() * 2.9e8), false),
        (ball().with_velocity(Vec3::x() * 3.1e8), true),
        (ball().with_pose(Pose::translation(9e15, 0.0, 0.0)), false),
        (ball().with_pose(Pose::translation(9.1e15, 0.0, 0.0)), true),
    ] {
        let mut world = no_gravity(world("time_stepping", DT));
        world.add(body).unwrap();
        let result = world.step();
        assert_eq!(matches!(&result, Err(StepError::Runaway { object, .. }) if object == "ball"), fails, "{result:?}");
        assert_eq!(result.is_err(), fails, "{result:?}");
    }
}

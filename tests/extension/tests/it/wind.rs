//! A force generator without a state of its own acts on old and new kinds alike.

use crate::common::*;
use tumble_core::RigidBody;
use tumble_core::collide::{Pose, Vec3};
use tumble_extension::Wind;

/// `v(t) = w·(1 − e^{−ct/m})` from rest, for a particle and for a rigid body.
#[test]
fn wind_carries_what_it_blows_on_as_its_equation_says() {
    for stepper in STEPPERS {
        let mut world = world(stepper, false);
        let windy = world.add(particle(2.0, 0.1, Vec3::zeros(), Vec3::zeros())).unwrap();
        let body =
            RigidBody::new(sphere(0.1)).with_name("ball").with_mass(3.0).with_pose(Pose::translation(0.0, 5.0, 0.0));
        let ball = world.add(body).unwrap();
        let calm = world.add(particle(2.0, 0.1, Vec3::new(0.0, -5.0, 0.0), Vec3::zeros())).unwrap();
        let wind = Vec3::new(4.0, 0.0, -1.0);
        world.add(Wind::new("wind", wind, 1.5, vec![windy, ball])).unwrap();
        step(&mut world, 480);
        for (id, mass) in [(windy, 2.0f64), (ball, 3.0)] {
            let expected = wind * (1.0 - (-1.5 * 2.0 / mass).exp());
            // one evaluation per step where the force depends on the velocity: first order, h·c/2m
            // of the speed at most
            let off = (velocity(&world, id) - expected).norm();
            assert!(off < DT * 1.5 / mass * wind.norm(), "{stepper}: {} m/s, by hand {expected}", velocity(&world, id));
        }
        assert_eq!(velocity(&world, calm), Vec3::zeros());
        world.remove(ball).unwrap();
        step(&mut world, 10);
    }
}

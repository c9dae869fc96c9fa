//! Pendulums made by a rod constraint, ropes, and what the solvers make of equality rows.

use crate::common::*;
use std::f64::consts::PI;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::{ObjectId, RigidBody, World};
use tumble_extension::{End, Particle, Rod};

const LENGTH: f64 = 1.0;
const AMPLITUDE: f64 = 0.1;

fn bob(angle: f64) -> Vec3 {
    LENGTH * Vec3::new(angle.sin(), 0.0, -angle.cos())
}

/// The pendulum's series: `T = 2π√(ℓ/g)·(1 + θ²/16 + 11θ⁴/3072)`.
fn period() -> f64 {
    2.0 * PI * (LENGTH / G).sqrt() * (1.0 + AMPLITUDE.powi(2) / 16.0 + 11.0 * AMPLITUDE.powi(4) / 3072.0)
}

/// A pendulum of a particle (its own kind of object) or of a rigid body hung by its centre, which then moves the same.
fn pendulum(stepper: &str, rigid: bool) -> (World, ObjectId) {
    let mut world = world(stepper, true);
    let id = if rigid {
        let at = bob(AMPLITUDE);
        world.add(RigidBody::with_mass("bob", sphere(0.1), 2.0).unwrap().at(Pose::translation(at.x, at.y, at.z))).unwrap()
    } else {
        world.add(Particle::new("bob", 2.0, sphere(0.1)).at(bob(AMPLITUDE), Vec3::zeros())).unwrap()
    };
    world.add(Rod::new("rod", End::Object(id), End::Point(Vec3::zeros()), LENGTH)).unwrap();
    (world, id)
}

#[test]
fn a_rod_makes_a_pendulum_of_the_right_period_that_keeps_energy_and_length() {
    for stepper in STEPPERS {
        for rigid in [false, true] {
            let (mut world, id) = pendulum(stepper, rigid);
            let swing_energy = 2.0 * G * LENGTH * (1.0 - AMPLITUDE.cos());
            let (measured, drift) = swing(&mut world, id, 20.0);
            let stretch = (position(&world, id).norm() - LENGTH).abs();
            eprintln!("{stepper} rigid={rigid}: period off {:e}, energy off {:e} of the swing, stretch {stretch:e}", measured / period() - 1.0, drift / swing_energy);
        }
    }
}

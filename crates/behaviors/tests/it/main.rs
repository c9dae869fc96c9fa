//! The behaviors against closed forms, hand computations and brute force.

#![allow(clippy::disallowed_methods)] // expected numbers may come from the platform

// the fuzz target of archives asks for its macro by this name
extern crate self as libfuzzer_sys;

mod archive_fuzz;
mod archives;
mod boids;
mod buoyancy;
mod drawn;
mod emission;
mod extremes;
mod fields;
mod flights;
mod frame_states;
mod helm;
mod laws;
mod neighbors;
mod non_spinning;
mod particles;
mod slanting;
mod springs;
mod steering;

use tumble_behaviors::Boid;
use tumble_core::prelude::*;

/// A world without gravity, in frames of 1/120 s, on one thread.
pub fn world() -> World {
    World::new(Settings::default().with_dt(1.0 / 120.0).with_gravity(Vec3::zeros())).unwrap()
}

/// A boid of 1 kg in a sphere of 1 cm.
pub fn boid(position: Vec3, velocity: Vec3) -> Boid {
    Boid::new(Shape::sphere(0.01).unwrap(), 1.0).unwrap().with_position(position).with_velocity(velocity)
}

/// Numbers of a fixed sequence, from −1 to 1.
pub struct Numbers(pub u64);

impl Numbers {
    /// Returns the next number.
    pub fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// Returns a vector with entries up to `size`.
    pub fn vector(&mut self, size: f64) -> Vec3 {
        size * Vec3::new(self.number(), self.number(), self.number())
    }
}

/// Replaces the macro of `libfuzzer_sys`: makes a target a function of its bytes.
#[macro_export]
macro_rules! fuzz_target {
    (|$bytes:ident: &[u8]| $body:block) => {
        pub fn target($bytes: &[u8]) {
            $body
        }
    };
}

/// Steps a world.
pub fn steps(world: &mut World, count: usize) {
    (0..count).for_each(|_| {
        world.step().unwrap();
    });
}

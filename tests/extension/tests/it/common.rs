//! Small worlds, and how a period is measured.

use tumble_core::collide::{Shape, Vec3};
use tumble_core::*;
use tumble_extension::Particle;

pub const G: f64 = 9.81;
pub const DT: f64 = 1.0 / 240.0;
pub use tumble_core::STEPPERS;

/// A world of `DT` frames in the given stepper; gravity along −z, or none.
pub fn world(stepper: &str, gravity: bool) -> World {
    let pull = if gravity { Vec3::new(0.0, 0.0, -G) } else { Vec3::zeros() };
    let mut world = World::new(Settings::default().with_dt(DT).with_gravity(pull)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

pub fn sphere(radius: f64) -> Shape {
    Shape::sphere(radius).unwrap()
}

/// A particle of `mass` kg in a sphere of that radius (m), at a position (m) with a velocity (m/s),
/// with the default material.
pub fn particle(mass: f64, radius: f64, at: Vec3, velocity: Vec3) -> Particle {
    let start = [at.x, at.y, at.z, velocity.x, velocity.y, velocity.z];
    Particle { mass, shape: sphere(radius), material: Material::default(), start }
}

/// The same particle with other restitution and friction.
pub fn with_material(particle: Particle, restitution: f64, friction: f64) -> Particle {
    Particle { material: Material { restitution, friction, ..Material::default() }, ..particle }
}

pub fn step(world: &mut World, frames: usize) {
    (0..frames).for_each(|_| {
        world.step().unwrap();
    });
}

pub fn position(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().position()
}

pub fn velocity(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().velocity
}

/// Runs for `seconds` and returns the mean period of `x` of an object, from its first to its last
/// rise through 0 (interpolated), and the largest deviation of the energy from its start, J.
pub fn swing(world: &mut World, id: ObjectId, seconds: f64) -> (f64, f64) {
    let (start, mut drift) = (world.energy().total(), 0.0f64);
    let (mut rises, mut before) = (Vec::new(), position(world, id).x);
    for _ in 0..(seconds / DT) as usize {
        let t = world.time();
        step(world, 1);
        let after = position(world, id).x;
        if before < 0.0 && after >= 0.0 {
            rises.push(t + DT * before / (before - after));
        }
        before = after;
        drift = drift.max((world.energy().total() - start).abs());
    }
    let periods = rises.len() - 1;
    ((rises[periods] - rises[0]) / periods as f64, drift)
}

//! Small worlds that several tests use.

use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

pub const G: f64 = 9.81;
pub fn world(stepper: &str, dt: f64) -> World {
    let mut world = World::new(Settings { dt, ..Settings::default() }).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

pub fn no_gravity(mut world: World) -> World {
    let settings = Settings { gravity: Vec3::zeros(), ..*world.settings() };
    world.set_settings(settings).unwrap();
    world
}

pub fn ground(world: &mut World, restitution: f64, friction: f64) -> ObjectId {
    world.add_static(RigidBody::fixture("ground", Shape::half_space()).surface(restitution, friction)).unwrap()
}

/// Ground tilted about y so that downhill is +x.
pub fn slope(world: &mut World, angle: f64, friction: f64) -> ObjectId {
    let pose = Pose::rotation(Vec3::new(0.0, angle, 0.0));
    world.add_static(RigidBody::fixture("slope", Shape::half_space()).surface(0.0, friction).at(pose)).unwrap()
}

pub fn sphere(radius: f64) -> Shape {
    Shape::sphere(radius).unwrap()
}

pub fn cube(edge: f64) -> Shape {
    Shape::cuboid(Vec3::repeat(0.5 * edge)).unwrap()
}

pub fn position(world: &World, id: ObjectId) -> Vec3 {
    world.site(id, 0).unwrap().position()
}

pub fn velocity(world: &World, id: ObjectId) -> Vec3 {
    world.site(id, 0).unwrap().velocity
}

//! Small worlds that several tests use.

use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

pub const G: f64 = 9.81;
pub fn world(stepper: &str, dt: f64) -> World {
    let mut world = World::new(Settings::default().with_dt(dt)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world
}

pub fn no_gravity(mut world: World) -> World {
    let settings = world.settings().with_gravity(Vec3::zeros());
    world.set_settings(settings).unwrap();
    world
}

pub fn ground(world: &mut World, restitution: f64, friction: f64) -> ObjectId {
    world
        .add_static(RigidBody::fixed(Shape::half_space()).with_name("ground").with_material(Material {
            restitution,
            friction,
            ..Material::default()
        }))
        .unwrap()
}

/// Ground tilted about y so that downhill is +x.
pub fn slope(world: &mut World, angle: f64, friction: f64) -> ObjectId {
    let pose = Pose::rotation(Vec3::new(0.0, angle, 0.0));
    world
        .add_static(
            RigidBody::fixed(Shape::half_space())
                .with_name("slope")
                .with_material(Material { friction, ..Material::default() })
                .with_pose(pose),
        )
        .unwrap()
}

pub fn sphere(radius: f64) -> Shape {
    Shape::sphere(radius).unwrap()
}

pub fn cube(edge: f64) -> Shape {
    Shape::cuboid(Vec3::repeat(edge)).unwrap()
}

pub fn position(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().position()
}

pub fn velocity(world: &World, id: ObjectId) -> Vec3 {
    world.part_state(id, 0).unwrap().velocity
}

/// Slides a cube at 5 m/s with μ = 0.5. Returns distance and time of its stop (the time from the
/// last two speeds), and the largest gap under it.
pub fn slide(stepper: &str, solver: &str, dt: f64) -> (f64, f64, f64) {
    let mut world = world(stepper, dt);
    world.set_solver(solver::by_name(solver).unwrap());
    ground(&mut world, 0.0, 0.5);
    let body = RigidBody::new(cube(0.2))
        .with_name("box")
        .with_mass(1.0)
        .with_material(Material { friction: 0.5, ..Material::default() });
    let id =
        world.add(body.with_pose(Pose::translation(0.0, 0.0, 0.1)).with_velocity(Vec3::new(5.0, 0.0, 0.0))).unwrap();
    let (mut stop, mut gap) = (f64::NAN, 0.0f64);
    for _ in 0..(1.5 / dt) as usize {
        let (before, start) = (velocity(&world, id).x, world.time());
        world.step().unwrap();
        gap = gap.max(position(&world, id).z - 0.1);
        if stop.is_nan() && velocity(&world, id).x.abs() < 1e-9 {
            stop = start + before / (0.5 * G);
        }
    }
    (position(&world, id).x, stop, gap)
}

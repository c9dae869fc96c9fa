//! Slides that end: `backtracking` finds the time at which a contact comes to rest on its surface, and what follows begins then.

use crate::common::*;
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

/// Steps that divide none of the times below.
const STEPS: [f64; 4] = [1.0 / 30.0, 1.0 / 60.0, 1.0 / 240.0, 1e-3];
/// Gravity of the default settings, m/s².
const G: f64 = 9.81;

fn surface(friction: f64) -> Material {
    Material { friction, restitution: 0.0, ..Material::default() }
}

fn stepped(mut world: World, seconds: f64) -> World {
    let frames = (seconds / world.settings().dt).round() as usize;
    (0..frames).for_each(|_| {
        world.step().unwrap();
    });
    world
}

/// Checks the errors of a motion, m, at every step.
fn check(what: &str, bound: f64, error: impl Fn(f64) -> f64) {
    for dt in STEPS {
        let error = error(dt);
        println!("{what} at {dt:.5} s: {error:.1e} m");
        assert!(error.abs() < bound, "{what} at {dt} s: {error:e} m");
    }
}

#[test]
fn boxes_slide_to_rest_where_friction_stops_them() {
    check("boxes", 2e-11, |dt| {
        let mut world = world("backtracking", dt);
        ground(&mut world, 0.0, 0.5);
        // each stops at a time of its own
        let slides = [(2.0, 0.5), (0.7, 0.5), (3.1, 0.2)].map(|(speed, friction)| {
            let start = Pose::translation(0.0, 2.0 * speed, 0.1);
            let body = RigidBody::new(cube(0.2)).with_mass(1.3).with_pose(start).with_material(surface(friction));
            let id = world.add(body.with_velocity(Vec3::new(speed, 0.0, 0.0))).unwrap();
            (id, speed * speed / (2.0 * G * (0.5f64 * friction).sqrt()))
        });
        let world = stepped(world, 3.0);
        slides.iter().map(|(id, way)| (position(&world, *id).x - way).abs()).fold(0.0, f64::max)
    });
}

#[test]
fn a_box_thrown_up_a_slope_turns_and_slides_back() {
    let (angle, friction, speed) = (0.4f64, 0.2, 2.0);
    let (along, across) = (G * angle.sin(), friction * G * angle.cos());
    let up = speed / (along + across);
    let at = |time: f64| speed * up / 2.0 - 0.5 * (along - across) * (time - up).powi(2);
    check("a slope", 2e-11, |dt| {
        let mut world = world("backtracking", dt);
        slope(&mut world, angle, friction);
        let turn = Pose::rotation(Vec3::new(0.0, angle, 0.0));
        let pose = turn * Pose::translation(0.0, 0.0, 0.1);
        // the slope falls along x
        let velocity = turn * Vec3::new(-speed, 0.0, 0.0);
        let body = RigidBody::new(cube(0.2)).with_mass(1.0).with_pose(pose).with_material(surface(friction));
        let id = world.add(body.with_velocity(velocity)).unwrap();
        let moved = turn.inverse_transform_vector(&(position(&stepped(world, 0.9), id) - pose.translation.vector));
        moved.x + at(0.9)
    });
}

#[test]
fn a_ball_slides_until_it_rolls() {
    let (friction, speed) = (0.2f64, 3.0);
    let rolls = 2.0 * speed / (7.0 * friction * G);
    let way = 12.0 * speed * speed / (49.0 * friction * G) + 5.0 / 7.0 * speed * (1.0 - rolls);
    check("a ball", 2e-11, |dt| {
        let mut world = world("backtracking", dt);
        ground(&mut world, 0.0, friction);
        let body = RigidBody::new(sphere(0.1)).with_mass(0.7).with_pose(Pose::translation(0.0, 0.0, 0.1));
        let id = world.add(body.with_material(surface(friction)).with_velocity(Vec3::new(speed, 0.0, 0.0))).unwrap();
        position(&stepped(world, 1.0), id).x - way
    });
}

#[test]
fn a_box_on_a_belt_reaches_its_speed_at_the_time_of_friction() {
    let (friction, belt) = (0.3, 1.7);
    let way = belt - 0.5 * belt * belt / (friction * G);
    check("a belt", 2e-11, |dt| {
        let mut world = world("backtracking", dt);
        let material = Material { surface_velocity: Vec3::new(belt, 0.0, 0.0), ..surface(friction) };
        world.add_static(RigidBody::fixed(Shape::half_space()).with_material(material)).unwrap();
        let body = RigidBody::new(cube(0.2)).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 0.1));
        let id = world.add(body.with_material(surface(friction))).unwrap();
        position(&stepped(world, 1.0), id).x - way
    });
}

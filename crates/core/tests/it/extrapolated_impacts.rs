//! Impacts in sub-steps of `backtracking` that are extrapolated: a change of velocity is none of the errors that two halves
//! of a sub-step measure.

use crate::common::{G, sphere, velocity, world};
use nalgebra::{UnitQuaternion, Vector3};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

fn frictionless() -> Material {
    Material { friction: 0.0, restitution: 0.0, ..Material::default() }
}

/// Energy of a capsule without friction and restitution after both of its ends have struck a plane, J.
fn energy_after_two_ends(rate: f64) -> f64 {
    let mut world = world("backtracking", 1.0 / rate);
    let settings = world.settings().with_integrator(Integrator::DormandPrince);
    world.set_settings(settings).unwrap();
    world.add_static(RigidBody::fixed(Shape::half_space()).with_material(frictionless())).unwrap();
    let turn = UnitQuaternion::from_scaled_axis(0.9 * Vector3::new(1.0, 2.0, 0.5).normalize());
    let pose = Pose::from_parts(Vec3::new(0.0, 0.0, 0.6).into(), turn);
    let body = RigidBody::new(Shape::capsule(0.12, 0.3).unwrap()).with_mass(6.0).with_material(frictionless());
    let body = body.with_velocity(Vec3::new(0.9, -1.4, -3.0)).with_angular_velocity(Vec3::new(-5.0, -0.9, -3.3));
    world.add(body.with_pose(pose)).unwrap();
    (0..(0.25 * rate).round() as usize).for_each(|_| {
        world.step().unwrap();
    });
    world.energy().total()
}

/// The second end of the pair may close within the drift tolerance, 1e-4 m, above the plane: a thousandth of its height.
#[test]
fn an_end_that_strikes_loses_the_same_energy_at_any_rate() {
    let exact = energy_after_two_ends(4000.0);
    for rate in [60.0, 120.0, 240.0, 480.0, 960.0] {
        let energy = energy_after_two_ends(rate);
        assert!((energy / exact - 1.0).abs() < 1e-3, "{rate} Hz: {energy} J for {exact} J");
    }
}

/// A ball lands right after a frame begins, while a disc far away rolls on its rim. It rebounds with `e` times the speed of
/// its fall, whatever the disc does.
#[test]
fn a_body_far_away_that_rolls_changes_no_rebound() {
    let (dt, e, speed) = (1.0 / 240.0, 0.5, 3.0);
    for gaps in [0.5, 1.1, 1.3, 1.6, 1.9, 2.1, 3.0, 10.0] {
        let mut world = world("backtracking", dt);
        let surface = Material { restitution: e, friction: 0.5, ..Material::default() };
        world.add_static(RigidBody::fixed(Shape::half_space()).with_material(surface)).unwrap();
        let gap = gaps * world.settings().contact_tolerance;
        let ball = RigidBody::new(sphere(0.1)).with_material(surface).with_pose(Pose::translation(0.0, 0.0, 0.1 + gap));
        let ball = world.add(ball.with_velocity(Vec3::new(0.0, 0.0, -speed))).unwrap();
        // the disc of the steady motion
        let (radius, half, tilt) = (0.1f64, 1e-3, 0.5f64);
        let height = radius * tilt.sin() + half * tilt.cos();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), tilt);
        let spin = (4.0 * G / (radius * tilt.sin())).sqrt() * tilt.sin() * Vec3::new(0.0, tilt.cos(), tilt.sin());
        let disc = RigidBody::new(Shape::cylinder(radius, 2.0 * half).unwrap())
            .with_material(Material { friction: 10.0, ..surface });
        let disc = disc.with_pose(Pose::from_parts(Vec3::new(50.0, 0.0, height).into(), turn));
        world.add(disc.with_angular_velocity(spin)).unwrap();
        world.step().unwrap();
        let v = velocity(&world, ball).z;
        let approach = (speed * speed + 2.0 * G * gap).sqrt();
        let expected = e * approach - G * (dt - gap / speed);
        assert!((v - expected).abs() < 1e-6, "gap of {gaps} tolerances: {v} m/s for {expected}");
    }
}

//! Limits and joint friction along directions that turn: what they hold does no work and keeps its place.

use crate::common::{no_gravity, position, sphere, velocity, world};
use tumble_core::collide::{Pose, Shape, Vec3};
use tumble_core::*;

fn run(world: &mut World, seconds: f64) {
    (0..(seconds / world.settings().dt).round() as usize).for_each(|_| _ = world.step().unwrap());
}

/// A ball of 3 kg at the end of a rope of 1 m to the origin.
fn on_a_rope(mut world: World, at: Vec3, speed: Vec3) -> (World, ObjectId) {
    let body = RigidBody::new(sphere(0.05)).with_mass(3.0).with_velocity(speed);
    let id = world.add(body.with_pose(Pose::from(nalgebra::Translation3::from(at)))).unwrap();
    let place = JointPlace::between(at, Vec3::zeros());
    let rope = LoopJoint::joining("rope", LoopJointKind::Rope, &world, Some((id, 0)), None, place).unwrap();
    world.add(rope.with_length(1.0).unwrap()).unwrap();
    (world, id)
}

/// A ball that circles on a taut rope keeps its speed, which is a constant of the motion.
#[test]
fn a_ball_that_circles_on_a_rope_keeps_its_speed() {
    for (stepper, rate) in ["time_stepping", "backtracking"]
        .iter()
        .flat_map(|stepper| [60.0, 120.0, 240.0, 960.0].map(|rate| (*stepper, rate)))
    {
        let most = 2e-4 * (60.0f64 / rate).powi(3);
        let empty = no_gravity(world(stepper, 1.0 / rate));
        let (mut world, id) = on_a_rope(empty, Vec3::x(), Vec3::y() * 2.0);
        run(&mut world, 10.0);
        let (lost, apart) = (velocity(&world, id).norm() / 2.0 - 1.0, position(&world, id).norm() - 1.0);
        assert!(lost.abs() < most && apart.abs() < 1e-7, "{stepper} at {rate} Hz: {lost} of the speed, {apart} m");
    }
}

/// A pendulum on a rope loses energy with the second order of the step: 1.1 % of its swing in 10 s at 60 Hz.
#[test]
fn a_pendulum_on_a_rope_keeps_its_energy() {
    for (rate, most) in [(60.0, 1.6e-2), (240.0, 1e-3), (960.0, 7e-5)] {
        let (angle, up) = (1.2f64, Vec3::z());
        let start = Vec3::new(angle.sin(), 0.0, -angle.cos());
        let (mut world, _) = on_a_rope(world("time_stepping", 1.0 / rate), start, Vec3::zeros());
        let (before, drop) = (world.energy().total(), 3.0 * crate::common::G * (1.0 + start.dot(&up)));
        run(&mut world, 10.0);
        let lost = (world.energy().total() - before) / drop;
        assert!(lost.abs() < most, "{rate} Hz: {lost} of the swing");
    }
}

/// Two bodies without gravity that turn about each other at 3 rad/s, with a slider that the turning pushes outwards.
fn turning_pair(rate: f64, setting: impl FnOnce(LoopJoint) -> LoopJoint) -> (World, [ObjectId; 3]) {
    let mut world = no_gravity(world("time_stepping", 1.0 / rate));
    let center = 0.5 / 3.0;
    let mut add = |size: Vec3, mass: f64, x: f64| {
        let body =
            RigidBody::new(Shape::cuboid(size).unwrap()).with_mass(mass).with_pose(Pose::translation(x, 0.0, 0.0));
        let body = body.with_angular_velocity(3.0 * Vec3::z()).with_velocity(3.0 * (x - center) * Vec3::y());
        let id = world.add(body).unwrap();
        world.set_collidable(id, false).unwrap();
        id
    };
    let (a, b) = (add(Vec3::new(0.3, 0.1, 0.1), 2.0, 0.0), add(Vec3::new(0.1, 0.1, 0.1), 1.0, 0.5));
    let place = JointPlace::on_line(Vec3::zeros(), Vec3::x());
    let joint =
        LoopJoint::joining("rail", LoopJointKind::Prismatic, &world, Some((b, 0)), Some((a, 0)), place).unwrap();
    let joint = world.add(setting(joint)).unwrap();
    (world, [a, b, joint])
}

#[test]
fn a_slider_at_the_end_of_a_turning_rail_takes_no_energy() {
    for rate in [60.0f64, 240.0, 960.0] {
        let most = 2e-4 * (60.0 / rate).powi(3);
        let (mut world, [a, ..]) = turning_pair(rate, |joint| joint.with_limits([-0.3, 0.0]).unwrap());
        let before = world.energy().total();
        run(&mut world, 1.0);
        let lost = world.energy().total() / before - 1.0;
        let spin = world.part_state(a, 0).unwrap().angular_velocity.z / 3.0 - 1.0;
        assert!(lost.abs() < most && spin.abs() < most, "{rate} Hz: {lost} of the energy, {spin} of the spin");
    }
}

/// Dry friction of 100 N where 3 N would do.
#[test]
fn a_slider_that_sticks_to_a_turning_rail_stays() {
    for rate in [60.0, 240.0, 960.0] {
        let dof = DofSettings { friction: 100.0, ..DofSettings::default() };
        let (mut world, [.., joint]) = turning_pair(rate, |joint| joint.with_dof(dof).unwrap());
        let before = world.energy().total();
        run(&mut world, 1.0);
        let way = world.get::<LoopJoint>(joint).unwrap().position(&world.view()).unwrap()[1];
        let lost = world.energy().total() / before - 1.0;
        assert!(way.abs() < 1e-4 && lost.abs() < 1e-4, "{rate} Hz: {way} m, {lost} of the energy");
    }
}

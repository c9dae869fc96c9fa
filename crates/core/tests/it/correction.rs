//! The position correction: it solves with the solver of the world, and corrects overlap, joints
//! and limits.

use crate::common::*;
use tumble_core::collide::{Pose, Quat, Shape, Vec3};
use tumble_core::rows::Rows;
use tumble_core::solver::{NAMES, RowSolver, SolveReport, SolverSettings, by_name};
use tumble_core::*;

/// A solver that leaves all multipliers at 0.
struct Idle;

impl RowSolver for Idle {
    fn name(&self) -> &'static str {
        "idle"
    }

    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        _: &[f64],
        lambda: &mut [f64],
        _: &mut [f64],
        _: SolverSettings,
    ) -> SolveReport {
        blocks.iter().for_each(|&b| lambda[rows.blocks[b as usize].range()].fill(0.0));
        SolveReport { iterations: 0, converged: true, ray: false, relaxations: 0 }
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(Idle)
    }
}

/// Overlap of a sphere with the ground, and distance of an open pin of another sphere, after 0.1 s
/// without gravity. Both are 1 cm at the start.
fn overlap_and_opening(stepper: &str, solver: Box<dyn RowSolver>) -> [f64; 2] {
    let mut world = no_gravity(world(stepper, 1.0 / 240.0));
    world.set_solver(solver);
    ground(&mut world, 0.0, 0.0);
    let body = |name: &str, x: f64, z: f64| {
        RigidBody::new(sphere(0.1)).with_mass(1.0).with_name(name).with_pose(Pose::translation(x, 0.0, z))
    };
    let sunk = world.add(body("sunk", 0.0, 0.09)).unwrap();
    let pinned = world.add(body("pinned", 1.0, 0.5)).unwrap();
    let pin = LoopJoint::spherical_at("pin", &world, Some((pinned, 0)), None, Vec3::new(1.0, 0.0, 0.8)).unwrap();
    let pin = world.add(pin).unwrap();
    world.set_pose(pinned, Pose::translation(1.01, 0.0, 0.5)).unwrap();
    for _ in 0..24 {
        world.step().unwrap();
    }
    let opening = world.get::<LoopJoint>(pin).unwrap().position_error(&world.view()).unwrap().distance;
    [0.1 - position(&world, sunk).z, opening]
}

#[test]
fn positions_are_corrected_by_the_solver_of_the_world() {
    for stepper in STEPPERS {
        for [overlap, opening] in NAMES.map(|solver| overlap_and_opening(stepper, by_name(solver).unwrap())) {
            assert!(overlap.abs() < 1.1e-7, "{stepper}: {overlap} m of overlap");
            assert!(opening < 1e-9, "{stepper}: {opening} m open");
        }
        let idle = overlap_and_opening(stepper, Box::new(Idle));
        assert!(idle.iter().all(|left| (left - 0.01).abs() < 1e-12), "{stepper}: {idle:?}, by another solver");
    }
}

/// A ball in a gap that is 100 µm too narrow, between planes that are 0.1 mrad from parallel: to first order it
/// gets out where the planes are 200 mm apart, a meter away. The overlap stays what it is, is shared by both
/// sides, and the ball stays where it is: no step moves it by more than twenty times the overlap.
#[test]
fn planes_that_contradict_each_other_do_not_throw_a_body() {
    for stepper in STEPPERS {
        for (slant, friction) in [(1e-2, 0.0), (1e-3, 0.0), (1e-4, 0.0), (1e-6, 0.0), (1e-2, 0.5), (1e-4, 0.5)] {
            let mut world = no_gravity(world(stepper, 1.0 / 240.0));
            ground(&mut world, 0.0, friction);
            let down = Quat::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
            let turn = Quat::from_axis_angle(&Vec3::y_axis(), slant) * down;
            let above = Pose::from_parts(Vec3::new(0.0, 0.0, 0.2 - 1e-4).into(), turn);
            let above = RigidBody::fixed(Shape::half_space()).with_name("above").with_pose(above);
            world.add_static(above.with_material(Material { friction, ..Material::default() })).unwrap();
            let ball = RigidBody::new(sphere(0.1)).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 0.1 - 3e-5));
            let ball = ball.with_material(Material { friction, ..Material::default() });
            let ball = world.add(ball).unwrap();
            let mut before = position(&world, ball);
            for step in 0..100 {
                world.step().unwrap();
                let (now, deepest) = (position(&world, ball), world.report().max_penetration);
                assert!(
                    (now - before).norm() < 2e-3,
                    "{stepper} {slant} {friction}: step {step} moves it from {before} to {now}"
                );
                assert!(deepest < 1e-4, "{stepper} {slant} {friction}: {deepest} m deep in step {step}");
                assert!(
                    velocity(&world, ball).norm() < 1e-9,
                    "{stepper} {slant} {friction}: {}",
                    velocity(&world, ball)
                );
                before = now;
            }
        }
    }
}

//! Every solver in the same worlds: friction does not lift, bodies stop at the right place, and
//! solvers agree without friction.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::solver::{NAMES, SolverSettings, by_name};
use tumble_core::*;

fn set(world: &mut World, solver: &str) {
    world.set_solver(by_name(solver).unwrap());
}

#[test]
fn no_solver_lifts_a_box_that_slides_fast_at_60_hz() {
    for stepper in STEPPERS {
        for solver in NAMES {
            let (_, _, gap) = slide(stepper, solver, 1.0 / 60.0);
            assert!(gap < 1e-4, "{stepper}, {solver}: lifted by {gap} m");
        }
    }
}

#[test]
fn a_sliding_box_stops_where_and_when_it_should_with_every_solver() {
    for stepper in STEPPERS {
        for solver in NAMES {
            let (distance, time, _) = slide(stepper, solver, 1.0 / 240.0);
            assert!((distance / 2.548420 - 1.0).abs() < 1e-4, "{stepper}, {solver}: stops after {distance} m");
            assert!((time / 1.019368 - 1.0).abs() < 1e-4, "{stepper}, {solver}: stops after {time} s");
        }
    }
}

#[test]
fn five_boxes_stand_with_every_solver() {
    for stepper in STEPPERS {
        for solver in NAMES {
            let mut world = world(stepper, 1.0 / 60.0);
            set(&mut world, solver);
            ground(&mut world, 0.0, 0.5);
            let ids: Vec<ObjectId> = (0..5)
                .map(|i| {
                    let body = RigidBody::new(cube(0.5))
                        .with_name(format!("box{i}"))
                        .with_mass(10.0)
                        .with_material(Material { friction: 0.5, ..Material::default() });
                    world.add(body.with_pose(Pose::translation(0.0, 0.0, 0.25 + 0.5 * i as f64))).unwrap()
                })
                .collect();
            (0..60).for_each(|_| {
                world.step().unwrap();
            });
            for (i, id) in ids.iter().enumerate() {
                let off = (position(&world, *id) - Vec3::new(0.0, 0.0, 0.25 + 0.5 * i as f64)).norm();
                assert!(
                    off < 1e-4 && velocity(&world, *id).norm() < 1e-3,
                    "{stepper}, {solver}: box {i} is {off} m off at {} m/s",
                    velocity(&world, *id).norm()
                );
            }
        }
    }
}

/// A frictionless pile in mid-fall: 20 spheres and boxes pressed against each other and the ground.
fn pile(stepper: &str) -> World {
    let mut world = world(stepper, 1.0 / 240.0);
    world
        .set_settings(world.settings().with_solver_settings(SolverSettings {
            max_sweeps: 200_000,
            max_relaxations: u32::MAX,
            tolerance: 1e-12,
            budget: None,
        }))
        .unwrap();
    ground(&mut world, 0.0, 0.0);
    for i in 0..20 {
        let (x, y, z) = (0.19 * (i % 2) as f64, 0.19 * ((i / 2) % 2) as f64, 0.1 + 0.195 * (i / 4) as f64);
        let shape = if i % 3 == 0 { sphere(0.1) } else { cube(0.19) };
        let body = RigidBody::new(shape)
            .with_name(format!("body{i}"))
            .with_mass(1.0 + 0.1 * i as f64)
            .with_material(Material { friction: 0.0, ..Material::default() });
        world
            .add(body.with_pose(Pose::translation(x, y, z)).with_velocity(Vec3::new(
                0.2 - 0.4 * (i % 2) as f64,
                0.1 * (i % 3) as f64,
                -1.0,
            )))
            .unwrap();
    }
    world
}

/// Without friction the problem is convex: the velocities after a step are unique for all solvers. The forces of redundant
/// contacts are not, and `backtracking` extrapolates a sub-step only if the same contacts carry in both halves: so its velocities differ by
/// what an extrapolation changes.
#[test]
fn pivoting_and_gauss_seidel_agree_on_a_frictionless_pile() {
    for stepper in STEPPERS {
        let start = pile(stepper);
        let speeds = |solver: &str| -> Vec<Vec3> {
            let mut world = start.fork();
            set(&mut world, solver);
            world.step().unwrap();
            assert!(world.contacts().len() > 30, "{} contacts", world.contacts().len());
            assert!(world.report().residual < 1e-8, "{stepper}, {solver}: residual {:e}", world.report().residual);
            world.part_states().iter().flat_map(|s| [s.velocity, s.angular_velocity]).collect()
        };
        let (pivoting, sweeping) = (speeds("lcp_pyramid"), speeds("gauss_seidel"));
        let apart = pivoting.iter().zip(&sweeping).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        let most = if stepper == "backtracking" { 1e-5 } else { 1e-6 };
        assert!(apart < most, "{stepper}: velocities differ by {apart:e}");
        let moved = pivoting.iter().map(|v| v.norm()).fold(0.0, f64::max);
        assert!(moved > 0.01, "something moves");
    }
}

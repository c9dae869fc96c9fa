//! Pendulums made by a rod constraint, ropes, and what the solvers make of equality rows.

use crate::common::*;
use std::f64::consts::PI;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::solver::{NAMES, by_name};
use tumble_core::{ObjectId, RigidBody, World};
use tumble_extension::{End, Rod};

const LENGTH: f64 = 1.0;
const AMPLITUDE: f64 = 0.1;

fn bob(angle: f64) -> Vec3 {
    LENGTH * Vec3::new(angle.sin(), 0.0, -angle.cos())
}

/// The pendulum's series: `T = 2π√(ℓ/g)·(1 + θ²/16 + 11θ⁴/3072)`.
fn period() -> f64 {
    2.0 * PI * (LENGTH / G).sqrt() * (1.0 + AMPLITUDE.powi(2) / 16.0 + 11.0 * AMPLITUDE.powi(4) / 3072.0)
}

/// A pendulum of a particle (its own kind of object) or of a rigid body hung by its center, which
/// then moves the same.
fn pendulum(stepper: &str, rigid: bool) -> (World, ObjectId) {
    let mut world = world(stepper, true);
    let id = if rigid {
        let at = bob(AMPLITUDE);
        world
            .add(
                RigidBody::new(sphere(0.1))
                    .with_name("bob")
                    .with_mass(2.0)
                    .with_pose(Pose::translation(at.x, at.y, at.z)),
            )
            .unwrap()
    } else {
        world.add(particle(2.0, 0.1, bob(AMPLITUDE), Vec3::zeros())).unwrap()
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
            // the leapfrog of an oscillator is fast by (ωh)²/24 = 7.1e-6
            assert!(
                (measured / period() - 1.0).abs() < 2e-5,
                "{stepper}, rigid {rigid}: period {measured} s, by hand {} s",
                period()
            );
            assert!(
                drift < 2e-4 * swing_energy,
                "{stepper}, rigid {rigid}: energy is off by {:e} of the swing",
                drift / swing_energy
            );
            let stretch = (position(&world, id).norm() - LENGTH).abs();
            assert!(stretch < 1e-6, "{stepper}, rigid {rigid}: the rod is {stretch:e} m off");
        }
    }
}

/// A large swing: once round needs `v² = 5gℓ` at the bottom on a rope; with 4 % more the energy at
/// the top is the bottom's less `2mgℓ`.
#[test]
fn a_rod_carries_a_full_turn() {
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        let v = (5.2 * G * LENGTH).sqrt();
        let id = world.add(particle(2.0, 0.1, bob(0.0), Vec3::new(v, 0.0, 0.0))).unwrap();
        world.add(Rod::new("rod", End::Object(id), End::Point(Vec3::zeros()), LENGTH)).unwrap();
        let (start, mut highest, mut stretch) = (world.energy().total(), -LENGTH, 0.0f64);
        for _ in 0..480 {
            step(&mut world, 1);
            highest = highest.max(position(&world, id).z);
            stretch = stretch.max((position(&world, id).norm() - LENGTH).abs());
        }
        assert!(highest > 0.999 * LENGTH, "{stepper}: it went up to {highest} m only");
        let drift = (world.energy().total() - start).abs() / (2.0 * 0.5 * v * v);
        assert!(drift < 2e-3, "{stepper}: energy is off by {drift:e}");
        assert!(stretch < 1e-5, "{stepper}: the rod was {stretch:e} m off");
    }
}

/// A rope is slack until the fall has used it up, and then stops the fall without a rebound
/// (`e = 0`).
#[test]
fn a_rope_is_slack_and_then_holds() {
    for stepper in STEPPERS {
        let mut world = world(stepper, true);
        let id = world.add(particle(2.0, 0.1, Vec3::new(0.0, 0.0, -0.4), Vec3::zeros())).unwrap();
        world.add(Rod::rope("rope", End::Object(id), End::Point(Vec3::zeros()), LENGTH)).unwrap();
        step(&mut world, 72); // 0.3 s: 0.6 m need √(2·0.6/g) = 0.3497 s
        let free = -0.4 - 0.5 * G * 0.09;
        assert!(
            (position(&world, id).z - free).abs() < 1e-9,
            "{stepper}: {} m, by hand {free}",
            position(&world, id).z
        );
        step(&mut world, 48);
        let z = position(&world, id).z;
        // the moment at which it is used up is located by `backtracking`
        let bound = if stepper == "backtracking" { 1e-6 } else { 1e-5 };
        assert!(
            (z + LENGTH).abs() < bound && velocity(&world, id).norm() < 1e-6,
            "{stepper}: at {z} m with {} m/s",
            velocity(&world, id)
        );
    }
}

/// Three bobs on three rods: equality rows are linear equations, so all solvers give the same
/// velocities.
#[test]
fn all_solvers_agree_on_equality_rows() {
    for stepper in STEPPERS {
        let run = |solver: &str| {
            let mut world = world(stepper, true);
            world.set_solver(by_name(solver).unwrap());
            let mut above = End::Point(Vec3::zeros());
            for i in 0..3 {
                let at = Vec3::new(0.5 * (i + 1) as f64, 0.1 * i as f64, -0.1 * i as f64);
                let before = if i == 0 {
                    Vec3::zeros()
                } else {
                    Vec3::new(0.5 * i as f64, 0.1 * (i - 1) as f64, -0.1 * (i - 1) as f64)
                };
                let id = world.add(particle(1.0 + i as f64, 0.05, at, Vec3::zeros())).unwrap();
                world.add(Rod::new(format!("rod{i}"), End::Object(id), above, (at - before).norm())).unwrap();
                above = End::Object(id);
            }
            step(&mut world, 60);
            assert!(world.report().residual < 1e-8, "{stepper}, {solver}: residual {:e}", world.report().residual);
            world
        };
        let first = run(NAMES[0]);
        assert!(first.part_states().iter().all(|s| s.velocity.norm() > 0.1), "they swing");
        for solver in &NAMES[1..] {
            let other = run(solver);
            let apart = first.state().iter().zip(other.state()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(
                apart < 1e-6,
                "{stepper}: {solver} differs from {} by {apart:e} after a quarter of a second",
                NAMES[0]
            );
        }
    }
}

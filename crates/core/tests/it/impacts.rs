//! Restitution, shocks, conservation.

use crate::common::*;
use tumble_core::collide::{Pose, Vec3};
use tumble_core::*;

/// Drops a ball from 1 m (lowest point). Returns the speed ratio of the first bounce, from the
/// energy of the rebound.
fn first_bounce(stepper: &str, e: f64, dt: f64) -> f64 {
    let mut world = world(stepper, dt);
    ground(&mut world, e, 0.0);
    let ball = RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_material(Material {
        restitution: e,
        friction: 0.0,
        ..Material::default()
    });
    let id = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 1.1))).unwrap();
    let fall = (2.0 / G).sqrt();
    (0..((fall + 0.05) / dt) as usize).for_each(|_| {
        world.step().unwrap();
    });
    let (v, z) = (velocity(&world, id).z, position(&world, id).z - 0.1);
    (v * v + 2.0 * G * z).max(0.0).sqrt() / (2.0 * G).sqrt()
}

#[test]
fn restitution_is_what_it_says_for_one_bounce() {
    for stepper in STEPPERS {
        for dt in [1.0 / 60.0, 1.0 / 240.0] {
            for e in [0.0, 0.25, 0.5, 0.75, 1.0] {
                let ratio = first_bounce(stepper, e, dt);
                assert!((ratio - e).abs() < 1e-3, "{stepper} at {dt}: e = {e} gives {ratio}");
            }
        }
    }
}

#[test]
fn a_bouncing_ball_comes_to_rest_when_the_series_says() {
    // t = √(2h/g)·(1 + e)/(1 − e) = 1.354571 s for h = 1 m, e = 0.5
    for dt in [1.0 / 60.0, 1.0 / 240.0] {
        let mut world = world("backtracking", dt);
        ground(&mut world, 0.5, 0.0);
        let ball = RigidBody::new(sphere(0.1)).with_name("ball").with_mass(1.0).with_material(Material {
            restitution: 0.5,
            friction: 0.0,
            ..Material::default()
        });
        let id = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 1.1))).unwrap();
        let mut rest = f64::NAN;
        // sub-steps are not visible outside a frame: single short frames are stepped once the
        // bounces are small
        while world.time() < 1.5 {
            if world.time() > 1.345 {
                let fine = world.settings().with_dt(1e-4);
                world.set_settings(fine).unwrap();
            }
            world.step().unwrap();
            if velocity(&world, id).z.abs() > 1e-6 {
                rest = world.time();
            }
        }
        assert!((rest - 1.354571).abs() < 1e-3, "dt {dt}: rests at {rest} s");
        assert!((position(&world, id).z - 0.1).abs() < 1e-6);
    }
}

/// A row of balls on a frictionless line without gravity.
fn cradle(stepper: &str, masses: &[f64], speeds: &[f64], gap: f64) -> Vec<f64> {
    let mut world = no_gravity(world(stepper, 1.0 / 240.0));
    let ids: Vec<ObjectId> = masses
        .iter()
        .zip(speeds)
        .enumerate()
        .map(|(i, (m, v))| {
            let shift = if *v > 0.0 { -gap } else { 0.0 };
            let ball = RigidBody::new(sphere(0.5))
                .with_name(format!("ball{i}"))
                .with_mass(*m)
                .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() });
            world
                .add(
                    ball.with_pose(Pose::translation(i as f64 + shift, 0.0, 0.0))
                        .with_velocity(Vec3::new(*v, 0.0, 0.0)),
                )
                .unwrap()
        })
        .collect();
    (0..120).for_each(|_| {
        world.step().unwrap();
    });
    ids.iter().map(|id| velocity(&world, *id).x).collect()
}

#[test]
fn a_shock_passes_along_newtons_cradle() {
    for stepper in STEPPERS {
        let out = cradle(stepper, &[1.0; 5], &[1.0, 0.0, 0.0, 0.0, 0.0], 0.1);
        assert!(
            out.iter().zip([0.0, 0.0, 0.0, 0.0, 1.0]).all(|(v, e)| (v - e).abs() < 1e-9),
            "{stepper}: one in: {out:?}"
        );
        let out = cradle(stepper, &[1.0; 5], &[1.0, 1.0, 0.0, 0.0, 0.0], 0.1);
        assert!(
            out.iter().zip([0.0, 0.0, 0.0, 1.0, 1.0]).all(|(v, e)| (v - e).abs() < 1e-9),
            "{stepper}: two in: {out:?}"
        );
    }
}

#[test]
fn two_balls_of_any_mass_exchange_velocity_as_the_textbook_says() {
    for stepper in STEPPERS {
        for (m1, m2) in [(1.0, 3.0), (5.0, 0.01), (1e-3, 10.0)] {
            let out = cradle(stepper, &[m1, m2], &[2.0, 0.0], 0.1);
            let (v1, v2) = (2.0 * (m1 - m2) / (m1 + m2), 4.0 * m1 / (m1 + m2));
            assert!((out[0] - v1).abs() < 1e-9 && (out[1] - v2).abs() < 1e-9, "{stepper} {m1}:{m2}: {out:?}");
        }
    }
}

/// Fifteen balls in a triangle on a frictionless table, broken by a sixteenth.
fn break_shot(stepper: &str, dt: f64) -> (World, Vec3, f64) {
    let mut world = world(stepper, dt);
    ground(&mut world, 0.0, 0.0);
    let r = 0.028575;
    let ball = |name: String, x: f64, y: f64| {
        RigidBody::new(sphere(r))
            .with_name(name)
            .with_mass(0.17)
            .with_material(Material { restitution: 1.0, friction: 0.0, ..Material::default() })
            .with_pose(Pose::translation(x, y, r))
    };
    for row in 0..5 {
        for k in 0..=row {
            let (x, y) = (row as f64 * 3f64.sqrt() * r, (2 * k) as f64 * r - row as f64 * r);
            world.add(ball(format!("ball{row}{k}"), x, y)).unwrap();
        }
    }
    world.add(ball("cue".into(), -0.5, 0.003).with_velocity(Vec3::new(9.0, 0.0, 0.0))).unwrap();
    let (p, e) = (world.momentum().linear, world.energy().kinetic);
    (world, p, e)
}

#[test]
fn a_billiards_break_keeps_momentum_and_energy() {
    for (stepper, energy_bound) in [("backtracking", 1e-6), ("time_stepping", 1e-6)] {
        let (mut world, p0, e0) = break_shot(stepper, 1.0 / 240.0);
        (0..36).for_each(|_| {
            world.step().unwrap();
        });
        let p = world.momentum().linear - p0;
        let moved = world.ids().iter().filter(|id| velocity(&world, **id).norm() > 0.01).count();
        let (dp, de) = (p.x.hypot(p.y) / p0.norm(), (world.energy().kinetic / e0 - 1.0).abs());
        assert!(moved >= 10, "{stepper}: only {moved} balls move");
        assert!(dp < 1e-12, "{stepper}: horizontal momentum off by {dp:e}");
        assert!(de < energy_bound, "{stepper}: energy off by {de:e}");
    }
}

#[test]
fn a_box_that_is_struck_where_it_rests_is_not_raised() {
    for stepper in STEPPERS {
        for (hz, drop) in [60.0, 240.0].into_iter().flat_map(|hz| (0..20).map(move |k| (hz, 0.1 + 0.007 * k as f64))) {
            let mut world = world(stepper, 1.0 / hz);
            ground(&mut world, 0.0, 0.5);
            let block = RigidBody::new(cube(0.2)).with_mass(1.0).with_pose(Pose::translation(0.0, 0.0, 0.1));
            let block = world.add(block.with_name("block")).unwrap();
            let bouncy = Material { restitution: 0.5, ..Material::default() };
            let ball = RigidBody::new(sphere(0.05)).with_mass(0.5).with_material(bouncy).with_name("ball");
            world.add(ball.with_pose(Pose::translation(0.0, 0.0, 0.25 + drop))).unwrap();
            let mut raised = 0.0f64;
            for _ in 0..(0.5 * hz) as usize {
                world.step().unwrap();
                raised = raised.max(position(&world, block).z - 0.1);
            }
            // less than the contact tolerance; half a step of gravity, ½g·h², is 1.4 mm at 60 Hz
            assert!(raised < 1e-7, "{stepper} at {hz} Hz from {drop} m: raised by {raised:e} m");
        }
    }
}

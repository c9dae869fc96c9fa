//! Several impacts within one step.

use crate::common::{ground, no_gravity, position, world};
use tumble_collide::{Pose, Quat, Shape, Vec3};
use tumble_core::{Material, ObjectId, RigidBody, World};

fn add(world: &mut World, shape: Shape, restitution: f64, friction: f64, at: [f64; 3]) -> ObjectId {
    let material = Material { restitution, friction, ..Material::default() };
    let body = RigidBody::new(shape).with_material(material);
    world.add(body.with_pose(Pose::translation(at[0], at[1], at[2]))).unwrap()
}

/// Speeds of equal balls in a row with these gaps after all their impacts, in the order of time.
fn speeds_after_impacts(mut gaps: Vec<f64>, mut speeds: Vec<f64>, e: f64) -> Vec<f64> {
    loop {
        let closes = |i: usize| (speeds[i] > speeds[i + 1] + 1e-12).then(|| gaps[i] / (speeds[i] - speeds[i + 1]));
        let next = (0..gaps.len()).filter_map(|i| Some((closes(i)?, i))).min_by(|x, y| x.0.total_cmp(&y.0));
        let Some((time, i)) = next else { return speeds };
        (0..gaps.len()).for_each(|k| gaps[k] += time * (speeds[k + 1] - speeds[k]));
        gaps[i] = 0.0;
        let (mean, half) = (0.5 * (speeds[i] + speeds[i + 1]), 0.5 * e * (speeds[i] - speeds[i + 1]));
        (speeds[i], speeds[i + 1]) = (mean - half, mean + half);
    }
}

/// Four equal balls in a row, 1 mm apart, of which the first strikes at 2 m/s: the shock passes all
/// gaps within 2 ms. The speeds are those of one impact after the other if steps are short, and
/// nearly so if several impacts share a step.
#[test]
fn a_shock_passes_several_gaps_in_a_step() {
    for e in [0.2, 0.5, 0.9, 1.0] {
        let expected = speeds_after_impacts(vec![0.001; 3], vec![2.0, 0.0, 0.0, 0.0], e);
        for rate in [60.0, 240.0, 1000.0, 4000.0] {
            let mut world = no_gravity(world("time_stepping", 1.0 / rate));
            let ball = || Shape::sphere(0.05).unwrap();
            let balls: Vec<_> = (0..4).map(|i| add(&mut world, ball(), e, 0.0, [0.101 * i as f64, 0.0, 0.0])).collect();
            world.set_velocity(balls[0], Vec3::new(2.0, 0.0, 0.0), Vec3::zeros()).unwrap();
            for _ in 0..(0.5 * rate) as usize {
                world.step().unwrap();
                for pair in balls.windows(2) {
                    let gap = position(&world, pair[1]).x - position(&world, pair[0]).x - 0.1;
                    // the second gap in a step is closed exactly, the third is noticed in the next
                    // step
                    assert!(gap > -1.0 / rate, "e = {e} at {rate} Hz: an overlap of {} m", -gap);
                }
            }
            let speeds: Vec<f64> = balls.iter().map(|b| world.part_state(*b, 0).unwrap().velocity.x).collect();
            println!("e = {e} at {rate} Hz: {speeds:.4?}, expected {expected:.4?}");
            let error = speeds.iter().zip(&expected).map(|(v, expected)| (v - expected).abs()).fold(0.0, f64::max);
            assert!((speeds[3] - expected[3]).abs() < 2e-3, "e = {e} at {rate} Hz: {speeds:?}, expected {expected:?}");
            assert!(rate < 1000.0 || error < 1e-3, "e = {e} at {rate} Hz: {speeds:?}, expected {expected:?}");
            assert!((speeds.iter().sum::<f64>() - 2.0).abs() < 1e-9, "e = {e} at {rate} Hz: {speeds:?}");
        }
    }
}

/// Balls of various sizes fall 5 m into a box: one that a second one deflects meets a third, which free motion
/// would pass. They move by up to 1.6 radii in a step.
#[test]
fn balls_that_fall_fast_into_a_crowd_hardly_overlap() {
    for (restitution, rate, deepest) in [(0.0, 60.0, 5e-3), (0.0, 240.0, 1e-3), (0.2, 60.0, 5e-3), (0.2, 240.0, 1e-3)] {
        let mut world = world("time_stepping", 1.0 / rate);
        ground(&mut world, restitution, 0.5);
        for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
            let normal = Vec3::new(x, y, 0.0);
            let turn = Quat::rotation_between(&Vec3::z(), &normal).unwrap();
            let wall =
                RigidBody::fixed(Shape::half_space()).with_material(Material { restitution, ..Material::default() });
            world.add(wall.with_pose(Pose::from_parts((-0.8 * normal).into(), turn))).unwrap();
        }
        for i in 0..250 {
            let size = 0.1 + 0.02 * ((i * 37) % 101) as f64 / 100.0;
            let place = |i: usize| 0.3 * (i % 5) as f64 - 0.6 + 0.05 * ((i * 61) % 97) as f64 / 97.0;
            let height = 5.0 + 0.3 * (i / 25) as f64;
            add(&mut world, Shape::sphere(size).unwrap(), restitution, 0.5, [place(i), place(i / 5), height]);
        }
        let mut overlap: f64 = 0.0;
        for _ in 0..(2.0 * rate) as usize {
            overlap = overlap.max(world.step().unwrap().max_penetration);
        }
        println!("e = {restitution} at {rate} Hz: {:.3} mm", 1e3 * overlap);
        assert!(overlap < deepest, "e = {restitution} at {rate} Hz: an overlap of {overlap} m");
    }
}

/// A hundred boxes of various sizes that bounce fall onto each other. A box falls 65 mm per step.
#[test]
fn boxes_that_bounce_in_a_crowd_gain_no_energy_and_hardly_overlap() {
    for (rate, deepest) in [(60.0, 0.005), (240.0, 0.001)] {
        let mut world = world("time_stepping", 1.0 / rate);
        ground(&mut world, 0.2, 0.5);
        let size = |i: usize, k: usize| 0.08 + 0.12 * ((i * 37 + k * 53) % 101) as f64 / 100.0;
        let place = |i: usize| -0.45 + 0.3 * (i % 4) as f64;
        for i in 0..96 {
            let shape = Shape::cuboid(Vec3::new(size(i, 0), size(i, 1), size(i, 2))).unwrap();
            add(&mut world, shape, 0.2, 0.5, [place(i), place(i / 4), 0.2 + 0.325 * (i / 16) as f64]);
        }
        let energy = |world: &World| world.energy().kinetic + world.energy().potential;
        let (start, mut before, mut overlap) = (energy(&world), energy(&world), 0.0f64);
        for frame in 0..(1.2 * rate) as usize {
            world.step().unwrap();
            let now = energy(&world);
            assert!(now < before + 1e-3 * start, "frame {frame} at {rate} Hz: from {before} to {now} J");
            before = now;
            overlap = overlap.max(world.report().max_penetration);
        }
        println!("{rate} Hz: energy {start} to {before} J, overlap {overlap} m");
        assert!(overlap < deepest, "{rate} Hz: an overlap of {overlap} m");
    }
}

/// A heap of boxes that bounce comes to rest like one of boxes that do not: its contacts rattle no
/// further, and no step takes more than a few passes of impacts.
#[test]
fn a_heap_of_boxes_that_bounce_comes_to_rest() {
    let rate = 120.0;
    let mut world = world("time_stepping", 1.0 / rate);
    ground(&mut world, 0.2, 0.5);
    for (x, y) in [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)] {
        let normal = Vec3::new(x, y, 0.0);
        let turn = Quat::rotation_between(&Vec3::z(), &normal).unwrap();
        let material = Material { restitution: 0.2, friction: 0.5, ..Material::default() };
        let wall = RigidBody::fixed(Shape::half_space()).with_material(material);
        world.add(wall.with_pose(Pose::from_parts((-0.45 * normal).into(), turn))).unwrap();
    }
    let size = |i: usize, k: usize| 0.08 + 0.12 * ((i * 37 + k * 53) % 101) as f64 / 100.0;
    let place = |i: usize, k: usize| -0.3 + 0.3 * (i % 3) as f64 + 0.04 * ((i * 61 + k * 29) % 97) as f64 / 97.0;
    let boxes: Vec<_> = (0..72)
        .map(|i| {
            let shape = Shape::cuboid(Vec3::new(size(i, 0), size(i, 1), size(i, 2))).unwrap();
            add(&mut world, shape, 0.2, 0.5, [place(i, 0), place(i / 3, 1), 0.2 + 0.3 * (i / 9) as f64])
        })
        .collect();
    let energy = |world: &World| world.energy().kinetic + world.energy().potential;
    let (start, mut before, mut passes) = (energy(&world), energy(&world), 0);
    for frame in 0..(5.0 * rate) as usize {
        world.step().unwrap();
        let now = energy(&world);
        assert!(now < before + 1e-4 * start, "frame {frame}: from {before} to {now} J");
        before = now;
        passes += if frame as f64 >= 4.0 * rate { world.report().impact_passes } else { 0 };
    }
    let fast = boxes.iter().filter(|b| world.part_state(**b, 0).unwrap().velocity.norm() > 0.05).count();
    println!("{fast} boxes move at the end, {passes} passes in the last second");
    assert!(fast <= 3, "{fast} of 72 boxes move faster than 5 cm/s");
    assert!(passes <= 120, "{passes} passes in the 120 frames of the last second");
}

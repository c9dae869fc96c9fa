//! Errors of sensors, and sensors in the state of a world: saved, forked and archived with the same bits.

use tumble_core::prelude::*;
use tumble_core::{Anchor, Sensor, SensorKind, SensorNoise, Settings, WorldError};

fn noise() -> SensorNoise {
    SensorNoise { deviation: 0.3, bias_walk: 0.05, delay: 3, seed: 5, ..SensorNoise::default() }
}

/// A tumbling block with noisy sensors of several lengths.
fn tumbling() -> (World, Vec<ObjectId>) {
    let mut world = World::new(Settings::default()).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let block = RigidBody::new(Shape::cuboid(Vec3::new(0.4, 0.3, 0.2)).unwrap());
    let block = world.add(block.with_pose(Pose::translation(0.0, 0.0, 0.5))).unwrap();
    world.set_velocity(block, Vec3::new(1.0, 0.0, 0.0), Vec3::new(1.0, 5.0, 2.0)).unwrap();
    let kinds = [SensorKind::Accelerometer, SensorKind::Orientation, SensorKind::Touch, SensorKind::RangeFinder];
    let at = Anchor::on(block, 0, Pose::translation(0.1, 0.0, 0.0));
    let ids = kinds.map(|kind| world.add(Sensor::new("", kind, at).unwrap().with_noise(noise()).unwrap()).unwrap());
    (world, ids.to_vec())
}

fn all(world: &World) -> Vec<f64> {
    world.sensors().flat_map(|id| world.reading(id).unwrap().to_vec()).collect()
}

fn run(world: &mut World, frames: usize) -> Vec<Vec<f64>> {
    (0..frames)
        .map(|_| {
            world.step().unwrap();
            all(world)
        })
        .collect()
}

#[test]
fn forks_snapshots_archives_and_threads_give_the_same_readings() {
    let (mut world, _) = tumbling();
    run(&mut world, 40);
    let (snapshot, archive, mut fork) = (world.save(), world.archive(&[]).unwrap(), world.fork());
    let at = {
        let mut state = Default::default();
        world.checkpoint(&mut state);
        state
    };
    let expected = run(&mut world, 80);
    assert_eq!(run(&mut fork, 80), expected);
    let mut read = World::from_archive(&archive, &mut |_| None).unwrap();
    assert_eq!(run(&mut read, 80), expected);
    world.restore(&snapshot).unwrap();
    assert_eq!(run(&mut world, 80), expected);
    assert!(world.roll_back(&at));
    world.set_settings(world.settings().with_threads(4)).unwrap();
    assert_eq!(run(&mut world, 80), expected);
    assert!(expected.windows(2).all(|pair| pair[0] != pair[1]), "noise is new in every frame");
}

#[test]
fn white_noise_has_its_deviation_and_a_bias_walks_with_the_root_of_time() {
    let mut world = World::default();
    let dt = world.settings().dt;
    let rest = world.add(RigidBody::fixed(Shape::sphere(0.1).unwrap())).unwrap();
    let at = Anchor::on(rest, 0, Pose::identity());
    let white = SensorNoise { deviation: 0.2, ..SensorNoise::default() };
    let walk = SensorNoise { bias_walk: 0.7, ..SensorNoise::default() };
    let add = |world: &mut World, noise| {
        world.add(Sensor::new("", SensorKind::Gyroscope, at).unwrap().with_noise(noise).unwrap()).unwrap()
    };
    let (white, walk): (ObjectId, Vec<ObjectId>) =
        (add(&mut world, white), (0..200).map(|_| add(&mut world, walk)).collect());
    let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
    for _ in 0..1000 {
        world.step().unwrap();
        for x in world.reading(white).unwrap() {
            (sum, square, count) = (sum + x, square + x * x, count + 1.0);
        }
    }
    let (mean, deviation) = (sum / count, (square / count - (sum / count).powi(2)).sqrt());
    assert!(mean.abs() < 4.0 * 0.2 / f64::sqrt(count), "{mean}");
    assert!((deviation - 0.2).abs() < 4.0 * 0.2 / f64::sqrt(2.0 * count), "{deviation}");
    let ends: Vec<f64> = walk.iter().flat_map(|id| world.reading(*id).unwrap().to_vec()).collect();
    let n = ends.len() as f64;
    let spread = (ends.iter().map(|x| x * x).sum::<f64>() / n).sqrt();
    let expected = 0.7 * (1000.0 * dt).sqrt();
    assert!((spread / expected - 1.0).abs() < 4.0 / f64::sqrt(2.0 * n), "{spread} against {expected}");
}

#[test]
fn a_reading_is_quantized_cut_off_and_late() {
    let mut world = World::default();
    let ball =
        world.add(RigidBody::new(Shape::sphere(0.1).unwrap()).with_pose(Pose::translation(0.0, 0.0, 9.0))).unwrap();
    let at = Anchor::on(ball, 0, Pose::identity());
    let plain = Sensor::new("", SensorKind::Velocimeter, at).unwrap();
    let with = |noise| plain.clone().with_noise(noise).unwrap();
    let late = world.add(with(SensorNoise { delay: 5, ..SensorNoise::default() })).unwrap();
    let coarse = world.add(with(SensorNoise { quantization: 0.25, ..SensorNoise::default() })).unwrap();
    let cut = world.add(plain.clone().with_cutoff(0.5).unwrap()).unwrap();
    let true_one = world.add(plain).unwrap();
    let mut history = vec![0.0];
    for frame in 1..=60_usize {
        world.step().unwrap();
        let z = |id| world.reading(id).unwrap()[2];
        history.push(z(true_one));
        assert_eq!(z(late), history[frame.saturating_sub(5)]);
        assert_eq!(z(cut), z(true_one).max(-0.5));
        assert_eq!(z(coarse), (z(true_one) * 4.0).round() / 4.0);
    }
}

#[test]
fn a_seed_starts_the_noise_anew_and_every_sensor_has_its_own() {
    let (mut world, ids) = tumbling();
    let first = run(&mut world.fork(), 5);
    world.seed_sensor(ids[0], 5).unwrap(); // its own seed again: one draw at the addition is repeated
    assert_ne!(run(&mut world.fork(), 5), first);
    let plain = Sensor::new("", SensorKind::Gyroscope, Anchor::world(Pose::identity())).unwrap();
    let twins = [0, 1].map(|_| world.add(plain.clone().with_noise(noise()).unwrap()).unwrap());
    run(&mut world, 10);
    assert_ne!(world.reading(twins[0]), world.reading(twins[1]));
}

#[test]
fn what_a_sensor_cannot_read_is_an_error() {
    let mut world = World::default();
    let ball = world.add(RigidBody::new(Shape::sphere(0.1).unwrap())).unwrap();
    let at = Anchor::on(ball, 0, Pose::identity());
    let message = |result: Result<ObjectId, WorldError>| result.unwrap_err().to_string();
    let force = Sensor::new("f", SensorKind::Force, at).unwrap();
    assert_eq!(
        message(world.add(force)),
        "sensor 'f': the force and torque of a joint are read at a link of an articulated body that a joint moves, or at a loop joint"
    );
    let beyond = Sensor::new("p", SensorKind::Position, Anchor::on(ball, 1, Pose::identity())).unwrap();
    assert!(matches!(world.add(beyond), Err(WorldError::NoPart { part: 1, .. })));
    let dof = Sensor::of_dof("q", SensorKind::JointPosition, ball, 0).unwrap();
    assert!(message(world.add(dof)).contains("no revolute or prismatic joint"));
    let joint = Sensor::of_joint("q", SensorKind::JointPosition, ball).unwrap();
    assert_eq!(message(world.add(joint)), "sensor 'q': 'body 0' is not a loop joint");
    let wrong = |kind, at| Sensor::new("s", kind, at).unwrap_err().to_string();
    assert_eq!(
        wrong(SensorKind::JointPosition, at),
        "sensor 's' of kind 'joint_position': it reads a joint, not a site"
    );
    let anywhere = Anchor::world(Pose::identity());
    assert_eq!(wrong(SensorKind::Touch, anywhere), "sensor 's' of kind 'touch': it must be on a body");
    let gyro = || Sensor::new("s", SensorKind::Gyroscope, at).unwrap();
    let noise = SensorNoise { deviation: -1.0, ..SensorNoise::default() };
    assert_eq!(
        gyro().with_noise(noise).unwrap_err().to_string(),
        "sensor 's': the standard deviation is -1; it must be finite and at least 0"
    );
    assert!(gyro().with_cutoff(0.0).is_err() && gyro().relative_to(at).is_err());
    assert!(gyro().with_volume(Shape::sphere(1.0).unwrap()).is_err());
    let id = world.add(gyro()).unwrap();
    world.remove(ball).unwrap();
    world.step().unwrap();
    assert!(world.reading(id).is_none() && world.object(id).is_none());
    assert!(matches!(world.add(gyro()), Err(WorldError::Stale)));
}

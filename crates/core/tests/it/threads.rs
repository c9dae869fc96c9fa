//! The number of threads changes no bit: of piles and of many islands, after a restored snapshot,
//! an archive, a fork and a roll-back, with both steppers.

use tumble_core::prelude::*;
use tumble_core::{STEPPERS, WorldState, stepper_by_name};

const THREADS: [u32; 3] = [2, 3, 8];

/// Returns a world with a ground.
fn world(stepper: &str) -> World {
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0)).unwrap();
    world.set_stepper(stepper_by_name(stepper).unwrap());
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    world
}

/// Returns numbers that look random, from 0 to 1.
fn spread(i: usize) -> f64 {
    (i as f64 * 0.754877666).fract()
}

/// 300 spheres that fall into a pile, some of which bounce.
fn pile(stepper: &str) -> World {
    let mut world = world(stepper);
    for i in 0..300 {
        let place = Vec3::new((i % 6) as f64, (i / 6 % 6) as f64, 0.5 + (i / 36) as f64);
        let at = 0.21 * place + 0.02 * Vec3::new(spread(i), spread(i + 1000), spread(i + 2000));
        let material = Material { restitution: if i % 5 == 0 { 0.3 } else { 0.0 }, ..Material::default() };
        let body = RigidBody::new(Shape::sphere(0.1).unwrap()).with_material(material);
        world.add(body.with_pose(Pose::from_parts(at.into(), Quat::identity()))).unwrap();
    }
    world
}

/// 16 towers of boxes of several sizes with a cylinder on top, and a pendulum beside each.
fn towers(stepper: &str) -> World {
    let mut world = world(stepper);
    for t in 0..16 {
        let (x, mut z) = (0.6 * t as f64, 0.0);
        for i in 0..6 {
            let size = 0.1 + 0.1 * spread(7 * t + i);
            let body = RigidBody::new(Shape::cuboid(Vec3::repeat(size)).unwrap());
            let at = Pose::translation(x + 0.01 * spread(i + 31 * t), 0.0, z + 0.5 * size);
            world.add(body.with_pose(at)).unwrap();
            z += size;
        }
        let top = RigidBody::new(Shape::cylinder(0.06, 0.1).unwrap()).with_velocity(Vec3::new(0.0, 0.3, 0.0));
        world.add(top.with_pose(Pose::translation(x, 0.0, z + 0.05 + 0.02 * spread(t)))).unwrap();
        let bob = RigidBody::new(Shape::sphere(0.05).unwrap()).with_pose(Pose::translation(x + 0.3, 1.0, 0.5));
        let bob = world.add(bob).unwrap();
        let pin = Vec3::new(x, 1.0, 1.0);
        world.add(LoopJoint::spherical_at(format!("pin {t}"), &world, Some((bob, 0)), None, pin).unwrap()).unwrap();
    }
    world
}

type Build = fn(&str) -> World;
const WORLDS: [(&str, Build); 2] = [("pile", pile), ("towers", towers)];

/// Returns the bits of the state, of the report and of the contacts.
fn bits(world: &World) -> Vec<u64> {
    let forces = world.contacts().iter().flat_map(|c| c.force.iter().copied().collect::<Vec<f64>>());
    let report = world.report();
    let numbers = [report.residual, report.max_penetration, report.unconverged as f64, report.iterations as f64];
    world.state().iter().copied().chain(forces).chain(numbers).map(f64::to_bits).collect()
}

fn set_threads(world: &mut World, threads: u32) {
    world.set_settings(world.settings().with_threads(threads)).unwrap();
}

/// Returns the bits after every tenth of `frames` frames.
fn record(world: &mut World, frames: usize) -> Vec<Vec<u64>> {
    let mut record = Vec::new();
    for frame in 1..=frames {
        world.step().unwrap();
        if frame % 10 == 0 {
            record.push(bits(world));
        }
    }
    record
}

/// Compares half a second, or 2 s with `TUMBLE_SLOW`, on several threads with one thread.
fn compare(build: Build, stepper: &str) {
    let frames = if std::env::var_os("TUMBLE_SLOW").is_some() { 120 } else { 30 };
    let alone = record(&mut build(stepper), frames);
    assert!(alone.first() != alone.last(), "nothing moves");
    for threads in THREADS {
        let mut world = build(stepper);
        set_threads(&mut world, threads);
        let many = record(&mut world, frames);
        let first = alone.iter().zip(&many).position(|(a, b)| a != b);
        assert_eq!(first, None, "{stepper} on {threads} threads: first tenth frame that differs");
    }
}

#[test]
fn a_pile_has_the_same_bits_on_any_number_of_threads() {
    STEPPERS.iter().for_each(|stepper| compare(pile, stepper));
}

#[test]
fn towers_have_the_same_bits_on_any_number_of_threads() {
    STEPPERS.iter().for_each(|stepper| compare(towers, stepper));
}

/// The number of threads changes in the middle, along every way out of a world and into another.
#[test]
fn a_world_goes_on_with_the_same_bits_on_another_number_of_threads() {
    for (name, build) in WORLDS {
        for stepper in STEPPERS {
            let mut first = build(stepper);
            let template = first.fork();
            set_threads(&mut first, 2);
            record(&mut first, 30);
            let (saved, archived, mut before) = (first.save(), first.archive(&[]).unwrap(), WorldState::default());
            first.checkpoint(&mut before);
            let expected = record(&mut first, 30);
            let check = |mut world: World, threads: u32, way: &str| {
                set_threads(&mut world, threads);
                assert!(record(&mut world, 30) == expected, "{name}, {stepper}: {way} on {threads} threads");
            };
            let mut restored = template.fork();
            restored.restore(&saved).unwrap();
            check(restored.fork(), 1, "a restored snapshot, forked");
            check(restored, 3, "a restored snapshot");
            check(World::from_archive(&archived, &mut |_| None).unwrap(), 3, "an archive");
            assert!(first.roll_back(&before));
            check(first.fork(), 1, "a fork after a roll-back");
        }
    }
}

/// An archive has the same bytes on any number of threads; the world that is read has one.
#[test]
fn the_number_of_threads_is_no_part_of_an_archive() {
    let (mut one, mut two) = (towers("time_stepping"), towers("time_stepping"));
    set_threads(&mut two, 2);
    one.step().unwrap();
    two.step().unwrap();
    assert!(one.archive(&[]).unwrap() == two.archive(&[]).unwrap());
    let read = World::from_archive(&two.archive(&[]).unwrap(), &mut |_| None).unwrap();
    assert_eq!((two.settings().threads, two.fork().settings().threads, read.settings().threads), (2, 2, 1));
}

/// Sleeping bodies sleep on: nothing that they feel has changed.
#[test]
fn another_number_of_threads_wakes_nothing() {
    let sleep = tumble_core::Sleep { after: 0.1, ..Default::default() };
    let mut world = World::new(Settings::default().with_sleep(Some(sleep))).unwrap();
    world.add(RigidBody::fixed(Shape::half_space())).unwrap();
    let body = RigidBody::new(Shape::cuboid(Vec3::repeat(0.2)).unwrap()).with_pose(Pose::translation(0.0, 0.0, 0.1));
    let body = world.add(body).unwrap();
    for _ in 0..100 {
        world.step().unwrap();
    }
    assert!(world.view().asleep(body));
    set_threads(&mut world, 2);
    assert!(world.view().asleep(body));
    world.set_settings(world.settings().with_substeps(2)).unwrap();
    assert!(!world.view().asleep(body), "another setting wakes it");
}

/// Worlds share the threads of the process: several at once have the bits of one alone.
#[test]
fn worlds_that_step_at_the_same_time_have_the_same_bits() {
    let expected = record(&mut towers("time_stepping"), 30);
    let run = || {
        let mut world = towers("time_stepping");
        set_threads(&mut world, 2);
        record(&mut world, 30)
    };
    std::thread::scope(|scope| {
        let runs: Vec<_> = (0..4).map(|_| scope.spawn(run)).collect();
        for run in runs {
            assert!(run.join().unwrap() == expected);
        }
    });
}

#[test]
fn a_number_of_threads_above_the_maximum_is_an_error() {
    let error = World::new(Settings::default().with_threads(257)).err().unwrap();
    assert_eq!(error.to_string(), "threads is 257; it must be 0 to 256");
    assert!(World::new(Settings::default().with_threads(0)).is_ok());
}

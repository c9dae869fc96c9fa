//! Time of a frame with many particles.
//!
//! `cargo run --release -p tumble-behaviors --example particles -- [COUNT [THREADS]]` lets a fountain of that many
//! particles, 100,000 by default, rise and fall on a floor with a ball, a box and 20 pillars, at 60 Hz, and prints the mean time of a frame
//! over the second after all of them were born, the mean processor time of the calling thread in it, and a hash of the bytes of the world. `THREADS` is 1 and 2 unless it is given.

#![allow(clippy::disallowed_methods)] // what is measured need not have the same bits on every platform

use std::time::Instant;
use tumble_behaviors::{Emitter, ParticleSettings, ParticleSystem};
use tumble_core::prelude::*;

const FRAMES: u32 = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let numbers: Result<Vec<u32>, _> = std::env::args().skip(1).map(|number| number.parse()).collect();
    let numbers = numbers?;
    let count = numbers.first().copied().unwrap_or(100_000);
    let threads = numbers.get(1).map_or(vec![1, 2], |threads| vec![*threads]);
    println!("| particles alive | threads | frame, ms | its calling thread, processor ms | hash |");
    println!("|---|---|---|---|---|");
    threads.into_iter().try_for_each(|threads| measure(count, threads))
}

fn measure(count: u32, threads: u32) -> Result<(), Box<dyn std::error::Error>> {
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0).with_threads(threads))?;
    world.add(RigidBody::fixed(Shape::half_space()))?;
    let ball = RigidBody::new(Shape::sphere(0.5)?).with_pose(Pose::translation(1.0, 0.0, 0.5));
    world.add(ball)?;
    let table = RigidBody::new(Shape::cuboid(Vec3::new(1.0, 1.0, 0.4))?).with_pose(Pose::translation(-1.5, 0.0, 0.2));
    world.add(table)?;
    for k in 0..20 {
        let angle = f64::from(k) * 0.314_159;
        let pillar = RigidBody::fixed(Shape::cylinder(0.1, 1.0)?);
        world.add(pillar.with_pose(Pose::translation(3.0 * angle.cos(), 3.0 * angle.sin(), 0.5)))?;
    }
    let emitter = Emitter {
        radius: 0.1,
        speed: [4.0, 9.0],
        half_angle: 0.6,
        lifetime: [4.0, 5.0],
        end: 2.0,
        ..Emitter::stream(Pose::translation(0.0, 0.0, 0.3), f64::from(count) / 2.0)
    };
    let settings = ParticleSettings {
        capacity: count as usize,
        linear_drag: 0.2,
        wind: Vec3::new(0.5, 0.0, 0.0),
        material: Material { restitution: 0.4, ..Material::default() },
        ..ParticleSettings::default()
    };
    let system = world.add(ParticleSystem::new("sparks", settings)?.with_emitter(emitter)?)?;
    (0..2 * FRAMES + 30).try_for_each(|_| world.step().map(drop))?;
    let (start, spent) = (Instant::now(), processor_s());
    (0..FRAMES).try_for_each(|_| world.step().map(drop))?;
    let [frame, caller] = [start.elapsed().as_secs_f64(), processor_s() - spent].map(|s| 1e3 * s / f64::from(FRAMES));
    let alive = ParticleSystem::particles(&world, system).map_or(0, Iterator::count);
    let hash = world
        .save()
        .iter()
        .fold(0xcbf2_9ce4_8422_2325u64, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3));
    println!("| {alive} | {threads} | {frame:.1} | {caller:.1} | {hash:016x} |");
    Ok(())
}

/// Returns the processor time of this thread so far, s; only Linux reports it, elsewhere it is 0.
fn processor_s() -> f64 {
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap_or_default();
    spent.split_whitespace().next().and_then(|nanoseconds| nanoseconds.parse().ok()).map_or(0.0, |s: f64| 1e-9 * s)
}

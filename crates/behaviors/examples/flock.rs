//! Time of a step of flocks of boids.
//!
//! `cargo run --release -p tumble-behaviors --example flock -- [COUNT…]` prints, for 1,000 and 10,000 boids unless counts are given,
//! the processor time of a step at 60 Hz on one thread, that of the forces alone, the clock time of a step on two threads, and the processor
//! time of the calling one of them, which the clock time is on a machine that does nothing else. Each is the median over two seconds of simulated time after one of warm-up, with the least in brackets: programs that share the
//! processor make a step longer, and none makes it shorter. Brute force runs up to 2,000 boids.

#![allow(clippy::disallowed_methods)] // what is measured need not have the same bits on every platform

use std::time::{Duration, Instant};
use tumble_behaviors::{Boid, Flock, Flyer, Search, Steering};
use tumble_core::prelude::*;

const FRAMES: u32 = 120;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let counts: Result<Vec<usize>, _> = std::env::args().skip(1).map(|count| count.parse()).collect();
    let counts = Some(counts?).filter(|counts| !counts.is_empty()).unwrap_or_else(|| vec![1000, 10_000]);
    println!(
        "| boids | search | step, processor ms | forces alone, processor ms | step on two threads, ms | its calling thread, processor ms | neighbors in reach |"
    );
    println!("|---|---|---|---|---|---|---|");
    for count in counts {
        measure(count, Search::Grid)?;
        if count <= 2000 {
            measure(count, Search::BruteForce)?;
        }
    }
    Ok(())
}

fn measure(count: usize, search: Search) -> Result<(), Box<dyn std::error::Error>> {
    let steering = Steering::default();
    let mut world = flock(count, search, &steering, 1)?;
    let mut parallel = flock(count, search, &steering, 2)?;
    let [mut steps, mut forces, mut both, mut caller] = [const { Vec::new() }; 4];
    for frame in 0..FRAMES + FRAMES / 2 {
        let start = processor_time();
        world.step()?;
        let step = processor_time() - start;
        let flyers = flyers(&world);
        let (start, spent) = (Instant::now(), processor_time());
        parallel.step()?;
        let (parallel, calling) = (start.elapsed(), processor_time() - spent);
        let start = processor_time();
        let sum: Vec3 = steering.forces(search, &flyers).into_iter().sum();
        let force = processor_time() - start;
        assert!(sum.norm().is_finite());
        if frame >= FRAMES / 2 {
            steps.push(step);
            forces.push(force);
            both.push(parallel);
            caller.push(calling);
        }
    }
    assert_eq!(world.state(), parallel.state());
    let near = neighbors(&flyers(&world), steering.visibility_distance);
    let [steps, forces, both, caller] = [steps, forces, both, caller].map(shown);
    println!("| {count} | {search:?} | {steps} | {forces} | {both} | {caller} | {near:.1} |");
    Ok(())
}

/// Returns the processor time of this thread; only Linux reports it, elsewhere it is that of the clock.
fn processor_time() -> Duration {
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let spent = spent.and_then(|text| text.split_whitespace().next()?.parse().ok());
    spent.map_or_else(
        || std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default(),
        Duration::from_nanos,
    )
}

/// Returns the median and the least of some times, ms.
fn shown(mut times: Vec<Duration>) -> String {
    times.sort();
    let ms = |time: Duration| 1e3 * time.as_secs_f64();
    format!("{:.2} ({:.2})", ms(times[times.len() / 2]), ms(times[0]))
}

fn flock(count: usize, search: Search, steering: &Steering, threads: u32) -> Result<World, Box<dyn std::error::Error>> {
    let settings = Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::zeros()).with_threads(threads);
    let mut world = World::new(settings)?;
    let flock = world.add(Flock::new("flock", *steering)?.with_search(search))?;
    for k in 0..count {
        let boid = Boid::new(Shape::sphere(0.1)?, 1.0)?;
        let (position, velocity) = (spread(k, count), spread(k * 7919 % count, count).normalize());
        Flock::add(&mut world, flock, boid.with_position(position).with_velocity(10.0 * velocity))?;
    }
    Ok(world)
}

/// Returns a point of a sphere filled with one boid in 27 m³, m.
fn spread(k: usize, count: usize) -> Vec3 {
    let share = (k as f64 + 0.5) / count as f64;
    let (height, turn) = (1.0 - 2.0 * (k as f64 * 0.754_877_666 % 1.0), k as f64 * 2.399_963);
    let across = (1.0 - height * height).sqrt();
    let radius = 3.0 * (0.75 / std::f64::consts::PI * count as f64 * share).cbrt();
    radius * Vec3::new(across * turn.cos(), across * turn.sin(), height)
}

fn flyers(world: &World) -> Vec<Flyer> {
    let flyer = |part: &tumble_core::PartState| Flyer {
        position: part.position(),
        velocity: part.velocity,
        forward: part.pose.rotation * Vec3::x(),
        mass: 1.0,
    };
    world.part_states().iter().map(flyer).collect()
}

/// Returns the mean number of boids within reach of one, m, of a hundred of them.
fn neighbors(flyers: &[Flyer], reach: f64) -> f64 {
    let some = flyers.iter().step_by(flyers.len().div_ceil(100));
    let counts: Vec<usize> =
        some.map(|a| flyers.iter().filter(|b| (a.position - b.position).norm() < reach).count() - 1).collect();
    counts.iter().sum::<usize>() as f64 / counts.len() as f64
}

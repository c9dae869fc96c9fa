//! Time of a step of flocks of boids.
//!
//! `cargo run --release -p tumble-behaviors --example flock -- [COUNT…]` prints the mean over a
//! second of simulated time after one of warm-up, on one and two threads: 1,000 and 10,000 boids unless counts
//! are given; and the time of the forces alone, on one thread. Brute force runs up to 2,000 boids.

use std::time::Instant;
use tumble_behaviors::{Boid, Flock, Search, Steering};
use tumble_core::prelude::*;

const FRAMES: u32 = 60;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let counts: Result<Vec<usize>, _> = std::env::args().skip(1).map(|count| count.parse()).collect();
    let counts = Some(counts?).filter(|counts| !counts.is_empty()).unwrap_or_else(|| vec![1000, 10_000]);
    println!("| boids | search | threads | step, ms | the forces on one thread, ms | neighbors in reach |");
    println!("|---|---|---|---|---|---|");
    for count in counts {
        for threads in [1, 2] {
            measure(count, Search::Grid, threads)?;
        }
        if count <= 2000 {
            measure(count, Search::BruteForce, 1)?;
        }
    }
    Ok(())
}

fn measure(count: usize, search: Search, threads: u32) -> Result<(), Box<dyn std::error::Error>> {
    let steering = Steering::default();
    let settings = Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::zeros()).with_threads(threads);
    let mut world = World::new(settings)?;
    let flock = world.add(Flock::new("flock", steering)?.with_search(search))?;
    for k in 0..count {
        let boid = Boid::new(Shape::sphere(0.1)?, 1.0)?;
        let (position, velocity) = (spread(k, count), spread(k * 7919 % count, count).normalize());
        Flock::add(&mut world, flock, boid.with_position(position).with_velocity(10.0 * velocity))?;
    }
    (0..FRAMES).try_for_each(|_| world.step().map(drop))?;
    let start = Instant::now();
    (0..FRAMES).try_for_each(|_| world.step().map(drop))?;
    let step = start.elapsed().as_secs_f64() / f64::from(FRAMES);
    let (forces, near) = forces(&world, &steering, search);
    println!("| {count} | {search:?} | {threads} | {:.2} | {:.2} | {near:.1} |", 1e3 * step, 1e3 * forces);
    Ok(())
}

/// Returns a point of a sphere filled with one boid in 27 m³, m.
fn spread(k: usize, count: usize) -> Vec3 {
    let share = (k as f64 + 0.5) / count as f64;
    let (height, turn) = (1.0 - 2.0 * (k as f64 * 0.754_877_666 % 1.0), k as f64 * 2.399_963);
    let across = (1.0 - height * height).sqrt();
    let radius = 3.0 * (0.75 / std::f64::consts::PI * count as f64 * share).cbrt();
    radius * Vec3::new(across * turn.cos(), across * turn.sin(), height)
}

/// Returns the time of the forces alone, s, and the mean number of boids within reach of one.
fn forces(world: &World, steering: &Steering, search: Search) -> (f64, f64) {
    let parts = world.part_states();
    let flyers = parts.iter().map(|part| tumble_behaviors::Flyer {
        position: part.position(),
        velocity: part.velocity,
        forward: part.pose.rotation * Vec3::x(),
        mass: 1.0,
    });
    let flyers: Vec<_> = flyers.collect();
    let start = Instant::now();
    let sum: Vec3 = steering.forces(search, &flyers).into_iter().sum();
    let time = start.elapsed().as_secs_f64();
    assert!(sum.norm().is_finite());
    let reach = steering.visibility_distance;
    let some = flyers.iter().step_by(flyers.len().div_ceil(100));
    let counts: Vec<usize> =
        some.map(|a| flyers.iter().filter(|b| (a.position - b.position).norm() < reach).count() - 1).collect();
    (time, counts.iter().sum::<usize>() as f64 / counts.len() as f64)
}

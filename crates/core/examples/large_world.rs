//! Time per step of a ball that falls and bounces among N bodies at rest.
//!
//! ```text
//! cargo run --release -p tumble-core --example large_world                     1,000 to 100,000
//! cargo run --release -p tumble-core --example large_world -- 1000000          one number
//! ```
//!
//! | bodies | |
//! |---|---|
//! | `fixed` | fixed cubes on a grid |
//! | `asleep` | cubes on a half-space, which have fallen asleep |
//!
//! `rest` is the time of the same step without the bodies at rest, taken in the same run.

use std::time::Instant;
use tumble_core::Sleep;
use tumble_core::prelude::*;

/// Frames until everything is at rest, and frames that are measured.
const FRAMES: [usize; 2] = [60, 120];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sizes: Vec<usize> = std::env::args().skip(1).map(|n| n.parse()).collect::<Result<_, _>>()?;
    let sizes = if sizes.is_empty() { vec![1_000, 10_000, 100_000] } else { sizes };
    let alone = measure(0, false)?;
    println!("ms per step, median of {} frames; {alone:.4} without bodies at rest\n", FRAMES[1]);
    println!("| bodies at rest | fixed | per 100,000 | asleep | per 100,000 |\n|---|---|---|---|---|");
    for n in sizes {
        let times = [measure(n, false)?, measure(n, true)?];
        let [fixed, asleep] = times.map(|time| format!("{time:.4} | {:.4}", (time - alone) * 1e5 / n as f64));
        println!("| {n} | {fixed} | {asleep} |");
    }
    Ok(())
}

/// Returns the median time of a step among `n` bodies, ms.
fn measure(n: usize, asleep: bool) -> Result<f64, Box<dyn std::error::Error>> {
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0).with_sleep(Some(Sleep::default())))?;
    world.add(RigidBody::fixed(Shape::half_space()))?;
    let (cube, row) = (Shape::cuboid(Vec3::repeat(0.5))?, n.isqrt().max(1));
    for i in 0..n {
        let pose = Pose::translation((i % row) as f64, (i / row) as f64, 0.25);
        let body = if asleep { RigidBody::new(cube.clone()) } else { RigidBody::fixed(cube.clone()) };
        world.add(body.with_pose(pose))?;
    }
    for _ in 0..FRAMES[0] {
        world.step()?;
    }
    // it falls beside the grid and disturbs nothing
    let ball = RigidBody::new(Shape::sphere(0.1)?).with_pose(Pose::translation(-2.0, 0.5, 3.0));
    world.add(ball)?;
    let mut times = Vec::with_capacity(FRAMES[1]);
    for _ in 0..FRAMES[1] {
        let start = Instant::now();
        world.step()?;
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    Ok(times[FRAMES[1] / 2])
}

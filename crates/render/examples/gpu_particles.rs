//! Time of a frame of particles on the graphics device. The example `particles` of `tumble-behaviors` has that of the processor.
//!
//! `cargo run --release -p tumble-render --example gpu_particles -- [COUNT…]` prints, for 100,000 and 1,000,000 particles unless counts
//! are given (at most a million), ms of the clock per frame of 1/60 s in both precisions: with one submission a frame, and with all frames
//! in a row. Ten seconds of particles that fall on a slope, a sphere and a box.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use std::time::{Duration, Instant};
use tumble_render::{FreeParticle, FreeParticles, GpuParticles, Obstacle, ObstacleShape, Precision, RenderError};

const FRAMES: u32 = 600;

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let counts: Result<Vec<usize>, _> = std::env::args().skip(1).map(|count| count.parse()).collect();
    let counts = Some(counts?).filter(|counts| !counts.is_empty()).unwrap_or_else(|| vec![100_000, 1_000_000]);
    let obstacles = [
        obstacle(ObstacleShape::HalfSpace, Vector3::zeros(), Vector3::new(0.05, 0.02, 0.0)),
        obstacle(ObstacleShape::Sphere(1.5), Vector3::new(2.0, 0.0, 0.5), Vector3::zeros()),
        obstacle(
            ObstacleShape::Box(Vector3::new(3.0, 3.0, 1.0)),
            Vector3::new(-2.0, 0.0, 0.6),
            Vector3::new(0.3, -0.2, 0.1),
        ),
    ];
    println!(
        "| particles | precision | device, a frame at a time | device, frames in a row | adapter |\n|---|---|---|---|---|"
    );
    for count in counts {
        let start = fallen(count);
        for precision in [Precision::Single, Precision::Double] {
            let constants = FreeParticles { linear_drag: 0.1, precision, ..FreeParticles::default() };
            match GpuParticles::new(&constants, &obstacles, &start) {
                Ok(device) => row(count, precision, device)?,
                Err(RenderError::Device { reason, .. }) if precision == Precision::Double => println!("{reason}"),
                Err(other) => return Err(other.into()),
            }
        }
    }
    Ok(())
}

fn row(count: usize, precision: Precision, mut device: GpuParticles) -> Result<(), Failure> {
    device.advance(10)?; // pipelines and memory are made at the first
    let begin = Instant::now();
    for _ in 0..FRAMES {
        device.advance(1)?;
    }
    let single = begin.elapsed();
    let begin = Instant::now();
    device.advance(FRAMES)?;
    let all = begin.elapsed();
    let ms = |time: Duration| 1e3 * time.as_secs_f64() / f64::from(FRAMES);
    println!("| {count} | {precision:?} | {:.3} | {:.3} | {} |", ms(single), ms(all), device.adapter());
    Ok(())
}

fn obstacle(shape: ObstacleShape, position: Vector3<f64>, turn: Vector3<f64>) -> Obstacle {
    let pose = Isometry3::from_parts(position.into(), UnitQuaternion::from_scaled_axis(turn));
    Obstacle { shape, pose, restitution: 0.6, friction: 0.3 }
}

/// A fixed cloud of particles above the obstacles.
fn fallen(count: usize) -> Vec<FreeParticle> {
    let number = |k: usize, ratio: f64| 2.0 * ((k as f64 + 0.5) * ratio % 1.0) - 1.0;
    let point =
        |k: usize| Vector3::new(number(k, 0.819_172_513_4), number(k, 0.671_043_606_7), number(k, 0.549_700_477_9));
    let particle = |k: usize| FreeParticle {
        position: Vector3::new(0.0, 0.0, 6.0) + 3.0 * point(k),
        velocity: 2.0 * point(k + 7919),
        life: 1e6,
    };
    (0..count).map(particle).collect()
}

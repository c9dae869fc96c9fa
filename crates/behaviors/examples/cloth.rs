//! Time of a frame with a stiff cloth.
//!
//! `cargo run --release -p tumble-behaviors --example cloth -- [SIDE]` hangs a square cloth of that many nodes along each edge, 20 by default,
//! with springs of 1e6 N/m by two corners, at 60 Hz, and prints the mean time of a frame over two seconds.

use std::time::Instant;
use tumble_behaviors::{Cloth, SpringMesh};
use tumble_core::prelude::*;

const FRAMES: u32 = 120;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let side = std::env::args().nth(1).map_or(Ok(20), |side| side.parse())?;
    let mut world = World::new(Settings::default().with_dt(1.0 / 60.0))?;
    let cloth = Cloth { nodes: [side; 2], stiffness: [1e6, 1e6, 1e4], ..Cloth::default() };
    let cloth = SpringMesh::add(&mut world, cloth.mesh()?.with_pins(|x| x.x.abs() > 0.499 && x.y > 0.499))?;
    let start = Instant::now();
    (0..FRAMES).try_for_each(|_| world.step().map(drop))?;
    let frame = start.elapsed().as_secs_f64() / f64::from(FRAMES);
    let nodes = SpringMesh::positions(&world, cloth).unwrap_or_default();
    let lowest = nodes.iter().map(|node| node.z).fold(0.0, f64::min);
    println!("{} nodes: {:.2} ms a frame; the lowest hangs at {lowest:.6} m", nodes.len(), 1e3 * frame);
    Ok(())
}

//! Steps a scene on request: for each input line with a number it takes that many steps and prints
//! a line with the frame.
//!
//!     cargo build --release -p tumble --example steps && echo 240 | target/release/examples/steps billiards
//!
//! The time between two lines is the time of stepping in Rust: `benches/python/costs.py` compares
//! it with a loop in Python.

use std::io::{BufRead, Write, stdin, stdout};
use tumble::scene::resolve_scene;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = std::env::args().nth(1).ok_or("usage: steps SCENE")?;
    let (mut world, _) = resolve_scene(&scene, &[])?.load()?.build()?;
    for line in stdin().lock().lines() {
        for _ in 0..line?.trim().parse::<u64>()? {
            world.step()?;
        }
        println!("{}", world.frame());
        stdout().flush()?;
    }
    Ok(())
}

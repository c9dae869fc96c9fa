//! Steps a scene as it is told: for every line with a number on its input that many steps, and a line with the frame when they are done.
//!
//!     cargo build --release -p tumble --example steps && echo 240 | target/release/examples/steps billiards
//!
//! What the program takes between two lines is what stepping takes in Rust: `benches/python/costs.py` compares it with a loop in Python.

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

//! What a user waits for when a scene with a mesh starts: its shape made for the first time, and with its tree from the cache.
//!
//! `cargo run --release -p tumble-collide --example shape_cost -- MESH.obj…` prints seconds by the clock on the wall and of CPU, medians of three.

mod cpu;

use cpu::cpu_seconds;
use std::error::Error;
use std::time::Instant;
use tumble_collide::{Shape, TreeCache, TreeSettings, TriMesh};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("tumble-shape-cost-{}", std::process::id()));
    println!("| mesh | triangles | first time, s (CPU s) | tree from the cache |\n|---|---|---|---|");
    for path in std::env::args().skip(1) {
        let mut mesh = TriMesh::from_obj(&std::fs::read_to_string(&path)?)?;
        mesh.check_closed()?;
        let cache = TreeCache::at(&folder);
        let mut times = [Vec::new(), Vec::new()];
        for _ in 0..3 {
            let _ = std::fs::remove_dir_all(&folder);
            for times in &mut times {
                let (start, before) = (Instant::now(), cpu_seconds());
                Shape::mesh_cached(mesh.clone(), &TreeSettings::octree(), &cache)?;
                times.push((start.elapsed().as_secs_f64(), cpu_seconds() - before));
            }
        }
        let [first, again] = times.map(|mut times| {
            times.sort_by(|a, b| a.0.total_cmp(&b.0));
            format!("{:.3} ({:.3})", times[1].0, times[1].1)
        });
        println!("| {} | {} | {first} | {again} |", path.rsplit('/').next().unwrap_or(&path), mesh.triangles.len());
    }
    let _ = std::fs::remove_dir_all(&folder);
    Ok(())
}

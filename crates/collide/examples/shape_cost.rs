//! Measures the start of a scene with a mesh: file and shape without and with the cache, and the
//! first contact.
//!
//! `cargo run --release -p tumble-collide --example shape_cost -- MESH…` prints CPU seconds and
//! peak memory of whole processes, one per run. A mesh is an OBJ file, `FILE.obj@COUNT` for that
//! file refined to this number of triangles with some noise, or `bumps@N`: an icosphere divided N
//! times, with bumps.

#![allow(clippy::disallowed_methods)] // what is measured need not have the same bits on every platform

mod cpu;
mod refine;

use cpu::{cpu_seconds, peak_megabytes};
use std::error::Error;
use std::path::PathBuf;
use std::process::Command;
use tumble_collide::{Pose, Quat, Shape, TreeCache, TreeSettings, TriMesh, Vec3, contacts};

const ONCE: &str = "--once";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [once, file] = &arguments[..]
        && once == ONCE
    {
        return measure(file);
    }
    let folder = std::env::temp_dir().join(format!("tumble-shape-cost-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    println!("| mesh | triangles | first time: CPU s, MB | again | two that touch, first time | again, MB |");
    println!("|---|---|---|---|---|---|");
    for name in &arguments {
        let file = folder.join("mesh.obj");
        let mesh = made(name)?;
        std::fs::write(&file, text_of(&mesh))?;
        let run = || {
            let child = Command::new(std::env::current_exe()?)
                .args([ONCE.as_ref(), file.as_os_str()])
                .env("TUMBLE_CACHE", folder.join("cache"))
                .output()?;
            let said = String::from_utf8(child.stdout)?;
            Ok::<_, Box<dyn Error>>(said.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
        };
        let (first, again) = (run()?, run()?);
        if first.len() != 5 || again.len() != 5 {
            return Err(format!("{name}: the measurement failed").into());
        }
        let short = name.rsplit('/').next().unwrap_or(name);
        println!(
            "| {short} | {} | {}, {} | {}, {} | {} | {}, {} |",
            mesh.triangles.len(),
            first[0],
            first[1],
            again[0],
            again[1],
            first[2],
            again[2],
            again[3]
        );
        std::fs::remove_dir_all(folder.join("cache"))?;
    }
    Ok(std::fs::remove_dir_all(&folder)?)
}

/// Loads a mesh, moves a copy towards it in several places, and prints the total cost.
fn measure(file: &str) -> Result<(), Box<dyn Error>> {
    let mesh = TriMesh::from_obj(&std::fs::read_to_string(file)?)?;
    let (shape, note) = Shape::mesh_cached(mesh, &TreeSettings::octree(), &TreeCache::of_environment())?;
    if let Some(note) = note {
        return Err(note.into());
    }
    let (loaded, peak) = (cpu_seconds(), peak_megabytes());
    let touching = touch(&shape);
    println!("{loaded:.2} {peak:.0} {:.2} {:.0} {touching}", cpu_seconds() - loaded, peak_megabytes());
    Ok(())
}

/// Moves a copy along x in steps until it touches, in ten places. Returns the number of contacts.
fn touch(shape: &Shape) -> usize {
    let size = shape.bounding_radius();
    let mut count = 0;
    for n in 0..10 {
        let turn = Quat::from_euler_angles(f64::from(n), 0.7 * f64::from(n), 0.3 * f64::from(n));
        let mut found = Vec::new();
        for step in (0..400).rev() {
            let pose = Pose::from_parts(Vec3::new(0.005 * f64::from(step) * size, 0.0, 0.0).into(), turn);
            contacts(shape, &Pose::identity(), shape, &pose, 1e-3 * size, &mut found);
            if !found.is_empty() {
                break;
            }
        }
        count += found.len();
    }
    count
}

fn made(name: &str) -> Result<TriMesh, Box<dyn Error>> {
    let Some((what, count)) = name.split_once('@') else {
        return Ok(TriMesh::from_obj(&std::fs::read_to_string(PathBuf::from(name))?)?);
    };
    if what == "bumps" {
        return Ok(refine::bumps(count.parse()?));
    }
    Ok(refine::refined(&TriMesh::from_obj(&std::fs::read_to_string(what)?)?, count.parse()?))
}

fn text_of(mesh: &TriMesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {:.9} {:.9} {:.9}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    vertices.chain(faces).collect()
}

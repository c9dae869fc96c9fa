//! Prints the table of the documentation: trees of the public meshes by every method, compared with
//! the toolkit of 2003.
//!
//! `cargo run --release -p tumble-collide --example sphere_trees -- MESHES [DEPTH] [METHOD…]`, with
//! a folder of OBJ files. Reference: trees of the toolkit of Bradshaw and O'Sullivan (2003; method
//! medial, branch 8), measured by the same definitions: as built, and modified to cover and nest.

mod cpu;

use cpu::cpu_seconds;
use std::error::Error;
use tumble_collide::{Builder, QualitySettings, SphereTree, TreeSettings, TriMesh};

/// Mesh, depth; worst and mean outward error at that level over the diagonal, worst error of the
/// trees modified to cover and nest, CPU seconds.
const REFERENCE: [(&str, u32, f64, f64, f64, f64); 7] = [
    ("spot", 2, 0.0228, 0.0094, 0.0256, 26.4),
    ("spot", 3, 0.0097, 0.0025, f64::NAN, 98.6),
    ("panda_link5", 2, 0.0244, 0.0093, 0.0294, 11.2),
    ("bunny1500", 2, 0.0545, 0.0150, 0.0555, 23.7),
    ("fandisk1500", 2, 0.0593, 0.0229, 0.0597, 28.2),
    ("fertility1500", 2, 0.0506, 0.0205, 0.0576, 34.7),
    ("hand1500", 2, 0.0338, 0.0127, 0.0340, 33.0),
];

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let folder = words.next().ok_or("expected a folder of OBJ files")?;
    let depth = words.next().map_or(Ok(2), |word| word.parse())?;
    let named: Vec<String> = words.collect();
    let all = [
        ("octree", Builder::Octree),
        ("grid", Builder::Grid),
        ("hubbard", Builder::Hubbard),
        ("medial", Builder::Medial),
    ];
    let methods = all.iter().filter(|(name, _)| named.is_empty() || named.iter().any(|n| n == name));
    let mut files: Vec<_> = std::fs::read_dir(folder)?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| p.extension().is_some_and(|e| e == "obj"))
        .collect();
    files.sort();
    println!(
        "| mesh | method | spheres | worst % | mean % | at most % | covered % | sticking out | volume | CPU s | toolkit worst / mean % | covering and nesting | CPU s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (name, builder) in methods {
        for file in &files {
            let mut mesh = TriMesh::from_obj(&std::fs::read_to_string(file)?)?;
            mesh.check_closed()?;
            let before = cpu_seconds();
            let tree = SphereTree::build(
                &mesh,
                &TreeSettings { builder: *builder, branch: 8, depth, error: 1e-4, even: false },
            )?;
            let taken = cpu_seconds() - before;
            let rows = tree.quality(&mesh, &QualitySettings::default());
            let Some(q) = rows.last() else { continue };
            let mesh_name = file.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
            let reference = REFERENCE.iter().find(|r| r.0 == mesh_name && r.1 == depth);
            let beside = reference.map_or("| | |".into(), |(_, _, worst, mean, nesting, cpu)| {
                let nesting = if nesting.is_nan() { String::new() } else { format!("{:.2}", 100.0 * nesting) };
                format!("{:.2} / {:.2} | {nesting} | {cpu} |", 100.0 * worst, 100.0 * mean)
            });
            println!(
                "| {mesh_name} | {name} | {} | {:.2} | {:.2} | {:.2} | {:.2} | {} | {:.3} | {taken:.2} | {beside}",
                q.spheres,
                100.0 * q.protrusion_max,
                100.0 * q.protrusion_mean,
                100.0 * tree.outward_error() / mesh.diagonal(),
                100.0 * q.coverage,
                rows.iter().map(|r| r.nesting_broken).sum::<usize>(),
                q.volume_ratio,
            );
        }
    }
    Ok(())
}

//! Builds a tree and writes its levels as JSON: `tree_figures MESH DEPTH OUT [BUILDER]`.

use std::error::Error;
use tumble_collide::{Builder, SphereTree, TreeSettings, TriMesh};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().collect();
    let [_, mesh, depth, out, rest @ ..] = &args[..] else {
        return Err("tree_figures MESH DEPTH OUT [BUILDER]".into());
    };
    let builder = match rest.first().map(String::as_str) {
        Some("grid") => Builder::Grid,
        Some("hubbard") => Builder::Hubbard,
        Some("octree") => Builder::Octree,
        _ => Builder::Medial,
    };
    let mesh = TriMesh::from_obj(&std::fs::read_to_string(mesh)?)?;
    let settings = TreeSettings { builder, depth: depth.parse()?, ..TreeSettings::default() };
    let (tree, stages) = SphereTree::build_with_progress(&mesh, &settings, &())?;
    for s in stages {
        println!("level {} {}: {}", s.level, s.stage, s.count);
    }
    let levels: Vec<_> = tree
        .level_lists()
        .iter()
        .map(|level| {
            let sphere = |b: &tumble_collide::LevelSphere| {
                let parent = b.parent.map_or(-1, |p| p as i64);
                serde_json::json!({ "c": [b.center.x, b.center.y, b.center.z], "r": b.radius, "parent": parent })
            };
            level.iter().map(sphere).collect::<Vec<_>>()
        })
        .collect();
    std::fs::write(out, serde_json::json!({ "levels": levels }).to_string())?;
    Ok(())
}

//! Builds a tree and writes its levels as JSON: `tree_figures MESH DEPTH OUT [BUILDER]`.
use std::io::Write;
use tumble_collide::{Builder, SphereTree, TreeSettings, TriMesh};

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let text = std::fs::read_to_string(&args[1]).expect("mesh");
    let mesh = TriMesh::from_obj(&text).expect("obj");
    let builder = match args.get(4).map_or("medial", String::as_str) {
        "grid" => Builder::Grid,
        "hubbard" => Builder::Hubbard,
        "octree" => Builder::Octree,
        _ => Builder::Medial,
    };
    let settings = TreeSettings { builder, branch: 8, depth: args[2].parse().expect("depth"), error: 1e-4, even: false };
    let start = std::time::Instant::now();
    let (tree, stages) = SphereTree::build_watched(&mesh, &settings, &()).expect("tree");
    eprintln!("{:?} wall", start.elapsed());
    for s in stages {
        eprintln!("{s:?}");
    }
    let mut out = std::fs::File::create(&args[3]).expect("out");
    let nodes = tree.nodes();
    let mut parent = vec![0_usize; nodes.len()];
    for (n, node) in nodes.iter().enumerate() {
        node.child_range().for_each(|c| parent[c] = n);
    }
    let mut levels = Vec::new();
    let mut place = vec![usize::MAX; nodes.len()];
    for level in 0..tree.levels() {
        let mut rows = Vec::new();
        let mut next = place.clone();
        for (n, node) in nodes.iter().enumerate() {
            if node.level == level || (node.level < level && node.is_leaf()) {
                let up = if level == 0 { -1 } else if node.level == level { place[parent[n]] as i64 } else { place[n] as i64 };
                next[n] = rows.len();
                let c = node.center;
                rows.push(format!(r#"{{"c":[{},{},{}],"r":{},"parent":{up}}}"#, c.x, c.y, c.z, node.radius));
            }
        }
        place = next;
        levels.push(format!("[{}]", rows.join(",")));
    }
    writeln!(out, r#"{{"levels":[{}]}}"#, levels.join(",")).expect("write");
}

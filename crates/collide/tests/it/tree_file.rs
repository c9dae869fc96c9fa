//! Trees as JSON: the same bits back, wrong texts refused, and the figures of an outside program on what is written.

use std::path::{Path, PathBuf};
use std::process::Command;
use tumble_collide::{LevelQuality, MeshId, QualitySettings, SphereTree, TreeFile, TreeFileError, TreeSettings, TriMesh, Vec3};

fn file(mesh: &TriMesh, depth: u32) -> TreeFile {
    // an error at which some leaves are above the last level
    let settings = TreeSettings { depth, error: 0.03, ..TreeSettings::default() };
    let (tree, stages) = SphereTree::build_watched(mesh, &settings, &()).unwrap();
    let few = QualitySettings { surface_samples: 500, sphere_samples: 500, volume_samples: 500, ..QualitySettings::default() };
    TreeFile { name: "a \"ring\"\n".into(), mesh: MeshId::of(mesh), settings, stages, quality: tree.quality(mesh, &few), tree }
}

#[test]
fn a_tree_comes_back_with_the_same_bits() {
    for (mesh, depth) in [(TriMesh::torus(1.0, 0.3, 48, 24), 6), (TriMesh::box_(Vec3::new(0.1, 1.0 / 3.0, 1e-4)), 5), (TriMesh::icosphere(1e-7, 2), 1)] {
        let file = file(&mesh, depth);
        let leaf_levels: Vec<u32> = file.tree.leaves().map(|l| l.level).collect();
        let text = file.to_json();
        let back = TreeFile::from_json(&text).unwrap();
        assert_eq!(back, file);
        assert_eq!(back.to_json(), text);
        eprintln!("{} balls, leaves at levels {:?} to {:?}", file.tree.nodes().len(), leaf_levels.iter().min(), leaf_levels.iter().max());
    }
}

#[test]
fn every_level_in_the_text_stands_for_the_solid() {
    let mesh = TriMesh::cylinder(0.2, 1.0, 24);
    let file = file(&mesh, 6);
    let text: serde_json::Value = serde_json::from_str(&file.to_json()).unwrap();
    let levels = text["levels"].as_array().unwrap();
    assert_eq!(levels.len(), file.tree.levels() as usize);
    let uneven = (0..file.tree.levels()).any(|l| file.tree.leaves().any(|leaf| leaf.level < l));
    assert!(uneven, "no leaf is carried down: the test shows nothing");
    for (n, level) in levels.iter().enumerate() {
        assert_eq!(level.as_array().unwrap().len(), file.tree.at_level(n as u32).count());
    }
}

/// A small good text to damage: a root with two leaves and one of them divided.
const GOOD: &str = r#"{"format":"tumble sphere tree","version":1,"name":"","units":"m","mesh":{"blake3":"","triangles":4,"diagonal":1.0},
"settings":{"builder":"octree","branch":8,"depth":2,"error":0.1,"even":true},"stages":[],"quality":[],
"levels":[[{"c":[0,0,0],"r":4,"out":1,"parent":-1}],[{"c":[1,0,0],"r":2,"out":1,"parent":0},{"c":[-1,0,0],"r":3,"out":1,"parent":0}],
[{"c":[1,0,0],"r":2,"out":1,"parent":0},{"c":[-2,0,0],"r":2,"out":1,"parent":1},{"c":[0,0,0],"r":2,"out":1,"parent":1}]]}"#;

#[test]
fn a_leaf_that_is_carried_down_is_one_ball() {
    let tree = TreeFile::from_json(GOOD).unwrap().tree;
    let said: Vec<(f64, u32, u32, u32)> = tree.nodes().iter().map(|n| (n.center.x, n.level, n.first_child, n.children)).collect();
    assert_eq!(said, [(0.0, 0, 1, 2), (1.0, 1, 0, 0), (-1.0, 1, 3, 2), (-2.0, 2, 0, 0), (0.0, 2, 0, 0)]);
}

#[test]
fn wrong_texts_are_refused_with_the_place_and_what_would_be_right() {
    let cases = [
        ("\"version\":1", "\"version\":2", "of version 2; what is read is a \"tumble sphere tree\" of version 1"),
        ("tumble sphere tree", "other", "it is a \"other\""),
        ("\"units\":\"m\"", "\"units\":\"mm\"", "units are \"mm\"; a sphere tree is in \"m\""),
        ("\"name\":\"\"", "\"nam\":\"\"", "unknown field `nam`"),
        ("\"octree\"", "\"oct\"", "unknown variant `oct`"),
        ("\"r\":4", "\"r\":-4", "ball 0 of level 0: its radius `r` is -4; wanted 0 to 1e10 m"),
        ("\"r\":4", "\"r\":1e400", "number out of range"),
        ("\"r\":4", "\"r\":null", "invalid type: null"),
        ("[-2,0,0]", "[-2e11,0,0]", "ball 1 of level 2: its centre has the coordinate -200000000000; wanted at most 1e10 m"),
        ("[-2,0,0]", "[-2,0]", "invalid length 2"),
        ("[-2,0,0]", "[-5,0,0]", "ball 3 sticks out of its parent 2 by 3e0 m"),
        ("\"r\":4,\"out\":1", "\"r\":4,\"out\":-1", "outward error `out` is -1"),
        ("\"parent\":-1", "\"parent\":0", "ball 0 of level 0: its parent is 0; the root has none"),
        ("\"r\":3,\"out\":1,\"parent\":0", "\"r\":3,\"out\":1,\"parent\":1", "ball 1 of level 1: its parent is 1; wanted 0 to 0"),
        ("\"r\":3,\"out\":1,\"parent\":0", "\"r\":3,\"out\":1", "ball 1 of level 1: its parent is -1; wanted 0 to 0"),
        ("[0,0,0],\"r\":2,\"out\":1,\"parent\":1", "[0,0,0],\"r\":2,\"out\":1,\"parent\":0", "its parent 0 comes after 1; balls stand in the order of their parents"),
        ("\"levels\":[[", "\"levels\":[],\"other\":[[", "unknown field"),
        ("\"levels\":[[{", "\"levels\":[[],[{", "there are 0 balls in level 0; wanted 1, the root"),
    ];
    for (from, to, said) in cases {
        assert!(GOOD.contains(from), "{from}");
        let error = TreeFile::from_json(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(error.contains(said), "{from} → {to}: {error}");
    }
    let repeated = GOOD.replace("]]}", "],[{\"c\":[1,0,0],\"r\":1,\"out\":1,\"parent\":0}]]}");
    let error = TreeFile::from_json(&repeated).unwrap_err();
    assert_eq!(error, TreeFileError::Ball { level: 3, ball: 0, what: "its parent repeats the ball above it, as only a leaf is".into() });
}

#[test]
fn a_cut_or_damaged_text_never_panics() {
    let mesh = TriMesh::torus(1.0, 0.3, 12, 8);
    let text = file(&mesh, 2).to_json();
    let ends = text.trim_end().len();
    for cut in 0..ends {
        if let Some(part) = text.get(..cut) {
            assert!(TreeFile::from_json(part).is_err(), "cut at {cut}");
        }
    }
    for at in (0..text.len()).step_by(3) {
        let mut bytes = text.clone().into_bytes();
        for with in [b'0', b'9', b'-', b'e', b']'] {
            bytes[at] = with;
            if let Ok(text) = std::str::from_utf8(&bytes) {
                let _ = TreeFile::from_json(text);
            }
        }
    }
}

fn ring() -> (TriMesh, SphereTree) {
    let mesh = TriMesh::torus(1.0, 0.3, 24, 12);
    let tree = SphereTree::build(&mesh, &TreeSettings { depth: 3, error: 0.02, ..TreeSettings::default() }).unwrap();
    (mesh, tree)
}

/// The measure in Python: `$TUMBLE_SPHERE_QUALITY`, else `shared/tools/sphere_quality.py` above this crate; said on stderr where it is absent.
fn measure_in_python(mesh: &TriMesh, file: &TreeFile) -> Option<serde_json::Value> {
    let script = std::env::var_os("TUMBLE_SPHERE_QUALITY").map(PathBuf::from).or_else(|| {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        here.ancestors().map(|a| a.join("shared/tools/sphere_quality.py")).find(|p| p.is_file())
    });
    let python = std::env::var_os("TUMBLE_PYTHON").unwrap_or_else(|| "python3".into());
    let Some(script) = script else { return skipped("no sphere_quality.py; TUMBLE_SPHERE_QUALITY names it") };
    let there = Command::new(&python).args(["-c", "import numpy, scipy, trimesh, rtree"]).output();
    if !there.is_ok_and(|o| o.status.success()) {
        return skipped("python (TUMBLE_PYTHON) has no numpy, scipy, trimesh and rtree; `make references` installs them");
    }
    let folder = std::env::temp_dir().join(format!("tumble-quality-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| folder.join(name);
    std::fs::write(path("mesh.obj"), obj(mesh)).unwrap();
    std::fs::write(path("tree.json"), file.to_json()).unwrap();
    let said = Command::new(&python).arg(script).arg("eval").args([path("mesh.obj"), path("tree.json")]).arg("--json").arg(path("said.json")).output().unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    let answer = serde_json::from_str(&std::fs::read_to_string(path("said.json")).unwrap()).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    Some(answer)
}

fn skipped(why: &str) -> Option<serde_json::Value> {
    // past the harness, which keeps what passing tests print
    let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: {why}\n"));
    None
}

fn obj(mesh: &TriMesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    vertices.chain(faces).collect()
}

/// Levels as the outside program tells them: greatest and mean protrusion, worst and mean error of the balls, volume ratio, outside, missing.
type Said = [f64; 7];

/// Both programs look at the same points of the balls, and at others of the surface and of space.
fn assert_agreement(ours: &[LevelQuality], its: &[Said]) {
    assert_eq!(ours.len(), its.len());
    for (ours, [max, mean, worst, per_ball, ratio, outside, missing]) in ours.iter().zip(its) {
        let near = |what: &str, ours_is: f64, its: f64, tolerance: f64| {
            assert!((ours_is - its).abs() <= tolerance, "level {}: {what} is {ours_is} here and {its} there", ours.level);
        };
        near("protrusion_max", ours.protrusion_max, *max, 1e-9);
        near("protrusion_mean", ours.protrusion_mean, *mean, 1e-6);
        near("sphere_worst", ours.sphere_worst, *worst, 1e-9);
        near("sphere_mean", ours.sphere_mean, *per_ball, 1e-9);
        near("volume_ratio", ours.volume_ratio, *ratio, 0.01 * ratio);
        near("outside", ours.outside, *outside, 0.01 * ratio);
        near("missing", ours.missing, *missing, 0.01);
    }
}

#[test]
fn figures_agree_with_the_measure_in_python() {
    let (mesh, tree) = ring();
    let settings = TreeSettings { depth: 3, error: 0.02, ..TreeSettings::default() };
    let file = TreeFile { name: "ring".into(), mesh: MeshId::of(&mesh), settings, stages: Vec::new(), quality: Vec::new(), tree };
    let Some(said) = measure_in_python(&mesh, &file) else { return };
    let keys = ["prot_max", "prot_mean", "sph_worst", "sph_mean", "vol_ratio", "out_frac", "miss_frac"];
    let its: Vec<Said> = said["levels"].as_array().unwrap().iter().map(|level| keys.map(|key| level[key].as_f64().unwrap())).collect();
    eprintln!("{its:?}");
    for level in said["levels"].as_array().unwrap() {
        assert_eq!((level["coverage"].as_f64(), level["vert_coverage"].as_f64()), (Some(1.0), Some(1.0)));
        assert!(level["nest_bad"].as_u64().is_none_or(|n| n == 0), "{level}");
    }
    assert_agreement(&file.tree.quality(&mesh, &QualitySettings::default()), &its);
}

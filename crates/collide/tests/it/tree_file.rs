//! Trees as JSON: the same bits after reading, invalid files rejected, and the figures of an
//! external program for the written file.

use std::path::{Path, PathBuf};
use std::process::Command;
use tumble_collide::{
    LevelQuality, LevelSphere, MeshId, QualitySettings, SphereTree, TreeFile, TreeFileError, TreeSettings, TriMesh,
    Vec3,
};

fn file(mesh: &TriMesh, depth: u32) -> TreeFile {
    // with this error some leaves are above the last level
    let settings = TreeSettings { depth, error: 0.03, ..TreeSettings::octree() };
    let (tree, stages) = SphereTree::build_with_progress(mesh, &settings, &()).unwrap();
    let few = QualitySettings {
        surface_samples: 500,
        sphere_samples: 500,
        volume_samples: 500,
        ..QualitySettings::default()
    };
    TreeFile {
        name: "a \"ring\"\n".into(),
        mesh: MeshId::of(mesh),
        settings,
        stages,
        quality: tree.quality(mesh, &few),
        tree,
    }
}

#[test]
fn a_tree_comes_back_with_the_same_bits() {
    for (mesh, depth) in [
        (TriMesh::torus(1.0, 0.3, 48, 24), 6),
        (TriMesh::cuboid(Vec3::new(0.2, 2.0 / 3.0, 2e-4)), 5),
        (TriMesh::icosphere(1e-7, 2), 1),
    ] {
        let file = file(&mesh, depth);
        let leaf_levels: Vec<u32> = file.tree.leaves().map(|l| l.level).collect();
        let text = file.to_json();
        let back = TreeFile::from_json(&text).unwrap();
        assert_eq!(back, file);
        assert_eq!(back.to_json(), text);
        eprintln!(
            "{} spheres, leaves at levels {:?} to {:?}",
            file.tree.nodes().len(),
            leaf_levels.iter().min(),
            leaf_levels.iter().max()
        );
    }
}

#[test]
fn every_level_of_the_file_represents_the_solid() {
    let mesh = TriMesh::cylinder(0.2, 2.0, 24);
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

/// A small valid file to damage: a root with two leaves, one of them divided.
const GOOD: &str = r#"{"format":"tumble sphere tree","version":1,"name":"","units":"m","mesh":{"blake3":"","triangles":4,"diagonal":1.0},
"settings":{"builder":"octree","branch":8,"depth":2,"error":0.1,"even":true},"stages":[],"quality":[],
"levels":[[{"c":[0,0,0],"r":4,"out":1,"parent":-1}],[{"c":[1,0,0],"r":2,"out":1,"parent":0},{"c":[-1,0,0],"r":3,"out":1,"parent":0}],
[{"c":[1,0,0],"r":2,"out":1,"parent":0},{"c":[-2,0,0],"r":2,"out":1,"parent":1},{"c":[0,0,0],"r":2,"out":1,"parent":1}]]}"#;

#[test]
fn a_repeated_leaf_is_one_sphere() {
    let tree = TreeFile::from_json(GOOD).unwrap().tree;
    let reference_levels: Vec<(f64, u32, u32, u32)> =
        tree.nodes().iter().map(|n| (n.center.x, n.level, n.first_child, n.children)).collect();
    assert_eq!(reference_levels, [(0.0, 0, 1, 2), (1.0, 1, 0, 0), (-1.0, 1, 3, 2), (-2.0, 2, 0, 0), (0.0, 2, 0, 0)]);
}

#[test]
fn invalid_files_are_rejected_with_place_and_remedy() {
    let cases = [
        ("\"version\":1", "\"version\":2", "of version 2; supported is \"tumble sphere tree\" of version 1"),
        ("tumble sphere tree", "other", "it is a \"other\""),
        ("\"units\":\"m\"", "\"units\":\"mm\"", "units are \"mm\"; a sphere tree is in \"m\""),
        ("\"name\":\"\"", "\"nam\":\"\"", "unknown field `nam`"),
        ("\"octree\"", "\"oct\"", "unknown variant `oct`"),
        ("\"r\":4", "\"r\":-4", "sphere 0 of level 0: its radius `r` is -4; expected 0 to 1e10 m"),
        ("\"r\":4", "\"r\":1e400", "number out of range"),
        ("\"r\":4", "\"r\":null", "invalid type: null"),
        (
            "[-2,0,0]",
            "[-2e11,0,0]",
            "sphere 1 of level 2: its center has the coordinate -200000000000; expected at most 1e10 m",
        ),
        ("[-2,0,0]", "[-2,0]", "invalid length 2"),
        ("[-2,0,0]", "[-5,0,0]", "sphere 1 of level 2: it extends beyond its parent, sphere 1 of level 1, by 3e0 m"),
        ("\"r\":4,\"out\":1", "\"r\":4,\"out\":-1", "outward error `out` is -1"),
        ("\"parent\":-1", "\"parent\":0", "sphere 0 of level 0: its parent is 0; the root has none"),
        (
            "\"r\":3,\"out\":1,\"parent\":0",
            "\"r\":3,\"out\":1,\"parent\":1",
            "sphere 1 of level 1: its parent is 1; expected 0 to 0",
        ),
        (
            "\"r\":3,\"out\":1,\"parent\":0",
            "\"r\":3,\"out\":1",
            "sphere 1 of level 1: its parent is -1; expected 0 to 0",
        ),
        (
            "[0,0,0],\"r\":2,\"out\":1,\"parent\":1",
            "[0,0,0],\"r\":2,\"out\":1,\"parent\":0",
            "its parent 0 comes after 1; spheres must be ordered by parent",
        ),
        ("\"levels\":[[", "\"levels\":[],\"other\":[[", "unknown field"),
        ("\"levels\":[[{", "\"levels\":[[],[{", "there are 0 spheres in level 0; expected 1, the root"),
        (
            "],\n[{\"c\":[1,0,0],\"r\":2,\"out\":1,\"parent\":0},{\"c\":[-2",
            "],[],[{\"c\":[1,0,0],\"r\":2,\"out\":1,\"parent\":0},{\"c\":[-2",
            "there are 0 spheres in level 2; expected at least 1",
        ),
        ("]]}", "],[]]}", "there are 0 spheres in level 3; expected at least 1"),
        (
            "\"quality\":[]",
            "\"quality\":[QUALITY]",
            "there are 1 rows of `quality`; expected one for each of the 3 levels, or none",
        ),
        ("\"diagonal\":1.0", "\"diagonal\":0", "`diagonal` of `mesh` is 0; expected above 0"),
    ];
    for (from, to, reference_levels) in cases {
        assert!(GOOD.contains(from), "{from}");
        let row = serde_json::to_string(&LevelQuality::default()).unwrap();
        let error = TreeFile::from_json(&GOOD.replacen(from, &to.replace("QUALITY", &row), 1)).unwrap_err().to_string();
        assert!(error.contains(reference_levels), "{from} → {to}: {error}");
    }
    let repeated = GOOD.replace("]]}", "],[{\"c\":[1,0,0],\"r\":1,\"out\":1,\"parent\":0}]]}");
    let error = TreeFile::from_json(&repeated).unwrap_err();
    assert_eq!(
        error,
        TreeFileError::Sphere {
            level: 3,
            sphere: 0,
            what: "its parent is a repeated leaf, which has no other children".into()
        }
    );
}

#[test]
fn a_handwritten_tree_needs_spheres_only() {
    let text = r#"{"format":"tumble sphere tree","version":1,"levels":[[{"c":[0,0,0],"r":2}],[{"c":[0,0,1],"r":1,"parent":0},{"c":[0,0,-1],"r":1,"out":0.5,"parent":0}]]}"#;
    let file = TreeFile::from_json(text).unwrap();
    assert_eq!(file.tree.nodes().iter().map(|n| n.outward).collect::<Vec<_>>(), [4.0, 2.0, 0.5]);
    // the box around the two leaves is 2 by 2 by 4
    assert!((file.mesh.diagonal - 24.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!((file.quality.len(), file.stages.len(), file.settings), (0, 0, TreeSettings::default()));
    assert_eq!(TreeFile::from_json(&file.to_json()).unwrap(), file);
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

/// Returns a ring and spheres about it by formula; the last ones leave part of it uncovered and
/// extend beyond their parents.
fn ring() -> (TriMesh, Vec<Vec<LevelSphere>>) {
    let spheres = |count: usize, radius: f64, parents: Option<usize>| -> Vec<LevelSphere> {
        let at = |n: usize| {
            let (sin, cos) = (std::f64::consts::TAU * n as f64 / count as f64).sin_cos();
            LevelSphere {
                parent: parents.map(|p| n * p / count),
                ..LevelSphere::new(Vec3::new(cos, sin, 0.0) * parents.map_or(0.0, |_| 1.0), radius)
            }
        };
        (0..count).map(at).collect()
    };
    (
        TriMesh::torus(1.0, 0.3, 24, 12),
        vec![spheres(1, 1.4, None), spheres(8, 0.6, Some(1)), spheres(16, 0.32, Some(8))],
    )
}

/// Returns levels as text, for the Python tool.
fn levels_text(levels: &[Vec<LevelSphere>]) -> String {
    let sphere = |b: &LevelSphere| serde_json::json!({"c": [b.center.x, b.center.y, b.center.z], "r": b.radius, "parent": b.parent.map_or(-1, |p| p as i64)});
    let levels: Vec<Vec<_>> = levels.iter().map(|level| level.iter().map(sphere).collect()).collect();
    serde_json::json!({"levels": levels}).to_string()
}

/// Runs the Python tool: `$TUMBLE_SPHERE_QUALITY`, else `shared/tools/sphere_quality.py` above this
/// crate. Reports on stderr if it is absent.
fn measure_in_python(mesh: &TriMesh, tree: &str) -> Option<serde_json::Value> {
    let script = std::env::var_os("TUMBLE_SPHERE_QUALITY").map(PathBuf::from).or_else(|| {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        here.ancestors().map(|a| a.join("shared/tools/sphere_quality.py")).find(|p| p.is_file())
    });
    let python = std::env::var_os("TUMBLE_PYTHON").unwrap_or_else(|| "python3".into());
    let Some(script) = script else { return skipped("no sphere_quality.py; TUMBLE_SPHERE_QUALITY names it") };
    let there = Command::new(&python).args(["-c", "import numpy, scipy, trimesh, rtree"]).output();
    if !there.is_ok_and(|o| o.status.success()) {
        return skipped(
            "python (TUMBLE_PYTHON) has no numpy, scipy, trimesh and rtree; `make references` installs them",
        );
    }
    let folder = std::env::temp_dir().join(format!("tumble-quality-{}-{}", std::process::id(), tree.len()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = |name: &str| folder.join(name);
    std::fs::write(path("mesh.obj"), obj(mesh)).unwrap();
    std::fs::write(path("tree.json"), tree).unwrap();
    let reference_levels = Command::new(&python)
        .arg(script)
        .arg("eval")
        .args([path("mesh.obj"), path("tree.json")])
        .arg("--json")
        .arg(path("said.json"))
        .output()
        .unwrap();
    assert!(reference_levels.status.success(), "{}", String::from_utf8_lossy(&reference_levels.stderr));
    let answer = serde_json::from_str(&std::fs::read_to_string(path("said.json")).unwrap()).unwrap();
    std::fs::remove_dir_all(folder).unwrap();
    Some(answer)
}

fn skipped(why: &str) -> Option<serde_json::Value> {
    // bypasses the harness, which hides the output of passing tests
    let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("\nSKIPPED: {why}\n"));
    None
}

fn obj(mesh: &TriMesh) -> String {
    let vertices = mesh.vertices.iter().map(|v| format!("v {} {} {}\n", v.x, v.y, v.z));
    let faces = mesh.triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1));
    vertices.chain(faces).collect()
}

/// The figures of a level: the keys of the external program, and the tolerances. Both use the same
/// points of the spheres, but different points of the surface and of space.
const KEYS: [Key; 12] = [
    ("coverage", |q| q.coverage, 0.005),
    ("gap_max", |q| q.gap_max, 5e-4),
    ("vert_coverage", |q| q.vertex_coverage, 1e-9),
    ("vert_gap_max", |q| q.vertex_gap_max, 1e-9),
    ("prot_max", |q| q.protrusion_max, 1e-6),
    ("prot_mean", |q| q.protrusion_mean, 1e-6),
    ("sph_worst", |q| q.sphere_worst, 1e-6),
    ("sph_mean", |q| q.sphere_mean, 1e-6),
    ("vol_ratio", |q| q.volume_ratio, 0.03),
    ("out_frac", |q| q.outside, 0.03),
    ("miss_frac", |q| q.missing, 0.005),
    ("nest_max", |q| q.nesting_max, 1e-9),
];
type ReferenceLevel = [f64; 12];
/// Key of the program, figure of the crate, tolerance.
type Key = (&'static str, fn(&LevelQuality) -> f64, f64);

fn assert_agreement(ours: &[LevelQuality], its: &[ReferenceLevel]) {
    assert_eq!(ours.len(), its.len());
    for (ours, its) in ours.iter().zip(its) {
        for ((key, figure, tolerance), its) in KEYS.iter().zip(its) {
            assert!(
                (figure(ours) - its).abs() <= *tolerance,
                "level {}: {key} is {} here and {its} there",
                ours.level,
                figure(ours)
            );
        }
    }
}

fn reference_levels(answer: &serde_json::Value) -> Vec<ReferenceLevel> {
    answer["levels"]
        .as_array()
        .unwrap()
        .iter()
        .map(|level| KEYS.map(|(key, ..)| level[key].as_f64().unwrap_or(0.0)))
        .collect()
}

/// Output of `tools/sphere_quality.py` for [`ring`] with numpy 2.4, scipy 1.17, trimesh 5.2 and
/// rtree 1.4. The next test prints it again: `TUMBLE_PYTHON=target/python/bin/python cargo test
/// --release -p tumble-collide --test it figures_agree -- --nocapture`.
const RING: [ReferenceLevel; 3] = [
    [1.0, 0.0, 1.0, 0.0, 0.379274048, 0.13714331, 0.379274048, 0.379274048, 6.85171579, 5.85151487, 0.0, 0.0],
    [
        1.0,
        0.0,
        1.0,
        0.0,
        0.0838871694,
        0.0690927105,
        0.0838871694,
        0.0838855224,
        3.56816801,
        2.56825591,
        0.0,
        0.0536828127,
    ],
    [
        0.66265,
        0.0120711016,
        0.388888889,
        0.00403356617,
        0.0109505371,
        0.00342230214,
        0.0109505371,
        0.00983196055,
        1.04880897,
        0.0910463908,
        0.0425505419,
        0.0295740344,
    ],
];

#[test]
fn figures_equal_those_of_the_python_tool() {
    let (mesh, levels) = ring();
    assert_agreement(&LevelQuality::of_levels(&levels, &mesh, &QualitySettings::default()), &RING);
}

#[test]
fn figures_agree_with_the_python_tool() {
    let (mesh, levels) = ring();
    let Some(answer) = measure_in_python(&mesh, &levels_text(&levels)) else { return };
    eprintln!("{:?}", reference_levels(&answer));
    let ours = LevelQuality::of_levels(&levels, &mesh, &QualitySettings::default());
    assert_agreement(&ours, &reference_levels(&answer));
    assert_eq!(answer["levels"][2]["nest_bad"].as_u64(), Some(ours[2].nesting_broken as u64));

    let file = file(&mesh, 3);
    let answer = measure_in_python(&mesh, &file.to_json()).unwrap();
    assert_agreement(&file.tree.quality(&mesh, &QualitySettings::default()), &reference_levels(&answer));
}

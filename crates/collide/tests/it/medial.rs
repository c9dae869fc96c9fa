//! The adaptive medial axis builder: its guarantees, and its errors compared with the reference
//! toolkit.

use super::rng::Rng;
use super::shared_meshes;
use std::sync::Mutex;
use tumble_collide::{Builder, Progress, QualitySettings, SphereTree, TreeSettings, TriMesh, Vec3};

fn settings(depth: u32) -> TreeSettings {
    TreeSettings { depth, ..TreeSettings::default() }
}

/// Returns both meshes as one.
fn both(a: TriMesh, b: &TriMesh) -> TriMesh {
    let offset = a.vertices.len() as u32;
    let mut all = a;
    all.vertices.extend(&b.vertices);
    all.triangles.extend(b.triangles.iter().map(|t| t.map(|v| v + offset)));
    all
}

/// Returns a box whose corners are moved slightly, each differently, so that nothing is symmetric.
fn distorted_box(half: Vec3, seed: u64) -> TriMesh {
    let mut rng = Rng::new(seed);
    let mut mesh = TriMesh::cuboid(2.0 * half);
    for v in &mut mesh.vertices {
        *v += half.map(|h| h * rng.between(-0.2, 0.2));
    }
    mesh
}

/// Checks with points only: each point of the surface lies in a sphere of each level, each sphere
/// in its parent, and no point has an error larger than the stated one.
fn check(name: &str, mesh: &TriMesh, tree: &SphereTree, settings: &TreeSettings) {
    let mut rng = Rng::new(5);
    let levels = tree.level_lists();
    assert!(levels.len() <= settings.depth as usize + 1, "{name}: {} levels", levels.len());
    for _ in 0..2000 {
        let [a, b, c] = mesh.corners((rng.unit() * mesh.triangles.len() as f64) as usize);
        let (u, v) = (rng.unit(), rng.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let p = a + (b - a) * u + (c - a) * v;
        for (n, level) in levels.iter().enumerate() {
            let held = level.iter().any(|sphere| (p - sphere.center).norm() <= sphere.radius * (1.0 + 1e-9));
            assert!(held, "{name}: {p} is bare on level {n}");
        }
    }
    for node in tree.nodes() {
        assert!(node.children <= settings.branch, "{name}: {} children", node.children);
        for child in node.child_range().map(|c| &tree.nodes()[c]) {
            let excess = (child.center - node.center).norm() + child.radius - node.radius;
            assert!(excess <= 1e-12 * node.radius, "{name}: {excess}");
        }
    }
}

#[test]
fn covers_and_nests_thin_and_scattered_solids() {
    let sphere = TriMesh::icosphere(0.3, 2);
    let cases = [
        ("sheet", distorted_box(Vec3::new(1.0, 0.8, 1e-3), 1)),
        ("needle", distorted_box(Vec3::new(1.0, 1e-3, 2e-3), 2)),
        ("crooked box", distorted_box(Vec3::new(1.0, 0.5, 0.3), 3)),
        (
            "two parts",
            both(distorted_box(Vec3::new(0.5, 0.2, 0.3), 4), &sphere.clone().translated(&Vec3::new(2.0, 0.5, 0.0))),
        ),
        (
            "parts that overlap",
            both(distorted_box(Vec3::new(0.5, 0.2, 0.3), 5), &sphere.translated(&Vec3::new(0.5, 0.0, 0.0))),
        ),
        ("ring", TriMesh::torus(1.0, 0.25, 24, 12)),
    ];
    for (name, mesh) in cases {
        for branch in [2, 8] {
            let settings = TreeSettings { branch, ..settings(2) };
            let tree = SphereTree::build(&mesh, &settings).unwrap();
            check(name, &mesh, &tree, &settings);
        }
    }
}

/// One sphere about the middle of a polyhedron that is inscribed in a sphere extends outside by the
/// sagitta of its faces. Eight spheres that share its points have the same error, except for the
/// growth to cover the surface between the points.
#[test]
fn a_sphere_is_covered_by_spheres_as_large() {
    let mesh = TriMesh::icosphere(1.0, 3);
    let depth = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        (b - a).cross(&(c - a)).normalize().dot(&a)
    };
    let sagitta = 1.0 - (0..mesh.triangles.len()).map(depth).fold(f64::INFINITY, f64::min);
    let tree = SphereTree::build(&mesh, &settings(1)).unwrap();
    assert!(tree.outward_error() <= 1.1 * sagitta, "{} of {sagitta}", tree.outward_error());
}

#[test]
fn spheres_within_the_error_are_not_divided() {
    let mesh = TriMesh::torus(1.0, 0.25, 24, 12);
    let coarse = TreeSettings { error: 0.5, ..settings(3) };
    let tree = SphereTree::build(&mesh, &coarse).unwrap();
    assert!(tree.levels() == 2 && tree.nodes().len() <= 9, "{} levels", tree.levels());
    check("coarse", &mesh, &tree, &coarse);
}

/// The reports in order.
struct Reports(Mutex<Vec<f64>>);

impl Progress for Reports {
    fn report(&self, share: f64) {
        self.0.lock().unwrap().push(share);
    }
}

#[test]
fn progress_is_monotonic_and_stages_are_counted() {
    let reports = Reports(Mutex::new(Vec::new()));
    let mesh = TriMesh::torus(1.0, 0.25, 24, 12);
    let (tree, stages) = SphereTree::build_with_progress(&mesh, &settings(2), &reports).unwrap();
    let shares = reports.0.into_inner().unwrap();
    assert!(shares.len() > 5 && shares.windows(2).all(|w| w[0] <= w[1]) && shares.last() == Some(&1.0), "{shares:?}");
    let count = |level, stage: &str| {
        stages.iter().filter(|s| s.level == level && s.stage == stage).map(|s| s.count).sum::<u64>()
    };
    for level in [1, 2] {
        let regions = 8_u64.pow(level - 1);
        let ways = ["expand won", "merge won", "burst won"].map(|way| count(level, way)).iter().sum::<u64>();
        assert_eq!(ways, regions, "level {level}");
        assert!(count(level, "internal spheres") >= 500, "level {level}");
    }
    assert!(count(2, "gaps filled") > 0);
    assert!(tree.at_level(2).count() as u64 <= 64);
}

#[test]
fn the_same_bits_on_any_number_of_threads() {
    let mesh = TriMesh::torus(1.0, 0.3, 24, 12);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| SphereTree::build(&mesh, &settings(2)).unwrap())
    };
    let (one, two) = (on(1), on(2));
    assert_eq!(one, two);
    assert!(one.nodes().iter().zip(two.nodes()).all(|(a, b)| a.radius.to_bits() == b.radius.to_bits()));
}

/// Worst and mean outward error of the reference toolkit's leaves over the diagonal, as built
/// (without covering or nesting), and of its first level modified to nest.
const TOOLKIT: [(&str, f64, f64, Option<f64>); 6] = [
    ("spot", 0.0228, 0.0094, Some(0.131)),
    ("panda_link5", 0.0244, 0.0093, Some(0.117)),
    ("low/bunny1500", 0.0545, 0.0150, Some(0.124)),
    ("low/fandisk1500", 0.0593, 0.0229, None),
    ("low/fertility1500", 0.0506, 0.0205, None),
    ("low/hand1500", 0.0338, 0.0127, None),
];

#[test]
fn tighter_than_the_reference_toolkit_and_yet_covering() {
    for (name, worst, mean, first) in TOOLKIT {
        let Some(text) = shared_meshes::text(&format!("{name}.obj")) else { return };
        let mesh = TriMesh::from_obj(&text).unwrap();
        let tree = SphereTree::build(&mesh, &settings(2)).unwrap();
        let rows = tree.quality(&mesh, &QualitySettings::default());
        let [_, one, two] = &rows[..] else { panic!("{name}: {} levels", rows.len()) };
        assert!(
            two.spheres <= 64 && (two.coverage, two.gap_max, two.nesting_broken) == (1.0, 0.0, 0),
            "{name}: {two:?}"
        );
        assert!(
            two.protrusion_max <= worst && two.protrusion_mean <= mean,
            "{name}: {} / {}",
            two.protrusion_max,
            two.protrusion_mean
        );
        assert!(first.is_none_or(|first| one.protrusion_max <= first), "{name}: {}", one.protrusion_max);
    }
}

#[test]
fn a_quarter_of_the_octrees_worst() {
    let Some(text) = shared_meshes::text("spot.obj") else { return };
    let mesh = TriMesh::from_obj(&text).unwrap();
    let worst = |builder| {
        let settings = TreeSettings { builder, depth: 2, ..TreeSettings::default() };
        SphereTree::build(&mesh, &settings).unwrap().quality(&mesh, &QualitySettings::default())[2].protrusion_max
    };
    let (medial, octree) = (worst(Builder::Medial), worst(Builder::Octree));
    assert!(medial <= 0.25 * octree, "{medial} of {octree}");
}

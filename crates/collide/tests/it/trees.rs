//! Sphere trees: their guarantees on public and generated meshes.

use crate::rng::Rng;
use crate::shared_meshes::text;
use tumble_collide::{MeshDistance, MeshError, SphereTree, TreeSettings, TriMesh, Vec3};

fn solid(name: &str) -> Option<TriMesh> {
    let mut mesh = TriMesh::from_obj(&text(&format!("{name}.obj"))?).unwrap();
    mesh.check_closed().unwrap();
    Some(mesh)
}

/// Checks that points of the leaf spheres are not further outside than stated, and that surface
/// samples lie in a leaf.
fn sample(name: &str, mesh: &TriMesh, tree: &SphereTree) {
    let distance = MeshDistance::new(mesh);
    let mut rng = Rng::new(7);
    let leaves: Vec<_> = tree.leaves().collect();
    for _ in 0..3000 {
        let leaf = leaves[rng.below(leaves.len())];
        let p = leaf.center + rng.direction() * leaf.radius;
        let outside = distance.closest(&p).signed_distance;
        assert!(outside <= leaf.outward + 1e-9 && leaf.outward <= tree.outward_error(), "{name}: {outside}");
    }
    for _ in 0..3000 {
        let [a, b, c] = mesh.corners(rng.below(mesh.triangles.len()));
        let (u, v) = (rng.unit(), rng.unit());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        let p = a + (b - a) * u + (c - a) * v;
        assert!(leaves.iter().any(|l| (l.center - p).norm() <= l.radius), "{name}: {p:?} is bare");
    }
}

#[test]
fn public_meshes_get_tight_trees() {
    for name in ["bunny", "spot", "torus", "panda_link5", "fandisk", "cow"] {
        let Some(mesh) = solid(name) else { return };
        let tree = SphereTree::build(&mesh, &TreeSettings::octree()).unwrap();
        let relative: Vec<f64> = (0..tree.levels()).map(|l| tree.outward_error_at(l) / mesh.diagonal()).collect();
        let count = tree.leaves().count();
        eprintln!("{name}: {count} leaves, {} spheres, error per level {relative:.4?}", tree.nodes().len());
        assert!(tree.outward_error() < 0.02 * mesh.diagonal(), "{name}");
        assert!(count < 6000, "{name}: {count}");
        // the cow crosses itself, and the reference distance takes part of its inside for outside
        if name != "cow" {
            sample(name, &mesh, &tree);
        }
    }
}

#[test]
fn generated_solids_get_tight_trees() {
    let meshes = [
        TriMesh::cuboid(Vec3::new(1.0, 2.0, 0.2)),
        TriMesh::cylinder(0.5, 1.0, 32),
        TriMesh::icosphere(1.0, 3),
        TriMesh::torus(1.0, 0.3, 48, 24),
    ];
    for mesh in meshes {
        let tree = SphereTree::build(&mesh, &TreeSettings::octree()).unwrap();
        let count = tree.leaves().count();
        eprintln!(
            "{} faces: {count} leaves, error {:.4}",
            mesh.triangles.len(),
            tree.outward_error() / mesh.diagonal()
        );
        assert!(tree.outward_error() < 0.02 * mesh.diagonal());
        sample("generated", &mesh, &tree);
    }
}

#[test]
fn coverage_check_notices_a_hole() {
    // a tree of a smaller torus does not cover a larger one
    let settings = TreeSettings { error: 0.02, ..TreeSettings::octree() };
    let tree = SphereTree::build(&TriMesh::torus(1.0, 0.3, 48, 24), &settings).unwrap();
    assert!(matches!(tree.check_coverage(&TriMesh::torus(1.2, 0.3, 48, 24)), Err(MeshError::Tree { .. })));
}

#[test]
fn settings_out_of_range_are_refused() {
    let mesh = TriMesh::cuboid(Vec3::repeat(2.0));
    for settings in [
        TreeSettings { depth: 0, ..TreeSettings::octree() },
        TreeSettings { error: f64::NAN, ..TreeSettings::octree() },
    ] {
        assert!(matches!(SphereTree::build(&mesh, &settings), Err(MeshError::Settings { .. })));
    }
}

#[test]
fn hard_meshes_and_fine_settings_still_cover() {
    // a needle, a sheet, a box far from the origin, and a sphere at a tenth of the default error
    let far = TriMesh::cuboid(Vec3::repeat(1.0)).translated(&Vec3::new(1e5, -1e5, 1e5));
    let meshes = [
        TriMesh::cylinder(1e-3, 2.0, 8),
        TriMesh::cuboid(Vec3::new(2.0, 2.0, 2e-4)),
        far,
        TriMesh::torus(1.0, 0.01, 64, 8),
    ];
    for mesh in meshes {
        let tree = SphereTree::build(&mesh, &TreeSettings::octree()).unwrap();
        eprintln!("{} leaves, error {:.4}", tree.leaves().count(), tree.outward_error() / mesh.diagonal());
        assert!(tree.outward_error() < 0.03 * mesh.diagonal());
    }
    let fine = TreeSettings { error: 0.001, depth: 9, ..TreeSettings::octree() };
    let mesh = TriMesh::torus(1.0, 0.3, 64, 32);
    assert!(SphereTree::build(&mesh, &fine).unwrap().outward_error() < 0.0011 * mesh.diagonal());
}

#[test]
fn an_uneven_tree_has_a_smaller_mean_error() {
    let mesh = TriMesh::torus(1.0, 0.3, 48, 24);
    let mean = |even| {
        let tree = SphereTree::build(&mesh, &TreeSettings { even, ..TreeSettings::octree() }).unwrap();
        tree.leaves().map(|l| l.outward).sum::<f64>() / tree.leaves().count() as f64 / mesh.diagonal()
    };
    assert!((mean(true) - 0.01).abs() < 1e-6);
    assert!(mean(false) < 0.009, "{}", mean(false));
}

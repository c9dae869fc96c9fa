//! The quality report against closed forms and plain quadrature.

use std::f64::consts::PI;
use tumble_collide::{
    LevelQuality, LevelSphere, QualitySettings, SphereTree, TreeSettings, TriMesh, Vec3, grow_to_cover,
};

/// Measures spheres `(x, r)` with their centers on the x axis.
fn on_axis(spheres: &[(f64, f64)], mesh: &TriMesh) -> LevelQuality {
    let level = spheres.iter().map(|&(x, r)| LevelSphere::new(Vec3::x() * x, r)).collect();
    LevelQuality::of_levels(&[level], mesh, &QualitySettings::default()).remove(0)
}

fn near(what: &str, value: f64, wanted: f64, tolerance: f64) {
    assert!((value - wanted).abs() <= tolerance, "{what} is {value}, expected {wanted} within {tolerance}");
}

/// `∫` over [−1, 1]² by the midpoint rule.
fn over_square(f: impl Fn(f64, f64) -> f64) -> f64 {
    let n = 400;
    let at = |k: usize| (2 * k + 1) as f64 / n as f64 - 1.0;
    (0..n).flat_map(|j| (0..n).map(move |k| (j, k))).map(|(j, k)| f(at(j), at(k))).sum::<f64>() * 4.0 / (n * n) as f64
}

/// Mean over the sphere of radius `r` of the distance to the cube [−1, 1]³, by latitude and
/// longitude.
fn mean_distance_to_cube(r: f64) -> f64 {
    let distance = |z: f64, longitude: f64| {
        let s = (1.0 - z * z).sqrt();
        Vec3::new(r * s * longitude.cos(), r * s * longitude.sin(), r * z).map(|x| (x.abs() - 1.0).max(0.0)).norm()
    };
    over_square(|z, turn| distance(z, PI * turn)) / 4.0
}

#[test]
fn a_sphere_around_a_cube() {
    let (r, d) = (3.0_f64.sqrt(), 12.0_f64.sqrt());
    // grown by more than the rounding of the corners
    let q = on_axis(&[(0.0, r * (1.0 + 1e-12))], &TriMesh::cuboid(Vec3::repeat(2.0)));
    assert_eq!((q.spheres, q.coverage, q.vertex_coverage, q.gap_max, q.vertex_gap_max), (1, 1.0, 1.0, 0.0, 0.0));
    near("greatest protrusion", q.protrusion_max, (r - 1.0) / d, 2e-5);
    near("mean protrusion", q.protrusion_mean, mean_distance_to_cube(r) / d, 2e-5);
    near("error of the sphere", q.sphere_worst, (r - 1.0) / d, 2e-5);
    let ratio = 4.0 / 3.0 * PI * r.powi(3) / 8.0;
    near("volume ratio", q.volume_ratio, ratio, 1e-3 * ratio);
    // half the standard deviation of the same number of random points
    near("outside", q.outside, ratio - 1.0, 3.4e-3);
    assert_eq!(q.missing, 0.0);
}

#[test]
fn a_sphere_in_a_cube() {
    let d = 12.0_f64.sqrt();
    let q = on_axis(&[(0.0, 1.0)], &TriMesh::cuboid(Vec3::repeat(2.0)));
    assert_eq!(
        (q.coverage, q.vertex_coverage, q.protrusion_max, q.protrusion_mean, q.outside),
        (0.0, 0.0, 0.0, 0.0, 0.0)
    );
    near("gap at the corners", q.vertex_gap_max, (3.0_f64.sqrt() - 1.0) / d, 1e-15);
    let mean = over_square(|x, y| (1.0 + x * x + y * y).sqrt() - 1.0) / 4.0;
    near("mean gap", q.gap_mean, mean / d, 1e-4);
    assert!(q.gap_max < q.vertex_gap_max && q.gap_max > 0.98 * q.vertex_gap_max, "{}", q.gap_max);
    near("volume ratio", q.volume_ratio, PI / 6.0, 1e-3);
    near("missing", q.missing, 1.0 - PI / 6.0, 1e-3);
}

#[test]
fn the_share_of_a_sheet_that_a_sphere_covers() {
    // faces of 2 × 2 at z = ±0.1; the sphere of radius 0.5 cuts a disc from each and reaches no rim
    let mesh = TriMesh::cuboid(Vec3::new(2.0, 2.0, 0.2));
    let q = on_axis(&[(0.0, 0.5)], &mesh);
    let area = 2.0 * 4.0 + 4.0 * 2.0 * 0.2;
    near("coverage", q.coverage, 2.0 * PI * (0.25 - 0.01) / area, 5e-4);
    near("error of the sphere", q.sphere_worst, 0.4 / mesh.diagonal(), 1e-5);
    // 95 % of the sphere is where |z| is at most 0.95 of the radius: the outside is 0.5·0.95 − 0.1
    near("95th percentile", q.protrusion_p95, 0.375 / mesh.diagonal(), 1e-5);
    // |z| is uniform on [0, 0.5]: the mean of max(0, |z| − 0.1) is 0.4²/2 / 0.5
    near("mean", q.protrusion_mean, 0.16 / mesh.diagonal(), 1e-5);
}

#[test]
fn two_spheres_that_overlap_count_their_lens_once() {
    let (apart, mesh) = (0.8_f64, TriMesh::cuboid(Vec3::repeat(4.0)));
    let q = on_axis(&[(-0.5 * apart, 1.0), (0.5 * apart, 1.0)], &mesh);
    let lens = PI * (4.0 + apart) * (2.0 - apart).powi(2) / 12.0;
    near("volume ratio", q.volume_ratio, (8.0 / 3.0 * PI - lens) / 64.0, 3e-4);
    near("missing", q.missing, 1.0 - (8.0 / 3.0 * PI - lens) / 64.0, 3e-4);
    assert_eq!(q.outside, 0.0);
}

#[test]
fn a_sphere_beside_a_sphere() {
    // the solid is a sphere to 0.1 %, the tree the same sphere moved by 0.7: their intersection is
    // the lens
    let apart = 0.7_f64;
    let q = on_axis(&[(apart, 1.0)], &TriMesh::icosphere(1.0, 5));
    let (whole, lens) = (4.0 / 3.0 * PI, PI * (4.0 + apart) * (2.0 - apart).powi(2) / 12.0);
    near("outside", q.outside, 1.0 - lens / whole, 2e-3);
    near("missing", q.missing, 1.0 - lens / whole, 2e-3);
    near("error", q.sphere_worst * 12.0_f64.sqrt(), apart, 2e-3);
    // the cap of the solid's surface beyond x = apart / 2 is covered; the mesh lies 0.07 % within
    // its sphere, which changes that by 5e-4
    near("coverage", q.coverage, (1.0 - 0.5 * apart) / 2.0, 2e-3);
}

#[test]
fn a_hidden_sphere_protrudes_from_nothing_but_has_its_own_error() {
    let mesh = TriMesh::cuboid(Vec3::repeat(2.0));
    let d = mesh.diagonal();
    // the small sphere is outside the cube, and within the large one
    let q = on_axis(&[(0.0, 2.0), (1.4, 0.3)], &mesh);
    let alone = on_axis(&[(0.0, 2.0)], &mesh);
    near("mean protrusion", q.protrusion_mean, alone.protrusion_mean, 1e-5);
    near("mean error", q.sphere_mean, 0.5 * (1.0 + 0.7) / d, 1e-3);
}

#[test]
fn broken_nesting_is_counted() {
    let mesh = TriMesh::cuboid(Vec3::repeat(2.0));
    let child = |x: f64, r: f64, parent| LevelSphere { parent, ..LevelSphere::new(Vec3::x() * x, r) };
    let levels = [
        vec![child(0.0, 2.0, None)],
        vec![child(1.0, 1.0, Some(0)), child(1.0, 1.25, Some(0)), child(0.0, 0.1, None), child(0.0, 0.1, Some(1))],
    ];
    let rows = LevelQuality::of_levels(&levels, &mesh, &QualitySettings::default());
    assert_eq!((rows[0].nesting_broken, rows[1].nesting_broken), (0, 3));
    near("excess", rows[1].nesting_max, 0.25 / mesh.diagonal(), 1e-15);
}

#[test]
fn a_tree_covers_nests_and_keeps_its_stated_error() {
    let mesh = TriMesh::torus(1.0, 0.3, 48, 24);
    let tree = SphereTree::build(&mesh, &TreeSettings { depth: 4, ..TreeSettings::octree() }).unwrap();
    let rows = tree.quality(&mesh, &QualitySettings::default());
    assert_eq!(rows.len(), tree.levels() as usize);
    for row in &rows {
        assert_eq!((row.coverage, row.gap_max, row.nesting_broken), (1.0, 0.0, 0), "level {}", row.level);
        assert_eq!(row.spheres, tree.at_level(row.level).count());
        let bound = tree.outward_error_at(row.level) / mesh.diagonal();
        assert!(row.sphere_worst <= bound + 1e-12 && row.sphere_worst > 0.5 * bound, "{} of {bound}", row.sphere_worst);
        assert!(
            row.protrusion_mean <= row.protrusion_p95
                && row.protrusion_p95 <= row.protrusion_max
                && row.protrusion_max <= row.sphere_worst
        );
        near("volumes", row.volume_ratio - row.outside + row.missing, 1.0, 3e-3);
    }
}

#[test]
fn figures_are_the_same_bits_on_any_number_of_threads() {
    let mesh = TriMesh::torus(1.0, 0.3, 24, 12);
    let tree = SphereTree::build(&mesh, &TreeSettings { depth: 3, ..TreeSettings::octree() }).unwrap();
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| format!("{:?}", tree.quality(&mesh, &QualitySettings::default())))
    };
    assert_eq!(on(1), on(4));
}

#[test]
fn a_cut_of_any_size_covers() {
    let mesh = TriMesh::torus(1.0, 0.3, 48, 24);
    let tree = SphereTree::build(&mesh, &TreeSettings { depth: 4, ..TreeSettings::octree() }).unwrap();
    let few = QualitySettings { sphere_samples: 2000, volume_samples: 2000, ..QualitySettings::default() };
    for most in [1, 2, 9, 30, 200, 100_000] {
        let cut = tree.select(most, 0.0);
        assert!(!cut.is_empty() && cut.len() <= most);
        let level = cut.iter().map(|&n| LevelSphere::new(tree.nodes()[n].center, tree.nodes()[n].radius)).collect();
        assert_eq!(LevelQuality::of_levels(&[level], &mesh, &few)[0].coverage, 1.0, "{most}");
    }
    assert_eq!(tree.select(1, 0.0), [0]);
    assert_eq!(tree.select(100_000, 0.0).len(), tree.leaves().count());
}

#[test]
fn spheres_grow_by_as_much_as_covering_needs() {
    // one sphere about a cube must reach the corners; spheres that cover do not grow
    let mesh = TriMesh::cuboid(Vec3::repeat(2.0));
    let mut spheres = [(Vec3::zeros(), 0.5)];
    near("growth", grow_to_cover(&mut spheres, &mesh), 3.0_f64.sqrt() - 0.5, 1e-12);
    assert_eq!(grow_to_cover(&mut spheres, &mesh), 0.0);
}

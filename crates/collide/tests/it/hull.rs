//! Convex hulls: against parry's, against known volumes, and against the definition of convexity.

use crate::rng::Rng;
use tumble_collide::{Pose, Quat, TriMesh, Vec3};

/// Returns a mesh with these vertices; its triangles are arbitrary.
fn cloud(vertices: Vec<Vec3>) -> TriMesh {
    let triangles = (0..vertices.len() as u32).map(|v| [v, 0, 0]).collect();
    TriMesh { vertices, triangles }
}

/// Checks that the hull is closed and outward-wound, and that no point is beyond any face by more
/// than the grid allows.
fn check(points: &[Vec3], hull: &TriMesh) -> f64 {
    let report = hull.clone().check_closed().expect("closed");
    assert_eq!((report.flipped_faces, report.shells, report.turned, report.nonmanifold_edges), (0, 1, false, 0));
    let slack = 2e-6 * hull.diagonal();
    for t in 0..hull.triangles.len() {
        let [a, b, c] = hull.corners(t);
        let n = (b - a).cross(&(c - a)).normalize();
        let farthest = points.iter().map(|p| n.dot(&(p - a))).fold(f64::NEG_INFINITY, f64::max);
        assert!(farthest < slack, "a point is {farthest} m outside");
    }
    report.volume
}

#[test]
fn a_cube_full_of_points_in_its_faces_and_edges_is_a_cube() {
    let points: Vec<Vec3> =
        (0..7 * 7 * 7).map(|n| Vec3::new((n % 7) as f64, (n / 7 % 7) as f64, (n / 49) as f64) / 6.0).collect();
    let hull = cloud(points.clone()).convex_hull().unwrap();
    assert!((check(&points, &hull) - 1.0).abs() < 1e-12);
    assert_eq!(hull.triangles.len(), 2 * hull.vertices.len() - 4, "Euler");
}

#[test]
fn convex_meshes_are_their_own_hulls() {
    for (mesh, vertices) in [
        (TriMesh::icosphere(0.3, 3), 642),
        (TriMesh::cylinder(0.2, 2.0, 48), 96),
        (TriMesh::cuboid(Vec3::new(2.0, 4.0, 6.0)), 8),
    ] {
        let hull = mesh.convex_hull().unwrap();
        let (volume, exact) = (check(&mesh.vertices, &hull), mesh.signed_volume());
        assert_eq!(hull.vertices.len(), vertices);
        assert!((volume - exact).abs() < 1e-5 * exact, "{volume} {exact}");
    }
}

#[test]
fn the_hull_of_a_torus_has_the_volume_of_disc_and_rim() {
    // within the tube's radius r of a disc of radius R: π R² 2r + (π r²/2)·2π(R + 4r/3π), Pappus
    // for the rounded rim
    let (big, small, pi) = (1.0, 0.25, std::f64::consts::PI);
    let exact = pi * big * big * 2.0 * small + 0.5 * pi * small * small * 2.0 * pi * (big + 4.0 * small / (3.0 * pi));
    let mesh = TriMesh::torus(big, small, 96, 48);
    let volume = check(&mesh.vertices, &mesh.convex_hull().unwrap());
    assert!(volume < exact && volume > 0.995 * exact, "{volume} {exact}");
}

#[test]
fn random_clouds_agree_with_parry() {
    for seed in 0..30 {
        let mut rng = Rng::new(seed);
        let stretch = Vec3::new(1.0, rng.between(0.01, 1.0), rng.between(0.01, 1.0));
        let points: Vec<Vec3> =
            (0..20 + 50 * seed).map(|_| Vec3::from_fn(|k, _| stretch[k] * rng.between(-1.0, 1.0))).collect();
        let volume = check(&points, &cloud(points.clone()).convex_hull().unwrap());
        let (vertices, triangles) = parry3d_f64::transformation::convex_hull(
            &points.iter().map(|p| [p.x, p.y, p.z].into()).collect::<Vec<_>>(),
        );
        let theirs = TriMesh { vertices: vertices.iter().map(|v| Vec3::new(v.x, v.y, v.z)).collect(), triangles }
            .signed_volume();
        assert!((volume - theirs).abs() < 1e-4 * theirs, "seed {seed}: {volume} {theirs}");
    }
}

#[test]
fn nearly_coplanar_and_coplanar_clouds() {
    let mut rng = Rng::new(7);
    let flat: Vec<Vec3> = (0..200).map(|_| Vec3::new(rng.between(-1.0, 1.0), rng.between(-1.0, 1.0), 0.5)).collect();
    assert!(cloud(flat.clone()).convex_hull().is_err());
    let noisy: Vec<Vec3> = flat.iter().map(|p| p + Vec3::new(0.0, 0.0, rng.between(-3e-6, 3e-6))).collect();
    check(&noisy, &cloud(noisy.clone()).convex_hull().unwrap());
    assert!(cloud(vec![Vec3::zeros(); 5]).convex_hull().is_err());
    assert!(cloud((0..9).map(|n| Vec3::new(n as f64, 2.0 * n as f64, 0.0)).collect()).convex_hull().is_err());
}

#[test]
fn rounded_points_of_a_box_in_any_pose_are_its_corners() {
    for seed in 0..40 {
        let mut rng = Rng::new(seed);
        let size = Vec3::from_fn(|_, _| rng.between(0.1, 2.0));
        let turn = Pose::from_parts(
            Vec3::from_fn(|_, _| rng.between(-3.0, 3.0)).into(),
            Quat::from_euler_angles(rng.between(-3.0, 3.0), rng.between(-1.5, 1.5), rng.between(-3.0, 3.0)),
        );
        let rounding = [0.0, 1e-15, 1e-12, 1e-8][seed as usize % 4];
        let points: Vec<Vec3> = (0..11 * 11 * 11)
            .map(|n| Vec3::new((n % 11) as f64, (n / 11 % 11) as f64, (n / 121) as f64) / 10.0 - Vec3::repeat(0.5))
            .map(|p| turn.transform_point(&p.component_mul(&size).into()).coords)
            .map(|p| p + Vec3::from_fn(|_, _| rng.between(-rounding, rounding)))
            .collect();
        let hull = TriMesh::hull_of(&points).unwrap();
        let volume = check(&points, &hull);
        assert!((volume - size.product()).abs() < 1e-5 * size.product(), "seed {seed}: {volume} {size:?}");
        assert_eq!(hull.vertices.len(), 8, "seed {seed}: {:?}", hull.vertices);
        assert!(hull.vertices.iter().all(|v| points.contains(v)), "vertices are given points");
    }
}

#[test]
fn hulls_of_points_with_many_ties_are_solids() {
    let mut solids = 0;
    for seed in 0..3000 {
        let mut rng = Rng::new(seed);
        let turn = rng.pose(1.0);
        let stretch = Vec3::from_fn(|_, _| [1.0, 1e-3, 1e-5][rng.below(3)]);
        let noise = [0.0, 1e-15, 1e-9, 3e-7][rng.below(4)];
        let side = 2.0 + 2.0 * rng.unit();
        let count = 4 + rng.below(60);
        let points: Vec<Vec3> = (0..count)
            .map(|_| {
                let p = Vec3::from_fn(|k, _| (side * rng.unit()).floor() * stretch[k]);
                turn.transform_point(&p.into()).coords + noise * rng.vec(1.0)
            })
            .collect();
        if let Ok(hull) = TriMesh::hull_of(&points) {
            check(&points, &hull);
            solids += 1;
        }
    }
    assert!(solids > 1000, "{solids}");
}

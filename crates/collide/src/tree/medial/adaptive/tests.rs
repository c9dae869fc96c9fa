//! Each point is contained, each error is as stated, and the target is reached.

use super::*;
use crate::TriMesh;

/// Returns the spheres of a region and the counts.
fn adaptive(
    cover: &CoverPoints,
    region: &[u32],
    distance: &MeshDistance,
    goal: &RefineGoal,
) -> (Vec<MedialSphere>, Counts) {
    let mut axis = MedialAxis::new(cover, region, distance, goal.least / 12, &());
    axis.refine(goal);
    (axis.spheres(), axis.counts())
}

fn check(mesh: &TriMesh, goal: &RefineGoal) -> (Vec<MedialSphere>, Counts) {
    let cover = CoverPoints::on(mesh, 2000);
    let distance = MeshDistance::new(mesh);
    let region: Vec<u32> = (0..cover.points.len() as u32).collect();
    let (spheres, counts) = adaptive(&cover, &region, &distance, goal);
    let slack = 1e-6 * mesh.diagonal();
    let far = |b: &MedialSphere, p: &Vec3| (b.sphere.center - p).norm() - b.sphere.radius;
    for p in &cover.points {
        assert!(spheres.iter().any(|b| far(b, p) <= 0.0), "{p} is bare");
    }
    for b in &spheres {
        let s = distance.closest(&b.sphere.center).signed_distance;
        assert!((b.outward - (b.sphere.radius + s).max(0.0)).abs() <= 1e-7 * b.sphere.radius);
    }
    assert_eq!(spheres.len() as u64, counts.internal + counts.cover + counts.alone);
    let mut axis = MedialAxis::new(&cover, &region, &distance, goal.least / 12, &());
    axis.refine(goal);
    assert_eq!(axis.spheres(), spheres);
    for (p, holders) in cover.points.iter().zip(axis.holders()) {
        let strictly: Vec<u32> = (0..spheres.len() as u32).filter(|&k| far(&spheres[k as usize], p) < -slack).collect();
        assert!(strictly.iter().all(|k| holders.contains(k)), "{p}");
        assert!(!holders.is_empty() && holders.iter().all(|&k| far(&spheres[k as usize], p) <= 0.0));
    }
    assert_eq!((spheres.clone(), counts), adaptive(&cover, &region, &distance, goal));
    (spheres, counts)
}

#[test]
fn a_box_is_refined_to_the_target() {
    let mesh = TriMesh::cuboid(Vec3::new(1.0, 2.0, 0.4));
    let (spheres, counts) = check(&mesh, &RefineGoal { target: 0.05, least: 100, most: 2000 });
    assert!(counts.inserted < 2000 && spheres.len() >= 100, "{counts:?}");
    let worst = spheres.iter().map(|b| b.outward).fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst} {counts:?}");
    // no inner sphere of the box is larger than half its least side
    assert!(spheres.iter().all(|b| b.sphere.radius - b.outward <= 0.2 + 1e-9));
}

#[test]
fn more_insertions_than_allowed_are_not_made() {
    let mesh = TriMesh::torus(1.0, 0.3, 48, 24);
    let (_, counts) = check(&mesh, &RefineGoal { target: 0.0, least: 0, most: 100 });
    assert_eq!(counts.inserted, 100);
    assert_eq!(counts.alone, 0);
}

#[test]
fn a_region_of_coplanar_points() {
    let mesh = TriMesh::cuboid(Vec3::new(1.0, 1.0, 1.0));
    let cover = CoverPoints::on(&mesh, 600);
    let region: Vec<u32> = (0..cover.points.len() as u32).filter(|&i| cover.points[i as usize].z == 0.5).collect();
    let distance = MeshDistance::new(&mesh);
    let (spheres, _) = adaptive(&cover, &region, &distance, &RefineGoal { target: 0.02, least: 50, most: 500 });
    for &i in &region {
        let p = cover.points[i as usize];
        assert!(spheres.iter().any(|b| (b.sphere.center - p).norm() <= b.sphere.radius), "{p} is bare");
    }
    let worst = spheres.iter().map(|b| b.outward).fold(0.0, f64::max);
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn points_of_thin_sheets_and_needles_are_contained() {
    for half in [Vec3::new(1.0, 1.0, 1e-3), Vec3::new(1.0, 1e-4, 1e-4)] {
        let (_, counts) = check(&TriMesh::cuboid(2.0 * half), &RefineGoal { target: 0.02, least: 100, most: 1000 });
        assert_eq!(counts.alone, 0, "{half}");
    }
}

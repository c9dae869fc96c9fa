//! Each point is held, each error is what is said, and the target is reached.

use super::*;
use crate::TriMesh;

/// The whole of it: the balls of a region and what was done.
fn adaptive(cover: &CoverPoints, region: &[u32], distance: &MeshDistance, want: &Want) -> (Vec<MedialBall>, Counts) {
    let mut axis = Axis::new(cover, region, distance, want.least / 12, &());
    axis.refine(want);
    (axis.balls(), axis.counts())
}

fn check(mesh: &TriMesh, want: &Want) -> (Vec<MedialBall>, Counts) {
    let cover = CoverPoints::on(mesh, 2000);
    let distance = MeshDistance::new(mesh);
    let region: Vec<u32> = (0..cover.points.len() as u32).collect();
    let (balls, counts) = adaptive(&cover, &region, &distance, want);
    let slack = 1e-6 * mesh.diagonal();
    let far = |b: &MedialBall, p: &Vec3| (b.ball.center - p).norm() - b.ball.radius;
    for p in &cover.points {
        assert!(balls.iter().any(|b| far(b, p) <= 0.0), "{p} is bare");
    }
    for b in &balls {
        let s = distance.closest(&b.ball.center).signed_distance;
        assert!((b.outward - (b.ball.radius + s).max(0.0)).abs() <= 1e-7 * b.ball.radius);
    }
    assert_eq!(balls.len() as u64, counts.internal + counts.cover + counts.alone);
    let mut axis = Axis::new(&cover, &region, &distance, want.least / 12, &());
    axis.refine(want);
    assert_eq!(axis.balls(), balls);
    for (p, holders) in cover.points.iter().zip(axis.holders()) {
        let strictly: Vec<u32> = (0..balls.len() as u32).filter(|&k| far(&balls[k as usize], p) < -slack).collect();
        assert!(strictly.iter().all(|k| holders.contains(k)), "{p}");
        assert!(!holders.is_empty() && holders.iter().all(|&k| far(&balls[k as usize], p) <= 0.0));
    }
    assert_eq!((balls.clone(), counts), adaptive(&cover, &region, &distance, want));
    (balls, counts)
}

#[test]
fn a_box_is_refined_to_what_is_asked() {
    let mesh = TriMesh::box_(Vec3::new(0.5, 1.0, 0.2));
    let (balls, counts) = check(&mesh, &Want { target: 0.05, least: 100, most: 2000 });
    assert!(counts.inserted < 2000 && balls.len() >= 100, "{counts:?}");
    let worst = balls.iter().map(|b| b.outward).fold(0.0, f64::max);
    assert!(worst < 0.05, "{worst} {counts:?}");
    // no inner ball of the box is larger than half its least side
    assert!(balls.iter().all(|b| b.ball.radius - b.outward <= 0.2 + 1e-9));
}

#[test]
fn more_insertions_than_allowed_are_not_made() {
    let mesh = TriMesh::torus(1.0, 0.3, 48, 24);
    let (_, counts) = check(&mesh, &Want { target: 0.0, least: 0, most: 100 });
    assert_eq!(counts.inserted, 100);
    assert_eq!(counts.alone, 0);
}

#[test]
fn a_region_of_coplanar_points() {
    let mesh = TriMesh::box_(Vec3::new(0.5, 0.5, 0.5));
    let cover = CoverPoints::on(&mesh, 600);
    let region: Vec<u32> = (0..cover.points.len() as u32).filter(|&i| cover.points[i as usize].z == 0.5).collect();
    let distance = MeshDistance::new(&mesh);
    let (balls, _) = adaptive(&cover, &region, &distance, &Want { target: 0.02, least: 50, most: 500 });
    for &i in &region {
        let p = cover.points[i as usize];
        assert!(balls.iter().any(|b| (b.ball.center - p).norm() <= b.ball.radius), "{p} is bare");
    }
    let worst = balls.iter().map(|b| b.outward).fold(0.0, f64::max);
    assert!(worst < 0.02, "{worst}");
}

#[test]
fn points_of_thin_sheets_and_needles_are_held() {
    for half in [Vec3::new(1.0, 1.0, 1e-3), Vec3::new(1.0, 1e-4, 1e-4)] {
        let (_, counts) = check(&TriMesh::box_(half), &Want { target: 0.02, least: 100, most: 1000 });
        assert_eq!(counts.alone, 0, "{half}");
    }
}

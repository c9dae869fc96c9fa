//! Detection of surface that the spheres leave uncovered between the cover points.
//!
//! Where spheres meet, the surface between samples lies outside both. The points that lie furthest
//! outside become cover points, so that refitting includes them. The final growth of the leaves is
//! then small.

use super::types::CoverPoints;
use crate::TriMesh;
use crate::Vec3;
use crate::tree::Progress;
use crate::tree::grow_to_cover::{deficit, halves_of};
use crate::tree::sphere::Sphere;

/// Adds a cover point for each cube of side `small` in which pieces of surface of about that size
/// lie in no sphere. Returns the number of points added.
pub(super) fn add_uncovered(
    cover: &mut CoverPoints,
    mesh: &TriMesh,
    spheres: &[Sphere],
    small: f64,
    progress: &dyn Progress,
) -> usize {
    let all: Vec<u32> = (0..spheres.len() as u32).collect();
    let before = cover.points.len();
    let mut found = Vec::new();
    for t in (0..mesh.triangles.len()).take_while(|_| !progress.stopped()) {
        find_uncovered(&mesh.corners(t), t as u32, &all, small, spheres, &mut found);
    }
    let origin = mesh.aabb().min;
    let cube = |p: &Vec3| ((p - origin) / small).map(|x| x as u32);
    found.sort_by(|x, y| {
        let (a, b) = (cube(&x.1), cube(&y.1));
        a.as_slice().cmp(b.as_slice()).then(y.0.total_cmp(&x.0)).then(x.2.cmp(&y.2))
    });
    found.dedup_by(|x, y| cube(&x.1) == cube(&y.1));
    found.into_iter().for_each(|(_, p, t)| cover.push(p, t, mesh));
    cover.points.len() - before
}

/// Finds the uncovered points: how far outside each lies, its position, its triangle.
fn find_uncovered(
    piece: &[Vec3; 3],
    t: u32,
    near: &[u32],
    small: f64,
    spheres: &[Sphere],
    found: &mut Vec<(f64, Vec3, u32)>,
) {
    let deficits: Vec<(f64, u32)> = near.iter().map(|&k| (deficit(&spheres[k as usize], piece), k)).collect();
    let Some(least) = deficits.iter().min_by(|a, b| a.0.total_cmp(&b.0)).filter(|l| l.0 > 0.0) else { return };
    let (size, halves) = halves_of(piece);
    if size < small {
        let sphere = &spheres[least.1 as usize];
        let out = |p: &Vec3| (p - sphere.center).norm_squared();
        found.extend(piece.iter().max_by(|p, q| out(p).total_cmp(&out(q))).map(|p| (least.0, *p, t)));
        return;
    }
    let near: Vec<u32> = deficits.iter().filter(|l| l.0 <= least.0 + size).map(|l| l.1).collect();
    for half in halves {
        find_uncovered(&half, t, &near, small, spheres, found);
    }
}

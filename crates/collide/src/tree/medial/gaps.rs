//! Gaps: the places of the surface that the balls leave uncovered between the cover points.
//!
//! Where balls meet, the surface between samples sticks out of both. The points that stick out most become cover
//! points, so that refitting sees them: closing then has little left to grow.

use super::spheres::CoverPoints;
use crate::TriMesh;
use crate::Vec3;
use crate::tree::ball::Ball;
use crate::tree::close::lack;

/// Adds cover points where pieces of surface of about the size `small` lie in no ball; their number.
pub(super) fn add_gaps(cover: &mut CoverPoints, mesh: &TriMesh, balls: &[Ball], small: f64) -> usize {
    let all: Vec<u32> = (0..balls.len() as u32).collect();
    let before = cover.points.len();
    for t in 0..mesh.triangles.len() {
        let mut found = Vec::new();
        look(&mesh.corners(t), &all, small, balls, &mut found);
        found.into_iter().for_each(|p| cover.push(p, t as u32, mesh));
    }
    cover.points.len() - before
}

fn look(piece: &[Vec3; 3], near: &[u32], small: f64, balls: &[Ball], found: &mut Vec<Vec3>) {
    let lacks: Vec<(f64, u32)> = near.iter().map(|&k| (lack(&balls[k as usize], piece), k)).collect();
    let Some(least) = lacks.iter().min_by(|a, b| a.0.total_cmp(&b.0)).filter(|l| l.0 > 0.0) else { return };
    let [a, b, c] = *piece;
    let size = (a - b).norm().max((b - c).norm()).max((c - a).norm());
    if size < small {
        let ball = &balls[least.1 as usize];
        let out = |p: &Vec3| (p - ball.center).norm_squared();
        found.extend(piece.iter().copied().max_by(|p, q| out(p).total_cmp(&out(q))));
        return;
    }
    let near: Vec<u32> = lacks.iter().filter(|l| l.0 <= least.0 + size).map(|l| l.1).collect();
    let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
    for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
        look(&part, &near, small, balls, found);
    }
}

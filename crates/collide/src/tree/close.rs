//! Closing: leaves are grown until they cover the surface itself, and not only samples of it.
//!
//! A triangle lies in a ball iff its corners do. Each is halved at its longest side until a piece lies in one ball or is small; the
//! ball that needs least to hold a small piece is grown to hold it.

use super::Progress;
use super::ball::Ball;
use crate::{TriMesh, Vec3};

/// Pieces smaller than this part of the mesh's diagonal are not split.
const SMALL: f64 = 4e-4;

/// The balls, grown to cover.
pub(super) fn closed(mesh: &TriMesh, mut balls: Vec<Ball>, progress: &dyn Progress) -> Vec<Ball> {
    let small = SMALL * mesh.diagonal();
    let all: Vec<u32> = (0..balls.len() as u32).collect();
    for t in (0..mesh.triangles.len()).take_while(|_| !progress.stopped()) {
        cover(&mesh.corners(t), &all, small, &mut balls);
    }
    // a rounding's worth, so that containment holds in floating point
    balls.iter_mut().for_each(|b| b.radius *= 1.0 + 1e-12);
    balls
}

/// Covers a piece by the balls `near`, which are all that could.
fn cover(piece: &[Vec3; 3], near: &[u32], small: f64, balls: &mut [Ball]) {
    if near.iter().any(|&k| lack(&balls[k as usize], piece) <= 0.0) {
        return;
    }
    let (size, halves) = halved(piece);
    if size < small {
        let least = near.iter().map(|&k| (lack(&balls[k as usize], piece), k)).min_by(|x, y| x.0.total_cmp(&y.0));
        if let Some((lack, k)) = least {
            balls[k as usize].radius += lack;
        }
        return;
    }
    // of the balls that reach within the piece's size of its least lack, one will hold or be grown
    let lacks: Vec<(f64, u32)> = near.iter().map(|&k| (lack(&balls[k as usize], piece), k)).collect();
    let bar = lacks.iter().map(|l| l.0).fold(f64::INFINITY, f64::min).max(0.0) + size;
    let near: Vec<u32> = lacks.into_iter().filter(|l| l.0 <= bar).map(|l| l.1).collect();
    for half in halves {
        cover(&half, &near, small, balls);
    }
}

/// The longest side of a piece, and its halves on the two sides of that side's middle.
pub(super) fn halved(piece: &[Vec3; 3]) -> (f64, [[Vec3; 3]; 2]) {
    let side = |k: usize| (piece[(k + 1) % 3] - piece[k]).norm();
    let k = (0..3).max_by(|&i, &j| side(i).total_cmp(&side(j))).unwrap_or(0);
    let [a, b, c] = [piece[k], piece[(k + 1) % 3], piece[(k + 2) % 3]];
    let middle = 0.5 * (a + b);
    (side(k), [[a, middle, c], [middle, b, c]])
}

/// By how much a ball must be grown to hold the piece.
pub(super) fn lack(ball: &Ball, piece: &[Vec3; 3]) -> f64 {
    let square = piece.iter().map(|p| (p - ball.center).norm_squared()).fold(0.0, f64::max);
    square.sqrt() - ball.radius
}

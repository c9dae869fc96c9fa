//! Growth of leaves until they cover the surface itself, not only samples of it.
//!
//! A triangle lies in a sphere iff its corners do. Each triangle is halved at its longest side
//! until a piece lies in one sphere or is small. The sphere with the smallest deficit is grown to
//! contain a small piece.

use super::Progress;
use super::sphere::Sphere;
use crate::{TriMesh, Vec3};

/// Smallest piece that is split, as a fraction of the mesh's diagonal.
const MIN_PIECE: f64 = 4e-4;

/// Returns the spheres, grown to cover the surface.
pub(super) fn grown_to_cover(mesh: &TriMesh, mut spheres: Vec<Sphere>, progress: &dyn Progress) -> Vec<Sphere> {
    let small = MIN_PIECE * mesh.diagonal();
    let all: Vec<u32> = (0..spheres.len() as u32).collect();
    for t in (0..mesh.triangles.len()).take_while(|_| !progress.stopped()) {
        cover(&mesh.corners(t), &all, small, &mut spheres);
    }
    // one rounding error more, so that containment holds in floating point
    spheres.iter_mut().for_each(|b| b.radius *= 1.0 + 1e-12);
    spheres
}

/// Covers a piece by the spheres `near`; no other sphere can contain it.
fn cover(piece: &[Vec3; 3], near: &[u32], small: f64, spheres: &mut [Sphere]) {
    if near.iter().any(|&k| deficit(&spheres[k as usize], piece) <= 0.0) {
        return;
    }
    let (size, halves) = halves_of(piece);
    if size < small {
        let least = near.iter().map(|&k| (deficit(&spheres[k as usize], piece), k)).min_by(|x, y| x.0.total_cmp(&y.0));
        if let Some((deficit, k)) = least {
            spheres[k as usize].radius += deficit;
        }
        return;
    }
    // only spheres within the piece's size of the smallest deficit can contain its halves or be
    // grown
    let deficits: Vec<(f64, u32)> = near.iter().map(|&k| (deficit(&spheres[k as usize], piece), k)).collect();
    let bar = deficits.iter().map(|l| l.0).fold(f64::INFINITY, f64::min).max(0.0) + size;
    let near: Vec<u32> = deficits.into_iter().filter(|l| l.0 <= bar).map(|l| l.1).collect();
    for half in halves {
        cover(&half, &near, small, spheres);
    }
}

/// Returns the length of the longest side of a piece, and its two halves.
pub(super) fn halves_of(piece: &[Vec3; 3]) -> (f64, [[Vec3; 3]; 2]) {
    let side = |k: usize| (piece[(k + 1) % 3] - piece[k]).norm();
    let k = (0..3).max_by(|&i, &j| side(i).total_cmp(&side(j))).unwrap_or(0);
    let [a, b, c] = [piece[k], piece[(k + 1) % 3], piece[(k + 2) % 3]];
    let middle = 0.5 * (a + b);
    (side(k), [[a, middle, c], [middle, b, c]])
}

/// Returns how much a sphere must grow to contain the piece, meters.
pub(super) fn deficit(sphere: &Sphere, piece: &[Vec3; 3]) -> f64 {
    let square = piece.iter().map(|p| (p - sphere.center).norm_squared()).fold(0.0, f64::max);
    square.sqrt() - sphere.radius
}

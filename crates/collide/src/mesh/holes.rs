//! Triangulation of holes.
//!
//! Short boundaries: the triangulation whose sharpest fold, against itself and the surrounding
//! faces, is the smallest; of equal ones the one with the least area. Found by dynamic programming
//! over the sub-chains `i … k` of the boundary:
//!
//! ```text
//! W(i, k) = min over m of  max-and-sum( W(i, m), W(m, k), weight of triangle (i, m, k) )
//! ```
//!
//! Longer boundaries are ear-clipped ([`super::ear_clipping`]); a boundary that crosses itself is
//! filled too.
//!
//! Sources: Barequet and Sharir, *Filling gaps in the boundary of a polyhedron* (1995), for the
//! program; Liepa, *Filling holes in meshes* (2003), for the weight.

use super::ear_clipping::clip_ears;
use crate::Vec3;

/// Maximum number of edges of a boundary for dynamic programming, whose time is cubic.
const MAX_DP_EDGES: usize = 200;
/// Maximum number of corners of longer boundaries that are tested per ear.
const MAX_TRIES: usize = 64;
/// Maximum of the number of edges times the square of the limit, over all boundaries of a mesh:
/// limits the total time.
const MAX_WORK: f64 = 1.5e9;
/// Fold of a triangle without area, larger than any other.
const DEGENERATE_FOLD: f64 = 4.0;
/// Fold of a triangle that repeats a vertex.
const REPEATED_VERTEX_FOLD: f64 = 8.0;

/// Fills a hole with triangles of indices into its boundary. `normals[n]` is the normal of the face
/// at the edge from point n to n+1, unit length or zero. The triangles have the orientation of the
/// points.
pub(super) fn fill(points: &[Vec3], normals: &[Vec3], max_dp_edges: usize) -> Vec<[usize; 3]> {
    if points.len() <= max_dp_edges {
        min_weight_triangulation(points, normals)
    } else {
        clip_ears(points, MAX_TRIES, &mut { u64::MAX })
    }
}

/// Returns the limit of dynamic programming for a mesh whose boundaries have `edges` edges in
/// total.
pub(super) fn max_dp_edges_for(edges: usize) -> usize {
    MAX_DP_EDGES.min((MAX_WORK / edges.max(1) as f64).sqrt() as usize).max(4)
}

/// Sharpest fold as 1 − cos of the angle between normals, and doubled area.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weight(f64, f64);

impl Weight {
    fn combined(self, other: Weight) -> Weight {
        Weight(self.0.max(other.0), self.1 + other.1)
    }

    fn is_less(self, other: Weight) -> bool {
        // folds that differ only by rounding are equal
        if (self.0 - other.0).abs() > 1e-9 { self.0 < other.0 } else { self.1 < other.1 }
    }
}

fn min_weight_triangulation(points: &[Vec3], edge_normals: &[Vec3]) -> Vec<[usize; 3]> {
    let n = points.len();
    let at = |i: usize, k: usize| i * n + k;
    let mut best = vec![Weight(0.0, 0.0); n * n];
    let mut apex = vec![0; n * n];
    let mut normal = vec![Vec3::zeros(); n * n];
    for i in 0..n - 1 {
        normal[at(i, i + 1)] = edge_normals[i];
    }
    for length in 2..n {
        for i in 0..n - length {
            let k = i + length;
            let mut least = Weight(f64::INFINITY, f64::INFINITY);
            for m in i + 1..k {
                let before = best[at(i, m)].combined(best[at(m, k)]);
                if before.0 > least.0 + 1e-9 {
                    continue;
                }
                let (own, area) = normal_and_area(&points[i], &points[m], &points[k]);
                let mut fold = own.map_or(DEGENERATE_FOLD, |n| {
                    fold_angle(&n, &normal[at(i, m)]).max(fold_angle(&n, &normal[at(m, k)]))
                });
                if let (Some(n), true) = (own, length + 1 == points.len()) {
                    fold = fold.max(fold_angle(&n, &edge_normals[points.len() - 1]));
                }
                if points[i] == points[m] || points[m] == points[k] || points[k] == points[i] {
                    fold = REPEATED_VERTEX_FOLD;
                }
                let weight = before.combined(Weight(fold, area));
                if weight.is_less(least) {
                    least = weight;
                    apex[at(i, k)] = m;
                    normal[at(i, k)] = own.unwrap_or_default();
                }
            }
            best[at(i, k)] = least;
        }
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, k)) = open.pop() {
        if k > i + 1 {
            let m = apex[at(i, k)];
            triangles.push([i, m, k]);
            open.extend([(m, k), (i, m)]);
        }
    }
    triangles
}

/// Returns 1 − cos of the angle between the normals of two faces; 0 without a second face.
fn fold_angle(a: &Vec3, b: &Vec3) -> f64 {
    if *b == Vec3::zeros() { 0.0 } else { 1.0 - a.dot(b) }
}

fn normal_and_area(a: &Vec3, b: &Vec3, c: &Vec3) -> (Option<Vec3>, f64) {
    let (u, v) = (b - a, c - a);
    let n = u.cross(&v);
    let area = n.norm();
    let flat = area <= 1e-12 * u.norm_squared().max(v.norm_squared());
    (if flat { None } else { Some(n / area) }, area)
}

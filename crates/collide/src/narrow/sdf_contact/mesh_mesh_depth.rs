//! Deep overlaps of two meshes, or of a box and a mesh: the deepest point of one surface below the
//! other, by branch and bound.
//!
//! ```text
//! D(p) = − d_B(p) ≤ dist_t(p)                            depth below B's surface: at most the distance from any of its triangles t
//! D(p) ≤ D(q) + |p − q|
//! D(p) ≤ max over the corners x of a box of dist_t(x)    p in the box, since dist_t is convex
//! D(p) ≤ Σ_t λ_t Σ_i w_i dist_t(p_i)                     p = Σ_i w_i p_i in a triangle; any weights λ ≥ 0 that add up to 1
//! max over p of D(p) ≤ min over λ of max over i of Σ_t λ_t dist_t(p_i)
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `p_i` | corners of a face of A, or of a part of one |
//! | `t` | the triangles of B that are closest to these corners |
//! | `λ` | mixed strategy of a matrix game with rows `t` and columns `p_i`; the value of the game is the bound |
//!
//! If one triangle of B is closest to the whole part, the bound is attained at a corner. On a ridge
//! of `D`, where two or three triangles are equally close, the mixture is exact for flat faces. A
//! part whose bound exceeds the best depth by more than the tolerance is halved across its longest
//! side (Horst and Tuy, *Global optimization*, 1996). Faces are found by a tree of boxes, deeper
//! boxes first.

use super::super::reduce::Collector;
use super::query::{Query, point_normal};
use crate::mesh::BestFirstSearch;
use crate::sdf::field::MeshField;
use crate::sdf::{DistanceField, TOUCHING};
use crate::{Aabb, Vec3};

/// Minimum gain of depth, in radii of the smaller body: the result can be less than the maximum by
/// this.
const MIN_GAIN: f64 = 4e-4;
/// Maximum number of halvings of a face; for a face as long as the body they leave parts of a
/// millionth of it.
const MAX_HALVINGS: u32 = 40;

impl Query<'_> {
    /// Adds one contact at the deepest point of the mesh's faces below the other mesh's surface, if
    /// that is deeper than the other contacts.
    pub(super) fn deepest(&self, mesh: &MeshField, other: &MeshField, found: &mut Collector) {
        let mut search = DepthSearch::new(self, mesh.faces(), other, found);
        mesh.search_faces(&mut search);
        search.push(found);
    }

    /// Adds one contact at the deepest point of a box's faces below the surface of the field's mesh,
    /// if that is deeper than the other contacts.
    pub(super) fn faces_of_box(&self, half: &Vec3, found: &mut Collector) {
        let Some(other) = self.mesh else { return };
        let faces: [[Vec3; 3]; 12] = std::array::from_fn(|t| {
            let (k, side) = (t / 4, if t & 1 == 0 { 1.0 } else { -1.0 });
            let corner = |u: f64, v: f64| {
                let (u, v) = (Vec3::ith((k + 1) % 3, u), Vec3::ith((k + 2) % 3, v));
                (Vec3::ith(k, side) + u + v).component_mul(half)
            };
            let last = if t & 2 == 0 { corner(1.0, -1.0) } else { corner(-1.0, 1.0) };
            [corner(1.0, 1.0), corner(-1.0, -1.0), last]
        });
        let mut search = DepthSearch::new(self, &faces, other, found);
        (0..faces.len()).for_each(|t| search.visit_triangle(t));
        search.push(found);
    }
}

struct DepthSearch<'a, 'b> {
    query: &'a Query<'b>,
    /// Corners, in the frame of the element.
    faces: &'a [[Vec3; 3]],
    other: &'a MeshField,
    /// Best depth so far, and the required gain, meters.
    deepest: f64,
    gain: f64,
    /// The face with the best depth, and the point in the frame of the field.
    best: Option<(usize, Vec3)>,
}

/// The depth at a point.
#[derive(Clone, Copy)]
struct DepthSample {
    at: Vec3,
    /// Depth below the other's surface, meters.
    depth: f64,
    /// The closest triangle of the other mesh.
    closest: usize,
}

impl BestFirstSearch for DepthSearch<'_, '_> {
    fn upper_bound(&self, bounds: &Aabb) -> f64 {
        let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
        let (at, reach) = (self.query.to_field(&middle), half.norm());
        let upper_bound = reach - self.other.bound(&at);
        if upper_bound <= self.threshold() {
            return upper_bound;
        }
        let (distance, t) = self.other.closest_face(&at);
        let upper_bound = upper_bound.min(reach - distance);
        if upper_bound <= self.threshold() {
            return upper_bound;
        }
        let corner = |octant: u32| middle + Vec3::from_fn(|k, _| if octant >> k & 1 == 1 { half[k] } else { -half[k] });
        let furthest = (0..8)
            .map(|octant| self.other.distance_from_face(t, &self.query.to_field(&corner(octant))))
            .fold(0.0, f64::max);
        upper_bound.min(furthest)
    }

    fn threshold(&self) -> f64 {
        self.deepest + self.gain
    }

    fn visit_triangle(&mut self, t: usize) {
        let corners = self.faces[t].map(|c| self.sample(t, self.query.to_field(&c)));
        self.refine_part(t, corners, MAX_HALVINGS);
    }
}

impl<'a, 'b> DepthSearch<'a, 'b> {
    fn new(
        query: &'a Query<'b>,
        faces: &'a [[Vec3; 3]],
        other: &'a MeshField,
        found: &Collector,
    ) -> DepthSearch<'a, 'b> {
        let deepest = (-found.min_gap()).max(0.0);
        DepthSearch { query, faces, other, deepest, gain: MIN_GAIN * query.size, best: None }
    }

    /// Adds the contact of the deepest point, if there is one.
    fn push(&self, found: &mut Collector) {
        let Some((t, at)) = self.best else { return };
        let hit = self.query.field.hit(&at, &[], TOUCHING);
        self.query.push(&at, 0.0, &hit, point_normal(&hit), 1 << 56 | t as u64, found);
    }

    fn sample(&mut self, t: usize, at: Vec3) -> DepthSample {
        let (distance, closest) = self.other.closest_face(&at);
        let depth = -distance;
        if depth > self.deepest {
            (self.deepest, self.best) = (depth, Some((t, at)));
        }
        DepthSample { at, depth, closest }
    }

    /// Searches a part of a face, with at most `halvings` halvings.
    fn refine_part(&mut self, t: usize, corners: [DepthSample; 3], halvings: u32) {
        if halvings == 0 || self.bound(&corners) <= self.threshold() {
            return;
        }
        let side = |k: usize| (corners[(k + 1) % 3].at - corners[k].at).norm_squared();
        let longest = (1..3).fold(0, |best, k| if side(k) > side(best) { k } else { best });
        let [a, b, c] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
        let middle = self.sample(t, 0.5 * (a.at + b.at));
        let [first, last] = if a.depth >= b.depth { [a, b] } else { [b, a] };
        self.refine_part(t, [first, middle, c], halvings - 1);
        self.refine_part(t, [middle, last, c], halvings - 1);
    }

    /// Returns an upper bound of the depth in a part.
    fn bound(&self, corners: &[DepthSample; 3]) -> f64 {
        // `D` changes by at most 1 m per meter; outside the other body this is better than
        // distances
        let far = |c: &DepthSample| corners.iter().map(|x| (x.at - c.at).norm_squared()).fold(0.0, f64::max).sqrt();
        let upper_bound = corners.iter().map(|c| c.depth + far(c)).fold(f64::INFINITY, f64::min);
        if upper_bound <= self.threshold() {
            return upper_bound;
        }
        let rows = corners.map(|row| {
            corners.map(|c| {
                if c.closest == row.closest { c.depth.abs() } else { self.other.distance_from_face(row.closest, &c.at) }
            })
        });
        upper_bound.min(game_value(&rows))
    }
}

/// Returns an upper bound of the value of a matrix game with a minimizing row player; it is
/// attained up to rounding.
fn game_value(rows: &[[f64; 3]; 3]) -> f64 {
    let upper_bound = |weights: [f64; 3]| {
        (0..3).map(|i| (0..3).map(|t| weights[t] * rows[t][i]).sum::<f64>()).fold(f64::NEG_INFINITY, f64::max)
    };
    let mut least =
        (0..3).map(|t| rows[t].iter().copied().fold(f64::NEG_INFINITY, f64::max)).fold(f64::INFINITY, f64::min);
    let mut try_weights = |weights: [f64; 3]| {
        let sum: f64 = weights.iter().sum();
        if weights.iter().all(|w| *w >= 0.0) && sum > 0.0 {
            least = least.min(upper_bound(weights.map(|w| w / sum)));
        }
    };
    // two rows, mixed so that two columns are equal
    for (t, u) in [(0, 1), (1, 2), (2, 0)] {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (rises, falls) = (rows[t][j] - rows[t][i], rows[u][i] - rows[u][j]);
            let mut weights = [0.0; 3];
            (weights[t], weights[u]) = if rises < 0.0 { (-falls, -rises) } else { (falls, rises) };
            try_weights(weights);
        }
    }
    // all three rows, mixed so that all columns are equal
    let column = |i: usize| Vec3::new(rows[0][i], rows[1][i], rows[2][i]);
    let mixed = (column(0) - column(1)).cross(&(column(0) - column(2)));
    try_weights((mixed * mixed.sum().signum()).into());
    least
}

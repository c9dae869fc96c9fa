//! A cell and its closest triangle, which decide the other relevant triangles and whether the cell
//! is divided. The rules are those of [`super::builder`].

use super::builder::corner;
use super::triangles::Triangles;
use crate::Vec3;
use crate::mesh::closest_on_triangle;

/// Length of a list up to which the cell is not divided.
pub(super) const SHORT_LIST: usize = 16;
/// Half diagonal, in mean lengths of an edge, up to which a cell is small, and the length of a list up to which a small cell
/// is not divided: a mesh of long thin triangles has many of them near most places.
const SMALL_CELL: f64 = 0.6;
const SHORT_LIST_OF_SMALL: usize = 32;
/// Maximum length of a list at the last level, or far from the surface.
pub(super) const LONG_LIST: usize = 96;
/// Distance from the surface, in half diagonals, above which a cell is not divided if its list is
/// not too long.
const FAR_FACTOR: f64 = 3.0;
/// Distance from the surface, as a fraction of the diagonal, above which a cell is not divided.
const FAR_DISTANCE: f64 = 0.06;
/// Cosine between the normals below which a triangle faces another side.
const OTHER_SIDE_COSINE: f64 = 0.5;
/// Smallest distance with a reliable direction, as a fraction of the diagonal.
const MIN_DISTANCE: f64 = 1e-9;
/// Bound of single-precision errors in distances and coordinates.
pub(super) const ROUNDING: f64 = 1e-6;

/// A triangle that can be relevant in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearTriangle {
    /// Distance from the cell's center.
    pub distance: f64,
    pub triangle: u32,
    /// Slope of the distance at the cell's center; zero on the triangle itself, where the distance
    /// is minimal.
    pub slope: Vec3,
}

impl NearTriangle {
    /// Returns a triangle whose distance is not yet known.
    pub fn anywhere(triangle: u32) -> NearTriangle {
        NearTriangle { distance: 0.0, triangle, slope: Vec3::zeros() }
    }
}

/// A cell and its closest triangle.
#[derive(Clone, Debug)]
pub(super) struct CellView {
    pub center: Vec3,
    pub half: f64,
    /// Half the diagonal.
    pub reach: f64,
    pub first: NearTriangle,
    /// Signed distance of the center.
    pub distance: f64,
    /// `e₀`.
    pub excess: f64,
    /// Whether triangles that face another side are relevant: if an element can be inside, or
    /// nearly touches.
    pub takes_others: bool,
}

impl CellView {
    pub fn new(triangles: &Triangles, center: Vec3, half: f64, first: NearTriangle) -> CellView {
        let found = triangles.closest_of(&center, first.triangle as usize);
        let distance = triangles.describe(&center, &found).distance;
        let reach = 3.0_f64.sqrt() * half;
        let excess = excess(triangles, &center, half, &first);
        CellView { center, half, reach, first, distance, excess, takes_others: distance < reach + triangles.around }
    }

    /// Returns the largest distance of a relevant triangle from the center.
    pub fn furthest(&self, triangles: &Triangles) -> f64 {
        self.first.distance + 2.0 * self.reach + triangles.around
    }

    /// Returns whether a triangle is relevant that faces another side than the closest one.
    pub fn is_turned(&self, triangles: &Triangles, t: u32) -> bool {
        let facing_first = triangles.normals[self.first.triangle as usize][0];
        self.takes_others && triangles.normals[t as usize][0].dot(&facing_first) < OTHER_SIDE_COSINE
    }

    /// Returns whether a triangle is close enough to be tested.
    fn is_close(&self, triangles: &Triangles, n: &NearTriangle) -> bool {
        n.distance <= self.first.distance + 2.0 * self.reach
            || (n.distance <= self.furthest(triangles) && self.is_turned(triangles, n.triangle))
    }

    pub fn counts(&self, triangles: &Triangles, n: &NearTriangle, turned: bool) -> bool {
        let slack = self.excess + ROUNDING * triangles.diagonal;
        let more = if turned { triangles.around } else { 0.0 };
        n.distance - self.first.distance <= slack + more + self.half * (n.slope - self.first.slope).abs().sum()
    }

    pub fn is_listed(&self, triangles: &Triangles, n: &NearTriangle) -> bool {
        self.counts(triangles, n, self.is_turned(triangles, n.triangle))
    }

    /// Returns whether the cell's children inherit a triangle. A triangle that faces another side
    /// in a child need not do so here.
    pub fn passes_on(&self, triangles: &Triangles, t: u32) -> bool {
        let n = triangles.near(&self.center, t);
        self.is_close(triangles, &n) && self.counts(triangles, &n, self.takes_others)
    }

    /// Returns whether an inherited triangle belongs in the cell's list.
    pub fn lists(&self, triangles: &Triangles, t: u32) -> bool {
        let n = triangles.near(&self.center, t);
        self.is_close(triangles, &n) && self.is_listed(triangles, &n)
    }

    pub fn is_away(&self, triangles: &Triangles) -> bool {
        self.first.distance > FAR_DISTANCE * triangles.diagonal
    }

    /// Returns whether the list is so long, and the surface so close, that the cell is divided;
    /// `listed` can be capped at more than [`LONG_LIST`].
    pub fn is_divided(&self, triangles: &Triangles, listed: usize) -> bool {
        let far = self.first.distance > FAR_FACTOR * self.reach && (listed <= LONG_LIST || self.is_away(triangles));
        let is_small = self.reach <= SMALL_CELL * triangles.mean_edge;
        listed > (if is_small { SHORT_LIST_OF_SMALL } else { SHORT_LIST }) && !far
    }
}

pub(super) fn order(a: &NearTriangle, b: &NearTriangle) -> std::cmp::Ordering {
    a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle))
}

impl Triangles {
    /// Returns a triangle with its distance from a cell's center.
    pub fn near(&self, center: &Vec3, triangle: u32) -> NearTriangle {
        let from = center - closest_on_triangle(center, &self.corners[triangle as usize]).0;
        let distance = from.norm();
        let slope = if distance > MIN_DISTANCE * self.diagonal { from / distance } else { Vec3::zeros() };
        NearTriangle { distance, triangle, slope }
    }
}

/// Returns `e₀`: an upper bound of how far the distance of a triangle rises above its tangent plane
/// within the cell, meters.
fn excess(triangles: &Triangles, center: &Vec3, half: f64, n: &NearTriangle) -> f64 {
    let (slope, triangle) = (n.slope, &triangles.corners[n.triangle as usize]);
    let of = |offset: Vec3| {
        let corner = center + offset;
        (closest_on_triangle(&corner, triangle).0 - corner).norm() - n.distance - slope.dot(&offset)
    };
    (0..8).map(|octant| of(corner(octant, half))).fold(0.0, f64::max)
}

//! A cell as its closest triangle decides it: which other triangles count in it, and whether it is divided. The rules are those of [`super::builder`].

use super::builder::corner;
use super::triangles::Triangles;
use crate::Vec3;
use crate::mesh::closest_on_triangle;

/// Lists up to this length are not divided.
pub(super) const SHORT_LIST: usize = 16;
/// At the last level, or far from the surface, lists up to this length are kept.
pub(super) const LONG_LIST: usize = 96;
/// A cell further from the surface than this many half diagonals is not divided, if its list is not too long,
const FAR_FACTOR: f64 = 3.0;
/// or it is further than this, as a part of the diagonal.
const FAR_DISTANCE: f64 = 0.06;
/// Another way: cosine between the normals below this.
const OTHER_SIDE_COSINE: f64 = 0.5;
/// A distance that has a direction in spite of rounding, as a part of the diagonal.
const MIN_DISTANCE: f64 = 1e-9;
/// Of single precision in distances and places, and more.
pub(super) const ROUNDING: f64 = 1e-6;

/// A triangle that may count in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct NearTriangle {
    /// Of the cell's center.
    pub distance: f64,
    pub triangle: u32,
    /// Of the distance at the cell's center; none on the triangle itself, where the distance is least.
    pub slope: Vec3,
}

impl NearTriangle {
    /// Of a triangle that nothing is known of yet.
    pub fn anywhere(triangle: u32) -> NearTriangle {
        NearTriangle { distance: 0.0, triangle, slope: Vec3::zeros() }
    }
}

/// A cell and its closest triangle, which decide which others count.
#[derive(Clone, Debug)]
pub(super) struct CellView {
    pub center: Vec3,
    pub half: f64,
    /// Half the diagonal.
    pub reach: f64,
    pub first: NearTriangle,
    /// Signed, of the center.
    pub distance: f64,
    /// `e₀`.
    pub excess: f64,
    /// Whether triangles that face another way are taken: where an element is inside, or as good as touches.
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

    /// No triangle that counts is further from the center.
    pub fn furthest(&self, triangles: &Triangles) -> f64 {
        self.first.distance + 2.0 * self.reach + triangles.around
    }

    /// Whether a triangle is taken that faces another way than the closest.
    pub fn is_turned(&self, triangles: &Triangles, t: u32) -> bool {
        let facing_first = triangles.normals[self.first.triangle as usize][0];
        self.takes_others && triangles.normals[t as usize][0].dot(&facing_first) < OTHER_SIDE_COSINE
    }

    /// Whether a triangle is close enough to be looked at.
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

    /// Whether the cell's children inherit a triangle: one that may face another way in a child may not do so in this cell.
    pub fn passes_on(&self, triangles: &Triangles, t: u32) -> bool {
        let n = triangles.near(&self.center, t);
        self.is_close(triangles, &n) && self.counts(triangles, &n, self.takes_others)
    }

    /// Whether the cell is listed with a triangle that it inherits.
    pub fn lists(&self, triangles: &Triangles, t: u32) -> bool {
        let n = triangles.near(&self.center, t);
        self.is_close(triangles, &n) && self.is_listed(triangles, &n)
    }

    pub fn is_away(&self, triangles: &Triangles) -> bool {
        self.first.distance > FAR_DISTANCE * triangles.diagonal
    }

    /// Whether a list is so long, and the surface so close, that the cell is divided; `listed` may be capped at more than [`LONG_LIST`].
    pub fn is_divided(&self, triangles: &Triangles, listed: usize) -> bool {
        let far = self.first.distance > FAR_FACTOR * self.reach && (listed <= LONG_LIST || self.is_away(triangles));
        listed > SHORT_LIST && !far
    }
}

pub(super) fn order(a: &NearTriangle, b: &NearTriangle) -> std::cmp::Ordering {
    a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle))
}

impl Triangles {
    /// A triangle as it is seen from a cell's center.
    pub fn near(&self, center: &Vec3, triangle: u32) -> NearTriangle {
        let from = center - closest_on_triangle(center, &self.corners[triangle as usize]).0;
        let distance = from.norm();
        let slope = if distance > MIN_DISTANCE * self.diagonal { from / distance } else { Vec3::zeros() };
        NearTriangle { distance, triangle, slope }
    }
}

/// `e₀`: how far the distance of a triangle rises above its tangent plane within the cell, at most, meters.
fn excess(triangles: &Triangles, center: &Vec3, half: f64, n: &NearTriangle) -> f64 {
    let (slope, triangle) = (n.slope, &triangles.corners[n.triangle as usize]);
    let of = |offset: Vec3| {
        let corner = center + offset;
        (closest_on_triangle(&corner, triangle).0 - corner).norm() - n.distance - slope.dot(&offset)
    };
    (0..8).map(|octant| of(corner(octant, half))).fold(0.0, f64::max)
}

//! Winding numbers: how often a surface encloses a point.
//!
//! For a closed surface it is an integer, 0 outside. Overlapping shells add up, so values above 1/2
//! are inside their union. A shell wound inwards subtracts one, so a cavity has 0.
//!
//! ```text
//! w(q) = 1/4π Σ Ω(a−q, b−q, c−q)        tan(Ω/2) = a·(b×c) / (|a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b|)
//! far:  w(q) ≈ ( N·r/|r|³ + tr D/|r|³ − 3 rᵀD r/|r|⁵ ) / 4π
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `Ω` | solid angle of a triangle, signed by its winding |
//! | `r = p − q` | from the query to the middle `p` of a group of triangles |
//! | `N = Σ A n` | sum of area vectors of the group |
//! | `D = Σ A (c − p) nᵀ` | their first moment, `c` a triangle's centroid |
//!
//! The winding number of a closed surface is also the number of times by which a ray leaves it more than it enters. [`WindingNumber::count`] finds
//! that with exact predicates along an axis, in far less time where many triangles are near; if the ray meets an edge, or `q` lies on a
//! triangle, along another axis, and otherwise by the sum.
//!
//! Sources: Van Oosterom and Strackee, *The solid angle of a plane triangle* (1983); Barill et al.,
//! *Fast winding numbers for soups and clouds* (2018), of which the first two terms are used.

use super::TriMesh;
use super::aabb_tree::AabbTree;
use super::crossing::{orient2d, orient3d};
use crate::{Mat3, Vec3};
use nalgebra::RealField;
use std::f64::consts::PI;

/// A group whose triangles all lie within `R` of its middle is far at distance `FAR_FACTOR·R`.
const FAR_FACTOR: f64 = 2.0;
/// Largest difference of a sum from an integer for which it is not computed again exactly.
const MAX_ROUNDING: f64 = 0.2;
/// A point lies in a triangle's plane if the volume spanned by the directions to the corners is
/// smaller than this fraction of the product of their lengths.
const COPLANAR: f64 = 1e-14;

/// A solid angle function of a point and a triangle.
type Angle = fn(&Vec3, &[Vec3; 3]) -> f64;

/// A mesh prepared for winding numbers.
#[derive(Clone, Debug)]
pub struct WindingNumber {
    tree: AabbTree,
    /// In leaf order.
    corners: Vec<[Vec3; 3]>,
    groups: Vec<Group>,
}

/// The far-field expansion of the triangles of one node.
#[derive(Clone, Copy, Debug)]
struct Group {
    middle: Vec3,
    /// `(FAR_FACTOR·R)²`
    far: f64,
    area: Vec3,
    moment: Mat3,
}

impl WindingNumber {
    /// Prepares a mesh, open or closed, of at least one triangle.
    pub fn new(mesh: &TriMesh) -> WindingNumber {
        let corners: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let tree = AabbTree::new(&corners);
        let corners: Vec<[Vec3; 3]> = tree.ids.iter().map(|&t| corners[t as usize]).collect();
        let mut groups = Vec::with_capacity(tree.nodes.len());
        let ends = ends(&tree);
        for (node, end) in tree.nodes.iter().zip(&ends) {
            groups.push(Group::around(&corners[node.first as usize..*end]));
        }
        WindingNumber { tree, corners, groups }
    }

    /// Returns the winding number at `p`, meters. Far groups of triangles are approximated, with an
    /// error of some thousandths. If the sum is not close to an integer, all triangles are
    /// evaluated.
    pub fn at(&self, p: &Vec3) -> f64 {
        self.excluding(p, &[])
    }

    /// Returns the winding number as the sum of all solid angles, for any mesh, in linear time.
    pub fn exact(&self, p: &Vec3) -> f64 {
        self.corners.iter().map(|c| solid_angle(p, c)).sum::<f64>() / (4.0 * PI)
    }

    /// Returns whether `p` is inside the solid that the surface encloses at least once.
    pub fn contains(&self, p: &Vec3) -> bool {
        let count = (0..3).find_map(|axis| self.count(p, &[], axis));
        count.map_or_else(|| self.checked_sum(p, &[], solid_angle_off_plane) > 0.5, |count| count > 0)
    }

    /// Returns how often a ray from `p` along an axis leaves the surface more than it enters, without some triangles. For a closed surface and
    /// none skipped it is the winding number. `None` if the ray meets the edge of a triangle, or `p` lies on one.
    pub(super) fn count(&self, p: &Vec3, skipped: &[u32], axis: usize) -> Option<i32> {
        let plane = [(axis + 1) % 3, (axis + 2) % 3];
        let (mut count, mut open, mut depth) = (0, [0_u32; 64], 1);
        while depth > 0 {
            depth -= 1;
            let n = open[depth] as usize;
            let node = &self.tree.nodes[n];
            let bounds = &node.bounds;
            if p[axis] > bounds.max[axis] || plane.iter().any(|&k| p[k] < bounds.min[k] || p[k] > bounds.max[k]) {
                continue;
            }
            if node.count == 0 {
                open[depth] = node.second;
                open[depth + 1] = n as u32 + 1;
                depth += 2;
                continue;
            }
            for k in node.range().filter(|&k| !skipped.contains(&self.tree.ids[k])) {
                count += leaves(p, &self.corners[k], plane, axis)?;
            }
        }
        Some(count)
    }

    /// Returns the winding number without some triangles that contain `p`.
    pub(super) fn excluding(&self, p: &Vec3, skipped: &[u32]) -> f64 {
        self.checked_sum(p, skipped, solid_angle)
    }

    fn checked_sum(&self, p: &Vec3, skipped: &[u32], angle: Angle) -> f64 {
        let near = self.sum(p, skipped, 1.0, angle);
        // the skipped triangles can account for halves
        if (2.0 * near - (2.0 * near).round()).abs() <= MAX_ROUNDING {
            near
        } else {
            self.sum(p, skipped, f64::INFINITY, angle)
        }
    }

    fn sum(&self, p: &Vec3, skipped: &[u32], far_scale: f64, angle: Angle) -> f64 {
        let mut sum = 0.0;
        let mut open = [0_u32; 64];
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let n = open[depth] as usize;
            let (node, group) = (&self.tree.nodes[n], &self.groups[n]);
            let r = group.middle - p;
            let square = r.norm_squared();
            if square > group.far * far_scale {
                sum += group.angle(&r, square);
            } else if node.count > 0 {
                let kept = node.range().filter(|&k| !skipped.contains(&self.tree.ids[k]));
                sum += kept.map(|k| angle(p, &self.corners[k])).sum::<f64>();
            } else {
                open[depth] = node.second;
                open[depth + 1] = n as u32 + 1;
                depth += 2;
            }
        }
        sum / (4.0 * PI)
    }
}

impl Group {
    fn around(triangles: &[[Vec3; 3]]) -> Group {
        let weighed = |c: &[Vec3; 3]| ((c[1] - c[0]).cross(&(c[2] - c[0])) * 0.5, (c[0] + c[1] + c[2]) / 3.0);
        let (mut total, mut first, mut area) = (0.0, Vec3::zeros(), Vec3::zeros());
        for (n, c) in triangles.iter().map(weighed) {
            total += n.norm();
            first += c * n.norm();
            area += n;
        }
        let middle = if total > 0.0 { first / total } else { triangles[0][0] };
        let moment = triangles.iter().map(weighed).map(|(n, c)| (c - middle) * n.transpose()).sum();
        let square = triangles.iter().flatten().map(|p| (p - middle).norm_squared()).fold(0.0, f64::max);
        Group { middle, far: FAR_FACTOR * FAR_FACTOR * square, area, moment }
    }

    fn angle(&self, r: &Vec3, square: f64) -> f64 {
        let cube = square * square.sqrt();
        (self.area.dot(r) + self.moment.trace() - 3.0 * r.dot(&(self.moment * r)) / square) / cube
    }
}

/// Returns 1 if a ray from `p` along an axis passes a triangle from behind, −1 from its front, 0 if it does not; `None` if it meets an edge or `p`
/// lies on the triangle.
fn leaves(p: &Vec3, corners: &[Vec3; 3], plane: [usize; 2], axis: usize) -> Option<i32> {
    let [a, b, c] = corners;
    // beside or behind, without a predicate
    let beside = |k: usize| {
        let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
        p[k] < low || p[k] > high
    };
    if plane.iter().any(|&k| beside(k)) || p[axis] > a[axis].max(b[axis]).max(c[axis]) {
        return Some(0);
    }
    let sides = [orient2d(plane, a, b, p), orient2d(plane, b, c, p), orient2d(plane, c, a, p)];
    if sides.iter().any(|s| *s > 0.0) && sides.iter().any(|s| *s < 0.0) {
        return Some(0);
    }
    let turn = if sides.iter().all(|s| *s > 0.0) {
        1
    } else if sides.iter().all(|s| *s < 0.0) {
        -1
    } else {
        return None;
    };
    // positive below the plane, seen from where the corners turn counter-clockwise
    match orient3d(a, b, c, p) {
        0.0 => None,
        below => Some(if (below > 0.0) == (turn > 0) { turn } else { 0 }),
    }
}

/// Returns the end of each node's triangles.
fn ends(tree: &AabbTree) -> Vec<usize> {
    let mut ends = vec![0; tree.nodes.len()];
    for n in (0..tree.nodes.len()).rev() {
        let node = &tree.nodes[n];
        ends[n] = if node.count > 0 { node.range().end } else { ends[node.second as usize] };
    }
    ends
}

/// Returns [`solid_angle`], or 0 for a point in the plane of the triangle: the mean of the values
/// on its two sides, so that coincident faces back to back cancel.
fn solid_angle_off_plane(p: &Vec3, corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|x| x - p);
    let flat = a.dot(&b.cross(&c)).abs() <= COPLANAR * a.norm() * b.norm() * c.norm();
    if flat { 0.0 } else { solid_angle(p, corners) }
}

/// Returns the solid angle of a triangle seen from `p`, steradians. Positive if its winding is
/// clockwise seen from there, so a closed outward-wound surface sums to 4π inside.
pub(super) fn solid_angle(p: &Vec3, corners: &[Vec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|x| x - p);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let above = a.dot(&b.cross(&c));
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    2.0 * RealField::atan2(above, below)
}

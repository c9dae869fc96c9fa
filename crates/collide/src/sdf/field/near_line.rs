//! The triangles of a mesh near a segment, and the part of the segment that each can be near.
//!
//! ```text
//! x(s) = x₀ + s·u             the segment, from ≤ s ≤ to
//! h(s) = n·(x(s) − c₀)        height over the plane of a triangle with corners c and normal n
//! m_k = (c_k₊₁ − c_k) × n     outward across its edge k, as long as the edge
//! near within ρ:  |h(s)| ≤ ρ  and  m_k·(x(s) − c_k) ≤ ρ·|m_k|  for each k
//! ```
//!
//! These bounds are linear in `s` (Cyrus and Beck 1978). They hold at each place whose distance
//! from the triangle is at most `ρ`, and at a few more beside its corners.

use super::triangles::Triangles;
use crate::{Aabb, Vec3};

/// A segment in the frame of the field.
#[derive(Clone, Copy)]
pub(crate) struct Segment {
    pub start: Vec3,
    /// Unit vector.
    pub along: Vec3,
    /// Range of `s`, meters.
    pub from: f64,
    pub to: f64,
}

impl Segment {
    /// Returns the part on which `a + b·s ≤ most`; `None` if there is none.
    fn below(self, a: f64, b: f64, most: f64) -> Option<Segment> {
        let (mut from, mut to) = (self.from, self.to);
        let place = (most - a) / b;
        if b > 0.0 {
            to = to.min(place);
        } else if b < 0.0 {
            from = from.max(place);
        } else if a > most {
            return None;
        }
        (from <= to).then_some(Segment { from, to, ..self })
    }

    /// Returns whether it meets a box grown by `reach`.
    fn meets(&self, bounds: &Aabb, inverse: &Vec3, reach: f64) -> bool {
        let (mut from, mut to) = (self.from, self.to);
        for k in 0..3 {
            // 0·∞ is not a number, which `min` and `max` leave out
            let low = (bounds.min[k] - reach - self.start[k]) * inverse[k];
            let high = (bounds.max[k] + reach - self.start[k]) * inverse[k];
            from = from.max(low.min(high));
            to = to.min(low.max(high));
        }
        from <= to
    }
}

/// A triangle, with the range of `s` on which it can be near a segment.
#[derive(Clone, Copy)]
pub(crate) struct TriangleNearLine<'a> {
    pub corners: &'a [Vec3; 3],
    pub normal: &'a Vec3,
    pub from: f64,
    pub to: f64,
    /// Height of the segment over its plane at `s = 0`, meters, and its slope.
    pub height: f64,
    pub slope: f64,
}

impl Triangles {
    /// Calls `each` with every triangle that can be within `reach` of the segment, until it returns
    /// false. Returns whether all were visited.
    pub fn each_near_line<'a>(
        &'a self,
        segment: &Segment,
        reach: f64,
        mut each: impl FnMut(TriangleNearLine<'a>) -> bool,
    ) -> bool {
        let tree = self.boxes();
        let inverse = segment.along.map(|x| 1.0 / x);
        let mut open = arrayvec::ArrayVec::<usize, MAX_OPEN>::new();
        open.push(0);
        while let Some(n) = open.pop() {
            let node = &tree.nodes[n];
            if !segment.meets(&node.bounds, &inverse, reach) {
                continue;
            }
            if node.count == 0 && (open.try_push(node.second as usize).is_err() || open.try_push(n + 1).is_err()) {
                return false;
            }
            for k in node.range() {
                if let Some(near) = self.near_line(tree.ids[k] as usize, segment, reach)
                    && !each(near)
                {
                    return false;
                }
            }
        }
        true
    }

    /// Returns a triangle if it can be within `reach` of the segment.
    fn near_line(&self, t: usize, segment: &Segment, reach: f64) -> Option<TriangleNearLine<'_>> {
        let (corners, normal) = (&self.corners[t], &self.normals[t][0]);
        let (height, slope) = (normal.dot(&(segment.start - corners[0])), normal.dot(&segment.along));
        let mut part = segment.below(height, slope, reach)?.below(-height, -slope, reach)?;
        for k in 0..3 {
            let outward = (corners[(k + 1) % 3] - corners[k]).cross(normal);
            let (a, b) = (outward.dot(&(segment.start - corners[k])), outward.dot(&segment.along));
            part = part.below(a, b, reach * outward.norm())?;
        }
        Some(TriangleNearLine { corners, normal, from: part.from, to: part.to, height, slope })
    }
}

/// Maximum number of nodes that wait for their visit: the depth of the tree and one.
const MAX_OPEN: usize = 40;

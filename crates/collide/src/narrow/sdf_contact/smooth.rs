//! Edges of a smooth surface against a mesh's field: whether they have to be searched.
//!
//! Such an edge needs a contact of its own only if the distance has its minimum inside the edge, by
//! more than `ε` below an end that has a contact ([`Edge::end_tolerance`]). If the edge only leaves
//! a face of the other mesh, the corners of the contact area are vertices, at most an edge's length
//! away.
//!
//! ```text
//! d(s) ≥ d(s') − |s − s'|        a few bounds along the edge, without evaluating the distance
//! d(s) ≥ both tangents           at the ends, if d is convex between them: nearly always on so short an edge
//! ```

use super::super::reduce::Collector;
use super::query::{Normals, Query};
use super::tolerances::LEVEL_SLOPE;
use crate::sdf::elements::Edge;
use crate::sdf::{Feature, TOUCHING};

impl Query<'_> {
    /// Returns whether an edge can have a contact of its own.
    pub(super) fn may_have_contact(&self, edge: &Edge, found: &Collector) -> bool {
        let short = edge.end_tolerance > 0.0 && self.is_one_piece(edge.length, true);
        self.mesh.is_none() || !short || self.may_have_minimum(edge, found)
    }

    fn may_have_minimum(&self, edge: &Edge, found: &Collector) -> bool {
        let at = |s: f64| edge.ends[0] + (edge.ends[1] - edge.ends[0]) * s;
        let near = |s: f64, within: f64| {
            self.bound(&at(s).map(|x| x as f32).into(), || at(s)) - within * edge.length <= found.limit()
        };
        if !near(0.5, 0.5) || !(near(0.25, 0.25) || near(0.75, 0.25)) {
            return false;
        }
        let [start, end] = edge.ends.map(|p| self.to_field(&p));
        let way = end - start;
        let normals: Normals = edge.normals.iter().map(|n| self.rotation * n).collect();
        let low = self.hit_at(&start, Some(edge.points[0]), &normals, TOUCHING);
        let fall = -low.normal.dot(&way);
        if fall <= LEVEL_SLOPE * edge.length {
            return false;
        }
        let high = self.hit_at(&end, Some(edge.points[1]), &normals, TOUCHING);
        let rise = high.normal.dot(&way);
        if rise <= LEVEL_SLOPE * edge.length {
            return false;
        }
        // the intersection of the tangents
        let level = (low.distance * rise + high.distance * fall - rise * fall) / (rise + fall);
        let lower = if low.distance < high.distance { &low } else { &high };
        let end_counts = lower.feature == Feature::Face && lower.facing;
        let above = level > found.limit() && level <= lower.distance;
        !(above || end_counts && lower.distance - level < edge.end_tolerance)
    }
}

//! An edge of a smooth surface against a mesh's field: whether it has to be searched.
//!
//! Such an edge needs a contact of its own only where the distance has its least place within the edge, by more than `ε` below an end that counts
//! ([`Edge::end_tolerance`]). Where it only leaves a face of the other, the corners of the area of contact are vertices, an edge's length away at most.
//!
//! ```text
//! d(s) ≥ d(s') − |s − s'|        a few bounds along the edge, a look at none of these places
//! d(s) ≥ both tangents           at the ends, where d is convex between them: as good as always on so short an edge
//! ```

use super::super::reduce::Collector;
use super::query::{Normals, Query};
use super::tolerances::LEVEL_SLOPE;
use crate::sdf::elements::Edge;
use crate::sdf::{Feature, TOUCHING};

impl Query<'_> {
    /// Whether an edge may have a contact of its own.
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
        // where the tangents meet
        let level = (low.distance * rise + high.distance * fall - rise * fall) / (rise + fall);
        let lower = if low.distance < high.distance { &low } else { &high };
        let end_counts = lower.feature == Feature::Face && lower.facing;
        let above = level > found.limit() && level <= lower.distance;
        !(above || end_counts && lower.distance - level < edge.end_tolerance)
    }
}

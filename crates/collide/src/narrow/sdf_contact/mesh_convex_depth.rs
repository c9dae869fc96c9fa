//! Deep overlaps of a mesh and a flat-sided convex body: the deepest point of the mesh's surface,
//! inside its faces too.
//!
//! ```text
//! depth = − min over the points p of all faces of d_B(p)      d_B convex: so is its minimum over a triangle, and along any line in it
//! h(s)  = min over t of d_B(p(s, t))                          convex again: two nested golden-section searches (Kiefer 1953)
//! ```
//!
//! In shallow overlaps the deepest points are vertices and edges that face the other body. In deep
//! overlaps the deepest point can lie inside a face, or on a feature that faces away. Without it,
//! the contacts would separate the bodies by less than their overlap.

use super::super::reduce::Collector;
use super::query::{Query, point_normal};
use crate::Vec3;
use crate::sdf::TOUCHING;
use crate::sdf::field::MeshField;

/// Minimum gain of depth over the other contacts, in radii of the smaller body.
const MIN_GAIN: f64 = 1e-4;
/// Steps of a search: they leave 5e-7 of a side.
const MAX_STEPS: usize = 30;
/// The golden section.
const GOLDEN_SECTION: f64 = 0.618_033_988_749_894_9;

impl Query<'_> {
    /// Adds one contact at the deepest point of the mesh's faces, if that is deeper than the other
    /// contacts.
    pub(super) fn faces(&self, mesh: &MeshField, found: &mut Collector) {
        if let Some(other) = self.mesh {
            return self.deepest(mesh, other, found);
        }
        let rounded = self.field.is_round() && !self.field.is_curved();
        if self.field.is_linear() || rounded || !self.field.is_convex() {
            return;
        }
        let gain = MIN_GAIN * self.size;
        let (mut least, mut best) = (found.min_gap(), None);
        for (t, corners) in mesh.faces().iter().enumerate() {
            let (center, radius) = mesh.sphere(t);
            if self.field.bound(&self.to_field(&center)) - radius > least - gain {
                continue;
            }
            let (at, depth) = self.lowest_of_face(&corners.map(|c| self.to_field(&c)));
            if depth < least - gain {
                (least, best) = (depth, Some((t, at)));
            }
        }
        if let Some((t, at)) = best {
            let hit = self.field.hit(&at, &[], TOUCHING);
            self.push(&at, 0.0, &hit, point_normal(&hit), 1 << 56 | t as u64, found);
        }
    }

    /// Returns the point of a triangle where the field is smallest, and the value.
    fn lowest_of_face(&self, [a, b, c]: &[Vec3; 3]) -> (Vec3, f64) {
        golden_section_search(|s| {
            let (from, to) = (a + (b - a) * s, a + (c - a) * s);
            golden_section_search(|t| {
                let p = from + (to - from) * t;
                (p, self.field.bound(&p))
            })
        })
    }
}

/// Returns the minimum of a convex function on 0 to 1, and its point.
fn golden_section_search(value: impl Fn(f64) -> (Vec3, f64)) -> (Vec3, f64) {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut s, mut t) = (1.0 - GOLDEN_SECTION, GOLDEN_SECTION);
    let (mut at_s, mut at_t) = (value(s), value(t));
    for _ in 0..MAX_STEPS {
        if at_s.1 <= at_t.1 {
            (high, t, at_t) = (t, s, at_s);
            s = high - GOLDEN_SECTION * (high - low);
            at_s = value(s);
        } else {
            (low, s, at_s) = (s, t, at_t);
            t = low + GOLDEN_SECTION * (high - low);
            at_t = value(t);
        }
    }
    if at_s.1 <= at_t.1 { at_s } else { at_t }
}

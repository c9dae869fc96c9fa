//! A massless rod or rope between two points: one row.
//!
//! ```text
//! d = p_a − p_b,  n = d/|d|      row velocity n·(v_a − v_b)      J̇·v = |v_⊥|²/|d|, plus the bias of the points' own motion
//! rod:  |d| = length (equality)           rope:  length − |d| ≥ 0 (one-sided; the row looks inwards)
//! ```

use tumble_core::collide::Vec3;
use tumble_core::{Constraint, Level, Object, ObjectId, RowBuilder, RowTarget, StateRange, WorldView, rows::RowSet};

/// The anchor of an end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// The origin of part 0 of an object: the center of mass of a rigid body.
    Object(ObjectId),
    /// A point of the world, m.
    Point(Vec3),
}

/// Keeps two ends at a distance, or (as a rope) within it.
#[derive(Clone, Debug)]
pub struct Rod {
    name: String,
    ends: [End; 2],
    length: f64,
    rope: bool,
}

impl Rod {
    /// A rod of `length` m (above 0).
    pub fn new(name: impl Into<String>, a: End, b: End, length: f64) -> Rod {
        Rod { name: name.into(), ends: [a, b], length, rope: false }
    }

    /// A rope: it pulls and never pushes.
    pub fn rope(name: impl Into<String>, a: End, b: End, length: f64) -> Rod {
        Rod { rope: true, ..Rod::new(name, a, b, length) }
    }
}

/// Position and velocity of an end; `None` where its object is gone.
fn motion(end: End, view: &WorldView) -> Option<(Vec3, Vec3)> {
    match end {
        End::Point(p) => Some((p, Vec3::zeros())),
        End::Object(id) => view.part_state(id, 0).map(|part_state| (part_state.position(), part_state.velocity)),
    }
}

impl Object for Rod {
    fn name(&self) -> &str {
        &self.name
    }

    fn constraint(&self) -> Option<&dyn Constraint> {
        Some(self)
    }
}

impl Constraint for Rod {
    fn rows(&self, _me: &StateRange, view: &WorldView, _level: Level, out: &mut RowBuilder) {
        let (Some((pa, va)), Some((pb, vb))) = (motion(self.ends[0], view), motion(self.ends[1], view)) else { return };
        let (d, v) = (pa - pb, va - vb);
        let distance = d.norm();
        if distance < 1e-9 {
            return; // no direction to hold
        }
        let n = d / distance;
        let turning = (v - n * n.dot(&v)).norm_squared() / distance;
        let (set, sign) = if self.rope { (RowSet::HalfLine, -1.0) } else { (RowSet::Equality, 1.0) };
        let target =
            RowTarget { bias_acceleration: sign * turning, ..RowTarget::new(set, sign * (distance - self.length)) };
        out.row(target);
        for (end, p, side) in [(self.ends[0], pa, sign), (self.ends[1], pb, -sign)] {
            if let End::Object(id) = end {
                out.on_point(id, 0, &p, &n, side);
            }
        }
    }

    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        out.extend(self.ends.iter().filter_map(|end| if let End::Object(id) = end { Some(*id) } else { None }));
        true
    }

    fn gaps(&self, _me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        if let (true, Some((pa, _)), Some((pb, _))) =
            (self.rope, motion(self.ends[0], view), motion(self.ends[1], view))
        {
            out.push(self.length - (pa - pb).norm());
        }
    }
}

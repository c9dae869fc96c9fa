//! Forces of loop joints: what they carry, and when they break.

use super::LoopJoint;
use super::pair::{EndPair, JointRow, Motion, Term, Terms};
use crate::contact::warm_starts::RowStart;
use crate::object::Level;
use crate::object::part_state::{PointLoad, Wrench};
use crate::world::view::{ObjectId, WorldView};
use tumble_collide::Vec3;

/// The force and torque that a loop joint transmits, with those of its limits, spring, friction,
/// damping and drive. World axes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointForce {
    /// Force on side A, N; the opposite acts on B.
    pub force: Vec3,
    /// Torque on side A about A's point of the joint, N·m.
    pub torque: Vec3,
    /// Forces or torques of the drives of its degrees of freedom, N or N·m; positive forces increase the position.
    pub drives: [f64; 3],
}

impl LoopJoint {
    /// Returns the force for the forces of its rows; zero if these are not the rows that it has in
    /// the view.
    pub(crate) fn transmitted(&self, view: &WorldView, forces: &[RowStart]) -> JointForce {
        let mut sum = JointForce::default();
        let Some(pair) = self.pair(view) else { return sum };
        let Some((rows, explicit)) = self.rows_with(&pair, view.time, forces.len()) else { return sum };
        for (row, start) in rows.iter().zip(forces) {
            add(&mut sum, &row.terms, start.force);
            if let Some(k) = row.drives {
                sum.drives[k] += start.force;
            }
        }
        if explicit {
            self.explicit_forces(&pair, |coordinate, k, [force, drive]| {
                add(&mut sum, &coordinate.terms, force);
                sum.drives[k] += drive;
            });
        }
        sum
    }

    /// Returns the rows of the last step if they are of this number, and whether soft forces were no rows in it.
    fn rows_with(&self, pair: &EndPair, time: f64, count: usize) -> Option<(Vec<JointRow>, bool)> {
        let levels = [Level::Velocity { h: 1.0 }, Level::Acceleration { h: 1.0, soft: None }];
        let [implicit, explicit] = levels.map(|level| {
            let mut rows = Vec::new();
            self.lay(pair, level, time, &mut |row| rows.push(row));
            rows
        });
        match count {
            _ if count == implicit.len() => Some((implicit, false)),
            _ if count == explicit.len() => Some((explicit, true)),
            _ => None,
        }
    }

    /// Adds the wrenches of its rows on its two parts to the table by part, each about the part's origin.
    pub(crate) fn add_wrenches(&self, view: &WorldView, forces: &[RowStart], out: &mut [Wrench]) {
        let Some(pair) = self.pair(view) else { return };
        let Some((rows, _)) = self.rows_with(&pair, view.time, forces.len()) else { return };
        for (row, start) in rows.iter().zip(forces) {
            pair.add_wrenches(&row.terms, start.force, view, out);
        }
    }

    /// Returns the forces on its sides for the forces of its rows, each at the joint's point of the side;
    /// `None` for the world, and for both if there are none.
    pub(crate) fn loads(&self, view: &WorldView, forces: &[RowStart]) -> [Option<(ObjectId, PointLoad)>; 2] {
        let force = self.transmitted(view, forces).force;
        let Some(pair) = self.pair(view).filter(|_| force != Vec3::zeros()) else { return [None; 2] };
        [(&pair.a, force), (&pair.b, -force)].map(|(end, force)| {
            let (id, part) = end.part?;
            Some((id, PointLoad { part, point: end.p(), force }))
        })
    }

    pub(crate) fn breaks(&self, force: &JointForce) -> bool {
        let [most, most_torque] = self.breaking();
        force.force.norm() > most || force.torque.norm() > most_torque
    }

    pub(crate) fn is_breakable(&self) -> bool {
        self.breaking().iter().any(|most| most.is_finite())
    }
}

impl EndPair {
    /// Adds the wrenches of a force along a velocity on the two parts, each about the part's origin.
    pub(super) fn add_wrenches(&self, terms: &Terms, force: f64, view: &WorldView, out: &mut [Wrench]) {
        for Term { side, motion, axis, factor } in terms.iter().flatten() {
            let end = [&self.a, &self.b][*side];
            let Some(range) = end.part.and_then(|(id, _)| view.state_range(id)) else { continue };
            let Some(wrench) = end.part.and_then(|(_, part)| out.get_mut(range.parts.start + part)) else {
                continue;
            };
            let force = *factor * force * axis;
            match motion {
                Motion::Point(p) => {
                    wrench.force += force;
                    wrench.torque += (p - end.part_state.position()).cross(&force);
                }
                Motion::Rotation => wrench.torque += force,
            }
        }
    }
}

/// Adds a force along the velocity of a row: that on A, whose points are A's point of the joint.
fn add(sum: &mut JointForce, terms: &Terms, force: f64) {
    for Term { motion, axis, factor, .. } in terms.iter().flatten().filter(|term| term.side == 0) {
        match motion {
            Motion::Point(_) => sum.force += factor * force * axis,
            Motion::Rotation => sum.torque += factor * force * axis,
        }
    }
}

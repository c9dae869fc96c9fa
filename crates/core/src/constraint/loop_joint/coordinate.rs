//! The position of a loop joint in a view of the world, for rows of other constraints.

use super::LoopJoint;
use super::pair::{Coordinate, EndPair};
use crate::constraint::builder::RowBuilder;
use crate::object::part_state::Wrench;
use crate::world::view::WorldView;

/// The position of a loop joint, with the sides on which a row along it acts.
pub(crate) struct JointCoordinate {
    pair: EndPair,
    coordinate: Coordinate,
}

impl JointCoordinate {
    /// Returns the position, rad or m.
    pub fn position(&self) -> f64 {
        self.coordinate.position
    }

    /// Returns the rate of its rate without any force.
    pub fn bias(&self) -> f64 {
        self.coordinate.bias
    }

    /// Adds `factor` times its rate to the open row.
    pub fn add(&self, factor: f64, out: &mut RowBuilder) {
        self.pair.add_terms(&self.coordinate.terms, factor, out);
    }

    /// Adds the wrenches of a force along it on both parts, each about the part's origin.
    pub fn add_wrenches(&self, force: f64, view: &WorldView, out: &mut [Wrench]) {
        self.pair.add_wrenches(&self.coordinate.terms, force, view, out);
    }
}

impl LoopJoint {
    /// Returns its position; `None` if it has none, or makes no rows.
    pub(crate) fn joint_coordinate(&self, view: &WorldView) -> Option<JointCoordinate> {
        let pair = self.pair(view)?;
        let coordinate = *self.coordinates(&pair).first()?;
        Some(JointCoordinate { pair, coordinate })
    }
}

//! The trait of objects that apply forces to others.

use super::part_state::{Forces, StateRange};
use crate::world::view::WorldView;

/// Applies forces to others without a state of its own, such as wind, a spring or a flock (thesis
/// §IV.A.2).
pub trait ForceGenerator {
    /// Adds forces for the view's state and time to the table.
    fn apply(&self, me: &StateRange, view: &WorldView, out: &mut Forces);
    /// Returns the potential energy of the forces, J; 0 by default. It is part of
    /// [`World::energy`](crate::World::energy).
    fn potential(&self, view: &WorldView) -> f64 {
        let _ = view;
        0.0
    }
    /// Returns the kinetic energy of inertias that the object adds to others, such as the rotors of joints, J; 0 by default. It is part
    /// of [`World::energy`](crate::World::energy).
    fn kinetic(&self, view: &WorldView) -> f64 {
        let _ = view;
        0.0
    }
}

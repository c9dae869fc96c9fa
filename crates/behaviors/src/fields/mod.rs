//! Force fields: forces on all bodies within them, or on chosen ones. Each is a
//! [`ForceGenerator`](tumble_core::ForceGenerator) without a state.

mod attractor;
mod buoyancy;
mod explosion;
mod panels;
mod silhouette;
mod submerged;
mod wind;

pub use attractor::Attractor;
pub use buoyancy::Buoyancy;
pub use explosion::Explosion;
pub use panels::{Panel, Panels};
pub use silhouette::silhouette;
pub use submerged::{Submerged, submerged};
pub use wind::{DragLaw, Wind};

use crate::error::{BehaviorError, check};
use tumble_collide::{Shape, Vec3};
use tumble_core::{ObjectId, PartState, WorldView};

/// The bodies that a field acts on.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Targets {
    /// All bodies that move, also those that are added later.
    #[default]
    All,
    /// The listed ones; ids of removed bodies are ignored.
    Only(Vec<ObjectId>),
}

/// A part of a moving body, as a field sees it. Links of an articulated body have mass, their
/// colliders have shapes; a rigid body has both.
pub(crate) struct Target<'a> {
    pub id: ObjectId,
    pub part: usize,
    /// Row in the tables of part states and forces.
    pub row: usize,
    pub state: &'a PartState,
    /// Mass, kg; 0 for a collider of a link.
    pub mass: f64,
    /// Center of mass, world axes, m.
    pub center: Vec3,
    pub shape: Option<&'a Shape>,
}

impl Targets {
    /// Calls `work` for each part of the bodies, in the order in which they were added.
    pub(crate) fn each(&self, view: &WorldView, mut work: impl FnMut(&Target)) {
        let ids = match self {
            Targets::All => view.ids(),
            Targets::Only(ids) => ids,
        };
        for &id in ids.iter().filter(|id| view.status(**id).is_some_and(|status| status.moves())) {
            let (Some(object), Some(range)) = (view.object(id), view.state_range(id)) else { continue };
            let Some(body) = object.integratable() else { continue };
            for (part, row) in range.parts.clone().enumerate() {
                let state = &view.part_states[row];
                let center = state.pose.transform_point(&body.part_center(part).into()).coords;
                let shape = object.collidable().and_then(|collidable| collidable.shape(part));
                work(&Target { id, part, row, state, mass: body.part_mass(part), center, shape });
            }
        }
    }
}

/// Checks that a vector is finite.
pub(crate) fn check_vector(what: &'static str, vector: &Vec3) -> Result<(), BehaviorError> {
    vector.iter().try_for_each(|x| check(what, *x, true, "finite"))
}

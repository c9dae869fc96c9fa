//! Wind: drag `F = −c·(v − w)` at the origin of every part of the listed objects.

use tumble_core::collide::Vec3;
use tumble_core::{ForceGenerator, Forces, Object, ObjectId, StateRange, WorldView};

/// Linear drag towards a velocity of the air.
#[derive(Clone, Debug)]
pub struct Wind {
    name: String,
    /// Velocity of the air, m/s.
    pub velocity: Vec3,
    /// Drag coefficient, N·s/m, at least 0.
    pub drag: f64,
    /// The objects it acts on; ids of removed objects are ignored.
    pub on: Vec<ObjectId>,
}

impl Wind {
    /// A wind of that velocity (m/s) and drag (N·s/m).
    pub fn new(name: impl Into<String>, velocity: Vec3, drag: f64, on: Vec<ObjectId>) -> Wind {
        Wind { name: name.into(), velocity, drag, on }
    }
}

impl Object for Wind {
    fn name(&self) -> &str {
        &self.name
    }

    fn force(&self) -> Option<&dyn ForceGenerator> {
        Some(self)
    }
}

impl ForceGenerator for Wind {
    fn apply(&self, _me: &StateRange, view: &WorldView, out: &mut Forces) {
        for index in
            self.on.iter().filter_map(|id| view.state_range(*id)).flat_map(|state_range| state_range.parts.clone())
        {
            let part_state = &view.part_states[index];
            out.add_at(index, part_state, -self.drag * (part_state.velocity - self.velocity), &part_state.position());
        }
    }
}

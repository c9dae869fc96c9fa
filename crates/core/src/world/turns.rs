//! The angles of revolute loop joints with wide limits, which are numbers of the state.

use super::World;
use crate::constraint::loop_joint::{LoopJoint, near};
use crate::object::FrameState;
use crate::world::error::WorldError;
use crate::world::view::ObjectId;

impl World {
    /// Sets which object a loop joint is that was added, and its first angle: the one within π of the middle of its limits.
    pub(super) fn start_turns(&mut self, id: ObjectId) {
        let Some(place) = self.core.table.place(id) else { return };
        let object: &mut dyn std::any::Any = self.core.table.placed[place].object.as_mut();
        let Some(joint) = object.downcast_mut::<LoopJoint>() else { return };
        joint.set_own(id);
        self.find_turns(id);
    }

    /// Sets the angle of a loop joint with wide limits to the one within π of their middle.
    pub(super) fn find_turns(&mut self, id: ObjectId) {
        let Some(joint) = self.get::<LoopJoint>(id).filter(|joint| joint.counts_turns()) else { return };
        let angle = joint.first_angle(&self.view());
        let Some(range) = self.core.objects().get(id).map(|entry| entry.state_range.x.clone()) else { return };
        self.core.state.x[range].fill(angle);
    }

    /// Sets the turn of a revolute loop joint that counts its turns (its limits are more than 3π/2 apart, or on one side): its angle is
    /// that of its frames nearest to `angle`, rad. Without this call it is within π of the middle of the limits when the joint is
    /// added, or of the angle nearest to 0 that a limit on one side leaves.
    ///
    /// # Errors
    /// [`WorldError::Stale`]; [`WorldError::BadState`] if the joint counts no turns, or the angle is not finite.
    pub fn set_turn(&mut self, id: ObjectId, angle: f64) -> Result<(), WorldError> {
        self.core.table.get(id).ok_or(WorldError::Stale)?;
        let joint = self.get::<LoopJoint>(id).filter(|joint| joint.counts_turns() && angle.is_finite());
        let Some(first) = joint.map(|joint| joint.first_angle(&self.view())) else {
            return Err(WorldError::BadState(self.name(id).unwrap_or_default().into()));
        };
        self.write_state_of(id, &[near(first, angle)])
    }

    /// Gives the angle of a joint whose limits were changed a place in the state, or takes it away.
    pub(super) fn fit_turns(&mut self, id: ObjectId) {
        let Some(place) = self.core.table.place(id) else { return };
        let core = &mut self.core;
        let wanted = core.table.placed[place].object.frame_state().map_or(0, FrameState::len);
        let range = core.table.placed[place].state_range.x.clone();
        if range.len() == wanted {
            return;
        }
        core.own_caches();
        core.moments.clear();
        core.table.walk.relayout();
        match wanted {
            0 => core.state.x.cut(range),
            _ => {
                core.state.x.resize(core.state.x.len() + 1);
                core.state.x[range.start..].rotate_right(1);
            }
        }
        for (k, placed) in core.table.placed.iter_mut().enumerate().skip(place) {
            let moved = |at: usize| if wanted == 0 { at - 1 } else { at + 1 };
            let x = &mut placed.state_range.x;
            *x = if k == place { x.start..moved(x.end) } else { moved(x.start)..moved(x.end) };
        }
        self.find_turns(id);
    }
}

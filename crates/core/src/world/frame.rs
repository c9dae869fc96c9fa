//! A frame begins, is started again, and ends: which objects it walks, and which may be left out of the next ones.

use super::core::Core;
use super::state::WorldState;
use super::view::Mode;
use crate::object::{Object, has_sensor};
use crate::rigid::RigidBody;

impl Core {
    /// Before a frame: computes part states and caches of all objects that are not settled.
    pub(super) fn refresh_walked(&mut self) {
        if self.stale {
            return self.refresh();
        }
        self.wake_for_forces();
        self.table.gather();
        self.integration().refresh();
    }

    /// Forces may act on sleeping objects, which must then be walked.
    fn wake_for_forces(&mut self) {
        if self.table.walk.asleep > 0 && self.has_forces() {
            self.table.walk.unsettle_all();
        }
    }

    /// Returns whether any object acts on others by forces.
    pub(super) fn has_forces(&self) -> bool {
        self.objects().iter().any(|e| e.status.enabled && e.object.force().is_some())
    }

    /// Starts a frame, or starts it again: numbers the degrees of freedom of what it walks.
    pub(super) fn enter_frame(&mut self) {
        self.dof = self.table.number_walked();
        let applied = &self.state.applied_generalized;
        self.applied_now.clear();
        match self.table.walk.kept() {
            None => self.applied_now.extend_from_slice(applied),
            Some(starts) => {
                for (place, start) in self.table.walk.places.iter().zip(starts) {
                    let count = self.table.placed[*place as usize].state_range.v.len();
                    self.applied_now.extend_from_slice(&applied[*start..*start + count]);
                }
            }
        }
    }

    /// Ends a frame.
    pub(super) fn leave_frame(&mut self) {
        self.dof = self.table.number_all();
        self.applied_now.clear();
    }

    /// Returns the generalized forces that users apply, as the degrees of freedom are numbered now.
    pub(crate) fn applied_generalized(&self) -> &[f64] {
        if self.table.walk.dof.is_some() { &self.applied_now } else { &self.state.applied_generalized }
    }

    /// Goes back to the state at the start of the frame. What the frame did not walk is as it was.
    pub(super) fn restart_frame(&mut self, before: &WorldState) {
        self.table.gather();
        self.state.copy_walked(before, &self.table);
        self.state.groups.clone_from(&before.groups);
        self.group_changes += 1;
        self.clear_contact_forces();
        for range in self.table.walk.parts.iter() {
            self.state.write_accelerations(range, &mut self.derived.part_states);
        }
        self.integration().refresh();
    }

    /// Ends a frame: objects that rest need not be walked in the next ones.
    pub(super) fn settle(&mut self) {
        if self.branches.are_recorded() {
            return;
        }
        let forces = !self.state.groups.is_empty() && self.has_forces();
        let Core { table, state, .. } = self;
        let (placed, objects) = (&table.placed, &state.objects);
        table.walk.settle(|place| {
            let object = &objects[place];
            let rests = object.status.mode == Mode::Static || !object.status.enabled || (object.asleep && !forces);
            (rests && may_settle(placed[place].object.as_ref())).then_some(object.asleep)
        });
    }
}

/// Returns whether a step may leave the object out while it rests: a rigid body that is no sensor and acts on
/// nothing.
fn may_settle(object: &dyn Object) -> bool {
    let any: &dyn std::any::Any = object;
    let sensor = || object.collidable().is_some_and(has_sensor);
    any.is::<RigidBody>()
        && object.constraint().is_none()
        && object.force().is_none()
        && object.frame_state().is_none()
        && !sensor()
}

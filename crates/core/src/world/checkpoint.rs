//! Going back by one frame: what a frame changes, kept without writing it out as a snapshot.

use super::World;
use crate::detect::WarmStarts;
use crate::part_state::Wrench;
use crate::sleep::{RestTimer, Sleepers};
use tumble_collide::Vec3;

/// What a frame changes: state, accelerations, applied forces, warm starts, time. Its memory is used again by the next [`World::checkpoint`].
#[derive(Default)]
pub struct Checkpoint {
    time: f64,
    frame: u64,
    x: Vec<f64>,
    /// Angular, then linear acceleration of every site.
    accelerations: Vec<[Vec3; 2]>,
    applied: Vec<Wrench>,
    applied_generalized: Vec<f64>,
    warm: WarmStarts,
    inner_step: f64,
    sleepers: Sleepers,
    /// Whether each object sleeps, and since when it is still; empty where nobody may sleep.
    rest_timer: Vec<(bool, RestTimer)>,
}

impl World {
    /// Notes where the world is.
    pub fn checkpoint(&self, at: &mut Checkpoint) {
        let c = &self.core;
        (at.time, at.frame, at.inner_step) = (c.time, c.frame, c.inner_step);
        c.x.clone_into(&mut at.x);
        at.accelerations.clear();
        at.accelerations.extend(c.part_states.iter().map(|s| [s.angular_acceleration, s.acceleration]));
        at.applied.clone_from(&c.applied);
        at.applied_generalized.clone_from(&c.applied_generalized);
        at.warm.clone_from(&c.warm);
        at.sleepers.clone_from(&c.sleepers);
        at.rest_timer.clear();
        if c.settings.sleep.is_some() {
            at.rest_timer.extend(c.table.iter().map(|e| (e.asleep, e.rest_timer.clone())));
        }
    }

    /// Goes back to where [`checkpoint`](Self::checkpoint) was called last. Switches and constants stay as they are; after objects came or went nothing is done.
    pub fn roll_back(&mut self, to: &Checkpoint) {
        let core = &mut self.core;
        if (to.x.len(), to.applied.len(), to.applied_generalized.len())
            != (core.x.len(), core.applied.len(), core.applied_generalized.len())
        {
            return;
        }
        (core.time, core.frame, core.inner_step) = (to.time, to.frame, to.inner_step);
        core.x.copy_from_slice(&to.x);
        for (part_state, a) in core.part_states.iter_mut().zip(&to.accelerations) {
            [part_state.angular_acceleration, part_state.acceleration] = *a;
        }
        core.applied.clone_from(&to.applied);
        core.applied_generalized.clone_from(&to.applied_generalized);
        core.warm.clone_from(&to.warm);
        core.sleepers.clone_from(&to.sleepers);
        let mut rest_timer = to.rest_timer.iter();
        core.table.for_each_mut(|e| {
            (e.asleep, e.rest_timer) = rest_timer.next().cloned().unwrap_or_default();
        });
        core.contacts.clear();
        core.clear_contact_forces();
        core.integration().refresh();
    }
}

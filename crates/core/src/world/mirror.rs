//! What a process needs that shows a world which another process simulates (thesis §IV.A.6): nothing in here steps.

use super::{World, WorldError};
use crate::object::SyncError;
use crate::object::part_state::PartState;
use crate::world::view::ObjectId;
use tumble_collide::Pose;

/// Why an object did not take what came for it. The world is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MirrorError {
    /// No such object, or no such part.
    #[error(transparent)]
    World(#[from] WorldError),
    /// The object refuses the message.
    #[error("'{name}': {why}")]
    Message {
        /// Object.
        name: String,
        /// Its reason.
        why: SyncError,
    },
    /// The object cannot be kept in step: it has no `NetSync`.
    #[error("'{0}' cannot be kept in step by messages")]
    NotSynchronizable(String),
}

impl World {
    /// Shows an object's parts at these poses, one per part. They are at rest, and the state stays what it was: the next step or change of state puts
    /// the parts back to where the state says. For a world that is drawn and never stepped.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, the count of poses is not that of its parts, or a pose is not finite.
    pub fn set_displayed_poses(&mut self, id: ObjectId, poses: &[Pose]) -> Result<(), WorldError> {
        let entry = self.core.table.get(id).ok_or(WorldError::Stale)?;
        let (name, state_range) = (&entry.name, entry.state_range.parts.clone());
        if poses.len() != state_range.len() {
            return Err(WorldError::NoPart { name: name.to_string(), part: poses.len().min(state_range.len()) });
        }
        if poses.iter().any(|p| !p.translation.vector.iter().chain(p.rotation.coords.iter()).all(|x| x.is_finite())) {
            return Err(WorldError::NotFinite(name.to_string()));
        }
        for (part_state, pose) in self.core.derived.part_states[state_range].iter_mut().zip(poses) {
            *part_state = PartState { pose: *pose, ..PartState::default() };
        }
        Ok(())
    }

    /// Appends the object's message for its copies elsewhere (thesis `GetData`); `false` where it has none.
    pub fn get_data(&self, id: ObjectId, out: &mut Vec<u8>) -> bool {
        let Some(entry) = self.core.table.get(id) else { return false };
        let sync = entry.object.net_sync();
        if let Some(sync) = sync {
            sync.get_data(&entry.state_range, &self.view(), out);
        }
        sync.is_some()
    }

    /// Applies such a message (thesis `ReadData`). It is not trusted: what is no state of the object is refused.
    ///
    /// # Errors
    /// [`MirrorError`]: the object was removed, takes no messages, or refuses this one.
    pub fn read_data(&mut self, id: ObjectId, data: &[u8]) -> Result<(), MirrorError> {
        self.core.wake(id);
        let core = &mut self.core;
        let entry = core.table.get(id).ok_or(WorldError::Stale)?;
        let name = || entry.name.to_string();
        let sync = entry.object.net_sync().ok_or_else(|| MirrorError::NotSynchronizable(name()))?;
        sync.read_data(data, &mut core.state.x[entry.state_range.x.clone()])
            .map_err(|why| MirrorError::Message { name: name(), why })?;
        core.integration().refresh_one(id);
        Ok(())
    }

    /// Sets the time that a copy shows, s. A time that is not finite is left out.
    pub fn set_displayed_time(&mut self, time: f64) {
        if time.is_finite() {
            self.core.state.time = time;
        }
    }
}

//! What a process needs that shows a world which another process simulates (thesis §IV.A.6): nothing in here steps.

use super::{World, WorldError};
use crate::object::SyncError;
use crate::site::Site;
use crate::view::ObjectId;
use tumble_collide::Pose;

/// Why an object did not take what came for it. The world is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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
    pub fn show_at(&mut self, id: ObjectId, poses: &[Pose]) -> Result<(), WorldError> {
        let entry = self.core.table.slots.get(id).ok_or(WorldError::Stale)?;
        let (name, span) = (entry.object.name(), entry.span.site.clone());
        if poses.len() != span.len() {
            return Err(WorldError::NoPart { name: name.to_string(), part: poses.len().min(span.len()) });
        }
        if poses.iter().any(|p| !p.translation.vector.iter().chain(p.rotation.coords.iter()).all(|x| x.is_finite())) {
            return Err(WorldError::NotFinite(name.to_string()));
        }
        for (site, pose) in self.core.sites[span].iter_mut().zip(poses) {
            *site = Site { pose: *pose, ..Site::default() };
        }
        Ok(())
    }

    /// Appends the object's message for its copies elsewhere (thesis `GetData`); `false` where it has none.
    pub fn get_data(&self, id: ObjectId, out: &mut Vec<u8>) -> bool {
        let Some(entry) = self.core.table.slots.get(id) else { return false };
        let sync = entry.object.net_sync();
        if let Some(sync) = sync {
            sync.get_data(&entry.span, &self.view(), out);
        }
        sync.is_some()
    }

    /// Applies such a message (thesis `ReadData`). It is not trusted: what is no state of the object is refused.
    pub fn read_data(&mut self, id: ObjectId, data: &[u8]) -> Result<(), MirrorError> {
        self.core.wake(id);
        let core = &mut self.core;
        let entry = core.table.slots.get(id).ok_or(WorldError::Stale)?;
        let name = || entry.object.name().to_string();
        let sync = entry.object.net_sync().ok_or_else(|| MirrorError::NotSynchronizable(name()))?;
        sync.read_data(data, &mut core.x[entry.span.x.clone()])
            .map_err(|why| MirrorError::Message { name: name(), why })?;
        core.motion().refresh_one(id);
        Ok(())
    }

    /// Sets the time that a copy shows, s. A time that is not finite is left out.
    pub fn show_time(&mut self, time: f64) {
        if time.is_finite() {
            self.core.time = time;
        }
    }
}

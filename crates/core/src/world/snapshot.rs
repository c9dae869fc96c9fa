//! Saving and restoring.
//!
//! A snapshot is a header, the [`WorldState`], and the drives that the program has changed (`drives.rs`). Shapes, masses and all
//! other settings belong to the scene and are not in it. It is restored into a world of the same objects, which the header checks by
//! their names and sizes. The sweep order of the broad phase is left out: its pairs come sorted, so
//! no result depends on it.

use super::{World, WorldState};
use serde::{Deserialize, Serialize};

/// An error of restoring a snapshot. The world is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// Not bytes that [`World::save`] wrote.
    #[error("not a snapshot of tumble, or cut off, or of another version: {0}")]
    Format(String),
    /// Another set of objects.
    #[error("the snapshot is of another world: object {index} is {theirs} there and {ours} here")]
    Objects {
        /// Index in the order of adding.
        index: usize,
        /// Name and size in the snapshot.
        theirs: String,
        /// Name and size here.
        ours: String,
    },
    /// A number in it is not finite.
    #[error("the snapshot holds a number that is not finite, or an orientation that is not of unit length")]
    NotFinite,
}

const MAGIC: [u8; 8] = *b"tumbleS9";

/// The objects of the world, before the state.
#[derive(Serialize, Deserialize)]
struct Header {
    magic: [u8; 8],
    objects: Vec<Label>,
}

/// An object's name and the sizes of its state, velocity and parts.
#[derive(Serialize, Deserialize)]
struct Label {
    name: String,
    sizes: [u32; 3],
}

impl std::fmt::Display for Label {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [x, v, parts] = self.sizes;
        write!(f, "'{}' ({x} state, {v} degrees of freedom, {parts} parts)", self.name)
    }
}

impl World {
    /// Returns the complete state of the world as bytes: the same bytes for the same state. Drives that the program has set since
    /// their objects were added are part of it; masses and all other settings are not. Of a recorded motion it has only that it is
    /// the one with which the object was added.
    pub fn save(&self) -> Vec<u8> {
        let snapshot = (Header { magic: MAGIC, objects: self.labels() }, &self.core.state);
        let mut bytes = postcard::to_stdvec(&snapshot).unwrap_or_default(); // writing plain numbers to memory cannot fail
        self.save_drives(&mut bytes);
        bytes
    }

    /// Restores a saved state. The world must have the same objects in the same order.
    ///
    /// # Errors
    /// [`SnapshotError`]. The world is then unchanged.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), SnapshotError> {
        let format = |e: postcard::Error| SnapshotError::Format(e.to_string());
        let (header, rest) = postcard::take_from_bytes::<Header>(bytes).map_err(format)?;
        if header.magic != MAGIC {
            return Err(SnapshotError::Format("the first eight bytes are not 'tumbleS9'".into()));
        }
        self.check_labels(&header.objects)?;
        let (state, rest) = postcard::take_from_bytes::<WorldState>(rest).map_err(format)?;
        let drives = self.read_drives(rest)?;
        self.restore_state(&state)?;
        if !drives.is_empty() {
            self.set_drives(drives);
            self.core.set_state(&state); // a change of drives wakes their objects
        }
        Ok(())
    }

    /// Restores a state of these objects that was read from outside.
    pub(crate) fn restore_state(&mut self, state: &WorldState) -> Result<(), SnapshotError> {
        self.check_state(state)?;
        self.core.set_state(state);
        self.core.contacts.clear();
        self.core.events.clear();
        Ok(())
    }

    fn labels(&self) -> Vec<Label> {
        let label = |e: crate::world::view::Entry| Label {
            name: e.name.to_string(),
            sizes: [e.state_range.x.len() as u32, e.state_range.v.len() as u32, e.state_range.parts.len() as u32],
        };
        self.core.objects().all().map(label).collect()
    }

    fn check_labels(&self, theirs: &[Label]) -> Result<(), SnapshotError> {
        let ours = self.labels();
        for index in 0..ours.len().max(theirs.len()) {
            let label = |list: &[Label]| list.get(index).map_or("absent".to_string(), Label::to_string);
            let (theirs, ours) = (label(theirs), label(&ours));
            if theirs != ours {
                return Err(SnapshotError::Objects { index, theirs, ours });
            }
        }
        Ok(())
    }

    fn check_state(&self, state: &WorldState) -> Result<(), SnapshotError> {
        let format = |what: &str| Err(SnapshotError::Format(what.into()));
        if state.sizes() != self.core.state.sizes() {
            return format("its tables have the wrong lengths");
        }
        let accepts = |e: crate::world::view::Entry| {
            let x = &state.x[e.state_range.x.clone()];
            e.object.integratable().is_none_or(|body| body.accepts(x))
                && e.object.frame_state().is_none_or(|follower| follower.accepts(x))
        };
        if !(state.is_finite() && self.core.objects().all().all(accepts)) {
            return Err(SnapshotError::NotFinite);
        }
        if !state.sleepers_are_sound() {
            return format("its sleepers do not add up");
        }
        if !state.counters_are_sound() {
            return format("its counters or its contacts are out of order");
        }
        Ok(())
    }
}

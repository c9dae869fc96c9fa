//! A world that shows the simulation of another process (thesis §IV.A.6). Nothing here steps.

use super::events::{Event, Touching, TouchingPair};
use super::{ContactPoint, World, WorldError};
use crate::object::part_state::PartState;
use crate::object::{Object, SyncError};
use crate::sensor::Sensor;
use crate::world::view::{Mode, ObjectId};
use tumble_collide::Pose;

/// The reason why an object refused a message. The world is unchanged.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReplicaError {
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

/// Access to a world that shows the state of another process, or of a recording. Such a world is
/// drawn and never stepped. Its own state stays as it was, so a step, or a change of that state,
/// replaces the displayed poses.
pub struct Replica<'w>(&'w mut World);

impl World {
    /// Returns access to the world as a replica of another one.
    pub fn replica(&mut self) -> Replica<'_> {
        Replica(self)
    }
}

impl Replica<'_> {
    /// Shows an object's parts at these poses, one per part, at rest.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, the count of poses is not that of its parts, or a
    /// pose is not finite.
    pub fn set_poses(&mut self, id: ObjectId, poses: &[Pose]) -> Result<(), WorldError> {
        let core = &mut self.0.core;
        let entry = core.table.get(id).ok_or(WorldError::Stale)?;
        let (name, parts) = (&entry.name, entry.state_range.parts.clone());
        if poses.len() != parts.len() {
            return Err(WorldError::NoPart { name: name.to_string(), part: poses.len().min(parts.len()) });
        }
        if poses.iter().any(|p| !p.translation.vector.iter().chain(p.rotation.coords.iter()).all(|x| x.is_finite())) {
            return Err(WorldError::NotFinite(name.to_string()));
        }
        for (part_state, pose) in core.derived.part_states[parts].iter_mut().zip(poses) {
            *part_state = PartState { pose: *pose, ..PartState::default() };
        }
        Ok(())
    }

    /// Applies a message of the object's copy elsewhere (thesis `ReadData`). The message is not
    /// trusted: numbers that are no state of the object are refused.
    ///
    /// # Errors
    /// [`ReplicaError`]: the object was removed, takes no messages, or refuses this one.
    pub fn read_data(&mut self, id: ObjectId, data: &[u8]) -> Result<(), ReplicaError> {
        self.0.core.wake(id);
        let core = &mut self.0.core;
        let entry = core.table.get(id).ok_or(WorldError::Stale)?;
        let name = || entry.name.to_string();
        let sync = entry.object.net_sync().ok_or_else(|| ReplicaError::NotSynchronizable(name()))?;
        sync.read_data(data, &mut core.state.x[entry.state_range.x.clone()])
            .map_err(|why| ReplicaError::Message { name: name(), why })?;
        core.integration().refresh_one(id);
        Ok(())
    }

    /// Shows a simulated time, s. A time that is not finite is left out.
    pub fn set_time(&mut self, time: f64) {
        if time.is_finite() {
            self.0.core.state.time = time;
        }
    }

    /// Shows contacts as those of the last step. Contacts of objects that are not in the world are
    /// left out.
    pub fn set_contacts(&mut self, contacts: impl IntoIterator<Item = ContactPoint>) {
        let core = &mut self.0.core;
        core.contacts.clear();
        let present = |c: &ContactPoint| core.table.place(c.a).is_some() && core.table.place(c.b).is_some();
        core.contacts.extend(contacts.into_iter().filter(present));
    }

    /// Shows events as those of the last step. Events of objects that are not in the world are left out.
    pub fn set_events(&mut self, events: impl IntoIterator<Item = Event>) {
        let core = &mut self.0.core;
        core.events.clear();
        let table = &core.table;
        let present = |e: &Event| table.place(e.a).is_some() && e.b.is_none_or(|b| table.place(b).is_some());
        core.events.extend(events.into_iter().filter(present));
    }

    /// Shows these pairs as those that touch; `None` if they are not known. Pairs of objects that are not in the world are left out.
    pub fn set_touching(&mut self, pairs: Option<impl IntoIterator<Item = TouchingPair>>) {
        let core = &mut self.0.core;
        core.knows_touching = pairs.is_some();
        core.state.touching.clear();
        let serial = |id| core.table.place(id).map(|place| core.state.objects[place].serial);
        let shown = |TouchingPair { sides: [(a, part_a), (b, part_b)], sensor }: TouchingPair| {
            Some(Touching::of([serial(a)?, part_a as u32, serial(b)?, part_b as u32], sensor))
        };
        let mut touching: Vec<Touching> = pairs.into_iter().flatten().filter_map(shown).collect();
        touching.sort_unstable();
        touching.dedup();
        core.state.touching = touching;
    }

    /// Removes an object, and nothing that is attached to it: the other process says what it has.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed before.
    pub fn remove(&mut self, id: ObjectId) -> Result<Box<dyn Object>, WorldError> {
        self.0.remove_alone(id)
    }

    /// Adds a sensor whose readings come from elsewhere, so it reads nothing at its addition and need not fit this world.
    ///
    /// # Errors
    /// [`WorldError`]: a name that is taken, or an object that was removed.
    pub fn add_sensor(&mut self, sensor: Sensor) -> Result<ObjectId, WorldError> {
        if sensor.place().object().is_some_and(|id| self.0.object(id).is_none()) {
            return Err(WorldError::Stale);
        }
        let name = Object::name(&sensor).to_string();
        self.0.add_named(name, Box::new(sensor), Mode::Dynamic)
    }
}

//! Places of objects: the world and the id behind a handle, and lookup by name.

use crate::errors::{Error, Result};
use crate::objects::robot::Robot;
use crate::world::inner::Inner;
use crate::world::shared::Shared;
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::collide::Pose;
use tumble::dynamics::{ArticulatedBody, LoopJoint, ObjectId, PartState, RigidBody as Rigid, Status, World as Core};

/// The target of a handle: a world, an object of it, and the name it had.
#[derive(Clone)]
pub struct Place {
    /// The world.
    pub shared: Arc<Shared>,
    /// The object.
    pub id: ObjectId,
    /// Its name, which never changes.
    pub name: Arc<str>,
}

impl Place {
    /// Returns the error for a handle whose object was removed.
    pub fn removed(&self) -> Error {
        Error::Removed(format!("'{}' was removed from its world", self.name))
    }

    /// Reads something of the object; `None` is a removed one.
    pub fn read<T>(&self, get: impl FnOnce(&Inner) -> Option<T>) -> Result<T> {
        self.shared.read(|inner| get(inner).ok_or_else(|| self.removed()))
    }

    /// Changes something of the object.
    pub fn write<T>(&self, py: Python<'_>, set: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
        self.shared.write(py, |inner| {
            inner.world.status(self.id).ok_or_else(|| self.removed())?;
            set(inner)
        })
    }

    /// Returns whether its world still has the object.
    pub fn exists(&self) -> Result<bool> {
        self.shared.read(|inner| Ok(inner.world.status(self.id).is_some()))
    }

    /// Returns mode and flags of the object.
    pub fn status(&self) -> Result<Status> {
        self.read(|inner| inner.world.status(self.id))
    }

    /// Returns the state of one part.
    pub fn part_state(&self, part: usize) -> Result<PartState> {
        self.read(|inner| inner.world.part_state(self.id, part).copied())
    }

    /// Returns the state of a rigid body at its center of mass.
    pub fn center_state(&self) -> Result<PartState> {
        self.read(|inner| inner.world.center_state(self.id))
    }

    /// Returns the pose of a rigid body's frame.
    pub fn pose(&self) -> Result<Pose> {
        self.read(|inner| inner.world.pose(self.id, 0))
    }

    /// Returns whether two handles refer to the same object.
    pub fn same(&self, other: &Place) -> bool {
        Arc::ptr_eq(&self.shared, &other.shared) && self.id == other.id
    }
}

/// Returns equal hashes for equal handles.
pub fn hash(place: &Place) -> u64 {
    use std::hash::{DefaultHasher, Hash, Hasher};
    let mut hasher = DefaultHasher::new();
    (Arc::as_ptr(&place.shared) as usize, place.id).hash(&mut hasher);
    hasher.finish()
}

/// Everything a handle is made from.
pub struct Found {
    /// The object.
    pub id: ObjectId,
    /// Its name.
    pub name: Arc<str>,
    /// The model of an articulated body.
    pub robot: Option<Arc<Robot>>,
    /// Whether it is a joint.
    pub joint: bool,
}

/// Returns what a handle of the object is made from.
pub fn found(inner: &Inner, id: ObjectId) -> Option<Found> {
    let name = inner.world.name(id)?.into();
    let joint = inner.world.get::<LoopJoint>(id).is_some();
    Some(Found { id, name, robot: inner.robots.get(&id).cloned(), joint })
}

/// Returns the ids of all bodies, in the order of addition.
pub fn body_ids(world: &Core) -> Vec<ObjectId> {
    world.ids().iter().copied().filter(|&id| is_body(world, id)).collect()
}

fn is_body(world: &Core, id: ObjectId) -> bool {
    world.get::<Rigid>(id).is_some() || world.get::<ArticulatedBody>(id).is_some()
}

/// Returns the body of that name.
pub fn by_name(inner: &Inner, name: &str) -> Result<Found> {
    let id = inner.world.find(name).filter(|&id| is_body(&inner.world, id));
    id.and_then(|id| found(inner, id)).ok_or_else(|| {
        let names: Vec<&str> = body_ids(&inner.world).iter().filter_map(|&id| inner.world.name(id)).take(8).collect();
        let known =
            if names.is_empty() { "it has none".to_string() } else { format!("there are {}", names.join(", ")) };
        Error::Name(format!("the world has no body named '{name}'; {known}"))
    })
}

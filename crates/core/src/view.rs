//! The table of objects and the read-only view of the world that objects are given.

use crate::object::Object;
use crate::part_state::{PartState, StateRange};
use crate::sleep::RestTimer;
use slotmap::{SlotMap, new_key_type};
use tumble_collide::Vec3;

new_key_type! {
    /// Names an object of a world. After the object is removed the id is `None` everywhere, never somebody else.
    pub struct ObjectId;
}

/// How a body takes part; switched between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Mode {
    /// Never moves; its velocity counts as zero.
    Static,
    /// Follows the pose and velocity it is given, and pushes others (the thesis's scripted motion).
    Kinematic,
    /// Moved by forces and impulses.
    #[default]
    Dynamic,
}

/// An object's switches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Status {
    /// How it takes part.
    pub mode: Mode,
    /// Not alive: neither moves, nor collides, nor acts, until it is alive again.
    pub enabled: bool,
    /// Whether its parts meet others.
    pub collidable: bool,
}

impl Default for Status {
    fn default() -> Status {
        Status { mode: Mode::Dynamic, enabled: true, collidable: true }
    }
}

impl Status {
    /// Whether impulses move it.
    pub fn moves(&self) -> bool {
        self.enabled && self.mode == Mode::Dynamic
    }
}

/// An object and its place.
pub(crate) struct Entry {
    pub object: Box<dyn Object>,
    pub state_range: StateRange,
    pub status: Status,
    /// Never used twice in a world: what warm starts are filed under.
    pub serial: u32,
    /// Left out of the steps until something stirs it.
    pub asleep: bool,
    pub rest_timer: RestTimer,
}

impl Entry {
    pub fn new(object: Box<dyn Object>, state_range: StateRange, status: Status, serial: u32) -> Entry {
        Entry { object, state_range, status, serial, asleep: false, rest_timer: RestTimer::default() }
    }

    /// Whether it takes part in dynamics: dynamic, alive, and with a state; awake or asleep.
    pub fn dynamic(&self) -> bool {
        self.status.moves() && !self.state_range.v.is_empty()
    }

    /// Whether forces and impulses move it: dynamic and awake.
    pub fn moves(&self) -> bool {
        self.dynamic() && !self.asleep
    }
}

impl Clone for Entry {
    fn clone(&self) -> Entry {
        let (asleep, rest_timer) = (self.asleep, self.rest_timer.clone());
        Entry {
            asleep,
            rest_timer,
            ..Entry::new(self.object.fork(), self.state_range.clone(), self.status, self.serial)
        }
    }
}

/// All objects, addressed by id and walked in the order in which they were added.
#[derive(Clone, Default)]
pub(crate) struct Table {
    pub slots: SlotMap<ObjectId, Entry>,
    pub order: Vec<ObjectId>,
}

impl Table {
    pub fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.order.iter().map(|&id| &self.slots[id])
    }

    /// Walks the objects that a step moves, and lets them change their caches.
    pub fn for_each_mut(&mut self, mut f: impl FnMut(&mut Entry)) {
        for &id in &self.order {
            f(&mut self.slots[id]);
        }
    }
}

/// What an object may read while it accumulates forces or makes rows.
pub struct WorldView<'a> {
    /// Simulated time of this stage, s.
    pub time: f64,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Whether this step's rows are at the velocity level, so that drives and damping are implicit rows of a [`Constraint`](crate::Constraint); where
    /// they are not, such forces belong to the force table.
    pub implicit: bool,
    /// The state `X` at this stage.
    pub x: &'a [f64],
    /// The site table at this stage.
    pub part_states: &'a [PartState],
    pub(crate) table: &'a Table,
}

impl WorldView<'_> {
    /// An object by id.
    pub fn object(&self, id: ObjectId) -> Option<&dyn Object> {
        self.table.slots.get(id).map(|e| e.object.as_ref())
    }

    /// An object by id, as its own type.
    pub fn get<T: Object>(&self, id: ObjectId) -> Option<&T> {
        let object: &dyn std::any::Any = self.object(id)?;
        object.downcast_ref()
    }

    /// Where an object's numbers lie.
    pub fn state_range(&self, id: ObjectId) -> Option<&StateRange> {
        self.table.slots.get(id).map(|e| &e.state_range)
    }

    /// The site of one part.
    pub fn part_state(&self, id: ObjectId, part: usize) -> Option<&PartState> {
        self.part_states[self.state_range(id)?.parts.clone()].get(part)
    }

    /// An object's switches.
    pub fn status(&self, id: ObjectId) -> Option<Status> {
        self.table.slots.get(id).map(|e| e.status)
    }

    /// Whether an object sleeps (see [`Sleep`](crate::Sleep)).
    pub fn asleep(&self, id: ObjectId) -> bool {
        self.table.slots.get(id).is_some_and(|e| e.asleep)
    }

    /// All ids in the order in which the objects were added.
    pub fn ids(&self) -> &[ObjectId] {
        &self.table.order
    }
}

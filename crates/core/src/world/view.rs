//! The table of objects, and the read-only view of the world for objects.

use crate::derived::Cache;
use crate::object::Object;
use crate::object::part_state::{PartState, StateRange};
use crate::rigid::RigidBody;
use crate::threads::Threads;
use crate::world::ObjectState;
use crate::world::walk::Walk;
use slotmap::{SlotMap, new_key_type};
use std::ops::Range;
use std::sync::Arc;
use tumble_collide::Vec3;

new_key_type! {
    /// The id of an object of a world. After the object is removed, the id gives `None`, never
    /// another object.
    pub struct ObjectId;
}

/// How the world moves an object; changed between steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Mode {
    /// Never moves; its velocity is zero.
    Static,
    /// Follows the given pose and velocity, and pushes dynamic objects (the thesis's scripted
    /// motion).
    Kinematic,
    /// Moved by forces and impulses.
    #[default]
    Dynamic,
}

impl std::fmt::Display for Mode {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Mode::Static => "static",
            Mode::Kinematic => "kinematic",
            Mode::Dynamic => "dynamic",
        })
    }
}

/// Settings of an object that change between steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Status {
    /// The mode of motion.
    pub mode: Mode,
    /// Whether it is part of the simulation. A disabled object does not move, collide or act, and
    /// keeps its state.
    pub enabled: bool,
    /// Whether its parts collide.
    pub collidable: bool,
}

impl Default for Status {
    fn default() -> Status {
        Status { mode: Mode::Dynamic, enabled: true, collidable: true }
    }
}

impl Status {
    /// Returns whether impulses move it.
    pub fn moves(&self) -> bool {
        self.enabled && self.mode == Mode::Dynamic
    }
}

/// An object, the ranges of its numbers in the world's tables, and its switches.
#[derive(Clone, Copy)]
pub(crate) struct Entry<'a> {
    /// Index in the order of adding.
    pub place: usize,
    pub name: &'a str,
    pub object: &'a dyn Object,
    pub state_range: &'a StateRange,
    pub status: Status,
    /// Serial number, used once in a world: the key of warm starts.
    pub serial: u32,
    /// Whether it sleeps: it is left out of the steps until it is woken.
    pub asleep: bool,
}

impl Entry<'_> {
    /// Returns whether it takes part in the dynamics: dynamic, enabled, and with a state; awake or
    /// asleep.
    pub fn dynamic(&self) -> bool {
        self.status.moves() && !self.state_range.v.is_empty()
    }

    /// Returns whether forces and impulses move it: dynamic and awake.
    pub fn moves(&self) -> bool {
        self.dynamic() && !self.asleep
    }

    /// Returns the vector from the origin of its part to the center of mass of a rigid body, world axes, m; zero for all others.
    pub(crate) fn center_from_origin(&self, state: &PartState) -> Vec3 {
        let any: &dyn std::any::Any = self.object;
        any.downcast_ref::<RigidBody>().map_or(Vec3::zeros(), |body| state.pose.rotation * body.center_in_part())
    }
}

/// An object and the ranges of its numbers in the world's tables.
pub(crate) struct Placed {
    /// Unique in the world.
    pub name: Arc<str>,
    pub object: Box<dyn Object>,
    pub state_range: StateRange,
}

impl Clone for Placed {
    fn clone(&self) -> Placed {
        Placed { name: self.name.clone(), object: self.object.fork(), state_range: self.state_range.clone() }
    }
}

/// The objects of a world, in the order in which they were added, and their ids. A step changes
/// nothing in it.
#[derive(Clone, Default)]
pub(crate) struct Table {
    pub placed: Vec<Placed>,
    /// Ids in the same order.
    pub order: Vec<ObjectId>,
    places: SlotMap<ObjectId, usize>,
    pub walk: Walk,
}

impl Table {
    /// Returns the place of an object in the order of adding.
    pub fn place(&self, id: ObjectId) -> Option<usize> {
        self.places.get(id).copied()
    }

    /// Returns an object and its ranges.
    pub fn get(&self, id: ObjectId) -> Option<&Placed> {
        Some(&self.placed[self.place(id)?])
    }

    /// Returns the degrees of freedom of all objects.
    pub fn dof(&self) -> usize {
        self.walk.dof.unwrap_or_else(|| self.placed.last().map_or(0, |placed| placed.state_range.v.end))
    }

    /// Brings the list of the walked objects up to date.
    pub fn gather(&mut self) {
        let Table { placed, walk, .. } = self;
        walk.gather();
        walk.measure(|place| {
            let range = &placed[place].state_range;
            [range.x.clone(), range.parts.clone()]
        });
    }

    /// Begins a frame: numbers the degrees of freedom among the walked objects. Returns their
    /// number.
    pub fn number_walked(&mut self) -> usize {
        self.gather();
        let Table { placed, walk, .. } = self;
        if walk.is_whole() {
            return self.dof();
        }
        let mut dof = 0;
        walk.kept.clear();
        for &place in &walk.places {
            let v = &mut placed[place as usize].state_range.v;
            walk.kept.push(v.start);
            *v = dof..dof + v.len();
            dof = v.end;
        }
        walk.dof = Some(dof);
        dof
    }

    /// Returns the degrees of freedom of an object as they are numbered outside a frame.
    pub fn outside(&self, place: usize) -> Range<usize> {
        let v = &self.placed[place].state_range.v;
        let walked = self.walk.kept().and_then(|kept| {
            let at = self.walk.places.binary_search(&(place as u32)).ok()?;
            Some(kept[at]..kept[at] + v.len())
        });
        walked.unwrap_or_else(|| v.clone())
    }

    /// Ends a frame: numbers the degrees of freedom among all objects. Returns their number.
    pub fn number_all(&mut self) -> usize {
        let Table { placed, walk, .. } = self;
        for (&place, start) in walk.places.iter().zip(walk.kept.drain(..)) {
            let v = &mut placed[place as usize].state_range.v;
            *v = start..start + v.len();
        }
        walk.dof = None;
        self.dof()
    }

    /// Makes a cache for every object.
    pub fn new_caches(&self) -> Vec<Cache> {
        self.placed.iter().map(|placed| placed.object.new_cache()).collect()
    }

    /// Adds an object behind all others.
    pub fn push(&mut self, name: Arc<str>, object: Box<dyn Object>, state_range: StateRange) -> ObjectId {
        let id = self.places.insert(self.placed.len());
        self.placed.push(Placed { name, object, state_range });
        self.walk.push();
        self.order.push(id);
        id
    }

    /// Removes an object; those behind it move up by one place. Ranges stay as they are.
    pub fn remove(&mut self, id: ObjectId) -> Option<(usize, Placed)> {
        let gone = self.places.remove(id)?;
        self.order.remove(gone);
        self.walk.remove(gone);
        for (place, other) in self.order.iter().enumerate().skip(gone) {
            self.places[*other] = place;
        }
        Some((gone, self.placed.remove(gone)))
    }

    /// Joins the objects with their switches.
    pub fn with<'a>(&'a self, states: &'a [ObjectState]) -> Objects<'a> {
        Objects { table: self, states }
    }
}

/// The objects of a world with their switches.
#[derive(Clone, Copy)]
pub(crate) struct Objects<'a> {
    pub table: &'a Table,
    pub states: &'a [ObjectState],
}

impl<'a> Objects<'a> {
    /// Walks those that are not settled, in the order in which they were added: the objects that a
    /// step works on.
    pub fn iter(self) -> impl Iterator<Item = Entry<'a>> + Clone {
        self.table.walk.places.iter().map(move |&place| self.at(place as usize))
    }

    /// Walks all of them in the order in which they were added.
    pub fn all(self) -> impl Iterator<Item = Entry<'a>> + Clone {
        let entries = self.table.placed.iter().zip(self.states).enumerate();
        entries.map(|(place, (placed, state))| entry(place, placed, state))
    }

    /// Returns the object at a place in the order of adding.
    pub fn at(self, place: usize) -> Entry<'a> {
        entry(place, &self.table.placed[place], &self.states[place])
    }

    /// Returns an object by id.
    pub fn get(self, id: ObjectId) -> Option<Entry<'a>> {
        Some(self.at(self.table.place(id)?))
    }
}

fn entry<'a>(place: usize, placed: &'a Placed, state: &ObjectState) -> Entry<'a> {
    Entry {
        place,
        name: &placed.name,
        object: placed.object.as_ref(),
        state_range: &placed.state_range,
        status: state.status,
        serial: state.serial,
        asleep: state.asleep,
    }
}

/// Data that an object may read while it accumulates forces or makes rows.
#[derive(Clone, Copy)]
pub struct WorldView<'a> {
    /// Simulated time of this stage, s.
    pub time: f64,
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Whether soft forces (damping, position drives, springs of joints) are implicit rows of a
    /// [`Constraint`](crate::Constraint) in this step: see [`Level::soft_step`](crate::Level::soft_step).
    /// Otherwise such forces belong to the force table.
    pub implicit: bool,
    /// The state `X` at this stage.
    pub x: &'a [f64],
    /// The part states at this stage.
    pub part_states: &'a [PartState],
    pub(crate) objects: Objects<'a>,
    pub(crate) threads: &'a Threads,
}

impl WorldView<'_> {
    /// Cuts an array into pieces of at least `least` items, and calls `work` with the number of the first item and the
    /// items of each piece, on several threads if the step has them. Returns the results in the order of the pieces.
    /// Their number depends on that of the threads, so results that are joined must not.
    pub fn each_piece<T: Send, R: Send>(
        &self,
        items: &mut [T],
        least: usize,
        work: impl Fn(usize, &mut [T]) -> R + Sync,
    ) -> Vec<R> {
        self.threads.each_piece(items, 1, least, work)
    }

    /// Returns an object by id.
    pub fn object(&self, id: ObjectId) -> Option<&dyn Object> {
        self.objects.get(id).map(|e| e.object)
    }

    /// Returns the name of an object.
    pub fn name(&self, id: ObjectId) -> Option<&str> {
        self.objects.get(id).map(|e| e.name)
    }

    /// Returns an object by id, as its own type.
    pub fn get<T: Object>(&self, id: ObjectId) -> Option<&T> {
        let object: &dyn std::any::Any = self.object(id)?;
        object.downcast_ref()
    }

    /// Returns the ranges of an object's numbers in the world's tables.
    pub fn state_range(&self, id: ObjectId) -> Option<&StateRange> {
        self.objects.get(id).map(|e| e.state_range)
    }

    /// Returns the state of one part.
    pub fn part_state(&self, id: ObjectId, part: usize) -> Option<&PartState> {
        self.part_states[self.state_range(id)?.parts.clone()].get(part)
    }

    /// Returns the settings of an object: mode, enabled, collidable.
    pub fn status(&self, id: ObjectId) -> Option<Status> {
        self.objects.get(id).map(|e| e.status)
    }

    /// Returns whether an object sleeps (see [`Sleep`](crate::Sleep)).
    pub fn asleep(&self, id: ObjectId) -> bool {
        self.objects.get(id).is_some_and(|e| e.asleep)
    }

    /// Returns all ids in the order in which the objects were added.
    pub fn ids(&self) -> &[ObjectId] {
        &self.objects.table.order
    }
}

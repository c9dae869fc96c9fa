//! The world: holds the objects, their state and the settings, and advances them by frames
//! (`Engine` in the thesis, §IV.B).

mod bodies;
mod body_view;
mod contacts_of;
mod core;
mod drives;
mod error;
pub(crate) mod events;
mod frame;
mod frame_states;
mod images;
mod islands;
mod joints;
mod pair_materials;
mod pick;
mod query;
mod replica;
mod runaway;
pub(crate) mod script;
mod sensors;
pub(crate) mod sleep;
mod snapshot;
mod state;
mod state_memory;
mod step_error;
mod turns;
pub(crate) mod view;
pub(crate) mod walk;
mod working_memory;

pub(crate) use self::core::Coordinates;
pub use self::core::{ContactPoint, Core};
pub use self::step_error::StepError;
pub use body_view::BodyView;
pub use error::WorldError;
pub use events::{Event, EventKind, TouchingPair};
pub use pick::PickForce;
pub use query::{BodyDistance, Overlap, PointDepth, QueryFilter, Ray, RayCastHit, ShapeCastHit, ShapeOverlap};
pub use replica::{Replica, ReplicaError};
pub use snapshot::SnapshotError;
pub(crate) use state::ObjectState;
pub use state::WorldState;
pub use state_memory::{StateMemory, StateMemoryHold};
pub use working_memory::WorkingMemory;

use crate::constraint::loop_joint::LoopJoint;
use crate::constraint::mimic::Mimic;
use crate::contact::detect::Owner;
use crate::object::part_state::{PartState, StateRange, StateSizes};
use crate::object::visual::Visual;
use crate::object::{Energy, FrameState, Momentum, Object};
use crate::report::StepReport;
use crate::rigid::RigidBody;
use crate::sensor::Sensor;
use crate::settings::Settings;
use crate::solver::{GaussSeidel, RowSolver};
use crate::step::{LargestTurn, StepContext, Stepper, TimeStepping};
use crate::world::view::{Mode, ObjectId, Placed, Status, Table, WorldView};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A world of objects that moves in frames of `settings.dt` seconds.
pub struct World {
    pub(crate) core: Core,
    stepper: Box<dyn Stepper>,
    /// The state before the frame: a frame that fails, or that wakes a sleeper, is rolled back to
    /// it.
    before: WorldState,
    /// Layout, settlings and sleeping groups that `before` is of.
    before_of: Option<[u64; 3]>,
    /// Contacts of the frame before, for a frame that fails.
    contacts_before: Vec<ContactPoint>,
    /// Part states before the frame, for objects with a frame state; empty if there are none.
    parts_before: Vec<PartState>,
    names: BTreeMap<Arc<str>, ObjectId>,
    first_drives: drives::FirstDrives,
}

impl Default for World {
    /// Returns an empty world with the default settings.
    fn default() -> World {
        match World::new(Settings::default()) {
            Ok(world) => world,
            Err(_) => unreachable!("the default settings are in range"),
        }
    }
}

impl World {
    /// Returns an empty world with the default solver (`gauss_seidel`) and stepper
    /// (`time_stepping`).
    ///
    /// # Errors
    /// [`WorldError::Settings`] names a setting that is out of its range.
    pub fn new(settings: Settings) -> Result<World, WorldError> {
        settings.validate()?;
        let core = Core::new(Table::default(), settings, Box::new(GaussSeidel), WorldState::default());
        Ok(World::of(core, Box::<TimeStepping>::default(), BTreeMap::new()))
    }

    fn of(core: Core, stepper: Box<dyn Stepper>, names: BTreeMap<Arc<str>, ObjectId>) -> World {
        World {
            core,
            stepper,
            before: WorldState::default(),
            before_of: None,
            contacts_before: Vec::new(),
            parts_before: Vec::new(),
            names,
            first_drives: drives::FirstDrives::default(),
        }
    }

    /// Replaces the stepper. A world is archived only with one of [`STEPPERS`](crate::STEPPERS).
    pub fn set_stepper(&mut self, stepper: Box<dyn Stepper>) {
        self.stepper = stepper;
    }

    /// Replaces the solver of contact rows. A world is archived only with one of
    /// [`solver::NAMES`](crate::solver::NAMES).
    pub fn set_solver(&mut self, solver: Box<dyn RowSolver>) {
        self.core.solver = solver;
    }

    /// Returns the name of the stepper in use.
    pub fn stepper_name(&self) -> &'static str {
        self.stepper.name()
    }

    /// Returns the name of the solver in use.
    pub fn solver_name(&self) -> &'static str {
        self.core.solver.name()
    }

    /// Returns the settings in use.
    pub fn settings(&self) -> &Settings {
        &self.core.settings
    }

    /// Changes the settings from the next step on.
    ///
    /// # Errors
    /// [`WorldError::Settings`] names a setting that is out of its range. The settings then stay as
    /// they are.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), WorldError> {
        settings.validate()?;
        let now = &self.core.settings;
        if settings.with_threads(now.threads).with_budget(now.solver_settings.budget) != *now {
            self.core.table.walk.unsettle_all();
            self.core.wake_all();
        }
        self.core.settings = settings;
        Ok(())
    }

    /// Advances by one frame of [`Settings::dt`] seconds, then clears the forces that were applied
    /// for the frame.
    ///
    /// # Errors
    /// [`StepError`]. The world is then as it was before: [`save`](Self::save) writes the same
    /// bytes. Forces applied for the frame are still applied;
    /// [`clear_applied`](Self::clear_applied) removes them.
    pub fn step(&mut self) -> Result<&StepReport, StepError> {
        let core = &mut self.core;
        core.threads.set(core.settings.threads);
        core.refresh_walked(); // constants and switches may have changed
        let now = [core.table.walk.layout, core.table.walk.settlings, core.group_changes];
        match self.before_of {
            Some(of) if of == now => self.before.copy_walked(&core.state, &core.table),
            _ => self.before.clone_from(&core.state),
        }
        self.before_of = Some(now);
        std::mem::swap(&mut self.contacts_before, &mut core.contacts);
        let report_before = std::mem::take(&mut core.report);
        core.needs_wake.clear();
        core.meter.reset();
        core.guide();
        core.wake_disturbed();
        core.divide_ahead(self.stepper.as_ref());
        core.keep_part_states(&mut self.parts_before);
        loop {
            let requests = core.needs_wake.len();
            core.enter_frame();
            core.clear_contact_forces();
            core.detect_scratch.forget();
            core.touches.clear();
            core.start_loads();
            core.broken.clear();
            core.meter.start_frame(core.settings.solver_settings.budget, self.before.time + core.settings.dt);
            core.largest_turn = LargestTurn::default();
            let done = self.stepper.step(StepContext { core });
            let done = done.and_then(|()| check_duration(self.stepper.name(), core, self.before.time));
            let done = done.and_then(|()| core.divide_again(self.stepper.as_ref(), self.before.time));
            let followed = |again: bool| match again {
                true => Ok(true),
                false => core
                    .check_runaway()
                    .and_then(|()| core.advance_frame_states(self.before.time, &self.parts_before))
                    .and_then(|()| core.read_sensors(&self.parts_before))
                    .map(|()| false),
            };
            let again = match done.and_then(followed) {
                Ok(again) => again,
                Err(error) => {
                    core.leave_frame();
                    core.set_state(&self.before);
                    std::mem::swap(&mut self.contacts_before, &mut core.contacts);
                    core.report = report_before;
                    return Err(error);
                }
            };
            core.request_wake_by_load();
            if core.needs_wake.len() == requests && !again {
                break;
            }
            core.leave_frame();
            core.restart_frame(&self.before);
            core.report = StepReport::default();
            core.guide();
            core.wake_disturbed();
            core.wake_requested();
        }
        core.disable_broken();
        core.fall_asleep();
        let asleep = core.objects().iter().filter(|e| e.asleep).count();
        core.report.asleep = (asleep + core.table.walk.asleep) as u32;
        core.report.relaxations = core.meter.done();
        core.collect_events(&self.before);
        core.state.clear_walked(&core.table);
        for range in core.table.walk.parts.iter() {
            core.state.keep_accelerations(range, &core.derived.part_states);
        }
        core.state.frame += 1;
        core.leave_frame();
        core.settle();
        if let Err(error) = self.fire_events() {
            let core = &mut self.core;
            core.set_state(&self.before);
            core.events.clear();
            std::mem::swap(&mut self.contacts_before, &mut core.contacts);
            core.report = report_before;
            return Err(error);
        }
        self.take_images();
        Ok(&self.core.report)
    }

    /// Writes the present state to `at`, whose memory is used again.
    pub fn checkpoint(&self, at: &mut WorldState) {
        at.clone_from(&self.core.state);
    }

    /// Goes back to the state at a [`checkpoint`](Self::checkpoint); there are no contacts until
    /// the next step. Constants of objects and settings stay as they are. Returns false, and
    /// changes nothing, if objects were added or removed since.
    pub fn roll_back(&mut self, to: &WorldState) -> bool {
        let fits = self.core.state.fits(to);
        if fits {
            self.core.set_state(to);
            self.core.contacts.clear();
            self.core.events.clear();
        }
        fits
    }

    /// Returns everything that the next step reads.
    pub(crate) fn state_value(&self) -> &WorldState {
        &self.core.state
    }

    /// Returns the simulated time, s.
    pub fn time(&self) -> f64 {
        self.core.state.time
    }

    /// Returns the number of frames since the world was made.
    pub fn frame(&self) -> u64 {
        self.core.state.frame
    }

    /// Returns counts and residuals of the last step.
    pub fn report(&self) -> &StepReport {
        &self.core.report
    }

    /// Sets the contacts, the events and the report of the last step.
    pub(crate) fn publish(&mut self, contacts: Vec<ContactPoint>, events: Vec<Event>, report: StepReport) {
        (self.core.contacts, self.core.events, self.core.report) = (contacts, events, report);
    }

    /// Returns the contacts of the last sub-step.
    pub fn contacts(&self) -> &[ContactPoint] {
        &self.core.contacts
    }

    /// Returns the state `X`: the ranges of all objects one after the other, in the order of
    /// addition.
    pub fn state(&self) -> &[f64] {
        &self.core.state.x
    }

    /// Returns the state of every part, in the order of addition of the objects.
    pub fn part_states(&self) -> &[PartState] {
        &self.core.derived.part_states
    }

    /// Returns the read-only view that objects get in a step.
    pub fn view(&self) -> WorldView<'_> {
        WorldView { implicit: false, ..self.core.view(self.core.state.time) }
    }

    /// Returns the ids in the order in which the objects were added.
    pub fn ids(&self) -> &[ObjectId] {
        &self.core.table.order
    }

    /// Returns the id of the object that has this name.
    pub fn find(&self, name: &str) -> Option<ObjectId> {
        self.names.get(name).copied()
    }

    /// Returns all visuals, object by object in the order of addition.
    pub fn visuals(&self) -> impl Iterator<Item = &Visual> {
        self.core.objects().all().filter_map(|e| e.object.renderable()).flat_map(|renderable| renderable.visuals())
    }

    /// Returns the mechanical energy of all dynamic objects, and of the springs and rotors between them, J.
    pub fn energy(&self) -> Energy {
        let g = self.core.settings.gravity;
        let bodies = self.moving().fold(Energy::default(), |sum, (x, body)| {
            let e = body.energy(x, &g);
            Energy { kinetic: sum.kinetic + e.kinetic, potential: sum.potential + e.potential }
        });
        let (view, enabled) = (self.view(), self.core.objects().all().filter(|e| e.status.enabled));
        let forces = enabled.filter_map(|e| e.object.force());
        forces.fold(bodies, |sum, force| Energy {
            kinetic: sum.kinetic + force.kinetic(&view),
            potential: sum.potential + force.potential(&view),
        })
    }

    /// Returns the momentum of all dynamic objects: linear, kg·m/s, and angular about the world's
    /// origin, kg·m²/s, world axes.
    pub fn momentum(&self) -> Momentum {
        self.moving().fold(Momentum::default(), |sum, (x, body)| {
            let m = body.momentum(x);
            Momentum { linear: sum.linear + m.linear, angular: sum.angular + m.angular }
        })
    }

    fn moving(&self) -> impl Iterator<Item = (&[f64], &dyn crate::object::Integratable)> {
        let moving = self.core.objects().all().filter(|e| e.dynamic());
        moving.filter_map(|e| Some((&self.core.state.x[e.state_range.x.clone()], e.object.integratable()?)))
    }

    /// Adds an object. It is dynamic, or static if it is a [fixed](RigidBody::fixed) body;
    /// [`set_mode`](Self::set_mode) changes that.
    ///
    /// Names are unique and of any length. An object without a name gets one: `body`, `joint`,
    /// `force`, `sensor`, `state` or `object` and the count of objects added before, `body 3`, or the next number if
    /// another object has that name. [`name`](Self::name) returns it.
    ///
    /// # Errors
    /// [`WorldError`]: a name that is taken, constants out of their range, or numbers that are not
    /// finite. Nothing is added then.
    pub fn add(&mut self, object: impl Object) -> Result<ObjectId, WorldError> {
        let any: &dyn std::any::Any = &object;
        let fixed = any.downcast_ref::<RigidBody>().is_some_and(RigidBody::is_fixed);
        self.add_boxed(Box::new(object), if fixed { Mode::Static } else { Mode::Dynamic })
    }

    /// Adds an object in the mode `Static`: it never moves.
    ///
    /// # Errors
    /// [`WorldError`], as [`add`](Self::add).
    pub fn add_static(&mut self, object: impl Object) -> Result<ObjectId, WorldError> {
        self.add_boxed(Box::new(object), Mode::Static)
    }

    /// Adds an object in a given mode.
    ///
    /// # Errors
    /// [`WorldError`], as [`add`](Self::add).
    pub fn add_boxed(&mut self, mut object: Box<dyn Object>, mode: Mode) -> Result<ObjectId, WorldError> {
        let any: &mut dyn std::any::Any = object.as_mut();
        if let Some(event) = any.downcast_mut::<script::ScriptedEvent>() {
            let prepared = event.prepare(self);
            prepared.map_err(|why| WorldError::Event { name: object.name().into(), why })?;
        }
        let name = match object.name() {
            "" => self.new_name(object.as_ref()),
            name => name.to_string(),
        };
        own_name(object.as_mut(), &name);
        let any: &dyn std::any::Any = object.as_ref();
        let Some(sensor) = any.downcast_ref::<Sensor>() else { return self.add_named(name, object, mode) };
        self.check_sensor(sensor)?;
        let id = self.add_named(name, object, mode)?;
        self.start_sensor(id);
        Ok(id)
    }

    /// Returns a name that no object has. It depends only on the objects added so far.
    fn new_name(&self, object: &dyn Object) -> String {
        let any: &dyn std::any::Any = object;
        let kind = if object.integratable().is_some() || object.collidable().is_some() {
            "body"
        } else if object.constraint().is_some() {
            "joint"
        } else if object.force().is_some() {
            "force"
        } else if object.frame_state().is_some() {
            if any.is::<Sensor>() { "sensor" } else { "state" }
        } else {
            "object"
        };
        let names = (self.core.state.next_serial..).map(|number| format!("{kind} {number}"));
        names.into_iter().find(|name| self.find(name).is_none()).unwrap_or_default() // one of them is free
    }

    /// Adds an object under this name.
    pub(crate) fn add_named(
        &mut self,
        name: String,
        object: Box<dyn Object>,
        mode: Mode,
    ) -> Result<ObjectId, WorldError> {
        if self.find(&name).is_some() {
            return Err(WorldError::DuplicateName(name));
        }
        let any: &dyn std::any::Any = object.as_ref();
        if let Some(body) = any.downcast_ref::<RigidBody>() {
            body.validate().map_err(|why| WorldError::Body { name: name.clone(), why })?;
        }
        let core = &mut self.core;
        let parts = object.collidable().map_or(0, |c| c.parts());
        let x = frame_states::alone(object.as_ref()).map_or(0, FrameState::len);
        let state_sizes = object.integratable().map_or(StateSizes { x, dof: 0, parts }, |i| i.state_sizes());
        if object.collidable().is_some() && state_sizes.parts != parts {
            return Err(WorldError::Parts { name, parts, part_states: state_sizes.parts });
        }
        let state_range = StateRange {
            x: core.state.x.len()..core.state.x.len() + state_sizes.x,
            v: core.dof..core.dof + state_sizes.dof,
            parts: core.derived.part_states.len()..core.derived.part_states.len() + state_sizes.parts,
        };
        core.state.x.resize(state_range.x.end);
        if let Some(body) = object.integratable() {
            body.write_initial(&mut core.state.x[state_range.x.clone()]);
        } else if let Some(follower) = object.frame_state() {
            follower.write_initial(&mut core.state.x[state_range.x.clone()]);
        }
        if core.state.x[state_range.x.clone()].iter().any(|x| !x.is_finite()) {
            core.state.x.resize(state_range.x.start);
            return Err(WorldError::NotFinite(name));
        }
        core.moments.clear();
        core.own_caches();
        core.derived.caches.push(object.new_cache());
        let name = Arc::<str>::from(name);
        let id = core.table.push(name.clone(), object, state_range.clone());
        core.dof = state_range.v.end;
        core.held.resize(core.dof, 0.0);
        core.derived.part_states.resize(state_range.parts.end, PartState::default());
        let place = core.state.objects.len() as u32;
        core.owners.extend((0..state_sizes.parts).map(|part| Owner { id, place, part: part as u32 }));
        core.state.add(Status { mode, ..Status::default() }, &state_range);
        core.integration().refresh_one(id);
        self.names.insert(name, id);
        self.start_turns(id);
        match self.core.table.placed[place as usize].object.constraint() {
            Some(constraint) => {
                let joined = constraint.joined_parts();
                joined.into_iter().for_each(|parts| self.core.pair_materials.join(parts));
                self.core.wake(id);
            }
            None => self.core.wake_near(id),
        }
        Ok(id)
    }

    /// Removes an object and returns it. What has no meaning without it is removed too ([`Object::attached_to`]): the loop
    /// joints and mimics of a body, the sensors on a body or joint, and those that read against it. The ranges of the state
    /// of all of them are removed, and the ranges behind them move up.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed before.
    pub fn remove(&mut self, id: ObjectId) -> Result<Box<dyn Object>, WorldError> {
        let mut attached = vec![id];
        let mut known = 0;
        while let Some(&on) = attached.get(known) {
            let goes = |id: &ObjectId| self.object(*id).is_some_and(|object| object.attached_to(on));
            let more: Vec<ObjectId> =
                self.ids().iter().filter(|id| goes(id) && !attached.contains(id)).copied().collect();
            attached.extend(more);
            known += 1;
        }
        attached.drain(1..).rev().try_for_each(|other| self.remove_alone(other).map(drop))?;
        self.remove_alone(id)
    }

    /// Removes an object and nothing that is attached to it.
    pub(crate) fn remove_alone(&mut self, id: ObjectId) -> Result<Box<dyn Object>, WorldError> {
        self.core.wake(id);
        self.forget_drives(id);
        let core = &mut self.core;
        core.own_caches();
        let (place, gone) = core.table.remove(id).ok_or(WorldError::Stale)?;
        self.names.remove(&gone.name);
        core.state.remove(place, &gone.state_range);
        core.derived.part_states.drain(gone.state_range.parts.clone());
        core.derived.caches.remove(place);
        core.moments.clear();
        core.forces.wrenches.clear();
        core.owners.drain(gone.state_range.parts.clone());
        core.dof -= gone.state_range.v.len();
        core.held.truncate(core.dof);
        let (dx, dv, ds) = (gone.state_range.x.len(), gone.state_range.v.len(), gone.state_range.parts.len());
        for Placed { state_range, .. } in &mut core.table.placed[place..] {
            *state_range = StateRange {
                x: state_range.x.start - dx..state_range.x.end - dx,
                v: state_range.v.start - dv..state_range.v.end - dv,
                parts: state_range.parts.start - ds..state_range.parts.end - ds,
            };
        }
        core.owners[gone.state_range.parts.start..].iter_mut().for_each(|owner| owner.place -= 1);
        core.pair_materials.forget(id);
        if gone.object.constraint().is_some() {
            core.find_joined();
        }
        core.contacts.retain(|c| c.a != id && c.b != id);
        core.events.retain(|event| !event.names(id));
        Ok(gone.object)
    }

    /// Returns an independent copy, which moves as this world does, bit for bit.
    pub fn fork(&self) -> World {
        let first_drives = self.first_drives.clone();
        World { first_drives, ..World::of(self.core.fork(), self.stepper.fork(), self.names.clone()) }
    }
}

/// Gives a joint, a mimic or a sensor the name that it has in the world, for its errors.
fn own_name(object: &mut dyn Object, name: &str) {
    let any: &mut dyn std::any::Any = object;
    if let Some(joint) = any.downcast_mut::<LoopJoint>() {
        joint.set_name(name);
    } else if let Some(mimic) = any.downcast_mut::<Mimic>() {
        mimic.set_name(name);
    } else if let Some(sensor) = any.downcast_mut::<Sensor>() {
        sensor.set_name(name);
    }
}

/// Checks that the stepper advanced the world from time `before` by a frame, up to rounding.
fn check_duration(stepper: &'static str, core: &Core, before: f64) -> Result<(), StepError> {
    let (advanced, dt) = (core.state.time - before, core.settings.dt);
    if (advanced - dt).abs() <= 1e-3 * dt {
        return Ok(());
    }
    Err(StepError::Duration { stepper, advanced, dt })
}

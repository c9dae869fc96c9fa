//! The world: objects in, frames out (the thesis's `Engine`, §IV.B).

mod bodies;
mod checkpoint;
mod core;
mod mirror;
mod overlaps;
mod pair_materials;
mod pick;
mod snapshot;
mod state_memory;

pub use self::core::{ContactPoint, Core, StepError};
pub use checkpoint::Checkpoint;
pub use mirror::MirrorError;
pub use overlaps::Overlap;
pub use pick::PickForce;
pub use snapshot::SnapshotError;
pub use state_memory::StateMemoryHold;

use crate::detect::{DetectorBuffers, Owner, WarmStarts};
use crate::object::{Energy, Momentum, Object};
use crate::pair_material::PairMaterials;
use crate::part_state::{Forces, PartState, StateRange, StateSizes, Wrench};
use crate::rigid::{BodyError, RigidBody};
use crate::settings::{Settings, SettingsError, StepReport};
use crate::sleep::Sleepers;
use crate::solver::{GaussSeidel, RowSolver};
use crate::step::{StepContext, Stepper, TimeStepping};
use crate::view::{Entry, Mode, ObjectId, Status, Table, WorldView};
use crate::visual::Visual;
use std::collections::BTreeMap;
use tumble_collide::SweepAndPrune;

/// Why an object was not added or found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum WorldError {
    /// Names are unique.
    #[error("an object named '{0}' is already in the world; names must be unique")]
    DuplicateName(String),
    /// Names travel in a 64-byte header.
    #[error("the name '{0}' must have 1 to 63 bytes")]
    Name(String),
    /// Constants of a body out of range.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// A setting out of range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The id belongs to no object of this world.
    #[error("no such object: it was removed, or belongs to another world")]
    Stale,
    /// What was asked for needs a rigid body.
    #[error("'{0}' is not a rigid body")]
    NotRigid(String),
    /// Every collidable part has one row in the site table.
    #[error("'{name}' has {parts} collidable parts and {part_states} sites; the numbers must be equal")]
    Parts {
        /// Object.
        name: String,
        /// Parts that its `Collidable` names.
        parts: usize,
        /// Sites that its `StateSizes` name.
        part_states: usize,
    },
    /// The object has no such part.
    #[error("'{name}' has no part {part}")]
    NoPart {
        /// Object.
        name: String,
        /// Part asked for.
        part: usize,
    },
    /// As many numbers are wanted as the object has degrees of freedom.
    #[error("'{name}' has {dof} degrees of freedom, and {given} numbers were given")]
    Freedoms {
        /// Object.
        name: String,
        /// Its degrees of freedom.
        dof: usize,
        /// Numbers given.
        given: usize,
    },
    /// Numbers that are no state of this object: wrong length, not finite, or an orientation that is not of unit length.
    #[error(
        "'{0}': these numbers are no state of it (wrong length, not finite, or an orientation that is not of unit length)"
    )]
    BadState(String),
    /// A number given is not finite.
    #[error("'{0}': a number given is not finite")]
    NotFinite(String),
}

/// A world of objects that moves in frames of `settings.dt` seconds.
pub struct World {
    core: Core,
    stepper: Box<dyn Stepper>,
    /// State before the frame, for when it fails.
    before: Vec<f64>,
    warm_before: WarmStarts,
    names: BTreeMap<String, ObjectId>,
}

impl World {
    /// An empty world with the default solver (`gauss_seidel`) and stepper (`time_stepping`).
    pub fn new(settings: Settings) -> Result<World, WorldError> {
        settings.validate()?;
        let core = Core {
            table: Table::default(),
            x: Default::default(),
            dof: 0,
            part_states: Vec::new(),
            owners: Vec::new(),
            applied: Vec::new(),
            applied_generalized: Vec::new(),
            implicit: false,
            held: Vec::new(),
            held_wrenches: Vec::new(),
            pinned: Default::default(),
            unpinned: Default::default(),
            forces: Forces::default(),
            settings,
            pair_materials: PairMaterials::default(),
            time: 0.0,
            frame: 0,
            broad: Box::<SweepAndPrune>::default(),
            detect_scratch: DetectorBuffers::default(),
            solver: Box::new(GaussSeidel),
            warm: WarmStarts::default(),
            contacts: Vec::new(),
            report: StepReport::default(),
            next_serial: 0,
            sleepers: Sleepers::default(),
            inner_step: 0.0,
        };
        Ok(World {
            core,
            stepper: Box::<TimeStepping>::default(),
            before: Vec::new(),
            warm_before: WarmStarts::default(),
            names: BTreeMap::new(),
        })
    }

    /// Replaces the stepper.
    pub fn set_stepper(&mut self, stepper: Box<dyn Stepper>) {
        self.stepper = stepper;
    }

    /// Replaces the solver of contact rows.
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

    /// The constants in use.
    pub fn settings(&self) -> &Settings {
        &self.core.settings
    }

    /// Changes the constants from the next step on.
    pub fn set_settings(&mut self, settings: Settings) -> Result<(), WorldError> {
        settings.validate()?;
        self.core.wake_all();
        self.core.settings = settings;
        Ok(())
    }

    /// Advances by one frame. On an error state and time are as they were before it; the forces applied for the frame are spent either way.
    pub fn step(&mut self) -> Result<&StepReport, StepError> {
        let core = &mut self.core;
        core.wake_disturbed();
        core.x.clone_into(&mut self.before);
        self.warm_before.clone_from(&core.warm);
        let (time, inner_step) = (core.time, core.inner_step);
        let part_states = if core.sleepers.groups.is_empty() { Vec::new() } else { core.part_states.clone() };
        let outcome = loop {
            core.report = StepReport::default();
            core.clear_contact_forces();
            core.detect_scratch.forget();
            let outcome = self.stepper.step(StepContext { core });
            if outcome.is_err() || !core.needs_wake() {
                break outcome;
            }
            core.x.copy_from_slice(&self.before);
            core.unpin();
            core.part_states.clone_from(&part_states);
            (core.time, core.inner_step) = (time, inner_step);
            core.warm.clone_from(&self.warm_before);
            core.integration().refresh();
            core.wake_requested();
        };
        if outcome.is_ok() {
            core.fall_asleep();
            core.report.asleep = core.table.iter().filter(|e| e.asleep).count() as u32;
        }
        core.applied.fill(Wrench::default());
        core.applied_generalized.fill(0.0);
        if let Err(error) = outcome {
            core.x.copy_from_slice(&self.before);
            core.unpin();
            (core.time, core.inner_step) = (time, inner_step);
            core.warm.clone_from(&self.warm_before);
            core.part_states.iter_mut().for_each(|s| *s = PartState { pose: s.pose, ..PartState::default() });
            core.integration().refresh();
            return Err(error);
        }
        core.frame += 1;
        Ok(&core.report)
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.core.time
    }

    /// Frames stepped since the world was made.
    pub fn frame(&self) -> u64 {
        self.core.frame
    }

    /// The report of the last step.
    pub fn report(&self) -> &StepReport {
        &self.core.report
    }

    /// Shows contacts and a report as those of the last step.
    pub(crate) fn publish(&mut self, contacts: Vec<ContactPoint>, report: StepReport) {
        (self.core.contacts, self.core.report) = (contacts, report);
    }

    /// The contacts of the last sub-step.
    pub fn contacts(&self) -> &[ContactPoint] {
        &self.core.contacts
    }

    /// The flat state `X`.
    pub fn state(&self) -> &[f64] {
        &self.core.x
    }

    /// The site table.
    pub fn part_states(&self) -> &[PartState] {
        &self.core.part_states
    }

    /// A read-only view, as objects get it.
    pub fn view(&self) -> WorldView<'_> {
        let c = &self.core;
        WorldView {
            time: c.time,
            gravity: c.settings.gravity,
            implicit: false,
            x: &c.x,
            part_states: &c.part_states,
            table: &c.table,
        }
    }

    /// Ids in the order in which the objects were added.
    pub fn ids(&self) -> &[ObjectId] {
        &self.core.table.order
    }

    /// The object of that name.
    pub fn find(&self, name: &str) -> Option<ObjectId> {
        self.names.get(name).copied()
    }

    /// All visuals, object by object in the order of adding.
    pub fn visuals(&self) -> impl Iterator<Item = &Visual> {
        self.core.table.iter().filter_map(|e| e.object.renderable()).flat_map(|renderable| renderable.visuals())
    }

    /// Mechanical energy of everything that moves, J.
    pub fn energy(&self) -> Energy {
        let g = self.core.settings.gravity;
        self.moving().fold(Energy::default(), |sum, (x, body)| {
            let e = body.energy(x, &g);
            Energy { kinetic: sum.kinetic + e.kinetic, potential: sum.potential + e.potential }
        })
    }

    /// Momentum of everything that moves, about the world's origin.
    pub fn momentum(&self) -> Momentum {
        self.moving().fold(Momentum::default(), |sum, (x, body)| {
            let m = body.momentum(x);
            Momentum { linear: sum.linear + m.linear, angular: sum.angular + m.angular }
        })
    }

    fn moving(&self) -> impl Iterator<Item = (&[f64], &dyn crate::object::Integratable)> {
        let moving = self.core.table.iter().filter(|e| e.dynamic());
        moving.filter_map(|e| Some((&self.core.x[e.state_range.x.clone()], e.object.integratable()?)))
    }

    /// Adds an object; it moves unless it is a [fixture](RigidBody::fixed), which is static, or [`set_mode`](Self::set_mode) says otherwise.
    pub fn add(&mut self, object: impl Object) -> Result<ObjectId, WorldError> {
        let any: &dyn std::any::Any = &object;
        let fixed = any.downcast_ref::<RigidBody>().is_some_and(RigidBody::is_fixed);
        self.add_boxed(Box::new(object), if fixed { Mode::Static } else { Mode::Dynamic })
    }

    /// Adds an object that never moves.
    pub fn add_static(&mut self, object: impl Object) -> Result<ObjectId, WorldError> {
        self.add_boxed(Box::new(object), Mode::Static)
    }

    /// Adds an object in a given mode.
    pub fn add_boxed(&mut self, object: Box<dyn Object>, mode: Mode) -> Result<ObjectId, WorldError> {
        let name = object.name().to_string();
        if name.is_empty() || name.len() > 63 {
            return Err(WorldError::Name(name));
        }
        if self.find(&name).is_some() {
            return Err(WorldError::DuplicateName(name));
        }
        let any: &dyn std::any::Any = object.as_ref();
        if let Some(body) = any.downcast_ref::<RigidBody>() {
            body.validate()?;
        }
        let core = &mut self.core;
        let parts = object.collidable().map_or(0, |c| c.parts());
        let state_sizes = object.integratable().map_or(StateSizes { x: 0, dof: 0, parts: parts }, |i| i.state_sizes());
        if object.collidable().is_some() && state_sizes.parts != parts {
            return Err(WorldError::Parts { name, parts, part_states: state_sizes.parts });
        }
        let state_range = StateRange {
            x: core.x.len()..core.x.len() + state_sizes.x,
            v: core.dof..core.dof + state_sizes.dof,
            parts: core.part_states.len()..core.part_states.len() + state_sizes.parts,
        };
        core.x.resize(state_range.x.end);
        if let Some(body) = object.integratable() {
            body.write_initial(&mut core.x[state_range.x.clone()]);
        }
        if core.x[state_range.x.clone()].iter().any(|x| !x.is_finite()) {
            core.x.resize(state_range.x.start);
            return Err(WorldError::NotFinite(name));
        }
        core.dof = state_range.v.end;
        core.held.resize(core.dof, 0.0);
        core.applied_generalized.resize(core.dof, 0.0);
        core.part_states.resize(state_range.parts.end, PartState::default());
        core.applied.resize(state_range.parts.end, Wrench::default());
        let serial = core.next_serial;
        core.next_serial += 1;
        let id = core.table.slots.insert(Entry::new(
            object,
            state_range.clone(),
            Status { mode, ..Status::default() },
            serial,
        ));
        core.table.order.push(id);
        core.owners.extend((0..state_sizes.parts).map(|part| Owner { id, part: part as u32, serial }));
        core.integration().refresh_one(id);
        self.names.insert(name, id);
        Ok(id)
    }

    /// Removes an object and gives it back; its state goes, and the slices behind it move up.
    pub fn remove(&mut self, id: ObjectId) -> Result<Box<dyn Object>, WorldError> {
        self.core.wake(id);
        let core = &mut self.core;
        let gone = core.table.slots.remove(id).ok_or(WorldError::Stale)?;
        self.names.remove(gone.object.name());
        core.table.order.retain(|&other| other != id);
        core.x.cut(gone.state_range.x.clone());
        core.part_states.drain(gone.state_range.parts.clone());
        core.owners.drain(gone.state_range.parts.clone());
        core.applied.drain(gone.state_range.parts.clone());
        core.dof -= gone.state_range.v.len();
        core.held.truncate(core.dof);
        core.applied_generalized.drain(gone.state_range.v.clone());
        let (dx, dv, ds) = (gone.state_range.x.len(), gone.state_range.v.len(), gone.state_range.parts.len());
        for &other in &core.table.order {
            let state_range = &mut core.table.slots[other].state_range;
            if state_range.x.start >= gone.state_range.x.end
                && state_range.v.start >= gone.state_range.v.end
                && state_range.parts.start >= gone.state_range.parts.end
            {
                *state_range = StateRange {
                    x: state_range.x.start - dx..state_range.x.end - dx,
                    v: state_range.v.start - dv..state_range.v.end - dv,
                    parts: state_range.parts.start - ds..state_range.parts.end - ds,
                };
            }
        }
        core.warm.forget(gone.serial);
        core.pair_materials.forget(id);
        core.contacts.retain(|c| c.a != id && c.b != id);
        Ok(gone.object)
    }

    /// An independent copy: same state, same future.
    pub fn fork(&self) -> World {
        let c = &self.core;
        World {
            core: Core {
                table: c.table.clone(),
                x: c.x.fork(),
                dof: c.dof,
                part_states: c.part_states.clone(),
                owners: c.owners.clone(),
                applied: c.applied.clone(),
                applied_generalized: c.applied_generalized.clone(),
                implicit: c.implicit,
                pinned: Default::default(),
                unpinned: Default::default(),
                held: c.held.clone(),
                held_wrenches: c.held_wrenches.clone(),
                forces: c.forces.clone(),
                settings: c.settings,
                pair_materials: c.pair_materials.clone(),
                time: c.time,
                frame: c.frame,
                broad: Box::<SweepAndPrune>::default(),
                detect_scratch: DetectorBuffers::default(),
                solver: c.solver.fork(),
                warm: c.warm.clone(),
                contacts: c.contacts.clone(),
                report: c.report,
                next_serial: c.next_serial,
                sleepers: c.sleepers.clone(),
                inner_step: c.inner_step,
            },
            stepper: self.stepper.fork(),
            before: Vec::new(),
            warm_before: WarmStarts::default(),
            names: self.names.clone(),
        }
    }
}

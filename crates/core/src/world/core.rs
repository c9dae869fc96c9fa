//! The core of a world, on which the steppers work.

use super::events::{Event, Touches, Touching};
use super::state::WorldState;
use crate::contact::detect::{ContactConstraint, DetectorBuffers, Owner, PartTable};
use crate::contact::pair_material::PairMaterials;
use crate::contact::warm_starts::{RowStart, WarmStart};
use crate::derived::{Cache, Derived};
use crate::each_object::first_object;
use crate::integrators::context::IntegrationContext;
use crate::linearize::Branches;
use crate::object::part_state::{Forces, PartState, Wrench};
use crate::object::{Object, has_sensor};
use crate::report::StepReport;
use crate::rigid::RigidBody;
use crate::sensor::loads::FrameLoads;
use crate::settings::Settings;
use crate::solver::RowSolver;
use crate::step::{Attempt, LargestTurn, Moment, ResistingBodies, WorkMeter};
use crate::threads::Threads;
use crate::world::view::{Entry, Mode, ObjectId, Objects, Table, WorldView};
use tumble_collide::{BroadPhase, SweepAndPrune, Vec3};

/// An error that stopped a step. [`World::step`](crate::World::step) restores state and time to
/// those before the frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// A force, a momentum or a position is not finite.
    #[error("'{object}' at t = {time} s: {what} is not finite; look at the forces and impulses given to it")]
    NotFinite {
        /// Object.
        object: String,
        /// The quantity: a force or the state.
        what: &'static str,
        /// Simulated time, s.
        time: f64,
    },
    /// A part flies away, which is an instability: of an explicit force, or of the step.
    #[error(
        "'{object}' at t = {time} s: part {part} flies away: {what}, is {value:e}, at most {most:e} is admissible; shorten dt, or look at the forces given to it: one that a program computes from the velocity is stable for |dF/dv| below 2·mass/dt"
    )]
    Runaway {
        /// Object.
        object: String,
        /// Part of the object: a link of an articulated body, 0 of a rigid body.
        part: usize,
        /// The quantity, with its unit: the speed of the part's surface or its distance from the origin.
        what: &'static str,
        /// Its value, m/s or m.
        value: f64,
        /// Largest admissible value, m/s or m.
        most: f64,
        /// Simulated time, s.
        time: f64,
    },
    /// An object's mass matrix is singular.
    #[error("'{object}' at t = {time} s: {why}")]
    Singular {
        /// Object.
        object: String,
        /// The singular joint, and a remedy.
        why: String,
        /// Simulated time, s.
        time: f64,
    },
    /// The adaptive integrator cannot hold its tolerance.
    #[error(
        "'{object}' at t = {time} s: its motion needs more than the {steps} inner steps of this frame (the last of {step} s) at the integrator's tolerance {tolerance}; soften what acts on it, or loosen the tolerance"
    )]
    Tolerance {
        /// The object with the largest error.
        object: String,
        /// Simulated time, s.
        time: f64,
        /// Length of the last inner step tried, s.
        step: f64,
        /// Inner steps of this frame, rejected ones included.
        steps: u32,
        /// `Settings::integrator_tolerance`.
        tolerance: f64,
    },
    /// An object is made for steps of a length that no stepper can take.
    #[error(
        "'{object}' is made for steps of {step} s (Integratable::made_for_step); expected at least {least} s, a ten-thousandth of the frame, and finite"
    )]
    MadeForStep {
        /// Object.
        object: String,
        /// Length that it returned, s.
        step: f64,
        /// Least length, s.
        least: f64,
    },
    /// The stepper did not advance the world by the length of a frame.
    #[error("stepper '{stepper}' advanced the world by {advanced} s; a frame has {dt} s")]
    Duration {
        /// Name of the stepper.
        stepper: &'static str,
        /// Time that it advanced, s.
        advanced: f64,
        /// `Settings::dt`.
        dt: f64,
    },
    /// The forces of joints turn a part too far even in the shortest sub-steps.
    #[error(
        "'{object}' at t = {time} s: the forces of its joints turn part {part} by {turn} rad in a sub-step, though it is divided as far as admissible; at most {most} is: shorten dt, give its lightest parts more inertia, or raise max_turn"
    )]
    Turn {
        /// Object.
        object: String,
        /// Part of the object: a link of an articulated body, 0 of a rigid body.
        part: usize,
        /// Turn, rad.
        turn: f64,
        /// `Settings::max_turn`.
        most: f64,
        /// Simulated time, s.
        time: f64,
    },
    /// An action of a scripted event failed.
    #[error("event '{event}': {why}")]
    Event {
        /// Name of the event.
        event: String,
        /// The fault.
        why: super::WorldError,
    },
    /// A callback of a scripted event returned an error.
    #[error("the callback of event '{event}': {why}")]
    Callback {
        /// Name of the event.
        event: String,
        /// Its text.
        why: String,
    },
    /// A constraint made an invalid row.
    #[error("constraint '{object}': {why}")]
    Row {
        /// Object.
        object: String,
        /// The fault of the row.
        why: String,
    },
}

/// One contact after a step, in world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// The object that the normal points to.
    pub a: ObjectId,
    /// Part of `a`.
    pub part_a: usize,
    /// Shape of that part that touches: the index of a compound's part; 0 for all other shapes.
    pub shape_a: usize,
    /// The object that the normal points from.
    pub b: ObjectId,
    /// Part of `b`.
    pub part_b: usize,
    /// Shape of that part that touches.
    pub shape_b: usize,
    /// Contact point, meters.
    pub point: Vec3,
    /// Unit normal from `b` to `a`.
    pub normal: Vec3,
    /// Depth of the overlap when it was detected, meters; negative while apart.
    pub depth: f64,
    /// Relative velocity of `a` against `b` when it was detected, m/s.
    pub velocity: Vec3,
    /// Impulse on `a` over the last sub-step, N·s.
    pub impulse: Vec3,
    /// Force on `a` over the last sub-step, N, without impacts.
    pub force: Vec3,
}

/// A world without its stepper: the model, its state, the values derived from it, and the working
/// memory of a step.
pub struct Core {
    pub(crate) table: Table,
    pub(crate) settings: Settings,
    pub(crate) pair_materials: PairMaterials,
    pub(crate) solver: Box<dyn RowSolver>,
    pub(crate) state: WorldState,
    pub(crate) dof: usize,
    pub(crate) derived: Derived,
    /// Whether the caches of `derived` are absent, or those of another state.
    pub(super) stale: bool,
    pub(crate) owners: Vec<Owner>,
    /// See [`WorldView::implicit`](crate::WorldView::implicit).
    pub(crate) implicit: bool,
    /// Whether the rows of the sub-step are at the velocity level.
    pub(crate) by_impulses: bool,
    pub(crate) held: Vec<f64>,
    /// Contact forces that are constant over the sub-step, per part, of objects whose state
    /// contains velocities; empty for none.
    pub(crate) held_wrenches: Vec<Wrench>,
    /// Unused moments, kept for their memory.
    pub(crate) moments: Vec<Moment>,
    /// In a frame: generalized forces that users apply to the walked objects, as these are numbered in it.
    pub(crate) applied_now: Vec<f64>,
    /// Counts the changes of the sleeping groups.
    pub(super) group_changes: u64,
    /// Groups with a member or support that is not settled, or without a load; and the changes of groups and of
    /// walked objects that they are of.
    pub(super) open_groups: Vec<u32>,
    pub(super) open_groups_of: Option<[u64; 2]>,
    /// Pairs of `touching` that a frame may change: all but those of settled bodies; and the changes of walked
    /// objects that they are of.
    pub(super) open_touching: Vec<Touching>,
    pub(super) open_touching_of: Option<u64>,
    pub(crate) forces: Forces,
    pub(crate) threads: Threads,
    pub(crate) broad: Box<dyn BroadPhase>,
    pub(crate) detect_scratch: DetectorBuffers,
    pub(crate) contacts: Vec<ContactPoint>,
    /// Touches of the present frame.
    pub(crate) touches: Touches,
    /// Impulses of the present frame, for sensors.
    pub(crate) loads: FrameLoads,
    /// Serials of the loop joints that break in the present frame.
    pub(crate) broken: Vec<u32>,
    /// Events of the last frame.
    pub(crate) events: Vec<Event>,
    /// Whether the pairs that touch are known: in a replica those that were sent.
    pub(crate) knows_touching: bool,
    /// Cameras whose images of the frame are in the state, or whose bias walks.
    pub(crate) cameras: Vec<ObjectId>,
    pub(crate) report: StepReport,
    /// Work of the frame, and its budget.
    pub(crate) meter: WorkMeter,
    /// Serial numbers of sleeping objects that the frame disturbs.
    pub(crate) needs_wake: Vec<u32>,
    /// Number of parts that each sub-step of the settings is divided into in this frame.
    pub(crate) division: u32,
    pub(crate) attempt: Attempt,
    /// Largest turn of the frame.
    pub(crate) largest_turn: LargestTurn,
    /// Bodies that resist turning.
    pub(crate) resisting: ResistingBodies,
    /// Working memory of frame states.
    pub(super) frame_numbers: Vec<f64>,
    /// Branches of the step that [`linearize`](crate::linearize) holds.
    pub(crate) branches: Branches,
}

/// The state of the objects, and the caches for the maps that change it.
pub(crate) struct Coordinates<'a> {
    pub objects: Objects<'a>,
    pub x: &'a mut [f64],
    pub caches: &'a mut [Cache],
    pub threads: &'a Threads,
}

impl Core {
    /// Returns a core without contacts, whose part states are not computed yet.
    pub(super) fn new(table: Table, settings: Settings, solver: Box<dyn RowSolver>, state: WorldState) -> Core {
        let (dof, parts) = (state.applied_generalized.len(), state.applied.len());
        let mut table = table;
        table.walk.unsettle_all(); // their numbers are not in the buffers of this core
        let caches = table.new_caches();
        let mut owners = Vec::with_capacity(parts);
        for (place, (placed, &id)) in (0..).zip(table.placed.iter().zip(&table.order)) {
            owners.extend((0..).zip(placed.state_range.parts.clone()).map(|(part, _)| Owner { id, place, part }));
        }
        Core {
            table,
            settings,
            pair_materials: PairMaterials::default(),
            solver,
            state,
            dof,
            derived: Derived { part_states: vec![PartState::default(); parts], caches },
            stale: false,
            owners,
            implicit: false,
            by_impulses: false,
            held: vec![0.0; dof],
            held_wrenches: Vec::new(),
            moments: Vec::new(),
            applied_now: Vec::new(),
            group_changes: 0,
            open_groups: Vec::new(),
            open_groups_of: None,
            open_touching: Vec::new(),
            open_touching_of: None,
            forces: Forces::default(),
            threads: Threads::NONE,
            broad: Box::<SweepAndPrune>::default(),
            detect_scratch: DetectorBuffers::default(),
            contacts: Vec::new(),
            touches: Touches::default(),
            loads: FrameLoads::default(),
            broken: Vec::new(),
            events: Vec::new(),
            knows_touching: true,
            cameras: Vec::new(),
            report: StepReport::default(),
            meter: WorkMeter::default(),
            needs_wake: Vec::new(),
            division: 1,
            attempt: Attempt::First,
            largest_turn: LargestTurn::default(),
            resisting: ResistingBodies::default(),
            frame_numbers: Vec::new(),
            branches: Branches::default(),
        }
    }

    /// Returns a copy with its own working memory.
    pub(super) fn fork(&self) -> Core {
        let mut fork = Core {
            pair_materials: self.pair_materials.clone(),
            contacts: self.contacts.clone(),
            events: self.events.clone(),
            knows_touching: self.knows_touching,
            cameras: Vec::new(),
            report: self.report,
            ..Core::new(self.table.clone(), self.settings, self.solver.fork(), self.state.clone())
        };
        fork.integration().refresh();
        fork.derived.part_states.clone_from(&self.derived.part_states); // accelerations, and poses that are shown
        fork
    }

    /// Returns the objects with their switches.
    pub(crate) fn objects(&self) -> Objects<'_> {
        self.table.with(&self.state.objects)
    }

    /// Returns the part table of the present.
    pub(crate) fn part_table(&self) -> PartTable<'_> {
        PartTable {
            objects: self.objects(),
            owners: &self.owners,
            part_states: &self.derived.part_states,
            pair_materials: &self.pair_materials,
        }
    }

    /// Returns the present state, and the caches of `acting`, or else of the present.
    pub(crate) fn coordinates<'a>(&'a mut self, acting: Option<&'a mut Moment>) -> Coordinates<'a> {
        if acting.is_none() {
            self.own_caches();
        }
        let objects = self.table.with(&self.state.objects);
        let derived = acting.map_or(&mut self.derived, |moment| &mut moment.derived);
        Coordinates { objects, x: &mut self.state.x, caches: &mut derived.caches, threads: &self.threads }
    }

    /// Returns a moment with the present state and accelerations, to be refreshed. Push it to
    /// `moments` after use.
    pub(crate) fn moment(&mut self) -> Moment {
        let mut moment = self.moments.pop().unwrap_or_else(|| Moment::new(&self.table));
        self.table.gather();
        let walk = &self.table.walk;
        if moment.settlings != Some(walk.settlings) {
            moment.x.clear();
            moment.derived.part_states.clear();
            moment.settlings = Some(walk.settlings);
        }
        walk.x.copy(&self.state.x, &mut moment.x);
        walk.parts.copy(&self.derived.part_states, &mut moment.derived.part_states);
        moment
    }

    /// Returns the present state at a time, s, as objects see it.
    pub(crate) fn view(&self, time: f64) -> WorldView<'_> {
        WorldView {
            time,
            gravity: self.settings.gravity,
            implicit: self.implicit,
            x: &self.state.x,
            part_states: &self.derived.part_states,
            objects: self.objects(),
            threads: &self.threads,
        }
    }

    /// Copies a state of these objects over the present one, and derives part states and caches.
    pub(crate) fn set_state(&mut self, state: &WorldState) {
        self.table.walk.unsettle_all();
        self.group_changes += 1;
        self.state.clone_from(state);
        self.clear_contact_forces();
        self.state.write_accelerations(0..state.accelerations.len(), &mut self.derived.part_states);
        self.refresh();
    }

    /// Clears all contact and joint forces.
    pub(crate) fn clear_contact_forces(&mut self) {
        self.held.clear();
        self.held.resize(self.dof, 0.0);
        self.held_wrenches.clear();
    }

    /// Before a frame: computes part states and caches of all objects that are not settled.
    pub(super) fn refresh_walked(&mut self) {
        if self.stale {
            return self.refresh();
        }
        self.wake_for_forces();
        self.table.gather();
        self.integration().refresh();
    }

    /// Forces may act on sleeping objects, which must then be walked.
    fn wake_for_forces(&mut self) {
        if self.table.walk.asleep > 0 && self.has_forces() {
            self.table.walk.unsettle_all();
        }
    }

    /// Returns whether any object acts on others by forces.
    pub(super) fn has_forces(&self) -> bool {
        self.objects().iter().any(|e| e.status.enabled && e.object.force().is_some())
    }

    /// Starts a frame, or starts it again: numbers the degrees of freedom of what it walks.
    pub(super) fn enter_frame(&mut self) {
        self.dof = self.table.number_walked();
        let applied = &self.state.applied_generalized;
        self.applied_now.clear();
        match self.table.walk.kept() {
            None => self.applied_now.extend_from_slice(applied),
            Some(starts) => {
                for (place, start) in self.table.walk.places.iter().zip(starts) {
                    let count = self.table.placed[*place as usize].state_range.v.len();
                    self.applied_now.extend_from_slice(&applied[*start..*start + count]);
                }
            }
        }
    }

    /// Ends a frame.
    pub(super) fn leave_frame(&mut self) {
        self.dof = self.table.number_all();
        self.applied_now.clear();
    }

    /// Returns the generalized forces that users apply, as the degrees of freedom are numbered now.
    pub(crate) fn applied_generalized(&self) -> &[f64] {
        if self.table.walk.dof.is_some() { &self.applied_now } else { &self.state.applied_generalized }
    }

    /// Goes back to the state at the start of the frame. What the frame did not walk is as it was.
    pub(super) fn restart_frame(&mut self, before: &WorldState) {
        self.table.gather();
        self.state.copy_walked(before, &self.table);
        self.state.groups.clone_from(&before.groups);
        self.group_changes += 1;
        self.clear_contact_forces();
        for range in self.table.walk.parts.iter() {
            self.state.write_accelerations(range, &mut self.derived.part_states);
        }
        self.integration().refresh();
    }

    /// Ends a frame: objects that rest need not be walked in the next ones.
    pub(super) fn settle(&mut self) {
        if self.branches.are_recorded() {
            return;
        }
        let forces = !self.state.groups.is_empty() && self.has_forces();
        let Core { table, state, .. } = self;
        let (placed, objects) = (&table.placed, &state.objects);
        table.walk.settle(|place| {
            let object = &objects[place];
            let rests = object.status.mode == Mode::Static || !object.status.enabled || (object.asleep && !forces);
            (rests && may_settle(placed[place].object.as_ref())).then_some(object.asleep)
        });
    }

    /// Computes part states and caches from the state.
    pub(crate) fn refresh(&mut self) {
        self.table.walk.unsettle_all();
        self.table.gather();
        if self.derived.caches.len() != self.table.placed.len() {
            self.derived.caches = self.table.new_caches();
        }
        self.stale = false;
        self.integration().refresh();
    }

    /// Makes the caches those of the present state. Part states stay as they are.
    pub(super) fn own_caches(&mut self) {
        if self.stale {
            let shown = self.derived.part_states.clone();
            self.refresh();
            self.derived.part_states = shown;
        }
    }

    /// Lends the present state to the integrators.
    pub(crate) fn integration(&mut self) -> IntegrationContext<'_> {
        self.integration_of(None)
    }

    /// Lends the state of `moment`, or else the present one, to the integrators.
    pub(crate) fn integration_of<'a>(&'a mut self, moment: Option<&'a mut Moment>) -> IntegrationContext<'a> {
        if moment.is_none() {
            self.own_caches();
        }
        self.held.resize(self.dof, 0.0);
        let (x, derived) = match moment {
            Some(moment) => (&mut moment.x[..], &mut moment.derived),
            None => (&mut self.state.x[..], &mut self.derived),
        };
        IntegrationContext {
            table: &self.table,
            states: &self.state.objects,
            threads: &self.threads,
            x,
            derived,
            forces: &mut self.forces,
            gravity: self.settings.gravity,
            implicit: self.implicit,
            applied: &self.state.applied,
            applied_generalized: if self.table.walk.dof.is_some() {
                &self.applied_now
            } else {
                &self.state.applied_generalized
            },
            held: &self.held,
            held_wrenches: &self.held_wrenches,
        }
    }

    /// Publishes the contacts of the sub-step and stores their forces as warm starts.
    pub(crate) fn publish(
        &mut self,
        contact_constraints: &[ContactConstraint],
        impulses: impl Iterator<Item = Vec3>,
        forces: impl Iterator<Item = Vec3>,
        rows: Vec<RowStart>,
    ) {
        self.contacts.clear();
        for ((constraint, impulse), force) in contact_constraints.iter().zip(impulses).zip(forces) {
            let (a, b) = (self.owners[constraint.a as usize], self.owners[constraint.b as usize]);
            let velocity = constraint.velocity(
                &self.derived.part_states[constraint.a as usize],
                &self.derived.part_states[constraint.b as usize],
            );
            self.contacts.push(ContactPoint {
                a: a.id,
                part_a: a.part as usize,
                shape_a: constraint.contact.shapes[0] as usize,
                b: b.id,
                part_b: b.part as usize,
                shape_b: constraint.contact.shapes[1] as usize,
                velocity,
                impulse,
                force,
                point: constraint.contact.point,
                normal: constraint.contact.normal,
                depth: -constraint.contact.gap,
            });
        }
        self.touch_contacts(contact_constraints);
        self.state.warm.replace_rows(rows.into_iter());
        let (contacts, part_states) = (&self.contacts, &self.derived.part_states);
        let carrying = contact_constraints.iter().zip(contacts).filter(|(_, c)| c.force != Vec3::zeros());
        self.state.warm.replace(carrying.map(|(t, c)| WarmStart {
            key: t.key,
            force: c.force.into(),
            point: part_states[t.a as usize].pose.inverse_transform_point(&c.point.into()).into(),
        }));
    }

    /// Advances time, refreshes the part states and checks the state.
    pub(crate) fn finish_substep(&mut self, h: f64) -> Result<(), StepError> {
        self.state.time += h;
        self.report.substeps += 1;
        self.keep_touches(h);
        self.integration().refresh();
        self.keep_loads(h);
        let moves = |s: &PartState| s.velocity.iter().chain(s.angular_velocity.iter()).all(|x| x.is_finite());
        let fine = |e: &Entry| {
            self.state.x[e.state_range.x.clone()].iter().all(|x| x.is_finite())
                && self.derived.part_states[e.state_range.parts.clone()].iter().all(moves)
        };
        if let Some(bad) = first_object(&self.threads, self.objects(), |e| !fine(e)) {
            return Err(self.not_finite(bad.name, "its state"));
        }
        self.measure_turns(h, false);
        Ok(())
    }

    /// Checks that all forces and accelerations are finite, and that no mass matrix is singular, at
    /// the moment `acting`, or else at the present.
    pub(crate) fn check_finite(&mut self, dp: &[f64], acting: Option<&mut Moment>) -> Result<(), StepError> {
        let time = self.state.time;
        let objects = self.table.with(&self.state.objects);
        let Derived { part_states, caches } = acting.map_or(&mut self.derived, |moment| &mut moment.derived);
        for e in objects.iter().filter(|e| e.moves()) {
            if let Some(why) = e.object.integratable().and_then(|body| body.singularity(&mut caches[e.place])) {
                return Err(StepError::Singular { object: e.name.to_string(), why, time });
            }
        }
        let accelerates =
            |s: &PartState| s.acceleration.iter().chain(s.angular_acceleration.iter()).all(|x| x.is_finite());
        let fine = |e: &Entry| {
            dp[e.state_range.v.clone()].iter().all(|x| x.is_finite())
                && part_states[e.state_range.parts.clone()].iter().all(accelerates)
        };
        let bad = first_object(&self.threads, objects, |e| !fine(e));
        bad.map_or(Ok(()), |e| Err(self.not_finite(e.name, "the force on it")))
    }

    fn not_finite(&self, object: &str, what: &'static str) -> StepError {
        StepError::NotFinite { object: object.to_string(), what, time: self.state.time }
    }
}

/// Returns whether a step may leave the object out while it rests: a rigid body that is no sensor and acts on
/// nothing.
fn may_settle(object: &dyn Object) -> bool {
    let any: &dyn std::any::Any = object;
    let sensor = || object.collidable().is_some_and(has_sensor);
    any.is::<RigidBody>()
        && object.constraint().is_none()
        && object.force().is_none()
        && object.frame_state().is_none()
        && !sensor()
}

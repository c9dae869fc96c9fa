//! The core of a world, on which the steppers work.

use super::events::{Event, Touches, Touching};
use super::state::WorldState;
use super::step_error::StepError;
use crate::contact::detect::{ContactConstraint, DetectorBuffers, Owner, PartTable};
use crate::contact::pair_material::PairMaterials;
use crate::contact::warm_starts::{RowStart, WarmStart};
use crate::derived::{Cache, Derived};
use crate::each_object::first_object;
use crate::integrators::context::IntegrationContext;
use crate::linearize::Branches;
use crate::object::part_state::{Forces, PartState, Wrench};
use crate::report::StepReport;
use crate::sensor::loads::FrameLoads;
use crate::settings::Settings;
use crate::solver::RowSolver;
use crate::step::{Attempt, LargestTurn, Moment, ResistingBodies, WorkMeter};
use crate::threads::Threads;
use crate::world::view::{Entry, ObjectId, Objects, Table, WorldView};
use tumble_collide::{BroadPhase, SweepAndPrune, Vec3};

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
        self.find_joined();
        self.refresh();
    }

    /// Clears all contact and joint forces.
    pub(crate) fn clear_contact_forces(&mut self) {
        self.held.clear();
        self.held.resize(self.dof, 0.0);
        self.held_wrenches.clear();
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

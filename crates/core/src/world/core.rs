//! The inside of a world: what the steppers work on.

use super::state::WorldState;
use crate::contact::detect::{ContactConstraint, DetectorBuffers, Owner};
use crate::contact::pair_material::PairMaterials;
use crate::integrators::context::IntegrationContext;
use crate::object::part_state::{Forces, PartState, Wrench};
use crate::report::StepReport;
use crate::settings::Settings;
use crate::solver::RowSolver;
use crate::world::view::{Entry, ObjectId, Objects, Table};
use tumble_collide::{BroadPhase, SweepAndPrune, Vec3};

/// Why a step stopped. [`World::step`](crate::World::step) puts state and time back to where they were before the frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// A force, a momentum or a position is no longer a number.
    #[error("'{object}' at t = {time} s: {what} is not finite; look at the forces and impulses given to it")]
    NotFinite {
        /// Object.
        object: String,
        /// Force or state.
        what: &'static str,
        /// Simulated time, s.
        time: f64,
    },
    /// An object's mass matrix has no inverse where it is.
    #[error("'{object}' at t = {time} s: {why}")]
    Singular {
        /// Object.
        object: String,
        /// What is singular, and what helps.
        why: String,
        /// Simulated time, s.
        time: f64,
    },
    /// The adaptive integrator cannot hold its tolerance.
    #[error(
        "'{object}' at t = {time} s: its motion needs more than the {steps} inner steps of this frame (the last of {step} s) at the integrator's tolerance {tolerance}; soften what acts on it, or loosen the tolerance"
    )]
    Tolerance {
        /// The object whose error is greatest.
        object: String,
        /// Simulated time, s.
        time: f64,
        /// Length of the last inner step tried, s.
        step: f64,
        /// Inner steps of this frame, refused ones included.
        steps: u32,
        /// `Settings::integrator_tolerance`.
        tolerance: f64,
    },
    /// A constraint made a row that cannot be.
    #[error("constraint '{object}': {why}")]
    Row {
        /// Object.
        object: String,
        /// What is wrong with the row.
        why: String,
    },
}

/// One contact as the world shows it after a step. World axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// The object that the normal points to.
    pub a: ObjectId,
    /// Part of `a`.
    pub part_a: usize,
    /// The object that the normal points from.
    pub b: ObjectId,
    /// Part of `b`.
    pub part_b: usize,
    /// Contact point, metres.
    pub point: Vec3,
    /// Unit normal from `b` to `a`.
    pub normal: Vec3,
    /// Depth of the overlap when it was detected, metres; negative while apart.
    pub depth: f64,
    /// Relative velocity of `a` against `b` when it was detected, m/s.
    pub velocity: Vec3,
    /// Impulse on `a` over the last sub-step, N·s.
    pub impulse: Vec3,
    /// Force on `a` that it stands for, N; impacts left out.
    pub force: Vec3,
}

/// A world without its stepper: the model, its state, what follows from the state, and the working memory of a step.
pub struct Core {
    pub(crate) table: Table,
    pub(crate) settings: Settings,
    pub(crate) pair_materials: PairMaterials,
    pub(crate) solver: Box<dyn RowSolver>,
    pub(crate) state: WorldState,
    pub(crate) dof: usize,
    pub(crate) part_states: Vec<PartState>,
    pub(crate) owners: Vec<Owner>,
    /// See [`WorldView::implicit`](crate::WorldView::implicit).
    pub(crate) implicit: bool,
    pub(crate) held: Vec<f64>,
    /// Contact forces that hold over the sub-step, per site, of objects whose state holds velocities; empty for none.
    pub(crate) held_wrenches: Vec<Wrench>,
    /// Where the caches of what moves are kept, whatever state is refreshed; empty for none. And the sites there.
    pub(crate) pinned: (Vec<f64>, Vec<PartState>),
    /// Memory of what was pinned last, for the next.
    pub(crate) unpinned: (Vec<f64>, Vec<PartState>),
    pub(crate) forces: Forces,
    pub(crate) broad: Box<dyn BroadPhase>,
    pub(crate) detect_scratch: DetectorBuffers,
    pub(crate) contacts: Vec<ContactPoint>,
    pub(crate) report: StepReport,
    /// Serials of sleepers that the frame disturbs.
    pub(crate) needs_wake: Vec<u32>,
}

impl Core {
    /// Returns a core without contacts, whose part table is yet to be written.
    pub(super) fn new(table: Table, settings: Settings, solver: Box<dyn RowSolver>, state: WorldState) -> Core {
        let (dof, parts) = (state.applied_generalized.len(), state.applied.len());
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
            part_states: vec![PartState::default(); parts],
            owners,
            implicit: false,
            held: vec![0.0; dof],
            held_wrenches: Vec::new(),
            pinned: Default::default(),
            unpinned: Default::default(),
            forces: Forces::default(),
            broad: Box::<SweepAndPrune>::default(),
            detect_scratch: DetectorBuffers::default(),
            contacts: Vec::new(),
            report: StepReport::default(),
            needs_wake: Vec::new(),
        }
    }

    /// Returns a copy with working memory of its own.
    pub(super) fn fork(&self) -> Core {
        Core {
            pair_materials: self.pair_materials.clone(),
            part_states: self.part_states.clone(),
            contacts: self.contacts.clone(),
            report: self.report,
            ..Core::new(self.table.clone(), self.settings, self.solver.fork(), self.state.clone())
        }
    }

    /// Returns the objects with their switches.
    pub(crate) fn objects(&self) -> Objects<'_> {
        self.table.with(&self.state.objects)
    }

    /// Returns the objects with their switches, beside their numbers in `X` to be changed.
    pub(crate) fn objects_and_x(&mut self) -> (Objects<'_>, &mut [f64]) {
        (self.table.with(&self.state.objects), &mut self.state.x)
    }

    /// Writes a state of these objects over the present one, and everything that follows from it.
    pub(crate) fn set_state(&mut self, state: &WorldState) {
        self.state.clone_from(state);
        self.unpin();
        self.clear_contact_forces();
        self.state.write_accelerations(&mut self.part_states);
        self.integration().refresh();
    }

    /// No contact or joint forces hold any more.
    pub(crate) fn clear_contact_forces(&mut self) {
        self.held.fill(0.0);
        self.held_wrenches.clear();
    }

    /// Keeps the caches of what moves at the present state until [`unpin`](Self::unpin): where in a step impulses act. From the next refresh on; sites still
    /// follow the state.
    pub(crate) fn pin(&mut self) {
        self.pinned = std::mem::take(&mut self.unpinned);
        self.state.x[..].clone_into(&mut self.pinned.0);
        self.pinned.1.clone_from(&self.part_states);
    }

    /// Lets the caches follow again from the next refresh on.
    pub(crate) fn unpin(&mut self) {
        self.unpinned = std::mem::take(&mut self.pinned);
    }

    /// The same for a while; what was pinned, to be put back.
    pub(crate) fn lift_pin(&mut self) -> (Vec<f64>, Vec<PartState>) {
        std::mem::take(&mut self.pinned)
    }

    pub(crate) fn pin_again(&mut self, pinned: (Vec<f64>, Vec<PartState>)) {
        self.pinned = pinned;
    }

    /// The state of the pinned caches.
    pub(crate) fn pinned(&self) -> Option<&[f64]> {
        Some(&self.pinned.0[..]).filter(|x| !x.is_empty())
    }

    /// The sites of the pinned caches; only those of what moves are there.
    pub(crate) fn pinned_part_states(&self) -> Option<&Vec<PartState>> {
        Some(&self.pinned.1).filter(|x| !x.is_empty())
    }

    pub(crate) fn integration(&mut self) -> IntegrationContext<'_> {
        IntegrationContext {
            table: &mut self.table,
            states: &self.state.objects,
            x: &mut self.state.x,
            part_states: &mut self.part_states,
            forces: &mut self.forces,
            gravity: self.settings.gravity,
            implicit: self.implicit,
            applied: &self.state.applied,
            applied_generalized: &self.state.applied_generalized,
            held: &self.held,
            held_wrenches: &self.held_wrenches,
            pinned: &self.pinned.0,
            pinned_part_states: &mut self.pinned.1,
        }
    }

    /// Shows the contacts of the sub-step and files their forces as warm starts.
    pub(crate) fn publish(
        &mut self,
        contact_constraints: &[ContactConstraint],
        impulses: impl Iterator<Item = Vec3>,
        forces: impl Iterator<Item = Vec3>,
    ) {
        self.contacts.clear();
        for ((constraint, impulse), force) in contact_constraints.iter().zip(impulses).zip(forces) {
            let (a, b) = (self.owners[constraint.a as usize], self.owners[constraint.b as usize]);
            let velocity =
                constraint.velocity(&self.part_states[constraint.a as usize], &self.part_states[constraint.b as usize]);
            self.contacts.push(ContactPoint {
                a: a.id,
                part_a: a.part as usize,
                b: b.id,
                part_b: b.part as usize,
                velocity,
                impulse,
                force,
                point: constraint.contact.point,
                normal: constraint.contact.normal,
                depth: -constraint.contact.gap,
            });
        }
        let contacts = &self.contacts;
        self.state.warm.replace(
            contact_constraints
                .iter()
                .zip(contacts)
                .filter(|(_, c)| c.force != Vec3::zeros())
                .map(|(t, c)| (t.key, c.force)),
        );
    }

    /// Counts time, lets objects put right what they must, writes the sites anew and checks the state.
    pub(crate) fn finish_substep(&mut self, h: f64) -> Result<(), StepError> {
        self.state.time += h;
        self.report.substeps += 1;
        let (objects, x) = self.objects_and_x();
        for entry in objects.iter().filter(|e| e.moves()) {
            if let Some(body) = entry.object.integratable() {
                body.stabilize(&mut x[entry.state_range.x.clone()], h);
            }
        }
        self.integration().refresh();
        let moves = |s: &PartState| s.velocity.iter().chain(s.angular_velocity.iter()).all(|x| x.is_finite());
        let fine = |e: &Entry| {
            self.state.x[e.state_range.x.clone()].iter().all(|x| x.is_finite())
                && self.part_states[e.state_range.parts.clone()].iter().all(moves)
        };
        let bad = self.objects().iter().find(|e| !fine(e));
        bad.map_or(Ok(()), |e| Err(self.not_finite(e.object.name(), "its state")))
    }

    /// Stops forces and impulses that are not numbers, and objects that cannot move.
    pub(crate) fn check_finite(&self, dp: &[f64]) -> Result<(), StepError> {
        let singularity = |e: Entry| {
            Some(StepError::Singular {
                why: e.object.integratable()?.singularity()?,
                object: e.object.name().to_string(),
                time: self.state.time,
            })
        };
        if let Some(error) = self.objects().iter().filter(|e| e.moves()).find_map(singularity) {
            return Err(error);
        }
        let accelerates =
            |s: &PartState| s.acceleration.iter().chain(s.angular_acceleration.iter()).all(|x| x.is_finite());
        let fine = |e: &Entry| {
            dp[e.state_range.v.clone()].iter().all(|x| x.is_finite())
                && self.part_states[e.state_range.parts.clone()].iter().all(accelerates)
        };
        let bad = self.objects().iter().find(|e| !fine(e));
        bad.map_or(Ok(()), |e| Err(self.not_finite(e.object.name(), "the force on it")))
    }

    fn not_finite(&self, object: &str, what: &'static str) -> StepError {
        StepError::NotFinite { object: object.to_string(), what, time: self.state.time }
    }
}

//! The working memory of a step, which many worlds may use in turn.
//!
//! A world keeps its buffers from step to step, and what its objects derive from the state. Both have
//! several times the size of the rest, so of many worlds only those that are stepped at the moment
//! should have them.

use super::World;
use crate::contact::detect::DetectorBuffers;
use crate::derived::Cache;
use crate::object::part_state::Forces;
use crate::solver::RowSolver;
use crate::step::Moment;
use crate::step::Stepper;
use crate::world::core::ContactPoint;
use crate::world::state::WorldState;
use std::mem::swap;
use tumble_collide::{BroadPhase, SweepAndPrune};

/// Buffers of steps, to be lent to one world after another. They hold nothing that a step reads, so
/// they change no bit.
#[derive(Default)]
pub struct WorkingMemory(Option<Buffers>);

struct Buffers {
    stepper: Box<dyn Stepper>,
    solver: Box<dyn RowSolver>,
    before: WorldState,
    contacts_before: Vec<ContactPoint>,
    moments: Vec<Moment>,
    forces: Forces,
    broad: Box<dyn BroadPhase>,
    detect_scratch: DetectorBuffers,
    caches: Vec<Cache>,
}

impl World {
    /// Gives the world working memory for its next steps, until
    /// [`return_working_memory`](Self::return_working_memory).
    ///
    /// The worlds that use one memory must be forks of one world, with the same stepper and solver,
    /// whose objects differ at most in constants that may change between steps. Memory that was
    /// used last with other objects than those of this world is not taken.
    pub fn lend_working_memory(&mut self, memory: &mut WorkingMemory) {
        let fits = |known: &Buffers| known.before.objects.is_empty() || known.before.fits(&self.core.state);
        let mut lent = memory.0.take().filter(fits).unwrap_or_else(|| self.buffers());
        self.swap(&mut lent);
        self.core.stale = true;
        memory.0 = Some(lent);
    }

    /// Takes the working memory back. The world keeps none: calls that need some make it again, at
    /// the price of time.
    pub fn return_working_memory(&mut self, memory: &mut WorkingMemory) {
        let Some(lent) = &mut memory.0 else { return };
        self.swap(lent);
        self.core.derived.caches = Vec::new();
        self.core.moments = Vec::new();
        self.core.stale = true;
    }

    /// Returns new buffers for this world.
    fn buffers(&self) -> Buffers {
        Buffers {
            stepper: self.stepper.fork(),
            solver: self.core.solver.fork(),
            before: WorldState::default(),
            contacts_before: Vec::new(),
            moments: Vec::new(),
            forces: Forces::default(),
            broad: Box::<SweepAndPrune>::default(),
            detect_scratch: DetectorBuffers::default(),
            caches: self.core.table.new_caches(),
        }
    }

    fn swap(&mut self, lent: &mut Buffers) {
        let World { core, stepper, before, contacts_before, .. } = self;
        swap(stepper, &mut lent.stepper);
        swap(&mut core.solver, &mut lent.solver);
        swap(before, &mut lent.before);
        swap(contacts_before, &mut lent.contacts_before);
        swap(&mut core.moments, &mut lent.moments);
        swap(&mut core.forces, &mut lent.forces);
        swap(&mut core.broad, &mut lent.broad);
        swap(&mut core.detect_scratch, &mut lent.detect_scratch);
        swap(&mut core.derived.caches, &mut lent.caches);
        core.table.walk.unsettle_all(); // their numbers are not in these buffers
        core.table.walk.gather();
        core.moments.iter_mut().for_each(|moment| moment.settlings = None);
        core.detect_scratch.forget_parts();
        core.forces.wrenches.clear();
        self.before_of = None;
    }
}

//! The working memory of a step, which many worlds may use in turn.
//!
//! A world keeps its buffers from step to step. They have several times the size of its state and
//! its objects, so of many worlds only those that are stepped at the moment should have any.

use super::World;
use crate::contact::detect::DetectorBuffers;
use crate::object::part_state::Forces;
use crate::solver::RowSolver;
use crate::step::Moment;
use crate::step::Stepper;
use crate::world::core::ContactPoint;
use crate::world::state::WorldState;
use std::mem::swap;
use tumble_collide::BroadPhase;

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
}

impl World {
    /// Gives the world other working memory, and returns its own by the same argument. Between two
    /// steps it needs none: `memory` is lent for some steps and taken back by the same call.
    ///
    /// The worlds that use one memory must be forks of one world, with the same stepper and solver. Memory
    /// that was used last with other objects than those of this world is not taken.
    pub fn swap_working_memory(&mut self, memory: &mut WorkingMemory) {
        let fresh = || Buffers {
            stepper: self.stepper.fork(),
            solver: self.core.solver.fork(),
            before: WorldState::default(),
            contacts_before: Vec::new(),
            moments: Vec::new(),
            forces: Forces::default(),
            broad: Box::<tumble_collide::SweepAndPrune>::default(),
            detect_scratch: DetectorBuffers::default(),
        };
        let fits = |known: &Buffers| known.before.objects.is_empty() || known.before.fits(&self.core.state);
        let mut lent = memory.0.take().filter(fits).unwrap_or_else(fresh);
        let World { core, stepper, before, contacts_before, .. } = self;
        swap(stepper, &mut lent.stepper);
        swap(&mut core.solver, &mut lent.solver);
        swap(before, &mut lent.before);
        swap(contacts_before, &mut lent.contacts_before);
        swap(&mut core.moments, &mut lent.moments);
        swap(&mut core.forces, &mut lent.forces);
        swap(&mut core.broad, &mut lent.broad);
        swap(&mut core.detect_scratch, &mut lent.detect_scratch);
        memory.0 = Some(lent);
    }
}

//! The work of a frame in block relaxations, and the budget that bounds it.
//!
//! [`SolverSettings::budget`] bounds the work of a frame. The bound is work and not time, so a frame
//! has the same bits on every machine and on any number of threads. A sub-step gets the share of the
//! rest that belongs to its length, and its stages get theirs one after the other:
//!
//! | stage | share of what is left | without the work for a sweep |
//! |---|---|---|
//! | impacts | [`IMPACTS`] | the solve stops the contacts |
//! | solve of all contacts | all but [`CORRECTION`], or [`CORRECTION_SWEEPS`] sweeps if that is less | one sweep |
//! | rebound of later contacts | [`REBOUND`] | they do not rebound |
//! | correction of positions | all | one sweep |
//!
//! In the solve of all contacts an island whose warm start satisfies the tolerance keeps it: an
//! island at rest costs one residual. A quarter of the work gives every other island the same number
//! of sweeps. The rest, and the work that converged islands leave, goes to the islands with the
//! largest residuals, the worst one first ([`Allotment`]): a few islands that converge come to rest
//! and cost nothing later, and many that do not converge never rest.
//!
//! Not counted: detection, rows, residuals, the ordering of a factorization, and equality rows of
//! joints that are factored by themselves. They are linear in the number of rows, as a rule.

use crate::solver::SolverSettings;
use std::sync::atomic::{AtomicU64, Ordering};

/// Share of the impacts in the work of a sub-step.
pub(super) const IMPACTS: f64 = 0.25;
/// Largest share that the solve of all contacts leaves to the correction, and the sweeps that it
/// leaves at most.
const CORRECTION: f64 = 0.3;
const CORRECTION_SWEEPS: usize = 20;
/// Share of the rebound in the work that the solve leaves.
pub(super) const REBOUND: f64 = 0.3;
/// Share of a frame that `backtracking` keeps for a last sub-step of `time_stepping`.
const LAST_SUBSTEP: f64 = 0.25;

/// The work of a frame.
#[derive(Debug, Default)]
pub(crate) struct WorkMeter {
    done: AtomicU64,
    /// Value of `done` at which the budget of the frame is spent; `None` without a budget.
    frame: Option<u64>,
    /// The same for the stages of the present sub-step.
    substep: Option<u64>,
    /// Time at the end of the frame, s.
    end: f64,
}

impl WorkMeter {
    /// Starts a frame that ends at a time, s, or starts it again.
    pub fn start_frame(&mut self, budget: Option<u32>, end: f64) {
        self.frame = budget.map(|budget| self.done() + u64::from(budget));
        (self.substep, self.end) = (self.frame, end);
    }

    /// Starts a sub-step of `h` seconds at a time, s.
    pub fn start_substep(&mut self, time: f64, h: f64) {
        let share = h / (self.end - time).max(h);
        self.substep = self.frame.map(|end| self.done() + part(end.saturating_sub(self.done()), share));
    }

    /// Starts a sub-step of `backtracking`, of unknown length. Returns false if the work for it is
    /// spent: the rest of the frame is one sub-step of `time_stepping`.
    pub fn start_try(&mut self, budget: Option<u32>) -> bool {
        let (Some(end), Some(budget)) = (self.frame, budget) else { return true };
        let left = end.saturating_sub(self.done());
        let kept = part(u64::from(budget), LAST_SUBSTEP);
        self.substep = Some(self.done() + left.saturating_sub(kept));
        left > 2 * kept
    }

    /// Returns the work so far.
    pub fn done(&self) -> u64 {
        self.done.load(Ordering::Relaxed)
    }

    /// Counts work. Sums do not depend on the order, so threads may count at once.
    pub fn count(&self, relaxations: u32) {
        self.done.fetch_add(u64::from(relaxations), Ordering::Relaxed);
    }

    /// Returns a share of the work that is left to the sub-step; `None` without a budget.
    pub fn left(&self, share: f64) -> Option<u32> {
        let left = self.substep?.saturating_sub(self.done());
        Some(part(left, share).min(u64::from(u32::MAX)) as u32)
    }

    /// Returns the work for the solve of all contacts, of `blocks` blocks.
    pub fn for_solve(&self, blocks: usize) -> Option<u32> {
        let (left, kept) = (self.left(1.0)?, self.left(CORRECTION)?);
        Some(left - kept.min((CORRECTION_SWEEPS * blocks).min(u32::MAX as usize) as u32))
    }

    /// Resets the count before a frame.
    pub fn reset(&mut self) {
        *self = WorkMeter::default();
    }
}

fn part(work: u64, share: f64) -> u64 {
    (work as f64 * share.clamp(0.0, 1.0)) as u64
}

/// Returns the settings of an island of `blocks` blocks that shares `budget` equally with others,
/// `all` blocks in total: at least one sweep.
pub(super) fn shared(settings: SolverSettings, budget: Option<u32>, blocks: usize, all: usize) -> SolverSettings {
    let sweeps = |budget: u32| (budget as usize / all.max(1)).max(1);
    SolverSettings { budget: budget.map(|budget| (sweeps(budget) * blocks).min(u32::MAX as usize) as u32), ..settings }
}

/// An island that a solve under a budget may go on with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Open {
    /// Its number.
    pub island: usize,
    /// Number of its blocks.
    pub blocks: usize,
    /// Its present residual.
    pub residual: f64,
}

/// A division of work among islands, in relaxations.
pub(super) struct Allotment {
    /// Number and work of each island that gets any, in the order of the islands.
    pub islands: Vec<(usize, u32)>,
}

impl Allotment {
    /// Divides `budget`. In the `first` round every island gets the same number of sweeps out of a
    /// quarter of it, at least one; the worst ones get the rest, as much as `most` sweeps each.
    pub fn new(mut open: Vec<Open>, budget: u32, first: bool, most: u32) -> Allotment {
        let all: usize = open.iter().map(|island| island.blocks).sum();
        let sweeps = if first { (budget as usize / 4 / all.max(1)).clamp(1, most as usize) } else { 0 };
        let mut rest = (budget as usize).saturating_sub(sweeps * all);
        open.sort_by(|a, b| b.residual.total_cmp(&a.residual).then(a.island.cmp(&b.island)));
        let mut islands = Vec::with_capacity(open.len());
        for Open { island, blocks, .. } in open {
            let more = (rest / blocks.max(1)).min(most as usize - sweeps);
            rest -= more * blocks;
            if sweeps + more > 0 {
                islands.push((island, ((sweeps + more) * blocks).min(u32::MAX as usize) as u32));
            }
        }
        islands.sort_unstable();
        Allotment { islands }
    }
}

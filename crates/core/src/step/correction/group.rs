//! Groups of a correction: objects that joints and active limits connect. Each group converges by
//! itself, so a group that cannot be corrected does not hinder another.
//!
//! A group has its own globalization of Newton's method. Its first rounds use the rows of the step
//! (a chord method, which costs no new rows), until one of them leaves more than a fifth of the
//! error; then it uses the rows at the corrected state. A round that increases the error is undone,
//! and the next round is damped (Levenberg and Marquardt):
//!
//! ```text
//! (K + R)·μ = −g,    R = d·min(10·|g|, 0.1)·k
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `g` | errors of the rows, m or rad |
//! | `k` | largest response among the rows of the same joint and unit |
//! | `d` | damping, 1 at first: times 10 after an increase of the error; at the end of a step divided by 3 after a decrease, 1 at least |
//!
//! `R` also handles redundant joints. Rows that agree only in a closed configuration have a
//! response of `|g|²` beside it, which is far below `R`, so they get no multiplier; `R` vanishes
//! with the error.

use super::super::{Workspace, unreachable_joints};
use super::errors::{Errors, position_tolerance};
use crate::constraint::rows::Side;
use crate::rigid::RigidBody;
use crate::solver::MAX_DIRECT_ROWS;
use crate::world::Core;
use crate::world::view::{Entry, Objects};
use smallvec::SmallVec;
use std::ops::Range;

/// Maximum number of rounds at the end of a step.
const MAX_ROUNDS: usize = 16;
/// Maximum number of rounds at its middle.
const MAX_ROUNDS_OF_MIDDLE: usize = 15;
/// Maximum number of rounds of a group that is too large for a direct solve: a long rope then costs
/// no more than its sweeps.
const MAX_ROUNDS_OF_LARGE: usize = 2;
/// A round of the chord method that leaves more than this fraction of the error is the last one.
const SLOW: f64 = 0.2;
/// Compliance of joint rows with an error of 1 m, and its maximum, as fractions of their response.
const COMPLIANCE: (f64, f64) = (10.0, 0.1);
/// Factor of the damping after a round that increased the error, divisor after one that decreased
/// it, and the damping at which the correction ends.
const DAMPING: (f64, f64, f64) = (10.0, 3.0, 1e6);

/// Connected objects with their joints and active limits.
pub(super) struct Group {
    /// Its joints and limits, as indices of targets, which are those of the blocks at the corrected
    /// state.
    pub rows: Vec<u32>,
    /// The same as indices of blocks of the step's rows.
    pub blocks: Vec<u32>,
    /// Its joints, as indices of targets.
    joints: Vec<u32>,
    /// Whether its joints can be closed whatever else holds: they are a tree of free rigid bodies, joined to the ground at one
    /// place at most.
    pub is_tree: bool,
    /// Ranges of the objects in the state, and in generalized velocities.
    pub ranges: Vec<(Range<usize>, Range<usize>)>,
    /// Largest error of position and of velocity, as multiples of the tolerance.
    pub left: (f64, f64),
    /// Whether its rounds use the rows of the step.
    pub chord: bool,
    /// Whether it takes one round, for errors of any size: limits that had a force, without joints.
    pub single_round: bool,
    /// Whether it is corrected, or cannot be corrected further.
    pub done: bool,
    rounds: usize,
    /// Whether velocities wait until positions are corrected.
    positions_first: bool,
    damping: f64,
    /// Whether the damping decreases again: at the end of a step.
    relaxes: bool,
}

/// The part of a group in a round.
pub(super) struct Round<'g> {
    /// Its blocks in the rows of the round.
    pub blocks: &'g [u32],
    /// Whether velocities stay.
    pub positions_only: bool,
    /// Whether errors within the tolerance are corrected too.
    pub always: bool,
}

/// Returns the dynamic objects in the order of their coordinates.
pub(super) fn by_start(objects: Objects<'_>) -> Vec<Entry<'_>> {
    objects.iter().filter(|e| e.moves()).collect()
}

/// Returns the object whose velocities start at `u`.
pub(super) fn entry_at<'e>(entries: &[Entry<'e>], u: u32) -> Option<Entry<'e>> {
    entries.binary_search_by_key(&(u as usize), |e| e.state_range.v.start).ok().map(|i| entries[i])
}

impl Group {
    /// Returns the groups of the rows that `errors` measures. At the end of a step they start with
    /// the rows of the step, unless they contain a limit.
    pub fn all(core: &Core, work: &mut Workspace, errors: &Errors, at_end: bool) -> Vec<Group> {
        let (contacts, Workspace { rows, islands, first, targets, .. }) = (work.contact_constraints.len(), work);
        islands.build(rows, |b| b >= contacts && errors.measures(b - contacts));
        let entries = by_start(core.objects());
        let group = |blocks: &[u32]| {
            let mut starts: Vec<u32> =
                blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides()).map(|s| s.u).collect();
            starts.sort_unstable();
            starts.dedup();
            let ranges = starts.iter().filter_map(|u| entry_at(&entries, *u));
            let free = ranges.clone().all(|entry| {
                let any: &dyn std::any::Any = entry.object;
                any.downcast_ref::<RigidBody>().is_some_and(RigidBody::is_free)
            });
            let is_tree = free && {
                let owner = |b: u32| first.partition_point(|&from| from + contacts <= b as usize);
                let joints = blocks.chunk_by(|&a, &b| owner(a) == owner(b));
                is_tree(&starts, joints.map(|joint| joint.iter().map(|&b| rows.blocks[b as usize].sides())))
            };
            let large = blocks.len() > MAX_DIRECT_ROWS;
            let rows: Vec<u32> = blocks.iter().map(|b| b - contacts as u32).collect();
            let (resisting, held): (Vec<u32>, Vec<u32>) = rows.iter().partition(|&&i| errors.resists(i as usize));
            let joints: Vec<u32> = held.iter().copied().filter(|&i| !errors.is_active(i as usize)).collect();
            Group {
                blocks: blocks.to_vec(),
                ranges: ranges.map(|e| (e.state_range.x.clone(), e.state_range.v.clone())).collect(),
                left: (f64::INFINITY, f64::INFINITY),
                chord: at_end && joints.len() + resisting.len() == rows.len(),
                single_round: joints.is_empty()
                    && errors.holds_limits()
                    && resisting.iter().all(|&i| targets[i as usize].spring.is_none()),
                done: false,
                rounds: match (large, at_end) {
                    (true, _) => MAX_ROUNDS_OF_LARGE,
                    (false, true) => MAX_ROUNDS,
                    (false, false) => MAX_ROUNDS_OF_MIDDLE,
                },
                positions_first: false,
                damping: 1.0,
                relaxes: at_end,
                is_tree,
                rows,
                joints,
            }
        };
        islands.iter().map(group).collect()
    }

    /// Ends the correction if the errors are within the tolerance, or after the last round.
    pub fn check_done(&mut self) {
        let corrected = self.left.0 <= 1.0 && self.left.1 <= 1.0 && !self.single_round;
        self.done |= corrected || self.rounds == 0;
    }

    /// Judges a round that changed the errors to `left`, and adapts the next one. Returns whether
    /// the round is to be undone.
    pub fn judge(&mut self, left: (f64, f64)) -> bool {
        let was = self.left;
        self.rounds -= 1;
        if was.0 > 1.0 && left.1 > was.1.max(1.0) && !self.positions_first {
            // rows, and velocities along them, change with positions
            self.positions_first = true;
            return true;
        }
        let share = if was.0 > 1.0 { left.0 / was.0 } else { left.1 / was.1 };
        let better = share < 1.0;
        if better {
            self.left = left;
            self.damping = if self.relaxes { (self.damping / DAMPING.1).max(1.0) } else { self.damping };
        } else if !self.chord {
            self.damping *= DAMPING.0;
            self.done |= self.damping > DAMPING.2;
        }
        self.chord &= share < SLOW;
        !better
    }

    /// Restores the states of its objects, and their displacements so far.
    pub fn restore(&self, (from, to): (&[f64], &mut [f64]), (moved_from, moved_to): (&[f64], &mut [f64])) {
        for (x, v) in &self.ranges {
            to[x.clone()].copy_from_slice(&from[x.clone()]);
            moved_to[v.clone()].copy_from_slice(&moved_from[v.clone()]);
        }
    }

    /// Returns whether the group is small enough for a direct solve. A larger one may be open
    /// because its rounds are few.
    pub fn direct(&self) -> bool {
        self.rows.len() <= MAX_DIRECT_ROWS
    }

    /// Returns whether its joints are open by more than the contact tolerance because they cannot
    /// be closed.
    pub fn is_open(&self, core: &Core) -> bool {
        let tolerance = core.settings.contact_tolerance;
        !self.joints.is_empty()
            && self.direct()
            && !self.is_tree
            && self.left.0 > tolerance / position_tolerance(tolerance)
    }

    /// Returns whether its joints are closed, in position and velocity.
    pub fn closed(&self) -> bool {
        self.left.0 <= 1.0 && self.left.1 <= 1.0
    }

    /// Gives its joint rows at the present state, in `probe`, the compliance `R` of a position
    /// error, m or rad.
    pub fn damp(&self, probe: &mut Workspace, error: f64) {
        unreachable_joints::soften(probe, &self.joints, (COMPLIANCE.0 * error).min(COMPLIANCE.1) * self.damping);
    }

    /// Returns the next round on some blocks, which are `rows` or `blocks`.
    pub fn round<'g>(&self, blocks: &'g [u32]) -> Round<'g> {
        let positions_only = self.positions_first && self.left.0 > 1.0;
        Round { blocks, positions_only, always: self.single_round }
    }

    /// Returns the largest magnitude among the numbers of its rows.
    pub fn largest(&self, of_rows: &[f64]) -> f64 {
        self.rows.iter().fold(0.0, |worst, &i| worst.max(of_rows[i as usize].abs()))
    }
}

/// Returns whether joints, each given by the sides of its rows, connect objects without a cycle. Objects are named by the start of
/// their velocities, sorted in `starts`; a row with one side joins to the ground, which is one object.
fn is_tree<'r>(starts: &[u32], joints: impl Iterator<Item = impl Iterator<Item = &'r [Side]>>) -> bool {
    let ground = starts.len();
    let mut parents: Vec<usize> = (0..=ground).collect();
    let root = |parents: &[usize], mut k: usize| {
        while parents[k] != k {
            k = parents[k];
        }
        k
    };
    for joint in joints {
        let mut ends = SmallVec::<[usize; 4]>::new();
        for sides in joint {
            ends.extend(sides.iter().filter_map(|side| starts.binary_search(&side.u).ok()));
            ends.extend((sides.len() < 2).then_some(ground));
        }
        ends.sort_unstable();
        ends.dedup();
        let [a, b] = ends[..] else { return false };
        let [a, b] = [a, b].map(|end| root(&parents, end));
        if a == b {
            return false;
        }
        parents[a] = b;
    }
    true
}

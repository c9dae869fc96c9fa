//! The blocks of an island as the sweeps read them, and the relaxation of one block.

use super::dof6::Dof6;
use super::linkage::{Linkages, SideRange};
use super::one_contact::{ContactBlock, Symmetric3};
use crate::constraint::rows::{Block, RowSet, Rows};

/// Number of blocks of an island that is solved without heap memory, such as a box on a floor.
pub(super) const INLINE_BLOCKS: usize = 4;

pub(super) fn write_back(locals: &[Local], lambda: &mut [f64]) {
    for local in locals {
        let range = local.block.range();
        lambda[range.clone()].copy_from_slice(&local.lambda[..range.len()]);
    }
}

/// Adds `Y·λ` of the island to `du` and solves the equality rows. Returns whether those hold.
pub(super) fn apply(
    locals: &[Local],
    linkages: &Linkages,
    rows: &Rows,
    c: &[f64],
    lambda: &mut [f64],
    du: &mut [f64],
) -> bool {
    write_back(locals, lambda);
    for local in locals.iter().filter(|l| l.lambda != [0.0; 3]) {
        match (local.dof6, &local.step) {
            (Some(dof6), BlockSolver::Contact(_)) => dof6.push(rows, local.lambda, du),
            _ => rows.apply_block(local.block, lambda, du),
        }
    }
    linkages.solve_equalities(rows, c, lambda, du)
}

/// A block in the layout of the sweeps. A scalar block uses the first of three numbers.
pub(super) struct Local<'a> {
    pub block: &'a Block,
    pub c: [f64; 3],
    pub lambda: [f64; 3],
    /// `λ` of the previous sweep.
    last: [f64; 3],
    pub step: BlockSolver,
    side_range: SideRange,
    dof6: Option<Dof6>,
}

/// Changes made by a sweep.
#[derive(Default)]
pub(super) struct Progress {
    /// Largest change of a row velocity by its own block.
    pub change: f64,
    /// Product of the change from the extrapolated multipliers and the last move, with sign
    /// reversed: above 0 the sweep goes against the move.
    pub against: f64,
}

impl Progress {
    #[inline(always)]
    fn record(&mut self, change: f64) {
        // `max` would take several instructions for NaN
        if change > self.change {
            self.change = change;
        }
    }
}

/// `x ← x + β(x − x_last)`, `x_last ← x`.
#[inline(always)]
pub(super) fn extrapolate_value(x: &mut f64, last: &mut f64, beta: f64) {
    let now = *x;
    *x += beta * (now - *last);
    *last = now;
}

pub(super) enum BlockSolver {
    /// No response, so no impulse.
    Unresponsive,
    Scalar(ScalarBlock),
    Contact(ContactBlock),
}

/// A scalar row.
pub(super) struct ScalarBlock {
    /// Its diagonal of `K + R`.
    pub k: f64,
    inverse: f64,
    pub compliance: f64,
    pub lo: f64,
    pub hi: f64,
}

impl BlockSolver {
    fn new(rows: &Rows, linkages: &Linkages, block: &Block, side_range: SideRange) -> BlockSolver {
        let (lo, hi) = match block.set {
            RowSet::Cone { mu } => {
                let k = if side_range.is_own() {
                    Symmetric3::own(rows, block)
                } else {
                    linkages.own_contact(rows, block, side_range)
                };
                return if k.m00 <= f64::MIN_POSITIVE {
                    BlockSolver::Unresponsive
                } else {
                    BlockSolver::Contact(ContactBlock::new(k, mu))
                };
            }
            RowSet::Equality => (f64::NEG_INFINITY, f64::INFINITY),
            RowSet::HalfLine => (0.0, f64::INFINITY),
            RowSet::Interval { lo, hi } => (lo, hi),
        };
        let response = rows.own(block, 0, 0);
        let moves = if side_range.is_own() { response } else { linkages.own(rows, block, side_range, 0, 0) };
        let k = moves + block.compliance;
        if response <= f64::MIN_POSITIVE || k <= f64::MIN_POSITIVE {
            return BlockSolver::Unresponsive;
        }
        BlockSolver::Scalar(ScalarBlock { k, inverse: 1.0 / k, compliance: block.compliance, lo, hi })
    }
}

impl<'a> Local<'a> {
    pub fn new(rows: &Rows, linkages: &mut Linkages, block: &'a Block, c: &[f64], lambda: &[f64]) -> Local<'a> {
        let side_range = linkages.extend_sides(rows, block);
        let step = BlockSolver::new(rows, linkages, block, side_range);
        let dof6 = if side_range.is_own() { Dof6::of(block) } else { None };
        let numbers = |from: &[f64]| {
            let mut three = [0.0; 3];
            three[..block.set.rows()].copy_from_slice(&from[block.range()]);
            three
        };
        let start = if matches!(step, BlockSolver::Unresponsive) { [0.0; 3] } else { numbers(lambda) };
        Local { block, c: numbers(c), lambda: start, last: start, step, side_range, dof6 }
    }

    /// Extrapolates the multipliers of this block, solves it with the others held, and moves by
    /// `factor` times the difference.
    #[inline(always)]
    pub fn relax(
        &mut self,
        beta: f64,
        factor: f64,
        rows: &Rows,
        linkages: &Linkages,
        du: &mut [f64],
        progress: &mut Progress,
    ) {
        match &self.step {
            BlockSolver::Unresponsive => {}
            BlockSolver::Scalar(scalar) => {
                extrapolate_value(&mut self.lambda[0], &mut self.last[0], beta);
                let velocity = match self.dof6.and_then(|dof6| dof6.sides::<1>(rows, du)) {
                    Some(sides) => sides.velocity(0),
                    None => rows.row_velocity(self.block, 0, du),
                };
                let full = scalar.change(self.lambda[0], self.c[0], velocity);
                if full != 0.0 {
                    let delta = factor * full;
                    let next = clamp(self.lambda[0] + delta, scalar.lo, scalar.hi);
                    self.lambda[0] = next;
                    progress.against -= delta * (next - self.last[0]);
                    progress.record((full * scalar.k).abs());
                    match self.dof6 {
                        Some(dof6) => dof6.push(rows, [delta], du),
                        None => self.push(rows, linkages, &[delta], du),
                    }
                }
            }
            BlockSolver::Contact(contact) => {
                (0..3).for_each(|k| extrapolate_value(&mut self.lambda[k], &mut self.last[k], beta));
                let w = match self.dof6.and_then(|dof6| dof6.sides::<3>(rows, du)) {
                    Some(sides) => {
                        let normal = self.c[0] + sides.velocity(0);
                        if contact.stays_open(self.lambda, normal) {
                            return;
                        }
                        [normal, self.c[1] + sides.velocity(1), self.c[2] + sides.velocity(2)]
                    }
                    None => [0, 1, 2].map(|k| self.c[k] + rows.row_velocity(self.block, k, du)),
                };
                let (mut next, mut delta) = contact.solve(self.lambda, w);
                if delta != [0.0; 3] {
                    progress.record((delta[0] * contact.k.m00).abs());
                    progress.record((delta[1] * contact.k.m11).abs());
                    progress.record((delta[2] * contact.k.m22).abs());
                    if factor < 1.0 {
                        delta = delta.map(|x| factor * x);
                        next = [0, 1, 2].map(|k| self.lambda[k] + delta[k]);
                    }
                    self.lambda = next;
                    let last = &self.last;
                    progress.against -= delta[0] * (next[0] - last[0])
                        + delta[1] * (next[1] - last[1])
                        + delta[2] * (next[2] - last[2]);
                    match self.dof6 {
                        Some(dof6) => dof6.push(rows, delta, du),
                        None => self.push(rows, linkages, &delta, du),
                    }
                }
            }
        }
    }

    /// Reads the multipliers of this block, unless it has no response.
    pub fn read(&mut self, lambda: &[f64]) {
        if !matches!(self.step, BlockSolver::Unresponsive) {
            let range = self.block.range();
            self.lambda[..range.len()].copy_from_slice(&lambda[range]);
        }
    }

    /// `u += Ỹ·δ`.
    fn push(&self, rows: &Rows, linkages: &Linkages, delta: &[f64], du: &mut [f64]) {
        let (sides, y) = linkages.moved(rows, self.block, self.side_range);
        for side in sides {
            let (u, dof) = (side.u as usize, side.dof as usize);
            for (y, delta) in y[side.y as usize..].chunks_exact(dof).zip(delta) {
                du[u..u + dof].iter_mut().zip(y).for_each(|(u, y)| *u += y * delta);
            }
        }
    }
}

impl ScalarBlock {
    /// Returns the change of the multiplier `old` at the row velocity `w = c + velocity + R·old`.
    /// The terms are ordered so that few operations wait for `velocity`: the rows of one body
    /// depend on each other.
    #[inline(always)]
    fn change(&self, old: f64, c: f64, velocity: f64) -> f64 {
        let without = -(c + self.compliance * old) * self.inverse;
        clamp(without - velocity * self.inverse, self.lo - old, self.hi - old)
    }
}

/// Unlike the standard function it does not panic if `lo > hi`; unlike `max` and `min` it takes no
/// instructions for NaN.
#[inline(always)]
fn clamp(x: f64, lo: f64, hi: f64) -> f64 {
    let above = if x < lo { lo } else { x };
    if above > hi { hi } else { above }
}

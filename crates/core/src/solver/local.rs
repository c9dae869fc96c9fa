//! The blocks of an island as the sweeps read them, and the relaxation of one block.

use super::dof6::Dof6;
use super::joint_row::JointRow;
use super::linkage::{Linkages, SideRange};
use super::one_contact::{ContactBlock, Symmetric3};
use crate::constraint::rows::{Block, RowSet, Rows, add_scaled, dot};
use std::cell::Cell;
use std::ops::Range;

/// Number of blocks of an island that is solved without heap memory, such as a box on a floor.
pub(super) const INLINE_BLOCKS: usize = 4;

/// Maximum number of blocks whose memory a thread keeps for its next solve, about 20 MB.
const KEPT_BLOCKS: usize = 1 << 16;

thread_local! {
    /// Memory of the last solve. To get megabytes from the system anew in each step takes a tenth of
    /// the time of the sweeps.
    static MEMORY: Cell<Vec<Local>> = const { Cell::new(Vec::new()) };
}

/// Calls `work` with an empty vector that has the memory of the last one.
pub(super) fn with_memory<R>(work: impl FnOnce(&mut Vec<Local>) -> R) -> R {
    let mut locals = MEMORY.take();
    let result = work(&mut locals);
    if locals.capacity() <= KEPT_BLOCKS {
        locals.clear();
        MEMORY.set(locals);
    }
    result
}

pub(super) fn write_back(locals: &[Local], lambda: &mut [f64]) {
    for local in locals {
        match &local.step {
            BlockSolver::Joint(row) => row.write(lambda),
            _ => {
                let range = local.range();
                lambda[range.clone()].copy_from_slice(&local.lambda[..range.len()]);
            }
        }
    }
}

/// Adds `Y·λ` of the island to `du` and solves the equality rows. Returns the largest velocity that
/// these are left with, m/s.
pub(super) fn apply(
    locals: &[Local],
    linkages: &Linkages,
    rows: &Rows,
    c: &[f64],
    lambda: &mut [f64],
    du: &mut [f64],
) -> f64 {
    write_back(locals, lambda);
    for local in locals {
        match (local.dof6, &local.step) {
            (_, BlockSolver::Joint(row)) => rows.push_row(local.block(rows), 0, row.total(), du),
            _ if local.lambda == [0.0; 3] => {}
            (Some(dof6), BlockSolver::Contact(_)) => dof6.push(rows, local.lambda, du),
            _ => rows.apply_block(local.block(rows), lambda, du),
        }
    }
    linkages.solve_equalities(rows, c, lambda, du)
}

/// A block in the layout of the sweeps. A scalar block uses the first of three numbers.
pub(super) struct Local {
    /// Index of the block.
    index: u32,
    /// Its first row, and the number of rows.
    row: u32,
    count: u32,
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
    /// Scalar rows along one direction.
    Joint(Box<JointRow>),
}

/// A scalar row.
pub(super) struct ScalarBlock {
    /// Its diagonal of `K + R`.
    pub k: f64,
    inverse: f64,
    pub compliance: f64,
    pub lo: f64,
    pub hi: f64,
    /// The response without zeros at its ends, of a row that moves one object and no linkage.
    single: Option<Stretch>,
}

/// Consecutive responses of one row: their number, the place of the first in [`Rows::y`], and in `du`.
#[derive(Clone, Copy)]
struct Stretch {
    len: u32,
    y: u32,
    u: u32,
}

impl Stretch {
    /// Returns `None` for a row that moves two objects. A row of a link moves the links before it, or
    /// those after it.
    fn of(rows: &Rows, block: &Block) -> Option<Stretch> {
        let [side] = block.sides() else { return None };
        let response = rows.response(side, 0);
        let first = response.iter().position(|y| *y != 0.0)?;
        let end = response.iter().rposition(|y| *y != 0.0)? + 1;
        Some(Stretch { len: (end - first) as u32, y: side.y + first as u32, u: side.u + first as u32 })
    }

    fn response<'a>(&self, rows: &'a Rows) -> &'a [f64] {
        &rows.y[self.y as usize..(self.y + self.len) as usize]
    }

    fn velocity(&self, rows: &Rows, du: &[f64]) -> f64 {
        dot(self.response(rows), &du[self.u as usize..(self.u + self.len) as usize])
    }

    fn push(&self, rows: &Rows, delta: f64, du: &mut [f64]) {
        add_scaled(&mut du[self.u as usize..(self.u + self.len) as usize], delta, self.response(rows));
    }
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
        let single = if side_range.is_own() { Stretch::of(rows, block) } else { None };
        BlockSolver::Scalar(ScalarBlock { k, inverse: 1.0 / k, compliance: block.compliance, lo, hi, single })
    }
}

impl Local {
    pub fn new(rows: &Rows, linkages: &mut Linkages, index: u32, c: &[f64], lambda: &[f64]) -> Local {
        let block = &rows.blocks[index as usize];
        let side_range = linkages.extend_sides(rows, block);
        let step = BlockSolver::new(rows, linkages, block, side_range);
        let dof6 = if side_range.is_own() { Dof6::of(block) } else { None };
        let numbers = |from: &[f64]| {
            let mut three = [0.0; 3];
            three[..block.set.rows()].copy_from_slice(&from[block.range()]);
            three
        };
        let start = if matches!(step, BlockSolver::Unresponsive) { [0.0; 3] } else { numbers(lambda) };
        let (row, count) = (block.row, block.set.rows() as u32);
        Local { index, row, count, c: numbers(c), lambda: start, last: start, step, side_range, dof6 }
    }

    /// Makes the block of a group of parallel rows; `None` if it has no response with the joints held.
    pub fn joint(
        rows: &Rows,
        linkages: &mut Linkages,
        group: &[(u32, f64)],
        c: &[f64],
        lambda: &[f64],
    ) -> Option<Local> {
        let mut local = Local::new(rows, linkages, group[0].0, c, lambda);
        let k = linkages.own(rows, local.block(rows), local.side_range, 0, 0);
        local.step = BlockSolver::Joint(Box::new(JointRow::new(rows, group, k, c, lambda)));
        (k > f64::MIN_POSITIVE).then_some(local)
    }

    pub fn block<'a>(&self, rows: &'a Rows) -> &'a Block {
        &rows.blocks[self.index as usize]
    }

    /// Returns its rows.
    fn range(&self) -> Range<usize> {
        self.row as usize..(self.row + self.count) as usize
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
                let velocity = match (self.dof6.and_then(|dof6| dof6.sides::<1>(rows, du)), scalar.single) {
                    (Some(sides), _) => sides.velocity(0),
                    (None, Some(single)) => single.velocity(rows, du),
                    (None, None) => rows.row_velocity(self.block(rows), 0, du),
                };
                let full = scalar.change(self.lambda[0], self.c[0], velocity);
                if full != 0.0 {
                    let delta = factor * full;
                    let next = clamp(self.lambda[0] + delta, scalar.lo, scalar.hi);
                    self.lambda[0] = next;
                    progress.against -= delta * (next - self.last[0]);
                    progress.record((full * scalar.k).abs());
                    match (self.dof6, scalar.single) {
                        (Some(dof6), _) => dof6.push(rows, [delta], du),
                        (None, Some(single)) => single.push(rows, delta, du),
                        (None, None) => self.push(rows, linkages, &[delta], du),
                    }
                }
            }
            BlockSolver::Joint(_) => self.relax_joint(beta, factor, rows, linkages, du, progress),
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
                    None => [0, 1, 2].map(|k| self.c[k] + rows.row_velocity(self.block(rows), k, du)),
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

    /// Relaxes a group of parallel rows.
    fn relax_joint(
        &mut self,
        beta: f64,
        factor: f64,
        rows: &Rows,
        linkages: &Linkages,
        du: &mut [f64],
        progress: &mut Progress,
    ) {
        let velocity = rows.row_velocity(self.block(rows), 0, du);
        let BlockSolver::Joint(row) = &mut self.step else { return };
        row.extrapolate(beta);
        let moved = row.relax(velocity, factor);
        progress.record((moved.total * row.k).abs());
        progress.against -= moved.along;
        if moved.total != 0.0 {
            self.push(rows, linkages, &[moved.total], du);
        }
    }

    /// Multiplies the multipliers of this block.
    pub fn scale(&mut self, factor: f64) {
        self.lambda = self.lambda.map(|x| factor * x);
        if let BlockSolver::Joint(row) = &mut self.step {
            row.scale(factor);
        }
    }

    /// Reads the multipliers of this block, unless it has no response.
    pub fn read(&mut self, lambda: &[f64]) {
        if let BlockSolver::Joint(row) = &mut self.step {
            row.read(lambda);
        } else if !matches!(self.step, BlockSolver::Unresponsive) {
            let range = self.range();
            self.lambda[..range.len()].copy_from_slice(&lambda[range]);
        }
    }

    /// `u += Ỹ·δ`.
    fn push(&self, rows: &Rows, linkages: &Linkages, delta: &[f64], du: &mut [f64]) {
        let (sides, y) = linkages.moved(rows, self.block(rows), self.side_range);
        for side in sides {
            let (u, dof) = (side.u as usize, side.dof as usize);
            for (y, delta) in y[side.y as usize..].chunks_exact(dof).zip(delta) {
                add_scaled(&mut du[u..u + dof], *delta, y);
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

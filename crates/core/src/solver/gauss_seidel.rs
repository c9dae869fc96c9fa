//! Block Gauss–Seidel on the friction cone.
//!
//! For each block in turn, with everything else held: `w = c + Yᵀ(Yλ) + Rλ`, then
//!
//! - half-line, interval: `λ ← clamp(λ − w/k)` with `k` the row's diagonal of `K + R`;
//! - contact: its own three-row problem (`one_contact.rs`).
//!
//! Equalities are in no sweep: they are solved all at once and hold in every iterate (`linkage.rs`), but for linkages too large for that,
//! where they are relaxed like intervals without ends.
//!
//! Its fixed points are the exact Coulomb solutions: `λ_n ⟂ w_n` without the dilation that a convex cone brings, and
//! friction against the sliding velocity.
//!
//! Between sweeps the iterate is extrapolated, `y = λ_k + β_k(λ_k − λ_{k−1})`, with Nesterov's weights `β_k = (θ_k − 1)/θ_{k+1}`,
//! `θ_{k+1} = ½(1 + √(1 + 4θ_k²))`, and a restart whenever the sweep goes against the last move, `(y − λ_{k+1})·(λ_{k+1} − λ_k) > 0`
//! (O'Donoghue and Candès, *Adaptive restart for accelerated gradient schemes*, 2015). Plain sweeps carry a load down a stack one
//! body at a time; a tower of ten boxes wants thousands of them and this about a hundred. With friction the problem is not convex and the
//! extrapolation can go in circles, so after [`ACCELERATED`] sweeps it is plain. What is slow even so (nearly redundant contacts, high mass ratios) is
//! finished by Newton's method where an island is small (`newton.rs`); elsewhere the residual says how far. Plain sweeps can go in circles too; those that
//! get nowhere go on by shorter steps (`relaxation.rs`).

use super::dof6::Dof6;
use super::linkage::{Linkages, SideRange};
use super::newton::Newton;
use super::one_contact::{ContactBlock, Symmetric3};
use super::relaxation::Relaxation;
use super::{RowSolver, SolveReport, SolverSettings};
use crate::rows::{Block, RowSet, Rows};
use smallvec::SmallVec;

/// Blocks of an island that is solved without memory from the heap: a ball on a floor, a box on it.
const INLINE_BLOCKS: usize = 4;
/// Sweeps with extrapolation between them.
const ACCELERATED: u32 = 200;

/// The block Gauss–Seidel solver, `gauss_seidel`.
#[derive(Clone, Copy, Debug, Default)]
pub struct GaussSeidel;

impl RowSolver for GaussSeidel {
    fn name(&self) -> &'static str {
        "gauss_seidel"
    }

    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport {
        let mut linkages = Linkages::new(rows, blocks);
        let mut locals: SmallVec<[Local; INLINE_BLOCKS]> = SmallVec::with_capacity(blocks.len());
        for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
            if !linkages.contains_row(rows, block) {
                locals.push(Local::new(rows, &mut linkages, block, c, lambda));
            }
        }
        apply(&locals, &linkages, rows, c, lambda, du);
        let sweeps = settings.max_sweeps_for(locals.len());
        let mut extrapolation = Extrapolation::new(&locals, &linkages, du);
        let mut newton = linkages.is_empty().then(|| Newton::new(&extrapolation));
        let mut outcome = SolveReport { iterations: sweeps, converged: false, ray: false };
        let mut relaxation = Relaxation::new(ACCELERATED);
        for sweep in 1..=sweeps {
            let mut progress = Progress::default();
            for local in &mut locals {
                local.relax(extrapolation.beta, relaxation.factor, rows, &linkages, du, &mut progress);
            }
            if progress.change <= settings.tolerance {
                outcome = SolveReport { iterations: sweep, converged: true, ray: false };
                break;
            }
            relaxation.record(sweep, progress.change);
            if let Some(newton) = &mut newton
                && newton.try_step(sweep..sweeps, progress.change, &mut locals, rows, &extrapolation, du)
            {
                extrapolation.rebuild(&locals, &linkages, rows, c, lambda, du);
                continue;
            }
            if sweep < sweeps {
                let plain = sweep > ACCELERATED || sweep + FINAL_PLAIN_SWEEPS >= sweeps;
                extrapolation.extrapolate(progress.against > 0.0 || plain, du);
            }
            if sweep % REBUILD_INTERVAL == 0 {
                extrapolation.rebuild(&locals, &linkages, rows, c, lambda, du);
            }
        }
        write_back(&locals, lambda);
        if !linkages.is_empty() {
            extrapolation.clear(du);
            outcome.converged &= apply(&locals, &linkages, rows, c, lambda, du);
        }
        outcome
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

/// The last sweeps are plain: an extrapolated iterate may overshoot far just before it turns, and a solve cut off there would be worse than none.
const FINAL_PLAIN_SWEEPS: u32 = 5;
/// Extrapolation carries the rounding errors of `du` on and on; after so many sweeps it is made anew from `λ`.
const REBUILD_INTERVAL: u32 = 1000;

fn write_back(locals: &[Local], lambda: &mut [f64]) {
    for local in locals {
        let range = local.block.range();
        lambda[range.clone()].copy_from_slice(&local.lambda[..range.len()]);
    }
}

/// `du += Y·λ` of the island, with the equalities that are solved at once; whether those are.
fn apply(locals: &[Local], linkages: &Linkages, rows: &Rows, c: &[f64], lambda: &mut [f64], du: &mut [f64]) -> bool {
    write_back(locals, lambda);
    for local in locals.iter().filter(|l| l.lambda != [0.0; 3]) {
        match (local.dof6, &local.step) {
            (Some(dof6), BlockSolver::Contact(_)) => dof6.push(rows, local.lambda, du),
            _ => rows.apply_block(local.block, lambda, du),
        }
    }
    linkages.solve_equalities(rows, c, lambda, du)
}

/// A block as the sweeps read it; of a scalar block only the first of each three numbers counts.
pub(super) struct Local<'a> {
    pub block: &'a Block,
    pub c: [f64; 3],
    pub lambda: [f64; 3],
    /// `λ` of the sweep before.
    last: [f64; 3],
    pub step: BlockSolver,
    side_range: SideRange,
    dof6: Option<Dof6>,
}

/// What a sweep did.
#[derive(Default)]
struct Progress {
    /// Largest change of a row velocity by its own block.
    change: f64,
    /// How far the change from the extrapolated multipliers goes against the move since the last sweep.
    against: f64,
}

impl Progress {
    #[inline(always)]
    fn record(&mut self, change: f64) {
        // Not `max`, which spends several instructions on NaN.
        if change > self.change {
            self.change = change;
        }
    }
}

/// The extrapolation between sweeps, over the stretches of `du` that the island acts on. Multipliers follow when it is their turn to be relaxed.
pub(super) struct Extrapolation {
    theta: f64,
    /// `β` of the sweep to come.
    beta: f64,
    /// First index and end of each stretch of `du`, one after the other; neighbours are joined.
    stretches: SmallVec<[(u32, u32); 2 * INLINE_BLOCKS]>,
    /// `du` of the sweep before, of all stretches.
    last: SmallVec<[f64; 32]>,
}

impl Extrapolation {
    fn new(locals: &[Local], linkages: &Linkages, du: &[f64]) -> Extrapolation {
        let mut stretches: SmallVec<[(u32, u32); 2 * INLINE_BLOCKS]> = linkages.stretches().collect();
        for (i, local) in locals.iter().enumerate() {
            // the contacts of a pair follow one another: one of them is enough
            let same =
                |other: &Local| other.block.sides().iter().map(|s| s.u).eq(local.block.sides().iter().map(|s| s.u));
            if i == 0 || !same(&locals[i - 1]) {
                stretches.extend(local.block.sides().iter().map(|s| (s.u, s.u + s.dof)));
            }
        }
        stretches.sort_unstable();
        stretches.dedup_by(|next, before| {
            let joins = next.0 <= before.1;
            if joins {
                before.1 = before.1.max(next.1);
            }
            joins
        });
        let last = stretches.iter().flat_map(|&(start, end)| &du[start as usize..end as usize]).copied().collect();
        Extrapolation { theta: 1.0, beta: 0.0, stretches, last }
    }

    /// How many freedoms the island has.
    pub fn size(&self) -> usize {
        self.last.len()
    }

    /// The place of a freedom of the island, given by its index in `du`, among those of the island.
    pub fn place(&self, index: u32) -> usize {
        let mut before = 0;
        for &(start, end) in &self.stretches {
            if index < end {
                return (before + index - start) as usize;
            }
            before += end - start;
        }
        before as usize
    }

    fn extrapolate(&mut self, restart: bool, du: &mut [f64]) {
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.theta * self.theta).sqrt());
        self.beta = if restart { 0.0 } else { (self.theta - 1.0) / next };
        self.theta = if restart { 1.0 } else { next };
        let beta = self.beta;
        let mut rest = &mut self.last[..];
        for &(start, end) in &self.stretches {
            let (last, try_step) = rest.split_at_mut((end - start) as usize);
            du[start as usize..end as usize]
                .iter_mut()
                .zip(last)
                .for_each(|(du, last)| extrapolate_value(du, last, beta));
            rest = try_step;
        }
    }

    /// Makes `du` anew from the multipliers, which are not extrapolated yet, and starts from rest.
    fn rebuild(
        &mut self,
        locals: &[Local],
        linkages: &Linkages,
        rows: &Rows,
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
    ) {
        self.clear(du);
        apply(locals, linkages, rows, c, lambda, du);
        self.extrapolate(true, du);
    }

    /// Zeroes `du` wherever the island acts.
    fn clear(&self, du: &mut [f64]) {
        self.stretches.iter().for_each(|&(start, end)| du[start as usize..end as usize].fill(0.0));
    }
}

/// `x ← x + β(x − x_last)`, `x_last ← x`.
#[inline(always)]
fn extrapolate_value(x: &mut f64, last: &mut f64, beta: f64) {
    let now = *x;
    *x += beta * (now - *last);
    *last = now;
}

pub(super) enum BlockSolver {
    /// No response: no impulse.
    Unresponsive,
    Scalar(ScalarBlock),
    Contact(ContactBlock),
}

/// A row by itself.
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
    fn new(rows: &Rows, linkages: &mut Linkages, block: &'a Block, c: &[f64], lambda: &[f64]) -> Local<'a> {
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

    /// Extrapolates the multipliers of this block, solves it with the others held, and goes this share of the way there.
    #[inline(always)]
    fn relax(
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

    /// Brings the multipliers back to what they may be.
    pub fn bound(&mut self) {
        match &self.step {
            BlockSolver::Unresponsive => self.lambda = [0.0; 3],
            BlockSolver::Scalar(scalar) => self.lambda[0] = clamp(self.lambda[0], scalar.lo, scalar.hi),
            BlockSolver::Contact(contact) => self.lambda = contact.bounded(self.lambda),
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
    /// How the multiplier changes where it was `old` and the row velocity is `w = c + velocity + R·old`. Written so that what waits for
    /// the velocity is short: rows of one body wait for each other.
    #[inline(always)]
    fn change(&self, old: f64, c: f64, velocity: f64) -> f64 {
        let without = -(c + self.compliance * old) * self.inverse;
        clamp(without - velocity * self.inverse, self.lo - old, self.hi - old)
    }
}

/// Not the standard one, which panics where `lo > hi`, nor `max` and `min`, which spend instructions on NaN.
#[inline(always)]
fn clamp(x: f64, lo: f64, hi: f64) -> f64 {
    let above = if x < lo { lo } else { x };
    if above > hi { hi } else { above }
}

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
//! extrapolation can go in circles, so after [`ACCELERATED`] sweeps it is plain. High mass ratios stay slow; the residual says how far.

use super::linkage::{Linkages, Reach};
use super::one_contact::Contact;
use super::{Accuracy, Outcome, RowSolver};
use crate::rows::{Block, RowSet, Rows, Side, dot, dot6};

/// Sweeps with extrapolation between them.
const ACCELERATED: u32 = 200;

/// The block Gauss–Seidel solver, `gauss_seidel`.
#[derive(Clone, Copy, Debug, Default)]
pub struct GaussSeidel;

impl RowSolver for GaussSeidel {
    fn name(&self) -> &'static str {
        "gauss_seidel"
    }

    fn solve(&self, rows: &Rows, blocks: &[u32], c: &[f64], lambda: &mut [f64], du: &mut [f64], accuracy: Accuracy) -> Outcome {
        let mut linkages = Linkages::new(rows, blocks);
        let mut locals: Vec<Local> = Vec::with_capacity(blocks.len());
        for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
            if !linkages.hold(rows, block) {
                locals.push(Local::new(rows, &mut linkages, block, c, lambda));
            }
        }
        apply(&locals, &linkages, rows, c, lambda, du);
        let sweeps = accuracy.sweeps_of(locals.len());
        let mut momentum = Momentum::new(&locals, &linkages, du);
        let mut outcome = Outcome { iterations: sweeps, converged: false, ray: false };
        for sweep in 1..=sweeps {
            let mut progress = Progress::default();
            for local in &mut locals {
                local.relax(rows, &linkages, du, &mut progress);
            }
            if progress.change <= accuracy.tolerance {
                outcome = Outcome { iterations: sweep, converged: true, ray: false };
                break;
            }
            if sweep < sweeps {
                let plain = sweep > ACCELERATED || sweep + SETTLE >= sweeps;
                momentum.extrapolate(&mut locals, progress.against > 0.0 || plain, du);
            }
            if sweep % RENEW == 0 {
                momentum.renew(&mut locals, &linkages, rows, c, lambda, du);
            }
        }
        write_back(&locals, lambda);
        if !linkages.is_empty() {
            momentum.clear(du);
            outcome.converged &= apply(&locals, &linkages, rows, c, lambda, du);
        }
        outcome
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

/// The last sweeps are plain: an extrapolated iterate may overshoot far just before it turns, and a solve cut off there would be worse than none.
const SETTLE: u32 = 5;
/// Extrapolation carries the rounding errors of `du` on and on; after so many sweeps it is made anew from `λ`.
const RENEW: u32 = 1000;

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
        match local.step {
            Step::Contact(_) => local.block.sides().iter().for_each(|s| add_impulse(&rows.y, s, local.lambda, du)),
            _ => rows.apply_block(local.block, lambda, du),
        }
    }
    linkages.settle(rows, c, lambda, du)
}

/// A block as the sweeps read it; of a scalar block only the first of each three numbers counts.
struct Local<'a> {
    block: &'a Block,
    c: [f64; 3],
    lambda: [f64; 3],
    /// `λ` of the sweep before.
    last: [f64; 3],
    step: Step,
    reach: Reach,
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
    fn note(&mut self, change: f64) {
        // Not `max`, which spends several instructions on NaN.
        if change > self.change {
            self.change = change;
        }
    }
}

/// The extrapolation between sweeps, over the multipliers of the island and the stretches of `du` that they act on.
struct Momentum {
    theta: f64,
    /// First index and end of each stretch of `du`, one after the other; neighbours are joined.
    stretches: Vec<(u32, u32)>,
    /// `du` of the sweep before, of all stretches.
    last: Vec<f64>,
}

impl Momentum {
    fn new(locals: &[Local], linkages: &Linkages, du: &[f64]) -> Momentum {
        let mut stretches: Vec<(u32, u32)> = linkages.stretches().collect();
        for (i, local) in locals.iter().enumerate() {
            // the contacts of a pair follow one another: one of them is enough
            let same = |other: &Local| other.block.sides().iter().map(|s| s.u).eq(local.block.sides().iter().map(|s| s.u));
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
        Momentum { theta: 1.0, stretches, last }
    }

    fn extrapolate(&mut self, locals: &mut [Local], restart: bool, du: &mut [f64]) {
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.theta * self.theta).sqrt());
        let beta = if restart { 0.0 } else { (self.theta - 1.0) / next };
        self.theta = if restart { 1.0 } else { next };
        for local in locals {
            for (lambda, last) in local.lambda.iter_mut().zip(&mut local.last) {
                go_on(lambda, last, beta);
            }
        }
        let mut rest = &mut self.last[..];
        for &(start, end) in &self.stretches {
            let (last, after) = rest.split_at_mut((end - start) as usize);
            du[start as usize..end as usize].iter_mut().zip(last).for_each(|(du, last)| go_on(du, last, beta));
            rest = after;
        }
    }

    /// Makes `du` anew, and starts from rest.
    fn renew(&mut self, locals: &mut [Local], linkages: &Linkages, rows: &Rows, c: &[f64], lambda: &mut [f64], du: &mut [f64]) {
        self.clear(du);
        apply(locals, linkages, rows, c, lambda, du);
        self.extrapolate(locals, true, du);
    }

    /// Zeroes `du` wherever the island acts.
    fn clear(&self, du: &mut [f64]) {
        self.stretches.iter().for_each(|&(start, end)| du[start as usize..end as usize].fill(0.0));
    }
}

/// `x ← x + β(x − x_last)`, `x_last ← x`.
#[inline(always)]
fn go_on(x: &mut f64, last: &mut f64, beta: f64) {
    let now = *x;
    *x += beta * (now - *last);
    *last = now;
}

enum Step {
    /// No response: no impulse.
    Dead,
    Scalar(Scalar),
    Contact(Contact),
}

/// A row by itself.
struct Scalar {
    /// Its diagonal of `K + R`.
    k: f64,
    inverse: f64,
    compliance: f64,
    lo: f64,
    hi: f64,
}

impl Step {
    fn new(rows: &Rows, linkages: &Linkages, block: &Block, reach: Reach) -> Step {
        let diagonal = linkages.own(rows, block, reach, 0, 0);
        let (compliance, k) = (block.compliance, diagonal + block.compliance);
        let scalar = |lo, hi| Step::Scalar(Scalar { k, inverse: 1.0 / k, compliance, lo, hi });
        match block.set {
            _ if k <= f64::MIN_POSITIVE || rows.own(block, 0, 0) <= f64::MIN_POSITIVE => Step::Dead,
            RowSet::Equality => scalar(f64::NEG_INFINITY, f64::INFINITY),
            RowSet::HalfLine => scalar(0.0, f64::INFINITY),
            RowSet::Interval { lo, hi } => scalar(lo, hi),
            RowSet::Cone { mu } if reach.is_own() => Step::Contact(Contact::new(rows, block, mu)),
            RowSet::Cone { mu } => Step::Contact(Contact::with_own(linkages.own_contact(rows, block, reach), mu)),
        }
    }
}

impl<'a> Local<'a> {
    fn new(rows: &Rows, linkages: &mut Linkages, block: &'a Block, c: &[f64], lambda: &[f64]) -> Local<'a> {
        let reach = linkages.lay(rows, block);
        let step = Step::new(rows, linkages, block, reach);
        let numbers = |from: &[f64]| {
            let mut three = [0.0; 3];
            three[..block.set.rows()].copy_from_slice(&from[block.range()]);
            three
        };
        let start = if matches!(step, Step::Dead) { [0.0; 3] } else { numbers(lambda) };
        Local { block, c: numbers(c), lambda: start, last: start, step, reach }
    }

    /// Solves this block with the others held.
    #[inline]
    fn relax(&mut self, rows: &Rows, linkages: &Linkages, du: &mut [f64], progress: &mut Progress) {
        match &self.step {
            Step::Dead => {}
            Step::Scalar(Scalar { k, inverse, compliance, lo, hi }) => {
                let w = self.c[0] + rows.row_velocity(self.block, 0, du) + compliance * self.lambda[0];
                let next = clamp(self.lambda[0] - w * inverse, *lo, *hi);
                let delta = next - self.lambda[0];
                if delta != 0.0 {
                    self.lambda[0] = next;
                    let (sides, y) = linkages.moved(rows, self.block, self.reach);
                    for side in sides {
                        add_multiple(row(y, side, 0), delta, &mut du[side.u as usize..(side.u + side.dof) as usize]);
                    }
                    progress.against -= delta * (next - self.last[0]);
                    progress.note((delta * k).abs());
                }
            }
            Step::Contact(contact) => {
                let mut w = self.c;
                self.block.sides().iter().for_each(|s| add_velocity(&rows.y, s, du, &mut w));
                let next = contact.solve(self.lambda, w);
                let delta = [next[0] - self.lambda[0], next[1] - self.lambda[1], next[2] - self.lambda[2]];
                if delta != [0.0; 3] {
                    self.lambda = next;
                    let (sides, y) = linkages.moved(rows, self.block, self.reach);
                    sides.iter().for_each(|s| add_impulse(y, s, delta, du));
                    let last = &self.last;
                    progress.against -= delta[0] * (next[0] - last[0]) + delta[1] * (next[1] - last[1]) + delta[2] * (next[2] - last[2]);
                    progress.note((delta[0] * contact.k.m00).abs());
                    progress.note((delta[1] * contact.k.m11).abs());
                    progress.note((delta[2] * contact.k.m22).abs());
                }
            }
        }
    }
}

/// Not the standard one, which panics where `lo > hi`, nor `max` and `min`, which spend instructions on NaN.
#[inline(always)]
fn clamp(x: f64, lo: f64, hi: f64) -> f64 {
    let above = if x < lo { lo } else { x };
    if above > hi { hi } else { above }
}

/// The three rows of a side of six freedoms.
#[inline(always)]
fn six<'a>(y: &'a [f64], side: &Side) -> Option<[&'a [f64; 6]; 3]> {
    let [normal, first, second, ..] = y[side.y as usize..].as_chunks::<6>().0 else { return None };
    (side.dof == 6).then_some([normal, first, second])
}

/// Row `r` of a side whose responses are in `y`.
#[inline(always)]
fn row<'a>(y: &'a [f64], side: &Side, r: usize) -> &'a [f64] {
    let (start, dof) = (side.y as usize + r * side.dof as usize, side.dof as usize);
    &y[start..start + dof]
}

/// `w += Yᵀu` of one side of a contact.
#[inline(always)]
fn add_velocity(y: &[f64], side: &Side, u: &[f64], w: &mut [f64; 3]) {
    let u = &u[side.u as usize..(side.u + side.dof) as usize];
    if let (Some([y0, y1, y2]), Some(u)) = (six(y, side), u.as_array::<6>()) {
        w[0] += dot6(y0, u);
        w[1] += dot6(y1, u);
        w[2] += dot6(y2, u);
    } else {
        w.iter_mut().enumerate().for_each(|(r, w)| *w += dot(row(y, side, r), u));
    }
}

/// `u += Y·δ` of one side of a contact.
#[inline(always)]
fn add_impulse(y: &[f64], side: &Side, delta: [f64; 3], u: &mut [f64]) {
    let u = &mut u[side.u as usize..(side.u + side.dof) as usize];
    if let (Some([y0, y1, y2]), Some(u)) = (six(y, side), u.as_mut_array::<6>()) {
        for k in 0..6 {
            u[k] += y0[k] * delta[0] + y1[k] * delta[1] + y2[k] * delta[2];
        }
    } else {
        (0..3).for_each(|r| add_multiple(row(y, side, r), delta[r], u));
    }
}

/// `u += y·δ`.
#[inline(always)]
fn add_multiple(y: &[f64], delta: f64, u: &mut [f64]) {
    if let (Some(y), Some(u)) = (y.as_array::<6>(), u.as_mut_array::<6>()) {
        (0..6).for_each(|k| u[k] += y[k] * delta);
    } else {
        u.iter_mut().zip(y).for_each(|(u, y)| *u += y * delta);
    }
}

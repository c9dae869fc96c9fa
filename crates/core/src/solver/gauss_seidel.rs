//! Block Gauss–Seidel on the friction cone.
//!
//! Each block in turn is solved with all others held. With `w = c + Yᵀ(Yλ) + Rλ`:
//!
//! - half-line, interval: `λ ← clamp(λ − w/k)`, with `k` the row's diagonal entry of `K + R`;
//! - contact: its own three-row problem (`one_contact.rs`).
//!
//! Equality rows take no part in the sweeps: they are solved together and hold in every iterate
//! (`linkage.rs`). Linkages that are too large for that are relaxed like intervals without bounds.
//!
//! The fixed points are exact Coulomb solutions: `λ_n ⟂ w_n` without the dilation of a convex cone,
//! and friction against the sliding velocity.
//!
//! Between sweeps the iterate is extrapolated, `y = λ_k + β_k(λ_k − λ_{k−1})`, with Nesterov's
//! weights `β_k = (θ_k − 1)/θ_{k+1}`, `θ_{k+1} = ½(1 + √(1 + 4θ_k²))`. The extrapolation restarts
//! if a sweep goes against the last change, `(y − λ_{k+1})·(λ_{k+1} − λ_k) > 0` (O'Donoghue and
//! Candès, *Adaptive restart for accelerated gradient schemes*, 2015). Plain sweeps carry a load
//! down a stack one body at a time: a tower of ten boxes needs thousands of them, and about a
//! hundred with extrapolation.
//!
//! With friction the problem is not convex and extrapolated sweeps can cycle, so there is no
//! extrapolation after [`ACCELERATED`] sweeps. Plain sweeps can also cycle; if they stagnate,
//! `relaxation.rs` shortens their steps.
//!
//! An island that is not finished when its sweeps have cost as much as [`FACTORIZATIONS`] is solved
//! as a whole (`direct/`). Islands whose factorization is too expensive are left to the sweeps, and
//! so are large islands in motion. A solve that ends unfinished is scaled so that it adds no energy
//! ([`optimal_scale`]).

use super::direct::Plan;
use super::extrapolation::Extrapolation;
use super::linkage::Linkages;
use super::local::{INLINE_BLOCKS, Local, Progress, apply, write_back};
use super::relaxation::Relaxation;
use super::{RowSolver, SolveReport, SolverSettings, residual};
use crate::constraint::rows::Rows;
use smallvec::SmallVec;

/// Number of sweeps with extrapolation.
const ACCELERATED: u32 = 200;

/// Minimum number of sweeps before an island is solved directly.
const FIRST_SWEEPS: u32 = 25;
/// Sweeps go on until they have cost as much as this number of factorizations.
const FACTORIZATIONS: f64 = 3.0;

/// Under a budget an island is solved directly only if it can pay for this number of factorizations:
/// the interior point method gives little before its end.
const AFFORDABLE: f64 = 12.0;

/// Islands of more blocks are solved if their residual is at most [`SOLVED`] tolerances; from smaller
/// ones the direct solution gains more digits for little.
const LARGE: usize = 500;
const SOLVED: f64 = 10.0;
/// The residual is computed if the last sweep changed nothing by more than this many tolerances.
const NEARLY_SOLVED: f64 = 100.0;

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
        let mut outcome = SolveReport { iterations: sweeps, converged: false, ray: false, relaxations: 0 };
        let affordable = settings.budget.map(|budget| f64::from(budget) / locals.len().max(1) as f64);
        let mut relaxation = Relaxation::new(ACCELERATED);
        let (mut plan, mut due, mut direct, mut swept) = (None, 0, false, 0);
        for sweep in 1..=sweeps {
            let mut progress = Progress::default();
            for local in &mut locals {
                local.relax(extrapolation.beta, relaxation.factor, rows, &linkages, du, &mut progress);
            }
            if progress.change <= settings.tolerance {
                (outcome.iterations, outcome.converged) = (sweep, true);
                break;
            }
            relaxation.record(sweep, progress.change);
            if sweep == FIRST_SWEEPS.min(sweeps) {
                write_back(&locals, lambda);
                let near = progress.change <= NEARLY_SOLVED * settings.tolerance;
                if locals.len() > LARGE && near && residual(rows, blocks, c, lambda, du) <= SOLVED * settings.tolerance
                {
                    (outcome.iterations, outcome.converged) = (sweep, true);
                    break;
                }
                plan = Plan::new(rows, blocks, c, sweeps < FIRST_SWEEPS);
                due = plan.as_ref().map_or(u32::MAX, |plan| (FACTORIZATIONS * plan.cost()) as u32).max(sweep);
                if let Some(affordable) = affordable {
                    let spare = |plan: &Plan| affordable - AFFORDABLE * plan.cost();
                    plan = plan.filter(|plan| spare(plan) >= f64::from(sweep));
                    due = plan.as_ref().map_or(u32::MAX, |plan| due.min(spare(plan) as u32));
                }
            }
            if let Some(plan) = plan.take_if(|_| sweep == due.min(sweeps)) {
                extrapolation.rebuild(&locals, &linkages, rows, c, lambda, du);
                let cost = plan.cost();
                let most = affordable.map_or(u32::MAX, |affordable| ((affordable - f64::from(sweep)) / cost) as u32);
                let solved = plan.solve(lambda, settings.tolerance, most);
                outcome.relaxations = (f64::from(solved.factorizations) * cost * locals.len() as f64) as u32;
                locals.iter_mut().for_each(|local| local.read(lambda));
                extrapolation.rebuild(&locals, &linkages, rows, c, lambda, du);
                (outcome.iterations, swept) = (sweep + solved.factorizations, sweep);
                outcome.converged = solved.converged;
                direct = true;
                break;
            }
            if sweep < sweeps {
                let plain = sweep > ACCELERATED || sweep + FINAL_PLAIN_SWEEPS >= sweeps;
                extrapolation.extrapolate(progress.against > 0.0 || plain, du);
            }
            if sweep % REBUILD_INTERVAL == 0 {
                extrapolation.rebuild(&locals, &linkages, rows, c, lambda, du);
            }
        }
        if !outcome.converged && !direct && linkages.is_empty() {
            let share = optimal_scale(&locals, extrapolation.square(du));
            if share < 1.0 {
                locals.iter_mut().for_each(|local| local.lambda = local.lambda.map(|x| share * x));
                extrapolation.clear(du);
                apply(&locals, &linkages, rows, c, lambda, du);
            }
        }
        outcome.relaxations += if direct { swept } else { outcome.iterations } * locals.len() as u32;
        write_back(&locals, lambda);
        if !linkages.is_empty() {
            extrapolation.clear(du);
            let joints_hold = apply(&locals, &linkages, rows, c, lambda, du);
            outcome.converged &= joints_hold || direct;
        }
        outcome
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

/// Returns the factor of the multipliers at which `½λᵀ(K + R)λ + cᵀλ` is least. A solution has `λᵀw ≤
/// 0` and so a factor of at least 1. A smaller factor means that the iterate overshoots and may add
/// energy; multipliers that are scaled by it add none.
///
/// `square` is `λᵀKλ`, the square of `Yλ`.
fn optimal_scale(locals: &[Local], square: f64) -> f64 {
    let (mut slope, mut curve) = (0.0, square);
    for local in locals {
        slope -= local.lambda.iter().zip(&local.c).map(|(l, c)| l * c).sum::<f64>();
        curve += local.block.compliance * local.lambda[0] * local.lambda[0];
    }
    if curve > 0.0 { (slope / curve).max(0.0) } else { 1.0 }
}

/// Number of plain sweeps at the end: an extrapolated iterate may overshoot far just before it
/// turns back, so a solve that stopped there would be worse than none.
const FINAL_PLAIN_SWEEPS: u32 = 5;
/// Number of sweeps after which `du` is computed anew from `λ`: extrapolation accumulates its
/// rounding errors.
const REBUILD_INTERVAL: u32 = 1000;

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
//! Scalar rows along one direction, such as the limits and the friction of a joint, are one block
//! (`joint_row.rs`).
//!
//! An island that is not finished when its sweeps have cost as much as [`FACTORIZATIONS`] is solved
//! as a whole (`direct/`), and a small one for which that fails from friction pyramids
//! (`pyramids.rs`). Islands whose factorization is too expensive are left to the sweeps, and so are
//! large islands in motion. A solve that ends unfinished is scaled so that it adds no energy
//! ([`optimal_scale`]).

use super::direct::{Plan, SmallIsland, is_wide};
use super::extrapolation::Extrapolation;
use super::folded::Folded;
use super::joint_row::parallel_rows;
use super::linkage::Linkages;
use super::local::{Local, Progress, apply, with_memory, write_back};
use super::pyramids;
use super::reduced::Reduced;
use super::relaxation::Relaxation;
use super::{RIGID, RowSolver, SolveReport, SolverSettings, residual};
use crate::constraint::rows::{RowSet, Rows, dot};
use smallvec::SmallVec;
use std::collections::BTreeMap;

/// Number of sweeps with extrapolation.
const ACCELERATED: u32 = 200;

/// Minimum number of sweeps before an island is solved directly.
const FIRST_SWEEPS: u32 = 25;
/// Sweeps go on until they have cost as much as this number of factorizations.
const FACTORIZATIONS: f64 = 3.0;

/// Numbers of sweeps after which Newton's method is tried on a small island. The first attempt is left out on
/// one of at most [`TINY`] blocks, whose sweeps cost less than a factorization.
const NEWTON: [u32; 2] = [2, 12];
const TINY: usize = 4;
/// The same for an island with a wide object.
const NEWTON_OF_WIDE: [u32; 3] = [4, 30, 80];

/// A few sweeps follow a direct solution that is not finished, in islands of at most this number of
/// blocks.
const FEW: usize = 120;

/// Under a budget an island is solved directly only if it can pay for this number of factorizations:
/// the interior point method gives little before its end.
const AFFORDABLE: f64 = 12.0;

/// An unfinished direct solution that makes rows faster than they were by more than this factor is not taken.
const RUNAWAY: f64 = 10.0;

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
        match Folded::new(rows, blocks, (c, lambda)) {
            Some(folded) => solve_folded(folded, (rows, c), (lambda, du), settings),
            None => solve_island((rows, blocks, c), (lambda, du), settings),
        }
    }

    fn follows_forces(&self) -> bool {
        true
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

/// Solves an island without the soft rows of its objects, then these.
fn solve_folded(
    mut folded: Folded,
    (rows, c): (&Rows, &[f64]),
    (lambda, du): (&mut [f64], &mut [f64]),
    settings: SolverSettings,
) -> SolveReport {
    let mut own = SmallVec::<[f64; 32]>::from_elem(0.0, folded.dof());
    let Folded { rows: rest, blocks, c: free, lambda: start, .. } = &mut folded;
    let outcome = if blocks.is_empty() {
        SolveReport { iterations: 1, converged: true, ray: false, relaxations: 0 }
    } else {
        solve_island((rest, blocks, free), (start, &mut own), settings)
    };
    folded.write((rows, c), (&folded.lambda, &mut own), lambda, du);
    outcome
}

/// Solves an island, in fewer numbers if it can be reduced.
fn solve_island(
    (rows, blocks, c): (&Rows, &[u32], &[f64]),
    (lambda, du): (&mut [f64], &mut [f64]),
    settings: SolverSettings,
) -> SolveReport {
    let linkages = Linkages::new(rows, blocks);
    let reduced = Reduced::new(rows, blocks, (c, lambda), &linkages);
    reduced
        .and_then(|reduced| solve_reduced(reduced, (rows, blocks, c), &linkages, (lambda, du), settings))
        .unwrap_or_else(|| solve_rows((rows, blocks, c), (lambda, du), linkages, settings, false))
}

/// Solves an island as it is.
fn solve_rows(
    (rows, blocks, c): (&Rows, &[u32], &[f64]),
    (lambda, du): (&mut [f64], &mut [f64]),
    mut linkages: Linkages,
    settings: SolverSettings,
    is_reduced: bool,
) -> SolveReport {
    with_memory(|locals| {
        add_blocks(rows, blocks, (c, lambda), &mut linkages, locals);
        let left = apply(locals, &linkages, rows, c, lambda, du);
        if locals.is_empty() {
            let converged = left <= settings.tolerance;
            return SolveReport { iterations: 1, converged, ray: false, relaxations: 0 };
        }
        let extrapolation = Extrapolation::new(locals, &linkages, rows, du);
        Solve { rows, blocks, c, lambda, du, settings, locals, linkages, extrapolation, is_reduced }.run()
    })
}

/// Solves an island that has become smaller. Returns `None` if what is solved there is not solved here, because of
/// rounding; `lambda` is then a start.
fn solve_reduced(
    mut reduced: Reduced,
    (rows, blocks, c): (&Rows, &[u32], &[f64]),
    linkages: &Linkages,
    (lambda, du): (&mut [f64], &mut [f64]),
    settings: SolverSettings,
) -> Option<SolveReport> {
    let mut own = vec![0.0; reduced.rows.dof];
    let Reduced { rows: few, blocks: all, c: free, lambda: start, .. } = &mut reduced;
    let outcome = solve_rows((few, all, free), (start, &mut own), Linkages::default(), settings, true);
    reduced.write(rows, c, linkages, lambda, du);
    let solved = !outcome.converged || residual(rows, blocks, c, lambda, du) <= SOLVED * settings.tolerance;
    if !solved {
        let sides = blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides());
        sides.for_each(|side| du[side.u as usize..(side.u + side.dof) as usize].fill(0.0));
    }
    solved.then_some(outcome)
}

/// An island while it is solved.
struct Solve<'a> {
    rows: &'a Rows,
    blocks: &'a [u32],
    c: &'a [f64],
    lambda: &'a mut [f64],
    du: &'a mut [f64],
    settings: SolverSettings,
    locals: &'a mut Vec<Local>,
    linkages: Linkages,
    extrapolation: Extrapolation,
    /// Whether it is the smaller problem of an island with equality rows.
    is_reduced: bool,
}

impl Solve<'_> {
    fn run(mut self) -> SolveReport {
        let count = self.locals.len();
        let sweeps = self.settings.max_sweeps_for(count);
        let mut outcome = SolveReport { iterations: sweeps, converged: false, ray: false, relaxations: 0 };
        let affordable = self.settings.budget.map(|budget| f64::from(budget) / count.max(1) as f64);
        let mut relaxation = Relaxation::new(ACCELERATED);
        let (mut small, mut plan, mut due, mut direct) = (None, None, 0, false);
        // of Newton's method, in relaxations
        let mut work = 0;
        let wide = is_wide(self.rows, self.blocks);
        let attempts = if wide { &NEWTON_OF_WIDE[..] } else { &NEWTON[usize::from(count <= TINY)..] };
        for sweep in 1..=sweeps {
            let progress = self.sweep(relaxation.factor);
            let first = sweep == FIRST_SWEEPS.min(sweeps);
            if progress.change <= self.settings.tolerance || first && self.is_solved(progress.change) {
                (outcome.iterations, outcome.converged) = (sweep, true);
                break;
            }
            relaxation.record(sweep, progress.change);
            if attempts.contains(&sweep) && self.may_try_newton(wide) {
                small = small.or_else(|| SmallIsland::new(self.rows, self.blocks, self.c));
                if let Some(island) = &mut small {
                    let tried = self.newton(island, sweep == NEWTON[1] && !wide);
                    work += tried.relaxations;
                    if tried.converged {
                        outcome = SolveReport { iterations: sweep + tried.iterations, ..tried };
                        outcome.relaxations = sweep * count as u32;
                        direct = true;
                        break;
                    }
                }
            }
            if first {
                plan = Plan::new(self.rows, self.blocks, self.c, sweeps < FIRST_SWEEPS);
                due = plan.as_ref().map_or(u32::MAX, |plan| (FACTORIZATIONS * plan.cost()) as u32).max(sweep);
                if let Some(affordable) = affordable {
                    let spare = |plan: &Plan| affordable - AFFORDABLE * plan.cost();
                    plan = plan.filter(|plan| spare(plan) >= f64::from(sweep));
                    due = plan.as_ref().map_or(u32::MAX, |plan| due.min(spare(plan) as u32));
                }
            }
            if let Some(plan) = plan.take_if(|_| sweep == due.min(sweeps)) {
                self.rebuild();
                let (cost, swept) = (plan.cost(), self.lambda.to_vec());
                let most = affordable.map_or(u32::MAX, |affordable| ((affordable - f64::from(sweep)) / cost) as u32);
                outcome = self.solve_whole(plan, most);
                outcome.relaxations = (f64::from(outcome.iterations) * cost * count as f64) as u32;
                self.finish_rows(&mut outcome);
                self.finish_by_pivoting(&mut outcome);
                self.refuse_runaway(&outcome, &swept);
                outcome.iterations += sweep;
                outcome.relaxations += sweep * count as u32;
                direct = true;
                break;
            }
            if sweep < sweeps {
                let plain = sweep > ACCELERATED || sweep + FINAL_PLAIN_SWEEPS >= sweeps;
                self.extrapolation.extrapolate(progress.against > 0.0 || plain, self.du);
            }
            if sweep % REBUILD_INTERVAL == 0 {
                self.rebuild();
            }
        }
        if !direct {
            outcome.relaxations = outcome.iterations * count as u32;
        }
        outcome.relaxations += work;
        write_back(self.locals, self.lambda);
        if !outcome.converged && !direct && self.linkages.is_empty() {
            self.limit_energy();
        }
        if !self.linkages.is_empty() {
            self.extrapolation.clear(self.du);
            let left = apply(self.locals, &self.linkages, self.rows, self.c, self.lambda, self.du);
            outcome.converged &= direct || left <= self.settings.tolerance;
        }
        outcome
    }

    /// Returns whether Newton's method may be tried: on small islands with a robot, whose contacts are seldom
    /// redundant. Of redundant multipliers it finds the nearest, and the interior point method those that share the
    /// load evenly.
    fn may_try_newton(&self, wide: bool) -> bool {
        let of_robot = |local: &Local| local.block(self.rows).sides().iter().any(|side| side.dof > RIGID);
        (wide || self.locals.len() <= FEW)
            && self.settings.budget.is_none()
            && self.linkages.is_empty()
            && (self.is_reduced || self.locals.iter().any(of_robot))
    }

    /// Tries Newton's method on a small island.
    fn newton(&mut self, island: &mut SmallIsland, thorough: bool) -> SolveReport {
        self.rebuild();
        let solved = island.solve(self.lambda, self.settings.tolerance, thorough);
        self.read();
        let relaxations = (f64::from(solved.factorizations) * island.cost() * self.locals.len() as f64) as u32;
        SolveReport { iterations: solved.factorizations, converged: solved.converged, ray: false, relaxations }
    }

    /// Relaxes every block once.
    fn sweep(&mut self, factor: f64) -> Progress {
        let mut progress = Progress::default();
        for local in self.locals.iter_mut() {
            local.relax(self.extrapolation.beta, factor, self.rows, &self.linkages, self.du, &mut progress);
        }
        progress
    }

    /// Returns whether a large island, whose last sweep changed row velocities by at most `change`, is
    /// solved well enough.
    fn is_solved(&mut self, change: f64) -> bool {
        if self.locals.len() <= LARGE || change > NEARLY_SOLVED * self.settings.tolerance {
            return false;
        }
        write_back(self.locals, self.lambda);
        self.residual() <= SOLVED * self.settings.tolerance
    }

    fn residual(&self) -> f64 {
        residual(self.rows, self.blocks, self.c, self.lambda, self.du)
    }

    /// Computes `du` anew from the multipliers.
    fn rebuild(&mut self) {
        self.extrapolation.rebuild(self.locals, &self.linkages, self.rows, self.c, self.lambda, self.du);
    }

    /// Reads the multipliers from `lambda`.
    fn read(&mut self) {
        self.locals.iter_mut().for_each(|local| local.read(self.lambda));
        self.rebuild();
    }

    /// Solves the island directly, by at most `most` factorizations: the iterations of the report.
    fn solve_whole(&mut self, plan: Plan, most: u32) -> SolveReport {
        let solved = plan.solve(self.lambda, self.settings.tolerance, most);
        self.read();
        SolveReport { iterations: solved.factorizations, converged: solved.converged, ray: false, relaxations: 0 }
    }

    /// Sweeps a few times over a small island whose direct solution is not finished: sweeps find the
    /// shares of parallel rows at once, which factorizations only approach.
    fn finish_rows(&mut self, outcome: &mut SolveReport) {
        if outcome.converged || self.locals.len() > FEW || self.settings.budget.is_some() {
            return;
        }
        let (error, found) = (self.residual(), self.lambda.to_vec());
        for _ in 0..FIRST_SWEEPS {
            outcome.iterations += 1;
            outcome.relaxations += self.locals.len() as u32;
            if self.sweep(1.0).change <= self.settings.tolerance {
                outcome.converged = true;
                return;
            }
        }
        write_back(self.locals, self.lambda);
        if self.residual() > error {
            self.lambda.copy_from_slice(&found);
            self.read();
        }
    }

    /// Solves a small island that is still not finished from solutions on friction pyramids, then by Newton's method alone.
    fn finish_by_pivoting(&mut self, outcome: &mut SolveReport) {
        let allowed = self.settings.budget.is_none() && self.linkages.is_empty() && !is_wide(self.rows, self.blocks);
        if outcome.converged || !allowed {
            return;
        }
        let Some(mut island) = SmallIsland::new(self.rows, self.blocks, self.c) else { return };
        write_back(self.locals, self.lambda);
        let (problem, tolerance) = ((self.rows, self.blocks, self.c), self.settings.tolerance);
        let mut solved = pyramids::solve(problem, &mut island, self.lambda, tolerance);
        if !solved.converged {
            let taken = solved.factorizations;
            solved = island.solve(self.lambda, tolerance, true);
            solved.factorizations += taken;
        }
        self.read();
        outcome.converged = solved.converged;
        outcome.iterations += solved.factorizations;
        outcome.relaxations += (f64::from(solved.factorizations) * island.cost() * self.locals.len() as f64) as u32;
    }

    /// Takes the multipliers of the sweeps back if direct solution ended unfinished with velocities far above those of the problem: what
    /// is jammed between bodies that nothing stops has no solution, and the attempts get multipliers of any size.
    fn refuse_runaway(&mut self, outcome: &SolveReport, swept: &[f64]) {
        if outcome.converged {
            return;
        }
        let (mut before, mut after) = (0.0, 0.0);
        for block in self.blocks.iter().map(|&b| &self.rows.blocks[b as usize]) {
            for (k, row) in block.range().enumerate() {
                before = self.c[row].abs().max(before);
                after = (self.c[row] + self.rows.row_velocity(block, k, self.du)).abs().max(after);
            }
        }
        if after <= RUNAWAY * before {
            return;
        }
        self.lambda.copy_from_slice(swept);
        self.read();
    }

    /// Scales the multipliers so that they add no energy.
    fn limit_energy(&mut self) {
        let share = optimal_scale(self.rows, self.blocks, self.c, self.lambda, self.extrapolation.square(self.du));
        if share < 1.0 {
            self.locals.iter_mut().for_each(|local| local.scale(share));
            self.extrapolation.clear(self.du);
            apply(self.locals, &self.linkages, self.rows, self.c, self.lambda, self.du);
        }
    }
}

/// Adds the blocks of an island to `locals`: parallel scalar rows as one, equality rows of the linkages
/// not at all.
fn add_blocks(
    rows: &Rows,
    blocks: &[u32],
    (c, lambda): (&[f64], &[f64]),
    linkages: &mut Linkages,
    locals: &mut Vec<Local>,
) {
    locals.reserve(blocks.len());
    if blocks.iter().all(|&block| matches!(rows.blocks[block as usize].set, RowSet::Cone { .. })) {
        return locals.extend(blocks.iter().map(|&block| Local::new(rows, linkages, block, c, lambda)));
    }
    let groups = parallel_rows(rows, blocks, |block| !linkages.contains_row(rows, block));
    let members = groups.iter().enumerate().flat_map(|(i, group)| group.iter().map(move |(b, _)| (*b, i)));
    let group_of: BTreeMap<u32, usize> = members.collect();
    for &block in blocks {
        match group_of.get(&block).map(|i| &groups[*i]) {
            Some(group) if group[0].0 != block => {}
            Some(group) => match Local::joint(rows, linkages, group, c, lambda) {
                Some(local) => locals.push(local),
                None => locals.extend(group.iter().map(|(b, _)| Local::new(rows, linkages, *b, c, lambda))),
            },
            None if linkages.contains_row(rows, &rows.blocks[block as usize]) => {}
            None => locals.push(Local::new(rows, linkages, block, c, lambda)),
        }
    }
}

/// Returns the factor of the multipliers at which `½λᵀ(K + R)λ + cᵀλ` is least. A solution has `λᵀw ≤
/// 0` and so a factor of at least 1. A smaller factor means that the iterate overshoots and may add
/// energy; multipliers that are scaled by it add none.
///
/// `square` is `λᵀKλ`, the square of `Yλ`.
fn optimal_scale(rows: &Rows, blocks: &[u32], c: &[f64], lambda: &[f64], square: f64) -> f64 {
    let (mut slope, mut curve) = (0.0, square);
    for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
        slope -= dot(&lambda[block.range()], &c[block.range()]);
        let first = lambda[block.row as usize];
        curve += block.compliance * first * first;
    }
    if curve > 0.0 { (slope / curve).max(0.0) } else { 1.0 }
}

/// Number of plain sweeps at the end: an extrapolated iterate may overshoot far just before it
/// turns back, so a solve that stopped there would be worse than none.
const FINAL_PLAIN_SWEEPS: u32 = 5;
/// Number of sweeps after which `du` is computed anew from `λ`: extrapolation accumulates its
/// rounding errors.
const REBUILD_INTERVAL: u32 = 1000;

//! Impacts: changes of velocity at the time at which surfaces meet.
//!
//! Generalized reflections (Smith et al., *Reflections on simultaneous impact*, 2012): reflect the
//! set of contacts that approach **now**, and repeat until none does. This propagates a shock along
//! Newton's cradle, which one simultaneous solve does not.
//!
//! ```text
//! repeat   A = { i : c_i < 0 },  c = Yᵀu + bias
//!          find λ on A with  w_n = (1 + e_i)·c_n + Kλ ≥ 0 ⟂ λ_n ≥ 0,  friction on w_t = c_t + Kλ      (Newton's law on A)
//!          u += Yλ
//! ```
//!
//! A contact slower than its rest speed has `e = 0`, as has one whose bounces have left less than a
//! hundredth of its approach speed. A pass leaves out islands in which only such contacts approach.
//! When no others are left, or after the cap, all candidates are solved at once with `e = 0`, which
//! ends the phase; `time_stepping` leaves that to its solve of all contacts. With equal `e` on `A`
//! and no friction the energy of a pass cannot grow. With friction or unequal `e` Newton's law can
//! create energy, so a pass that does is blended with its `e = 0` solution as far as the energy
//! requires. A half-line of a constraint takes part if its gap is within the contact tolerance,
//! always with `e = 0`.

use super::budget::shared;
use super::contacts::{Workspace, row_velocities, zero};
use super::islands::each_island;
use super::solves::Solves;
use crate::constraint::rows::{Block, RowSet, Rows};
use crate::object::RowTarget;
use crate::solver::{RowSolver, SolveReport, SolverSettings, largest_residual};
use crate::world::Core;

/// A contact in the impact phase.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Whether the contact may take part.
    pub takes_part: bool,
    /// Whether its surfaces meet at the time of the impacts and do not part again: its restitution is 0.
    pub stops: bool,
    /// Approach speed up to which it rests instead of bouncing, m/s.
    pub rest_speed: f64,
    /// Coefficient of restitution of the pair.
    pub restitution: f64,
    /// Whether it belongs to a large group of touching bodies, which rebounds at the end of the step.
    pub crowd: bool,
}

/// The part of a contact in one pass.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Part {
    /// Whether the contact is in the pass.
    pub member: bool,
    /// Separation speed after the pass, m/s, at least.
    pub rebound: f64,
    /// Ratio of the sliding velocity after the pass to the reverse of that before.
    pub reversal: f64,
    /// Energy that the contact took from the bodies before, J. A pass may give it back.
    pub energy: f64,
}

/// Error of an impact relative to the fastest row velocity: of elastic ones, which keep energy to about this fraction, and of others.
const PRECISION: (f64, f64) = (1e-13, 1e-9);
/// Contacts of a larger restitution are elastic.
pub(crate) const ELASTIC: f64 = 0.99;
/// A contact rests after bounces that have left less than this fraction of its approach speed.
const FAINT: f64 = 0.01;
/// Minimum number of sweeps of a pass under a budget.
const FEW_SWEEPS: usize = 4;
/// A slower approach does not count, m/s.
const APPROACH: f64 = 1e-9;
/// A slower impact never bounces, m/s: bodies wedged between others would chatter forever.
pub(crate) const SLOWEST_BOUNCE: f64 = 1e-4;

/// Resolves impacts at whitened velocity `u` and adds the multipliers to `total`. With `finish` the
/// last pass stops every contact that still approaches; without it a solve of all contacts follows.
/// The phase ends early if its `budget` is spent.
pub(crate) fn resolve(
    core: &mut Core,
    work: &mut Workspace,
    candidates: &[Candidate],
    (cap, finish, budget): (u32, bool, Option<u32>),
    u: &mut [f64],
    total: &mut [f64],
) {
    let reach = core.settings.contact_tolerance;
    let mut c = Vec::new();
    let mut left = vec![1.0; candidates.len()];
    let end = budget.map(|budget| core.meter.done() + u64::from(budget));
    for pass in 0..=cap {
        row_velocities(&core.threads, &work.rows, &work.bias, u, &mut c);
        aim_constraints(work, &mut c);
        let approach = |i: usize| candidates[i].takes_part && c[work.rows.blocks[i].row as usize] < -APPROACH;
        let bounces = |i: usize| {
            approach(i)
                && candidates[i].restitution > 0.0
                && left[i] > FAINT
                && -c[work.rows.blocks[i].row as usize] > candidates[i].rest_speed
        };
        let limits = work.rows.blocks[candidates.len()..].iter().zip(&work.targets);
        let at_limit = |(block, t): (&Block, &RowTarget)| at_stop(t, reach) && c[block.row as usize] < -APPROACH;
        if !(0..candidates.len()).any(approach) && !limits.clone().any(at_limit) {
            return;
        }
        let budget = end.map(|end| end.saturating_sub(core.meter.done()) as u32);
        let approaching = (0..candidates.len()).filter(|&i| approach(i)).count();
        let spent = budget.is_some_and(|budget| !pays(budget, approaching + work.targets.len()));
        let last = pass == cap || spent || !(0..candidates.len()).any(bounces);
        if last && !finish {
            return;
        }
        core.report.impact_passes += 1;
        let elastic = !last && (0..candidates.len()).any(|i| bounces(i) && candidates[i].restitution > ELASTIC);
        let part = |i: usize| {
            let restitution = if !last && bounces(i) { candidates[i].restitution } else { 0.0 };
            let approach_speed = -c[work.rows.blocks[i].row as usize];
            Part {
                member: if last { candidates[i].takes_part } else { approach(i) },
                rebound: restitution * approach_speed,
                reversal: if restitution > 0.0 { work.contact_constraints[i].reversal() } else { 0.0 },
                energy: 0.0,
            }
        };
        let parts: Vec<Part> = (0..candidates.len()).map(part).collect();
        for (left, (candidate, part)) in left.iter_mut().zip(candidates.iter().zip(&parts)) {
            *left *= if part.rebound > 0.0 { candidate.restitution } else { 1.0 };
        }
        reflect(core, work, &c, &parts, (elastic, budget));
        u.iter_mut().zip(&work.du).for_each(|(u, du)| *u += du);
        total.iter_mut().zip(&work.lambda).for_each(|(t, l)| *t += l);
        if last {
            return;
        }
    }
}

/// Resolves the rebound of contacts whose approach the solve of all contacts has stopped: velocity
/// `u`, impulses of that solve in `work.lambda`. Writes the multipliers to `work.lambda` and their
/// effect to `work.du`. Returns false, and does nothing, if the budget does not pay for it.
pub(crate) fn rebound(core: &mut Core, work: &mut Workspace, parts: &[Part], u: &[f64], budget: Option<u32>) -> bool {
    let blocks = parts.iter().filter(|part| part.member).count() + work.targets.len();
    if budget.is_some_and(|budget| !pays(budget, blocks)) {
        return false;
    }
    let mut c = Vec::new();
    row_velocities(&core.threads, &work.rows, &work.bias, u, &mut c);
    aim_constraints(work, &mut c);
    core.report.impact_passes += 1;
    reflect(core, work, &c, parts, (false, budget));
    true
}

/// Returns whether a budget pays for a pass of some blocks: a few sweeps of the pass and of the
/// plastic solution for the energy guard.
fn pays(budget: u32, blocks: usize) -> bool {
    budget as usize >= 2 * FEW_SWEEPS * blocks
}

/// Returns whether a row is a rigid limit within `reach` of its stop. Springs exert no impulse.
fn at_stop(t: &RowTarget, reach: f64) -> bool {
    t.set == RowSet::HalfLine && t.error <= reach && t.compliance == 0.0
}

/// Subtracts the target velocities of the constraints' rows; an inertia keeps the velocity that it has.
fn aim_constraints(work: &Workspace, c: &mut [f64]) {
    for (block, target) in work.rows.blocks[work.contact_constraints.len()..].iter().zip(&work.targets) {
        let c = &mut c[block.row as usize];
        *c = if target.inertial { 0.0 } else { *c - target.velocity };
    }
}

/// Solves one pass: the multipliers are in `work.lambda`, their effect in `work.du`.
fn reflect(core: &mut Core, work: &mut Workspace, c: &[f64], parts: &[Part], (elastic, budget): (bool, Option<u32>)) {
    let contact_constraints = work.contact_constraints.len();
    let (targets, reach, set) = (&work.targets, core.settings.contact_tolerance, core.settings.solver_settings);
    let fastest = c.iter().fold(0.0, |f: f64, c| f.max(c.abs()));
    let solver_settings = SolverSettings {
        max_sweeps: set.max_sweeps.max(1000),
        max_relaxations: set.max_relaxations.max(100_000),
        tolerance: fastest * if elastic { PRECISION.0 } else { PRECISION.1 },
        budget: None,
    };
    work.islands.build(&work.rows, |b| {
        let holds = |t: &RowTarget| t.set == RowSet::Equality && (t.compliance == 0.0 || t.inertial);
        let takes_part = |t: &RowTarget| holds(t) || at_stop(t, reach);
        if b < contact_constraints { parts[b].member } else { takes_part(&targets[b - contact_constraints]) }
    });
    work.c.copy_from_slice(c);
    for (block, part) in work.rows.blocks.iter().zip(parts) {
        work.c[block.row as usize] -= part.rebound;
        if part.reversal > 0.0 {
            block.range().skip(1).for_each(|row| work.c[row] *= 1.0 + part.reversal);
        }
    }
    work.lambda.fill(0.0);
    zero(&mut work.du, core.dof);
    let plastic = parts.iter().all(|part| part.rebound <= 0.0);
    let Workspace { rows, islands, bias, targets, lambda, du, c: aimed, .. } = &mut *work;
    let (rows, bias, aimed, solver) = (&*rows, &*bias, &*aimed, core.solver.as_ref());
    let all: usize = islands.iter().map(<[u32]>::len).sum();
    let solve = |blocks: &[u32], lambda: &mut [f64], du: &mut [f64]| {
        let of_island = || blocks.iter().filter_map(|&b| parts.get(b as usize));
        let rebounds = of_island().any(|part| part.rebound > 0.0);
        if !plastic && !rebounds {
            return None; // the solve that ends the phase stops these contacts
        }
        // half of it for the energy guard
        let solver_settings = shared(solver_settings, budget.map(|budget| budget / 2), blocks.len(), all);
        let outcome = solver.solve(rows, blocks, aimed, lambda, du, solver_settings);
        core.meter.count(outcome.relaxations);
        let left = largest_residual(rows, blocks, aimed, lambda, du);
        // kinematic bodies and motors may add energy
        let kinematic = |&b: &u32| {
            let target = (b as usize).checked_sub(contact_constraints).map_or(0.0, |i| targets[i].velocity);
            target != 0.0 || rows.blocks[b as usize].range().any(|row| bias[row] != 0.0)
        };
        let guard = rebounds && !blocks.iter().any(kinematic);
        let scale: f64 = rows_of(rows, blocks).map(|i| (lambda[i] * c[i]).abs()).sum();
        let energy: f64 = of_island().map(|part| part.energy).sum();
        if guard && work_done(rows, blocks, c, lambda, du) > energy + 1e-12 * scale {
            let outcome = blend(solver, (rows, blocks, c), energy, lambda, du, solver_settings);
            core.meter.count(outcome.relaxations);
        }
        Some((outcome, left))
    };
    let mut solves = Solves::new(&mut core.report, solver, solver_settings.tolerance);
    each_island(&core.threads, rows, islands.iter(), (lambda, du), solve, |solved| solves.add(solved));
    solves.finish(core.table.with(&core.state.objects), rows, islands);
}

fn rows_of<'a>(rows: &'a Rows, blocks: &'a [u32]) -> impl Iterator<Item = usize> + 'a {
    blocks.iter().flat_map(|&b| rows.blocks[b as usize].range())
}

/// Returns the kinetic energy that the multipliers add, J: `λᵀc + ½λᵀKλ = ½ Σ λ·(c + w)`. What rows of inertias take from
/// the bodies they have themselves, so they are left out.
fn work_done(rows: &Rows, blocks: &[u32], c: &[f64], lambda: &[f64], du: &[f64]) -> f64 {
    let inertial = |b: u32| rows.blocks[b as usize].compliance > 0.0;
    let pairs = blocks.iter().filter(|b| !inertial(**b)).flat_map(|&b| {
        let block = &rows.blocks[b as usize];
        block.range().enumerate().map(move |(k, row)| lambda[row] * (c[row] + 0.5 * rows.row_velocity(block, k, du)))
    });
    pairs.sum()
}

/// Blends the plastic solution (`e = 0`, which never adds energy) with the bouncing one, as far
/// towards the latter as the energy that is added does not exceed `energy`, J.
///
/// Returns the report of the plastic solve. With `δ = λ_e − λ_0` the energy is `W(s) = W_0 + s·B + s²·A`, `B = δᵀ(c + Kλ_0)`, `A = W_e − W_0
/// − B`; `s` is the positive root of `W(s) = energy`.
fn blend(
    solver: &dyn RowSolver,
    (rows, blocks, c): (&Rows, &[u32], &[f64]),
    energy: f64,
    lambda: &mut [f64],
    du: &mut [f64],
    solver_settings: SolverSettings,
) -> SolveReport {
    let energy_bounce = work_done(rows, blocks, c, lambda, du);
    let bounce: Vec<f64> = rows_of(rows, blocks).map(|i| lambda[i]).collect();
    rows_of(rows, blocks).for_each(|i| lambda[i] = 0.0);
    for side in blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides()) {
        du[side.u as usize..(side.u + side.dof) as usize].fill(0.0);
    }
    let outcome = solver.solve(rows, blocks, c, lambda, du, solver_settings);
    let energy_plastic = work_done(rows, blocks, c, lambda, du).min(energy);
    let plastic_velocity = blocks.iter().flat_map(|&b| {
        let block = &rows.blocks[b as usize];
        let du = &*du;
        block.range().enumerate().map(move |(k, row)| c[row] + rows.row_velocity(block, k, du))
    });
    let delta: Vec<f64> = rows_of(rows, blocks).zip(&bounce).map(|(i, b)| b - lambda[i]).collect();
    let slope: f64 = delta.iter().zip(plastic_velocity).map(|(d, w)| d * w).sum();
    let curve = energy_bounce - energy_plastic - slope;
    let excess = energy_plastic - energy;
    let root = (-slope + (slope * slope - 4.0 * curve * excess).max(0.0).sqrt()) / (2.0 * curve);
    let s = if root.is_finite() { root.clamp(0.0, 1.0) } else { 0.0 };
    let mut step = vec![0.0; lambda.len()];
    for (i, d) in rows_of(rows, blocks).zip(&delta) {
        step[i] = s * d;
        lambda[i] += s * d;
    }
    blocks.iter().for_each(|&b| rows.apply_block(&rows.blocks[b as usize], &step, du));
    outcome
}

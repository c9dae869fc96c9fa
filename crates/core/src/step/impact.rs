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
//! A contact slower than its rest speed has `e = 0`. When only such contacts approach, or after the
//! cap, all candidates are solved at once with `e = 0`, which ends the phase. With equal `e` on `A`
//! and no friction the energy of a pass cannot grow; with friction or unequal `e` Newton's law can
//! create energy, so a pass that does is blended with its `e = 0` solution as far as the energy
//! requires. A half-line of a constraint takes part if its gap is within the contact tolerance,
//! always with `e = 0`.

use super::contacts::{Workspace, row_velocities, zero};
use crate::constraint::rows::{Block, RowSet, Rows};
use crate::object::RowTarget;
use crate::solver::{RowSolver, SolverSettings, residual};
use crate::world::Core;

/// A contact in the impact phase.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Whether the contact may take part.
    pub takes_part: bool,
    /// Approach speed up to which it rests instead of bouncing, m/s.
    pub rest_speed: f64,
    /// Coefficient of restitution of the pair.
    pub restitution: f64,
}

/// Impacts are solved to this fraction of the fastest row velocity, so a reflection keeps energy to
/// about this fraction.
const PRECISION: f64 = 1e-13;
/// A slower approach does not count, m/s.
const APPROACH: f64 = 1e-9;
/// A slower impact never bounces, m/s: bodies wedged between others would chatter forever.
pub(crate) const SLOWEST_BOUNCE: f64 = 1e-4;

/// Resolves impacts at whitened velocity `u` and adds the multipliers to `total`.
pub(crate) fn resolve(
    core: &mut Core,
    work: &mut Workspace,
    candidates: &[Candidate],
    cap: u32,
    u: &mut [f64],
    total: &mut [f64],
) {
    let (set, reach) = (core.settings.solver_settings, core.settings.contact_tolerance);
    let mut c = Vec::new();
    for pass in 0..=cap {
        row_velocities(&work.rows, &work.bias, u, &mut c);
        aim_constraints(work, &mut c);
        let approach = |i: usize| candidates[i].takes_part && c[work.rows.blocks[i].row as usize] < -APPROACH;
        let bounces = |i: usize| {
            approach(i)
                && candidates[i].restitution > 0.0
                && -c[work.rows.blocks[i].row as usize] > candidates[i].rest_speed
        };
        let limits = work.rows.blocks[candidates.len()..].iter().zip(&work.targets);
        let at_limit = |(block, t): (&Block, &RowTarget)| at_stop(t, reach) && c[block.row as usize] < -APPROACH;
        if !(0..candidates.len()).any(approach) && !limits.clone().any(at_limit) {
            return;
        }
        core.report.impact_passes += 1;
        let fastest = c.iter().fold(0.0, |f: f64, c| f.max(c.abs()));
        let solver_settings = SolverSettings {
            max_sweeps: set.max_sweeps.max(1000),
            max_relaxations: set.max_relaxations.max(100_000),
            tolerance: PRECISION * fastest,
        };
        let last = pass == cap || !(0..candidates.len()).any(bounces);
        let member: Vec<bool> =
            (0..candidates.len()).map(|i| if last { candidates[i].takes_part } else { approach(i) }).collect();
        let bounce: Vec<f64> =
            (0..candidates.len()).map(|i| if !last && bounces(i) { candidates[i].restitution } else { 0.0 }).collect();
        reflect(core, work, &c, &member, &bounce, solver_settings);
        u.iter_mut().zip(&work.du).for_each(|(u, du)| *u += du);
        total.iter_mut().zip(&work.lambda).for_each(|(t, l)| *t += l);
        if last {
            return;
        }
    }
}

/// Returns whether a row is a rigid limit within `reach` of its stop. Springs exert no impulse.
fn at_stop(t: &RowTarget, reach: f64) -> bool {
    t.set == RowSet::HalfLine && t.error <= reach && t.compliance == 0.0
}

/// Subtracts the target velocities of the constraints' rows.
fn aim_constraints(work: &Workspace, c: &mut [f64]) {
    for (block, target) in work.rows.blocks[work.contact_constraints.len()..].iter().zip(&work.targets) {
        c[block.row as usize] -= target.velocity;
    }
}

/// Solves one pass: the multipliers are in `work.lambda`, their effect in `work.du`.
fn reflect(
    core: &mut Core,
    work: &mut Workspace,
    c: &[f64],
    member: &[bool],
    bounce: &[f64],
    solver_settings: SolverSettings,
) {
    let contact_constraints = work.contact_constraints.len();
    let (targets, reach) = (&work.targets, core.settings.contact_tolerance);
    work.islands.build(&work.rows, |b| {
        let takes_part = |t: &RowTarget| (t.set == RowSet::Equality && t.compliance == 0.0) || at_stop(t, reach);
        if b < contact_constraints { member[b] } else { takes_part(&targets[b - contact_constraints]) }
    });
    work.c.copy_from_slice(c);
    for (block, bounce) in work.rows.blocks.iter().zip(bounce) {
        work.c[block.row as usize] *= 1.0 + bounce;
    }
    work.lambda.fill(0.0);
    zero(&mut work.du, core.dof);
    for blocks in work.islands.iter() {
        let outcome = core.solver.solve(&work.rows, blocks, &work.c, &mut work.lambda, &mut work.du, solver_settings);
        core.report.solved(outcome, residual(&work.rows, blocks, &work.c, &work.lambda, &work.du));
        let bounces = blocks.iter().any(|&b| bounce.get(b as usize).is_some_and(|e| *e > 0.0));
        // kinematic bodies and motors may add energy
        let kinematic = |&b: &u32| {
            let target = (b as usize).checked_sub(contact_constraints).map_or(0.0, |i| targets[i].velocity);
            target != 0.0 || work.rows.blocks[b as usize].range().any(|row| work.bias[row] != 0.0)
        };
        let guard = !blocks.iter().any(kinematic);
        let scale: f64 = rows_of(&work.rows, blocks).map(|i| (work.lambda[i] * c[i]).abs()).sum();
        if guard && bounces && work_done(&work.rows, blocks, c, &work.lambda, &work.du) > 1e-12 * scale {
            blend(core.solver.as_ref(), &work.rows, blocks, c, &mut work.lambda, &mut work.du, solver_settings);
        }
    }
}

fn rows_of<'a>(rows: &'a Rows, blocks: &'a [u32]) -> impl Iterator<Item = usize> + 'a {
    blocks.iter().flat_map(|&b| rows.blocks[b as usize].range())
}

/// Returns the kinetic energy that the multipliers add, J: `λᵀc + ½λᵀKλ = ½ Σ λ·(c + w)`.
fn work_done(rows: &Rows, blocks: &[u32], c: &[f64], lambda: &[f64], du: &[f64]) -> f64 {
    let pairs = blocks.iter().flat_map(|&b| {
        let block = &rows.blocks[b as usize];
        block.range().enumerate().map(move |(k, row)| lambda[row] * (c[row] + 0.5 * rows.row_velocity(block, k, du)))
    });
    pairs.sum()
}

/// Blends the plastic solution (`e = 0`, which never adds energy) with the bouncing one, as far
/// towards the latter as no energy is created.
///
/// With `δ = λ_e − λ_0` the energy is `W(s) = W_0 + s·B + s²·A`, `B = δᵀ(c + Kλ_0)`, `A = W_e − W_0
/// − B`; `s` is its positive root.
fn blend(
    solver: &dyn RowSolver,
    rows: &Rows,
    blocks: &[u32],
    c: &[f64],
    lambda: &mut [f64],
    du: &mut [f64],
    solver_settings: SolverSettings,
) {
    let energy_bounce = work_done(rows, blocks, c, lambda, du);
    let bounce: Vec<f64> = rows_of(rows, blocks).map(|i| lambda[i]).collect();
    rows_of(rows, blocks).for_each(|i| lambda[i] = 0.0);
    for side in blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides()) {
        du[side.u as usize..(side.u + side.dof) as usize].fill(0.0);
    }
    solver.solve(rows, blocks, c, lambda, du, solver_settings);
    let energy_plastic = work_done(rows, blocks, c, lambda, du).min(0.0);
    let plastic_velocity = blocks.iter().flat_map(|&b| {
        let block = &rows.blocks[b as usize];
        let du = &*du;
        block.range().enumerate().map(move |(k, row)| c[row] + rows.row_velocity(block, k, du))
    });
    let delta: Vec<f64> = rows_of(rows, blocks).zip(&bounce).map(|(i, b)| b - lambda[i]).collect();
    let slope: f64 = delta.iter().zip(plastic_velocity).map(|(d, w)| d * w).sum();
    let curve = energy_bounce - energy_plastic - slope;
    let root = (-slope + (slope * slope - 4.0 * curve * energy_plastic).max(0.0).sqrt()) / (2.0 * curve);
    let s = if root.is_finite() { root.clamp(0.0, 1.0) } else { 0.0 };
    let mut step = vec![0.0; lambda.len()];
    for (i, d) in rows_of(rows, blocks).zip(&delta) {
        step[i] = s * d;
        lambda[i] += s * d;
    }
    blocks.iter().for_each(|&b| rows.apply_block(&rows.blocks[b as usize], &step, du));
}

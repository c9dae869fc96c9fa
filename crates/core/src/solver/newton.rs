//! Newton's method for the error that sweeps leave: all blocks of an island at once.
//!
//! A contact among others that carry the same body is nearly redundant, and sweeps move load
//! between such contacts in small fractions (a pin on its base needs hundreds). The conditions of
//! all blocks are smooth except for the choice of open, stick or slide. With the choice that the
//! multipliers imply, one linear solve reaches the point at which all conditions hold (semismooth
//! Newton; Alart and Curnier, *A mixed formulation for frictional contact problems prone to Newton
//! like solution methods*, 1991). Sweeps between the Newton steps make the choice anew.
//!
//! For each block, with `w = c + Yᵀ(Yλ) + Rλ` and the trial `σ = λ − w/k`, normal `σ_n` and
//! tangential `σ_t`:
//!
//! ```text
//! open      σ_n ≤ 0           δλ = −λ
//! stick     |σ_t| ≤ μ σ_n     δλ = −(w + δw)/ε
//! slide     else              δλ_n = −(w_n + δw_n)/ε,   δλ·t = μ δλ_n + r·t,   δλ·s = (r·s − κρ δw·s)/(1 − κ + ερ)
//!           t = σ_t/|σ_t|,  s across it,  κ = μλ_n/|σ_t|,  ρ = 1/k_t,  r = μλ_n t − λ_t
//! scalar    σ within bounds   δλ = −(w + δw)/(ε + R);   else to the bound
//! ```
//!
//! `ε` selects one solution for redundant multipliers: the nearest to the present ones. It is a
//! proximal step, repeated until nothing changes. With `δλ = a − G·Yᵀδu` for each block, `δu = Σ
//! Y·δλ` is one system with as many unknowns as the island has degrees of freedom:
//!
//! ```text
//! (1 + Σ Y G Yᵀ) δu = Σ Y a
//! ```
//!
//! A step goes far along redundant directions if contacts conflict. Examples: one of two
//! neighboring contacts has to carry all load; two sticking contacts on one body demand
//! accelerations that no rigid body has, so one must slide. The conditions then have no common
//! solution and the step overshoots. After a failed step a *damped* step follows. It ends when the
//! first multiplier reaches its bound: `λ + α δλ` with the largest `α ≤ 1` at which no normal
//! changes sign and no sticking contact leaves its cone. With that multiplier at its bound the
//! conditions of the next step differ.

use super::extrapolation::Extrapolation;
use super::local::{BlockSolver, Local};
use super::one_contact::ContactBlock;
use crate::constraint::rows::Rows;
use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// `ε` as a fraction of the mean diagonal of `K`.
const PROXIMAL: f64 = 1e-7;
/// Maximum number of degrees of freedom of an island; larger ones are left to sweeps.
const MAX_DOFS: usize = 120;
/// Number of sweeps before the first step, in addition to half the number of degrees of freedom.
const FIRST_WAIT: u32 = 10;
/// Number of sweeps after a step before it is judged.
const TRIAL_SWEEPS: u32 = 3;
/// Number of sweeps after a damped step before it is judged: such a step turns friction by much.
const LONG_TRIAL_SWEEPS: u32 = 10;
/// Approximate maximum turn of the friction of a sliding contact in a damped step, rad.
const MAX_TURN: f64 = 0.5;
/// If sweeps after a step change more than this fraction of what they did before, the next step
/// waits.
const WORTHWHILE: f64 = 0.8;
/// Admissible growth of the change per sweep after a damped step, which only leads to other
/// conditions.
const ALLOWED_GROWTH: f64 = 10.0;
/// A contact is inside its cone by more than this fraction of the square of its bound.
const INSIDE: f64 = 1e-9;
/// From this sweep on a failed step doubles the wait for the next.
const LATE_SWEEP: u32 = 200;

/// When to take a step, and the multipliers to return to.
pub(super) struct Newton {
    size: usize,
    /// The sweep after which the next step is taken, or the present one is judged.
    due: u32,
    wait: u32,
    /// Multipliers and change per sweep before a step on trial.
    before: Option<(Vec<[f64; 3]>, f64)>,
    /// Whether the next step, or the one on trial, is damped.
    damped: bool,
}

/// `δλ = a − G·δw` of one block.
#[derive(Clone, Copy, Default)]
struct Linearization {
    a: [f64; 3],
    g: [[f64; 3]; 3],
}

impl Newton {
    pub fn new(extrapolation: &Extrapolation) -> Newton {
        let size = extrapolation.size();
        let wait = FIRST_WAIT + size as u32 / 2;
        Newton { size, due: if size <= MAX_DOFS { wait } else { u32::MAX }, wait, before: None, damped: false }
    }

    /// Takes, judges or reverts a step after the sweep `sweeps.start`, which changed row velocities
    /// by `change`; `sweeps.end` is the last sweep. Returns whether multipliers changed, by a step
    /// or by the reversal of a failed one. The velocities must then be computed anew.
    pub fn try_step(
        &mut self,
        sweeps: Range<u32>,
        change: f64,
        locals: &mut [Local],
        rows: &Rows,
        extrapolation: &Extrapolation,
        du: &[f64],
    ) -> bool {
        let (sweep, left) = (sweeps.start, sweeps.len() as u32);
        if sweep < self.due {
            return false;
        }
        if let Some((lambda, before)) = self.before.take()
            && (change.is_nan() || change > WORTHWHILE * before)
        {
            let worse = change.is_nan() || change >= before * if self.damped { ALLOWED_GROWTH } else { 1.0 };
            if worse {
                locals.iter_mut().zip(lambda).for_each(|(local, lambda)| local.lambda = lambda);
                self.wait *= if sweep > LATE_SWEEP && self.damped { 2 } else { 1 };
                self.damped = !self.damped;
            }
            self.due = sweep + if worse && self.damped { 1 } else { self.wait };
            return worse;
        }
        let trial = if self.damped { LONG_TRIAL_SWEEPS } else { TRIAL_SWEEPS };
        if left <= trial {
            return false;
        }
        let lambda = locals.iter().map(|local| local.lambda).collect();
        self.due = sweep + trial;
        if newton_step(self.size, self.damped, locals, rows, extrapolation, du) {
            self.before = Some((lambda, change));
            return true;
        }
        self.due = sweep + self.wait;
        false
    }
}

/// Takes one step of all multipliers. A full step is projected onto the bounds; a damped one ends
/// at the first bound. Returns whether the system could be solved. `du` belongs to the multipliers.
fn newton_step(
    size: usize,
    damped: bool,
    locals: &mut [Local],
    rows: &Rows,
    extrapolation: &Extrapolation,
    du: &[f64],
) -> bool {
    let Some(epsilon) = proximal(locals) else { return false };
    let mut matrix = DMatrix::identity(size, size);
    let mut right = DVector::zeros(size);
    let linearizations: Vec<Linearization> =
        locals.iter().map(|local| linearization(local, rows, du, epsilon)).collect();
    for (local, linearization) in locals.iter().zip(&linearizations) {
        assemble(local, linearization, rows, extrapolation, &mut matrix, &mut right);
    }
    if !matrix.lu().solve_mut(&mut right) || !right.iter().all(|x| x.is_finite()) {
        return false;
    }
    let changes: Vec<[f64; 3]> = locals
        .iter()
        .zip(&linearizations)
        .map(|(local, linearization)| multiplier_change(local, linearization, rows, extrapolation, right.as_slice()))
        .collect();
    let share = if damped {
        locals.iter().zip(&changes).map(|(local, change)| max_fraction(local, change)).fold(1.0, f64::min)
    } else {
        1.0
    };
    for (local, change) in locals.iter_mut().zip(&changes) {
        (0..3).for_each(|k| local.lambda[k] += share * change[k]);
        local.bound();
    }
    true
}

/// Returns `δλ` of one block.
fn multiplier_change(
    local: &Local,
    linearization: &Linearization,
    rows: &Rows,
    extrapolation: &Extrapolation,
    du: &[f64],
) -> [f64; 3] {
    let n = local.block.set.rows();
    let mut velocity = [0.0; 3];
    for side in local.block.sides() {
        let change = &du[extrapolation.place(side.u)..][..side.dof as usize];
        (0..n).for_each(|k| velocity[k] += crate::constraint::rows::dot(rows.response(side, k), change));
    }
    let mut change = [0.0; 3];
    for k in 0..n {
        change[k] = linearization.a[k] - (0..n).map(|j| linearization.g[k][j] * velocity[j]).sum::<f64>();
    }
    change
}

/// Returns the largest fraction of `change` at which the normal is not below 0 and multipliers
/// inside the cone stay inside.
fn max_fraction(local: &Local, change: &[f64; 3]) -> f64 {
    let (BlockSolver::Contact(contact), [n, x, y]) = (&local.step, local.lambda) else { return 1.0 };
    let lifts = if n > 0.0 && change[0] < -n { -n / change[0] } else { 1.0 };
    // |λ_t + α δ_t|² = μ² (λ_n + α δ_n)²
    let square = contact.mu * contact.mu;
    let inside = square * n * n - x * x - y * y;
    if inside <= INSIDE * square * n * n {
        let (turn, most) = ((change[1] * change[1] + change[2] * change[2]).sqrt(), MAX_TURN * contact.mu * n);
        return lifts.min(if turn > most && most > 0.0 { most / turn } else { 1.0 });
    }
    let a = change[1] * change[1] + change[2] * change[2] - square * change[0] * change[0];
    let half = x * change[1] + y * change[2] - square * n * change[0];
    // the smallest root above 0 of a α² + 2 half α − inside, written without cancellation
    let root = (half * half + a * inside).max(0.0).sqrt();
    let slides = if half + root > 0.0 { inside / (half + root) } else { 1.0 };
    lifts.min(slides)
}

/// Returns `ε`; `None` if no block has a response.
fn proximal(locals: &[Local]) -> Option<f64> {
    let diagonal = |local: &Local| match &local.step {
        BlockSolver::Unresponsive => None,
        BlockSolver::Scalar(scalar) => Some(scalar.k - scalar.compliance),
        BlockSolver::Contact(contact) => Some(contact.k.m00),
    };
    let (sum, count) = locals.iter().filter_map(diagonal).fold((0.0, 0.0), |(s, n), k| (s + k, n + 1.0));
    (sum > 0.0).then(|| PROXIMAL * sum / count)
}

fn linearization(local: &Local, rows: &Rows, du: &[f64], epsilon: f64) -> Linearization {
    let velocity = |k: usize| local.c[k] + rows.row_velocity(local.block, k, du);
    let mut linearization = Linearization::default();
    match &local.step {
        BlockSolver::Unresponsive => {}
        BlockSolver::Scalar(scalar) => {
            let old = local.lambda[0];
            let w = velocity(0) + scalar.compliance * old;
            let trial = old - w / scalar.k;
            if trial <= scalar.lo || trial >= scalar.hi {
                linearization.a[0] = if trial <= scalar.lo { scalar.lo - old } else { scalar.hi - old };
            } else {
                linearization.g[0][0] = 1.0 / (epsilon + scalar.compliance);
                linearization.a[0] = -w * linearization.g[0][0];
            }
        }
        BlockSolver::Contact(contact) => {
            linearization = linearize_contact(contact, local.lambda, [0, 1, 2].map(velocity), epsilon)
        }
    }
    linearization
}

fn linearize_contact(contact: &ContactBlock, old: [f64; 3], w: [f64; 3], epsilon: f64) -> Linearization {
    let (k, mu, mut linearization) = (&contact.k, contact.mu, Linearization::default());
    let normal = old[0] - w[0] / k.m00;
    if normal <= 0.0 {
        linearization.a = old.map(|x| -x);
        return linearization;
    }
    let stiff = 1.0 / epsilon;
    let mean = 0.5 * (k.m11 + k.m22);
    let rho = if mean > f64::MIN_POSITIVE { 1.0 / mean } else { 0.0 };
    let trial = [old[1] - rho * w[1], old[2] - rho * w[2]];
    let size = (trial[0] * trial[0] + trial[1] * trial[1]).sqrt();
    if size <= mu * normal {
        for i in 0..3 {
            linearization.g[i][i] = stiff;
            linearization.a[i] = -stiff * w[i];
        }
        return linearization;
    }
    let (t, s) = ([trial[0] / size, trial[1] / size], [-trial[1] / size, trial[0] / size]);
    let kappa = (mu * old[0] / size).min(1.0);
    let r = [mu * old[0] * t[0] - old[1], mu * old[0] * t[1] - old[2]];
    let across = 1.0 / (1.0 - kappa + epsilon * rho);
    linearization.g[0][0] = stiff;
    linearization.a[0] = -stiff * w[0];
    let (along, aside) = (mu * linearization.a[0] + r[0] * t[0] + r[1] * t[1], across * (r[0] * s[0] + r[1] * s[1]));
    for i in 0..2 {
        linearization.g[i + 1] =
            [mu * stiff * t[i], kappa * rho * across * s[i] * s[0], kappa * rho * across * s[i] * s[1]];
        linearization.a[i + 1] = along * t[i] + aside * s[i];
    }
    linearization
}

/// Adds `Y G Yᵀ` and `Y a` of one block.
fn assemble(
    local: &Local,
    linearization: &Linearization,
    rows: &Rows,
    extrapolation: &Extrapolation,
    matrix: &mut DMatrix<f64>,
    right: &mut DVector<f64>,
) {
    let n = local.block.set.rows();
    for side in local.block.sides() {
        let (at, d) = (extrapolation.place(side.u), side.dof as usize);
        for k in 0..n {
            let y = rows.response(side, k);
            right.as_mut_slice()[at..at + d].iter_mut().zip(y).for_each(|(r, y)| *r += y * linearization.a[k]);
            for other in local.block.sides() {
                let from = extrapolation.place(other.u);
                for j in (0..n).filter(|&j| linearization.g[k][j] != 0.0) {
                    for (column, x) in rows.response(other, j).iter().enumerate() {
                        let share = linearization.g[k][j] * x;
                        matrix.column_mut(from + column).as_mut_slice()[at..at + d]
                            .iter_mut()
                            .zip(y)
                            .for_each(|(m, y)| *m += y * share);
                    }
                }
            }
        }
    }
}

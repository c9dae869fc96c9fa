//! Dormand–Prince 5(4): an explicit Runge–Kutta pair with error control, on states with rotations.
//!
//! Within an inner step from `x₀` the unknown is `y = (Θ, Δp)`: the tangent displacement and the
//! change of momentum since its start (Runge–Kutta–Munthe-Kaas). The corresponding state is
//!
//! ```text
//! x(y) = integrate_positions(kick(x₀, Δp), Θ)     Θ' = dexp⁻¹_Θ(v(x, t))            Δp' = f(x, t)
//! y_i = h·Σ_{j<i} a_ij·k_j                k_i = y'(t + c_i·h, y_i)          i = 1…7;   y₇ is the step (fifth order) and k₇ the next step's k₁
//! e = h·Σ e_i·k_i                         the difference from the embedded step of fourth order
//! ```
//!
//! The error of an object is the maximum of `|e_Θ| / (tol·(1 + |Θ|))` and `|e_v| / (tol·(1 + |v|))`
//! over its coordinates, with `e_v = M⁻¹·e_Δp` the error as a velocity and 1 one SI unit (m, rad,
//! m/s, rad/s). The error of a step is the maximum over all objects, so that many objects do not
//! dilute the error of one. A step is accepted if its error is at most 1. The next is
//! `0.9·error^(−1/5)` times as long, with a factor between 0.2 and 5.
//!
//! Sources: Dormand and Prince, *A family of embedded Runge–Kutta formulae*, 1980; Munthe-Kaas,
//! *High order Runge–Kutta methods on manifolds*, 1999; Hairer, Nørsett and Wanner, *Solving
//! Ordinary Differential Equations I*, §II.4–6 (step control, dense output), §IV.8 of Hairer,
//! Lubich and Wanner, *Geometric Numerical Integration* (`dexp⁻¹`).
//!
//! | symbol | meaning |
//! |---|---|
//! | `h`, `tol` | length of the inner step (s), `Settings::integrator_tolerance` |
//! | `Θ`, `Δp` | displacement and change of momentum since the start of the inner step, `dof` numbers each |
//! | `k_i` | rates of `y` at stage `i`, `2·dof` numbers |
//!
//! Kinematic objects keep the velocity that they have at the start of the call: `Θ = t·v`, without
//! error.

use super::trajectory::{InnerStep, STAGES, Trajectory};
use crate::integrators::context::IntegrationContext;
use crate::settings::Settings;
use crate::world::StepError;
use crate::world::view::{Entry, Mode};
use nalgebra::ComplexField;

const C: [f64; STAGES] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];
const A: [[f64; STAGES - 1]; STAGES] = [
    [0.0; 6],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Fifth order minus fourth.
const E: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Maximum number of inner steps in one frame, rejected ones included.
const MAX_STEPS: u32 = 100_000;
/// Minimum inner step, as a fraction of the frame.
const MIN_STEP_FRACTION: f64 = 1e-12;
/// Minimum and maximum factor from one inner step to the next.
const SHRINK: f64 = 0.2;
const GROW: f64 = 5.0;
/// Fraction of the step size that the error allows.
const SAFETY: f64 = 0.9;

/// The adaptive integrator: constants of a call, the step size carried between calls, buffers and
/// the recorded path.
#[derive(Default)]
pub(crate) struct Adaptive {
    /// `Settings::integrator_tolerance`.
    pub tolerance: f64,
    /// Length of a frame, s: the maximum inner step; the minimum is a fraction of it.
    pub frame: f64,
    /// Initial inner step, s; 0 stands for a frame. After a call: the inner step to continue with.
    pub step: f64,
    /// Inner steps of the frame so far, rejected ones included.
    pub steps: u32,
    /// The accepted inner steps of the last recorded call.
    pub path: Trajectory,
    work: Work,
}

#[derive(Default)]
struct Work {
    start: Vec<f64>,
    /// Velocity of kinematic objects.
    kinematic: Vec<f64>,
    k: [Vec<f64>; STAGES],
    y: Vec<f64>,
    /// Velocity at the end of the step, before `pull_back`.
    velocity: Vec<f64>,
    error: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
}

/// The largest error of a step, and the index of its object in the table's order.
#[derive(Clone, Copy)]
struct Worst {
    error: f64,
    object: usize,
}

impl Adaptive {
    /// Sets the constants of a call, the initial inner step, and the number of inner steps taken in
    /// the frame.
    pub fn set(&mut self, settings: &Settings, step: f64, steps: u32) {
        (self.tolerance, self.frame) = (settings.integrator_tolerance, settings.dt);
        (self.step, self.steps) = (step, steps);
    }

    /// Integrates from time `t` over `h` exactly, with as many inner steps as the tolerance
    /// requires.
    ///
    /// With `record` the path is kept, and the call ends early when the record is full. Returns the
    /// time integrated, s. State, part states and forces are left there, and the last rates are in
    /// `dp`.
    ///
    /// # Errors
    /// [`StepError::Tolerance`] if the tolerance requires too many or too short inner steps;
    /// [`StepError::Singular`] if a mass matrix is singular.
    pub fn integrate(
        &mut self,
        motion: &mut IntegrationContext,
        t: f64,
        h: f64,
        dp: &mut [f64],
        record: bool,
    ) -> Result<f64, StepError> {
        let n = dp.len();
        self.begin(motion, t, n);
        if record {
            self.path.begin(motion.x.len(), n, &self.work.kinematic);
        }
        self.step =
            if self.step > 0.0 { self.step.clamp(MIN_STEP_FRACTION * self.frame, self.frame) } else { self.frame };
        let (mut done, mut grow) = (0.0, GROW);
        while done < h && !(record && self.path.full()) {
            // equal parts of the remaining time, so that no sliver remains for the last
            let parts = ((h - done) / self.step).ceil();
            let step = (h - done) / parts;
            self.steps += 1;
            let worst = self.try_step(motion, t + done, step);
            let factor = (SAFETY * ComplexField::powf(worst.error, -0.2)).clamp(SHRINK, grow);
            if worst.error > 1.0 {
                if step <= MIN_STEP_FRACTION * self.frame || self.steps >= MAX_STEPS {
                    return Err(self.tolerance_error(motion, t + done, step, worst));
                }
                (self.step, grow) = (step * factor, 1.0);
                continue;
            }
            let end = if parts <= 1.0 { h } else { done + step };
            if record {
                self.path.push(
                    InnerStep { start: done, length: step },
                    end,
                    &self.work.start,
                    &self.work.k,
                    &self.work.y,
                );
            }
            done = end;
            let proposed = step * factor;
            self.step = if factor >= grow { self.step.max(proposed) } else { proposed }.min(self.frame);
            grow = GROW;
            self.advance(motion, n);
            if self.steps >= MAX_STEPS && done < h {
                return Err(self.tolerance_error(motion, t + done, step, worst));
            }
        }
        dp.copy_from_slice(&self.work.k[0][n..]);
        Ok(done)
    }

    /// Evaluates the first stage of the first step.
    fn begin(&mut self, motion: &mut IntegrationContext, t: f64, n: usize) {
        let w = &mut self.work;
        w.k.iter_mut().for_each(|k| k.resize(2 * n, 0.0));
        [&mut w.y, &mut w.error].into_iter().for_each(|v| v.resize(2 * n, 0.0));
        [&mut w.kinematic, &mut w.velocity].into_iter().for_each(|v| v.resize(n, 0.0));
        motion.x.clone_into(&mut w.start);
        let (v, f) = w.k[0].split_at_mut(n);
        motion.evaluate(t, f);
        motion.velocities(v);
        w.kinematic.copy_from_slice(v);
    }

    /// Takes one inner step without judging it: leaves the state at its end, the rates of all
    /// stages in `k` and the step in `y`.
    fn try_step(&mut self, motion: &mut IntegrationContext, t: f64, step: f64) -> Worst {
        let w = &mut self.work;
        let n = w.kinematic.len();
        for i in 1..STAGES {
            let (before, after) = w.k.split_at_mut(i);
            combine(before, &A[i][..i], step, &mut w.y);
            motion.displace(&w.start, &w.y, &w.kinematic);
            let (v, f) = after[0].split_at_mut(n);
            motion.evaluate(t + C[i] * step, f);
            motion.velocities(v);
            w.velocity.copy_from_slice(v);
            motion.pull_back(&w.y[..n], v, &w.kinematic);
        }
        combine(&w.k, &E, step, &mut w.error);
        self.worst(motion)
    }

    /// Returns the largest error of all dynamic objects; NaN counts as infinite.
    fn worst(&mut self, motion: &IntegrationContext) -> Worst {
        let w = &mut self.work;
        let n = w.kinematic.len();
        let mut worst = Worst { error: 0.0, object: 0 };
        for entry in motion.objects().iter().filter(|e| e.moves()) {
            let object = entry.place;
            let Some(body) = entry.object.integratable() else { continue };
            let (x, v) = (entry.state_range.x.clone(), entry.state_range.v.clone());
            // e_v = M⁻¹·e_Δp: the error as a velocity, at the end of the step
            let momentum = &w.error[n + v.start..n + v.end];
            w.x.clear();
            w.x.extend_from_slice(&motion.x[x]);
            w.v.clear();
            w.v.resize(v.len(), 0.0);
            body.write_velocity(&mut w.x, &w.v);
            body.kick(&mut w.x, momentum, 1.0);
            body.velocity(&w.x, &mut w.v);
            let displacement = w.error[v.clone()].iter().zip(&w.y[v.clone()]);
            let velocity = w.v.iter().zip(&w.velocity[v]);
            for (e, y) in displacement.chain(velocity) {
                let error = e.abs() / (self.tolerance * (1.0 + y.abs()));
                let error = if error.is_nan() { f64::INFINITY } else { error };
                if error > worst.error {
                    worst = Worst { error, object };
                }
            }
        }
        worst
    }

    /// Makes the end of the step the start of the next; the last stage becomes the first.
    fn advance(&mut self, motion: &IntegrationContext, n: usize) {
        let w = &mut self.work;
        w.start.copy_from_slice(motion.x);
        w.k.swap(0, STAGES - 1);
        w.k[0][..n].copy_from_slice(&w.velocity);
        for entry in motion.objects().iter().filter(|e| is_kinematic(e)) {
            w.k[0][entry.state_range.v.clone()].copy_from_slice(&w.kinematic[entry.state_range.v.clone()]);
        }
    }

    fn tolerance_error(&self, motion: &mut IntegrationContext, time: f64, step: f64, worst: Worst) -> StepError {
        let entry = motion.table.with(motion.states).at(worst.object);
        let cache = &mut motion.derived.caches[worst.object];
        let object = entry.name.to_string();
        match entry.object.integratable().and_then(|body| body.singularity(cache)) {
            Some(why) => StepError::Singular { object, why, time },
            None => StepError::Tolerance { object, time, step, steps: self.steps, tolerance: self.tolerance },
        }
    }
}

/// Computes `out = h·Σ weight_j·k_j`.
fn combine(k: &[Vec<f64>], weight: &[f64], h: f64, out: &mut [f64]) {
    out.fill(0.0);
    for (k, weight) in k.iter().zip(weight).filter(|(_, w)| **w != 0.0) {
        out.iter_mut().zip(k).for_each(|(out, k)| *out += weight * k);
    }
    out.iter_mut().for_each(|out| *out *= h);
}

fn is_kinematic(entry: &Entry) -> bool {
    entry.status.enabled && entry.status.mode == Mode::Kinematic
}

impl IntegrationContext<'_> {
    /// Writes the state at `(Θ, Δp)` from `start`. Kinematic objects keep their velocity.
    pub(super) fn displace(&mut self, start: &[f64], y: &[f64], kinematic_velocity: &[f64]) {
        self.x.copy_from_slice(start);
        let (theta, pi) = y.split_at(kinematic_velocity.len());
        for entry in self.table.with(self.states).iter().filter(|e| e.moves() || is_kinematic(e)) {
            let Some(body) = entry.object.integratable() else { continue };
            let (x, v) = (&mut self.x[entry.state_range.x.clone()], entry.state_range.v.clone());
            if entry.moves() {
                body.kick(x, &pi[v.clone()], 1.0);
                body.integrate_positions(x, &theta[v], 1.0);
            } else {
                body.integrate_positions(x, &theta[v.clone()], 1.0);
                body.write_velocity(x, &kinematic_velocity[v]);
            }
        }
    }

    /// Turns velocities at the displacement `Θ` into rates of `Θ`.
    fn pull_back(&self, theta: &[f64], v: &mut [f64], kinematic_velocity: &[f64]) {
        for entry in self.table.with(self.states).iter() {
            let (Some(body), state_range) = (entry.object.integratable(), entry.state_range.v.clone()) else {
                continue;
            };
            if entry.moves() {
                body.pull_back(&theta[state_range.clone()], &mut v[state_range]);
            } else if is_kinematic(&entry) {
                v[state_range.clone()].copy_from_slice(&kinematic_velocity[state_range]);
            }
        }
    }
}

//! Dense output: the state at any time of a call, from the stages of its inner steps.
//!
//! Per inner step the interpolant of fourth order of Dormand and Prince (Hairer, Nørsett and
//! Wanner, §II.6) on `y = (Θ, Δp)`:
//!
//! ```text
//! y(s) = s·(r₂ + (1−s)·(r₃ + s·(r₄ + (1−s)·r₅)))           s from 0 to 1 over the step of length h
//! r₂ = y₁     r₃ = h·k₁ − y₁     r₄ = y₁ − h·k₇ − r₃     r₅ = h·Σ d_i·k_i
//! ```
//!
//! It has the right values and slopes at the ends of a step, so the path is continuously
//! differentiable.

use crate::integrators::context::IntegrationContext;

/// Stages of an inner step; the last is the first of the next inner step.
pub(super) const STAGES: usize = 7;
const D: [f64; STAGES] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];
/// Maximum size of the record, in numbers (32 MiB); one inner step always fits.
const MAX_NUMBERS: usize = 1 << 22;

/// One inner step: start, relative to the start of the call, and length, s.
#[derive(Clone, Copy, Debug)]
pub(super) struct InnerStep {
    pub start: f64,
    pub length: f64,
}

/// The inner steps of a call in order.
#[derive(Default)]
pub(crate) struct Trajectory {
    inner_steps: Vec<InnerStep>,
    /// Per inner step: the state at its start, then `r₂ … r₅`.
    data: Vec<f64>,
    state: usize,
    dof: usize,
    /// End of the path, s.
    end: f64,
    /// Velocity of kinematic objects.
    kinematic: Vec<f64>,
}

impl Trajectory {
    /// Removes all inner steps.
    pub fn clear(&mut self) {
        self.inner_steps.clear();
        self.data.clear();
    }

    pub(super) fn begin(&mut self, state: usize, dof: usize, kinematic: &[f64]) {
        self.clear();
        (self.state, self.dof) = (state, dof);
        self.kinematic.clear();
        self.kinematic.extend_from_slice(kinematic);
    }

    fn stride(&self) -> usize {
        self.state + 8 * self.dof
    }

    /// Returns whether there is no room for another inner step.
    pub(super) fn full(&self) -> bool {
        !self.inner_steps.is_empty() && self.data.len() + self.stride() > MAX_NUMBERS
    }

    /// Adds an inner step that extends the path to `end`.
    pub(super) fn push(&mut self, inner_step: InnerStep, end: f64, start: &[f64], k: &[Vec<f64>; STAGES], y: &[f64]) {
        let h = inner_step.length;
        self.end = end;
        self.inner_steps.push(inner_step);
        self.data.extend_from_slice(start);
        self.data.extend_from_slice(y);
        self.data.extend(k[0].iter().zip(y).map(|(k, y)| h * k - y));
        self.data.extend((0..y.len()).map(|i| y[i] - h * k[6][i] - (h * k[0][i] - y[i])));
        self.data.extend((0..y.len()).map(|i| h * (0..STAGES).map(|s| D[s] * k[s][i]).sum::<f64>()));
    }

    /// Returns whether the path reaches `t` seconds after its start.
    pub fn reaches(&self, t: f64) -> bool {
        !self.inner_steps.is_empty() && t <= self.end
    }

    /// Returns whether the path extends beyond `t`.
    pub fn extends_beyond(&self, t: f64) -> bool {
        !self.inner_steps.is_empty() && t < self.end
    }

    /// Returns the last start of an inner step before `t`, s from the start of the path, and the
    /// state there.
    pub fn before(&self, t: f64) -> (f64, &[f64]) {
        let i = self.index(t);
        (self.inner_steps[i].start, &self.data[i * self.stride()..][..self.state])
    }

    /// Returns the length of the inner step that contains `t`, s.
    pub fn length(&self, t: f64) -> f64 {
        self.inner_steps[self.index(t)].length
    }

    /// Returns the index of the inner step that contains `t`.
    fn index(&self, t: f64) -> usize {
        self.inner_steps.partition_point(|p| p.start < t).saturating_sub(1)
    }

    /// Writes the state `t` seconds after the start of the path and refreshes the part states.
    /// Accelerations are not updated.
    pub fn write(&self, motion: &mut IntegrationContext, t: f64) {
        let (i, n) = (self.index(t), 2 * self.dof);
        let inner_step = self.inner_steps[i];
        let (start, r) = self.data[i * self.stride()..(i + 1) * self.stride()].split_at(self.state);
        let s = (t - inner_step.start) / inner_step.length;
        let y = |i: usize| s * (r[i] + (1.0 - s) * (r[n + i] + s * (r[2 * n + i] + (1.0 - s) * r[3 * n + i])));
        let y: Vec<f64> = (0..n).map(y).collect();
        motion.displace(start, &y, &self.kinematic);
        motion.refresh();
    }
}

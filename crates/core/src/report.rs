//! What a step reports.

use crate::solver::SolveReport;
use crate::world::view::ObjectId;

/// A joint that could not be closed where it was led.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnreachableJoint {
    /// The constraint.
    pub loop_joint: ObjectId,
    /// How far it is open, metres; 0 where only its angle is.
    pub distance: f64,
    /// The same of its angle, rad, where its distance is not what is furthest off.
    pub angle: f64,
}

/// What one frame took and how well it went.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StepReport {
    /// Committed sub-steps.
    pub substeps: u32,
    /// `backtracking`: integrations tried, committed ones included.
    pub tries: u32,
    /// `backtracking` with `dormand_prince`: inner steps of all integrations, refused ones included.
    pub inner_steps: u32,
    /// `backtracking`: sub-steps taken at the floor, where a crossing was accepted and projected out.
    pub floor_hits: u32,
    /// Contacts at the last sub-step: what the narrow phase found within its margin.
    pub contacts: u32,
    /// Objects asleep at its end.
    pub asleep: u32,
    /// Passes of the impact phase.
    pub impact_passes: u32,
    /// Largest residual of any solve, m/s (see [`crate::solver::residual`]).
    pub residual: f64,
    /// Solves that did not reach the solver's own aim.
    pub unconverged: u32,
    /// Solves that ended on a secondary ray and were resolved at the impulse level.
    pub rays: u32,
    /// Iterations of the largest solve.
    pub iterations: u32,
    /// Deepest penetration found by the narrow phase, metres.
    pub max_penetration: f64,
    /// The joint that was furthest open where it cannot be closed; `None` where all could.
    #[serde(skip)]
    pub unreachable_joint: Option<UnreachableJoint>,
}

impl StepReport {
    pub(crate) fn solved(&mut self, outcome: SolveReport, residual: f64) {
        self.residual = self.residual.max(residual);
        self.unconverged += !outcome.converged as u32;
        self.rays += outcome.ray as u32;
        self.iterations = self.iterations.max(outcome.iterations);
    }
}

//! The report of a step.

use crate::solver::SolveReport;
use crate::world::view::ObjectId;

/// A loop joint that could not be closed at the pose that kinematic motion asked for.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnreachableJoint {
    /// The loop joint.
    pub loop_joint: ObjectId,
    /// Distance between its sides, m; 0 if the largest error is an angle.
    pub distance: f64,
    /// Angle between its sides, rad; 0 if the largest error is a distance.
    pub angle: f64,
}

/// The solve of a frame with the largest residual, and the place of that residual.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstSolve {
    /// An object that the row with the largest residual acts on; the first one in the order of the
    /// row. [`World::islands`](crate::World::islands) lists the objects connected to it.
    pub object: ObjectId,
    /// The other object that this row acts on, if it can move.
    pub other: Option<ObjectId>,
    /// Number of objects of the island.
    pub objects: u32,
    /// Number of rows of the island: three per contact, one per joint row, limit or drive.
    pub rows: u32,
    /// Largest residual with which the solve counts as converged, m/s.
    pub tolerance: f64,
    /// Whether the solver reached its tolerance.
    pub converged: bool,
}

/// Counts and residuals of one frame. Later versions can have more of them.
#[non_exhaustive]
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct StepReport {
    /// Number of committed sub-steps.
    pub substeps: u32,
    /// `backtracking`: number of integrations, committed ones included.
    pub tries: u32,
    /// `backtracking` with `dormand_prince`: inner steps of all integrations, rejected ones
    /// included.
    pub inner_steps: u32,
    /// `backtracking`: sub-steps of the minimum length, at which a crossing was accepted and
    /// projected out.
    pub floor_hits: u32,
    /// Contacts of the last sub-step, speculative ones within the margin included.
    pub contacts: u32,
    /// Number of sleeping objects at the end of the frame.
    pub asleep: u32,
    /// Number of passes of the impact phase.
    pub impact_passes: u32,
    /// Largest residual of any solve, m/s (see [`crate::solver::residual`]).
    pub residual: f64,
    /// Number of solves that did not reach the solver's tolerance.
    pub unconverged: u32,
    /// The solve whose residual is [`residual`](Self::residual); `None` if nothing was solved, or
    /// without any error.
    #[serde(skip)]
    pub worst_solve: Option<WorstSolve>,
    /// Number of solves that ended on a secondary ray and were resolved at the impulse level.
    pub rays: u32,
    /// Maximum number of iterations of a solve.
    pub iterations: u32,
    /// Work of all solves in block relaxations, which
    /// [`SolverSettings::budget`](crate::solver::SolverSettings::budget) bounds.
    pub relaxations: u64,
    /// Deepest penetration that the narrow phase found, m.
    pub max_penetration: f64,
    /// Largest angle by which the forces of joints turn a part back and forth in a sub-step, rad, without those that it resists
    /// ([`Settings::max_turn`](crate::Settings::max_turn)).
    pub max_turn: f64,
    /// The unreachable joint with the largest error; `None` if all joints could be closed.
    #[serde(skip)]
    pub unreachable_joint: Option<UnreachableJoint>,
}

impl StepReport {
    /// Counts a solve. The caller sets [`residual`](Self::residual) and the place of the worst one.
    pub(crate) fn solved(&mut self, outcome: SolveReport) {
        self.unconverged += !outcome.converged as u32;
        self.rays += outcome.ray as u32;
        self.iterations = self.iterations.max(outcome.iterations);
    }

    /// Counts a solve whose friction laws were missed by a row velocity, m/s.
    pub(crate) fn missed(&mut self, residual: f64) {
        self.unconverged += 1;
        self.residual = self.residual.max(residual);
    }
}

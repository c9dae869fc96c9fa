//! Solvers of the contact problem, each behind [`RowSolver`].
//!
//! Find `λ` in the rows' sets so that `w = c + (K + R)·λ` (`R`: compliance of soft rows) satisfies
//! each set as [`RowSet`](crate::constraint::rows::RowSet) defines it.

mod coupled;
mod direct;
mod dof6;
mod equality;
mod extrapolation;
mod folded;
mod gauss_seidel;
mod island;
mod joint_row;
mod lcp;
mod lemke;
mod linkage;
mod local;
mod objects;
mod one_contact;
mod pyramids;
mod reduced;
mod relaxation;
mod residual;
#[cfg(test)]
mod tests;

pub(crate) use coupled::{CoupledIsland, Folding};
pub(crate) use equality::smallest_pivot;
pub use gauss_seidel::GaussSeidel;
pub use island::Islands;
pub use lcp::{LcpPyramid, LcpSliding, MAX_UNKNOWNS};
pub use lemke::{LcpResult, lemke};
pub use linkage::MAX_DIRECT_ROWS;
pub use residual::residual;
pub(crate) use residual::{LargestResidual, largest_residual, largest_residual_on};

use crate::constraint::rows::Rows;

/// Limits of an iterative solver. Pivoting solvers are exact and ignore them.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SolverSettings {
    /// Maximum number of sweeps, at least 1.
    pub max_sweeps: u32,
    /// Maximum number of block relaxations of a step, in all sweeps of all islands but the smallest.
    /// It bounds the cost of a step: large islands get fewer sweeps, but at least [`MIN_SWEEPS`] (or
    /// `max_sweeps` if that is less).
    pub max_relaxations: u32,
    /// A sweep that changes no row velocity by more than this ends the solve (m/s; m/s² at the
    /// acceleration level).
    pub tolerance: f64,
    /// Maximum work of a step in block relaxations: sweeps and factorizations of all solves, impacts
    /// and corrections too, but at least one sweep of each solve. In a call of
    /// [`RowSolver::solve`], the maximum work of this solve. `None`: no bound.
    pub budget: Option<u32>,
}

/// Degrees of freedom of a rigid body.
const RIGID: u32 = 6;

/// Number of sweeps that every island gets, whatever its size.
pub const MIN_SWEEPS: u32 = 25;

impl SolverSettings {
    /// Returns the settings of an island of `blocks` blocks that shares the relaxations with others,
    /// `all` blocks in total.
    pub fn shared_by(mut self, blocks: usize, all: usize) -> SolverSettings {
        let share = blocks as f64 / all.max(1) as f64;
        self.max_relaxations = (share * f64::from(self.max_relaxations)) as u32;
        self
    }

    /// Returns the maximum number of sweeps of an island with `blocks` blocks.
    pub fn max_sweeps_for(&self, blocks: usize) -> u32 {
        let share = self.max_relaxations / (blocks.max(1) as u32);
        let affordable = self.budget.map_or(u32::MAX, |budget| budget / blocks.max(1) as u32);
        share.max(MIN_SWEEPS).min(self.max_sweeps).min(affordable).max(1)
    }
}

/// Result of the solve of one island.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveReport {
    /// Number of sweeps or pivots.
    pub iterations: u32,
    /// Whether the solver reached its own criterion: the tolerance, or a complementary basis.
    pub converged: bool,
    /// Whether a pivoting solver ended on a secondary ray. With friction there may be no solution
    /// (Painlevé); the caller then resolves the contacts at the impulse level.
    pub ray: bool,
    /// Work of sweeps and factorizations, in block relaxations. A factorization counts as the sweeps
    /// with as many multiplications. Pivots do not count.
    pub relaxations: u32,
}

/// Names of all solvers of this crate, as scene files, archives, Python and the command line use them.
pub const NAMES: [&str; 3] = ["gauss_seidel", "lcp_pyramid", "lcp_sliding"];

/// Returns the solver of that name; `lcp` is short for `lcp_pyramid`. `None` for other names.
pub fn by_name(name: &str) -> Option<Box<dyn RowSolver>> {
    match name {
        "gauss_seidel" => Some(Box::new(GaussSeidel)),
        "lcp_pyramid" | "lcp" => Some(Box::new(LcpPyramid)),
        "lcp_sliding" => Some(Box::new(LcpSliding)),
        _ => None,
    }
}

/// A solver of constraint rows.
///
/// `lambda` is the warm start on entry and the solution on return. `du = Y·λ` of **these blocks**
/// is added to `du`, which holds the sum over other islands on entry (0 on this island's own
/// ranges). A block without sides, or a row without response, gets no multiplier.
pub trait RowSolver: Send + Sync {
    /// Returns the solver's name in reports and archives: one of [`NAMES`] for the solvers of this
    /// crate, any other for those of other crates.
    fn name(&self) -> &'static str;
    /// Solves the island of the given `blocks` (indices into `rows.blocks`).
    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport;
    /// Returns whether islands of robots whose bounds follow the normal forces of contacts, as those of rolling friction do,
    /// may be solved by Newton's method as a whole instead of by this solver, with bounds held, again and again. False by
    /// default.
    fn follows_forces(&self) -> bool {
        false
    }
    /// Returns an independent copy.
    fn fork(&self) -> Box<dyn RowSolver>;
}

//! Solvers of the one contact problem, each behind [`RowSolver`].
//!
//! Find `λ` in the rows' sets so that `w = c + (K + R)·λ` (`R`: compliance of soft rows) answers each set as [`RowSet`](crate::constraint::rows::RowSet) says.

mod dof6;
mod equality;
mod extrapolation;
mod gauss_seidel;
mod island;
mod lcp;
mod lemke;
mod linkage;
mod local;
mod newton;
mod one_contact;
mod relaxation;
mod residual;
#[cfg(test)]
mod tests;

pub(crate) use equality::smallest_pivot;
pub use gauss_seidel::GaussSeidel;
pub use island::Islands;
pub use lcp::{LcpPyramid, LcpSliding, MAX_UNKNOWNS};
pub use lemke::{LcpResult, lemke};
pub use linkage::MAX_DIRECT_ROWS;
pub use residual::residual;

use crate::constraint::rows::Rows;

/// How far an iterative solver goes. Pivoting solvers are exact and take no notice.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct SolverSettings {
    /// Sweeps at most, at least 1.
    pub max_sweeps: u32,
    /// Relaxations of one block at most, all sweeps of an island together: large islands get fewer sweeps, so that the cost of a
    /// step is bounded, but never fewer than [`MIN_SWEEPS`] (or `sweeps`, if that is less).
    pub max_relaxations: u32,
    /// A sweep that changes no row velocity by more than this ends the solve (m/s; m/s² at the acceleration level).
    pub tolerance: f64,
}

/// What an island gets however large it is.
pub const MIN_SWEEPS: u32 = 25;

impl SolverSettings {
    /// Sweeps for an island of that many blocks.
    pub fn max_sweeps_for(&self, blocks: usize) -> u32 {
        let share = self.max_relaxations / (blocks.max(1) as u32);
        share.max(MIN_SWEEPS).min(self.max_sweeps).max(1)
    }
}

/// How one island's solve ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolveReport {
    /// Sweeps or pivots taken.
    pub iterations: u32,
    /// Whether the solver itself says that it reached its aim: the tolerance, or a complementary basis.
    pub converged: bool,
    /// A pivoting solver ended on a secondary ray: with friction no solution may exist (Painlevé), and the
    /// caller resolves the contacts at the impulse level instead.
    pub ray: bool,
}

/// Names of all solvers, as files and the command line take them; `lcp` is short for `lcp_pyramid`.
pub const NAMES: [&str; 3] = ["gauss_seidel", "lcp_pyramid", "lcp_sliding"];

/// The solver of that name; `None` for a name that is not in [`NAMES`] and is not `lcp`.
pub fn by_name(name: &str) -> Option<Box<dyn RowSolver>> {
    match name {
        "gauss_seidel" => Some(Box::new(GaussSeidel)),
        "lcp_pyramid" | "lcp" => Some(Box::new(LcpPyramid)),
        "lcp_sliding" => Some(Box::new(LcpSliding)),
        _ => None,
    }
}

/// A way to solve rows.
///
/// `lambda` comes in as the warm start and goes out as the answer; `du = Y·λ` of **these blocks** is added to `du`,
/// which comes in as the sum over other islands (0 on this island's own stretches). A block without sides, or a
/// row without response, gets no multiplier.
pub trait RowSolver: Send + Sync {
    /// The name that `--solver` takes.
    fn name(&self) -> &'static str;
    /// Solves the island made of `blocks` (indices into `rows.blocks`).
    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport;
    /// An independent copy.
    fn fork(&self) -> Box<dyn RowSolver>;
}

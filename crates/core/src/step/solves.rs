//! The solves of one stage of a step, and which of them is the worst.

use crate::constraint::rows::Rows;
use crate::report::{StepReport, WorstSolve};
use crate::solver::{Islands, LargestResidual, LcpPyramid, LcpSliding, RowSolver, SolveReport};
use crate::world::view::{ObjectId, Objects};

/// A solve counts as converged below this number of tolerances, the change that ends the sweeps.
pub(super) const SOLVED: f64 = 10.0;
/// Least tolerance, m/s: that of impacts is relative to their speed, and may be near rounding.
const LEAST_TOLERANCE: f64 = 1e-9;

/// Enters the solves of a stage in the report.
pub(super) struct Solves<'a> {
    report: &'a mut StepReport,
    /// Largest residual of a converged solve, m/s.
    tolerance: f64,
    /// Whether the residual decides that a solve converged. Pivoting solvers solve another
    /// model, so their residuals say nothing about that.
    exact_cone: bool,
    /// Number of islands so far.
    islands: usize,
    /// Island, largest residual and outcome of the worst solve of this stage, if it is the worst of
    /// the frame.
    worst: Option<(usize, LargestResidual, SolveReport)>,
}

impl<'a> Solves<'a> {
    /// `tolerance`: change of a row velocity that ends the sweeps of `solver`, m/s.
    pub fn new(report: &'a mut StepReport, solver: &dyn RowSolver, tolerance: f64) -> Solves<'a> {
        let exact_cone = ![LcpPyramid.name(), LcpSliding.name()].contains(&solver.name());
        Solves { report, tolerance: SOLVED * tolerance.max(LEAST_TOLERANCE), exact_cone, islands: 0, worst: None }
    }

    /// Adds the solve of the next island; `None` if it was not solved.
    pub fn add(&mut self, solved: Option<(SolveReport, LargestResidual)>) {
        let island = self.islands;
        self.islands += 1;
        let Some((mut outcome, largest)) = solved else { return };
        if self.exact_cone {
            // not by the criterion of the solver: sweeps that change little may still be far from the solution, and
            // those that go on may be at it
            outcome.converged = largest.residual <= self.tolerance;
        }
        self.report.solved(outcome);
        if largest.residual > self.report.residual {
            self.report.residual = largest.residual;
            self.worst = Some((island, largest, outcome));
        }
    }

    /// Names the objects of the worst solve.
    pub fn finish(self, objects: Objects, rows: &Rows, islands: &Islands) {
        let Some((island, largest, outcome)) = self.worst else { return };
        let blocks = || islands.get(island).iter().map(|&b| &rows.blocks[b as usize]);
        let mut acted_on = vec![false; rows.dof];
        blocks().flat_map(|block| block.sides()).for_each(|side| acted_on[side.u as usize] = true);
        let object = |u: u32| -> Option<ObjectId> {
            let (placed, walked) = (&objects.table.placed, &objects.table.walk.places);
            let at = walked.partition_point(|place| placed[*place as usize].state_range.v.end <= u as usize);
            walked.get(at).map(|place| objects.table.order[*place as usize])
        };
        let mut sides = rows.blocks[largest.block as usize].sides().iter().map(|side| object(side.u));
        let (first, other) = (sides.next().flatten(), sides.next().flatten());
        let worst = |object| WorstSolve {
            object,
            other,
            objects: acted_on.iter().filter(|&&is| is).count() as u32,
            rows: blocks().map(|block| block.set.rows() as u32).sum(),
            tolerance: self.tolerance,
            converged: outcome.converged,
        };
        self.report.worst_solve = first.map(worst);
    }
}

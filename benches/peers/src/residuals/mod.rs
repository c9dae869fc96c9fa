//! Residual over CPU time of every solver on ten contact problems.
//!
//! A problem is what a world hands to its solver in one step: rows, free velocities and the blocks of
//! one island. Every solver starts from zero multipliers and is judged by
//! [`residual`](tumble_core::solver::residual).

mod chart;
mod problems;
mod sweeps;

pub use chart::draw;
pub use problems::{Problem, problems};

use crate::clock::cpu_seconds;
use sweeps::Sweeps;
use tumble_core::solver::{GaussSeidel, LcpPyramid, LcpSliding, RowSolver, SolverSettings, residual};

/// Time after which a curve ends, s.
const LONGEST: f64 = 1.0;
/// A solve that takes less is repeated and the median taken, s.
const SHORT: f64 = 0.05;
/// Number of repetitions of a short solve.
const REPETITIONS: usize = 5;
/// Residual below which a curve ends, m/s.
const EXACT: f64 = 1e-14;

/// Names and colors of the solvers, in the order of [`curves`].
pub const SOLVERS: [(&str, &str); 5] = [
    ("plain sweeps", "#999999"),
    ("extrapolated sweeps", "#e69f00"),
    ("gauss_seidel (sweeps, then direct)", "#0060c0"),
    ("lcp_pyramid", "#c03030"),
    ("lcp_sliding", "#009060"),
];

/// A solver on a problem: pairs of CPU time (s) and residual (m/s).
pub type Curve = Vec<(f64, f64)>;

/// Returns the curves of all solvers on a problem: of sweeps with growing limits, a point of each
/// pivoting solver, or nothing if it gives up.
pub fn curves(problem: &Problem) -> [Curve; 5] {
    let pivoting = |solver: &dyn RowSolver| {
        let (time, error, converged) = solve(problem, solver, 1);
        if converged { vec![(time, error)] } else { Vec::new() }
    };
    [
        sweep(problem, false),
        sweep(problem, true),
        limits().map(|n| solve(problem, &GaussSeidel, n)).scan(false, end).collect(),
        pivoting(&LcpPyramid),
        pivoting(&LcpSliding),
    ]
}

/// Ends a curve after its first point that is exact or took too long.
fn end(over: &mut bool, (time, error, converged): (f64, f64, bool)) -> Option<(f64, f64)> {
    if *over {
        return None;
    }
    *over = converged || time > LONGEST;
    Some((time, error))
}

/// Returns limits of sweeps: 1, 2, 5, 10 and so on.
fn limits() -> impl Iterator<Item = u32> {
    (0..7).flat_map(|power| [1, 2, 5].map(|n| n * 10_u32.pow(power)))
}

/// Returns time and residual of one solver after every limit of sweeps.
fn sweep(problem: &Problem, extrapolated: bool) -> Curve {
    let mut sweeps = Sweeps::new(problem, extrapolated);
    let (mut curve, mut time, mut done) = (Vec::new(), 0.0, 0);
    for limit in limits() {
        let before = cpu_seconds();
        (done..limit).for_each(|_| sweeps.sweep());
        time += cpu_seconds() - before;
        done = limit;
        let (lambda, du) = sweeps.result();
        let error = residual(&problem.rows, &problem.blocks, &problem.c, lambda, &du);
        curve.push((time, error));
        if time > LONGEST || error < EXACT {
            break;
        }
    }
    curve
}

/// Returns time, residual and convergence of a solver with a limit of sweeps.
fn solve(problem: &Problem, solver: &dyn RowSolver, sweeps: u32) -> (f64, f64, bool) {
    let Problem { rows, blocks, c, .. } = problem;
    let defaults = tumble_core::Settings::default().solver_settings;
    let settings = SolverSettings { max_sweeps: sweeps, max_relaxations: u32::MAX, ..defaults };
    let mut times = Vec::new();
    loop {
        let (mut lambda, mut du) = (vec![0.0; rows.len], vec![0.0; rows.dof]);
        let before = cpu_seconds();
        let report = solver.solve(rows, blocks, c, &mut lambda, &mut du, settings);
        times.push(cpu_seconds() - before);
        if times[0] > SHORT || times.len() == REPETITIONS {
            times.sort_by(f64::total_cmp);
            let error = residual(rows, blocks, c, &lambda, &du);
            return (times[times.len() / 2], error, report.converged);
        }
    }
}

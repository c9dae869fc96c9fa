//! Robots as a solver sees them: one object, soft equality rows on its joints, and some contacts and limits.

use super::{FAR, Random, all, distance, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::folded::Folded;
use crate::solver::{GaussSeidel, LcpPyramid, SolverSettings, residual};

const SETTINGS: SolverSettings =
    SolverSettings { max_sweeps: 1000, max_relaxations: u32::MAX, tolerance: 1e-9, budget: None };

/// A robot with `dof` degrees of freedom, of which all but six are damped, with limits and contacts. Free values
/// are those of a random motion.
fn robot(seed: u64, dof: usize, contacts: usize, mu: f64) -> (Rows, Vec<f64>) {
    let mut random = Random(seed);
    let mut rows = Rows::default();
    rows.clear(dof);
    let mut add = |random: &mut Random, set: RowSet, compliance: f64, scale: f64| {
        rows.push_soft(set, compliance);
        let y = rows.side(0, dof).expect("one side");
        y.iter_mut().for_each(|y| *y = scale * random.real(-1.0, 1.0));
    };
    for k in 6..dof {
        let compliance = random.real(0.1, 3.0);
        add(&mut random, RowSet::Equality, compliance, 1.0);
        if k % 3 == 0 {
            add(&mut random, RowSet::HalfLine, 0.0, 1.0);
        }
    }
    for _ in 0..contacts {
        add(&mut random, if mu > 0.0 { RowSet::Cone { mu } } else { RowSet::HalfLine }, 0.0, 0.7);
    }
    let c = (0..rows.len).map(|_| random.real(-1.0, 0.5)).collect();
    (rows, c)
}

/// Without friction the velocity is unique: that of the pivoting solver.
#[test]
fn limits_of_a_damped_robot_are_those_of_pivoting() {
    for seed in 0..200 {
        let (rows, c) = robot(seed, 18, 8, 0.0);
        let (ours, pivoted) = (solve(&GaussSeidel, &rows, &c, SETTINGS), solve(&LcpPyramid, &rows, &c, FAR));
        assert!(ours.outcome.converged && pivoted.outcome.converged, "{seed}");
        assert!(distance(&ours.du, &pivoted.du) < 1e-7, "{seed}: {:.1e}", distance(&ours.du, &pivoted.du));
    }
}

/// With friction the error is judged by the formula that shares no code with the solver. The smaller problem has
/// the same answer: its multipliers solve the whole one.
#[test]
fn contacts_of_a_damped_robot_are_solved() {
    let mut few = 0;
    for seed in 0..300 {
        let (rows, c) = robot(1000 + seed, 24, 4, 0.2);
        let solved = solve(&GaussSeidel, &rows, &c, SETTINGS);
        let left = residual(&rows, &all(&rows), &c, &solved.lambda, &solved.du);
        assert!(solved.outcome.converged && left <= 1e-8, "{seed}: {left:.1e} m/s, {:?}", solved.outcome);
        few += usize::from(solved.outcome.iterations < 25);
    }
    // most end by Newton's method, before the sweep after which other methods follow
    assert!(few > 200, "{few}");
}

/// Damping is folded into the responses of the robot, and stiff drives are not: their rows hold either way, and the
/// velocity is that of pivoting, which solves all rows together.
#[test]
fn soft_rows_hold_whether_they_are_folded_or_not() {
    let mut random = Random(7);
    for stiffness in [1e-3, 1.0, 1e3, 1e5, 1e8] {
        let (mut rows, mut c) = robot(3, 12, 3, 0.0);
        for block in 0..6 {
            rows.push_soft(RowSet::Equality, 1.0 / stiffness);
            rows.side(0, 12).expect("one side")[block] = 1.0;
            c.push(random.real(-1.0, 1.0));
        }
        let folded = Folded::new(&rows, &all(&rows), (&c, &vec![0.0; rows.len])).expect("damping is folded");
        let soft = rows.blocks.iter().filter(|b| b.set == RowSet::Equality).count();
        let left = folded.rows.blocks.iter().filter(|b| b.set == RowSet::Equality).count();
        assert_eq!(left, if stiffness > 1e4 { 6 } else { 0 }, "of {soft}");
        let (ours, pivoted) = (solve(&GaussSeidel, &rows, &c, SETTINGS), solve(&LcpPyramid, &rows, &c, FAR));
        assert!(distance(&ours.du, &pivoted.du) < 1e-8, "{stiffness}: {:.1e}", distance(&ours.du, &pivoted.du));
        for block in rows.blocks.iter().filter(|b| b.set == RowSet::Equality) {
            let row = block.row as usize;
            let w = c[row] + rows.row_velocity(block, 0, &ours.du) + block.compliance * ours.lambda[row];
            assert!(w.abs() < 1e-9, "{stiffness}: {w}");
        }
    }
}

//! Equality, half-line and interval rows against closed forms, on sliders along one line.

use super::{FAR, Random, distance, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, LcpPyramid, LcpSliding, RowSolver};

fn solvers() -> [&'static dyn RowSolver; 3] {
    [&GaussSeidel, &LcpPyramid, &LcpSliding]
}

/// Sliders of 1 degree of freedom each.
fn sliders(count: usize) -> Rows {
    let mut rows = Rows::default();
    rows.clear(count);
    rows
}

/// A row that pushes slider `i` (of mass `m`) by `sign`, for each.
fn row(rows: &mut Rows, set: RowSet, sides: &[(usize, f64, f64)]) {
    rows.push_block(set);
    for (i, m, sign) in sides {
        rows.side(*i, 1).expect("two sides at most")[0] += sign / m.sqrt();
    }
}

#[test]
fn a_motor_gives_what_it_needs_and_no_more_than_it_has() {
    let mass = 2.0;
    for solver in solvers() {
        for (lo, hi) in [
            (-3.0, 5.0),
            (0.0, 1.0),
            (-4.0, -1.0),
            (-3.0, f64::INFINITY),
            (f64::NEG_INFINITY, 5.0),
            (1.0, 1.0),
            (f64::NEG_INFINITY, f64::INFINITY),
        ] {
            for wanted in [-7.0, -1.0, 0.0, 0.3, 1.0, 9.0] {
                let mut rows = sliders(1);
                row(&mut rows, RowSet::Interval { lo, hi }, &[(0, mass, 1.0)]);
                let solved = solve(solver, &rows, &[-wanted], FAR);
                // Impulse m·Δv, within the ends.
                let expected = (mass * wanted).max(lo).min(hi);
                assert!(
                    (solved.lambda[0] - expected).abs() < 1e-12,
                    "{} {lo} {hi} {wanted}: {}",
                    solver.name(),
                    solved.lambda[0]
                );
                assert!(solved.outcome.converged);
            }
        }
    }
}

/// Two sliders welded (three times over), the first driven by a motor: they move as one mass.
#[test]
fn a_fixed_joint_makes_one_mass_of_two() {
    let (a, b) = (2.0, 3.0);
    for solver in solvers() {
        for (wanted, strength, expected) in [(1.0, 100.0, 1.0), (1.0, 2.0, 0.4), (-1.0, 2.5, -0.5)] {
            let mut rows = sliders(2);
            row(&mut rows, RowSet::Interval { lo: -strength, hi: strength }, &[(0, a, 1.0)]);
            for _ in 0..3 {
                row(&mut rows, RowSet::Equality, &[(0, a, 1.0), (1, b, -1.0)]);
            }
            let solved = solve(solver, &rows, &[-wanted, 0.0, 0.0, 0.0], FAR);
            let v = [solved.du[0] / a.sqrt(), solved.du[1] / b.sqrt()];
            assert!(distance(&v, &[expected, expected]) < 1e-9, "{}: {v:?}", solver.name());
            // The motor's impulse is the momentum of both.
            assert!((solved.lambda[0] - (a + b) * expected).abs() < 1e-8);
            assert!(solved.outcome.converged);
        }
    }
}

/// Welded to a slider that a stop holds: nothing moves, and the stop takes all the momentum.
#[test]
fn a_fixed_joint_passes_an_impulse_on_to_a_stop() {
    for solver in solvers() {
        let mut rows = sliders(2);
        row(&mut rows, RowSet::HalfLine, &[(1, 3.0, -1.0)]);
        row(&mut rows, RowSet::Equality, &[(0, 2.0, 1.0), (1, 3.0, -1.0)]);
        // Slider 0 comes at 5 m/s, slider 1 rests at its stop.
        let solved = solve(solver, &rows, &[0.0, 5.0], FAR);
        assert!(distance(&solved.lambda, &[10.0, -10.0]) < 1e-9, "{}: {:?}", solver.name(), solved.lambda);
        assert!(solved.w.iter().all(|w| w.abs() < 1e-9));
    }
}

/// A row that equalities determine wholly: a stop on a slider that is fixed to the ground.
#[test]
fn a_stop_on_what_cannot_move_does_nothing() {
    for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
        let mut rows = sliders(1);
        row(&mut rows, RowSet::Equality, &[(0, 0.3, 1.0)]);
        row(&mut rows, RowSet::HalfLine, &[(0, 0.3, 0.7)]);
        let solved = solve(solver, &rows, &[-2.0, -1.4], FAR);
        assert!(solved.outcome.converged && solved.w.iter().all(|w| w.abs() < 1e-12));
    }
}

/// Eight equalities on three degrees of freedom: solved, and by multipliers of an ordinary size.
#[test]
fn redundant_equalities_do_not_blow_up() {
    let mut random = Random(32);
    for _ in 0..100 {
        let mut rows = Rows::default();
        rows.clear(3);
        let (mut c, v) = (Vec::new(), [1.0, -0.5, 0.7]);
        for _ in 0..8 {
            rows.push_block(RowSet::Equality);
            let y = rows.side(0, 3).expect("first side");
            y.iter_mut().for_each(|y| *y = random.real(-1.0, 1.0));
            c.push(y.iter().zip(v).map(|(y, v)| y * v).sum());
        }
        let solved = solve(&LcpPyramid, &rows, &c, FAR);
        assert!(solved.outcome.converged);
        // All three degrees of freedom are stopped.
        assert!(distance(&solved.du, &v.map(|v| -v)) < 1e-12, "{:?}", solved.du);
        let largest = solved.lambda.iter().fold(0.0, |a: f64, l| a.max(l.abs()));
        assert!(largest < 100.0 && solved.lambda.iter().filter(|l| **l != 0.0).count() == 3, "{:?}", solved.lambda);
    }
}

/// Equalities that contradict each other are reported.
#[test]
fn contradicting_fixed_joints_do_not_pass_for_solved() {
    for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
        let mut rows = sliders(1);
        row(&mut rows, RowSet::Equality, &[(0, 1.0, 1.0)]);
        row(&mut rows, RowSet::Equality, &[(0, 1.0, 1.0)]);
        assert!(!solve(solver, &rows, &[1.0, 2.0], FAR).outcome.converged);
    }
}

/// Two parts of one object that has two degrees of freedom: the block's one side sees their cross
/// term.
#[test]
fn two_parts_of_one_object_meet_as_two_bodies_would() {
    let (a, b, speed) = (2.0f64, 3.0f64, 4.0);
    for solver in solvers() {
        let mut rows = Rows::default();
        rows.clear(2);
        rows.push_block(RowSet::HalfLine);
        rows.side(0, 2).expect("first part")[0] += 1.0 / a.sqrt();
        rows.side(0, 2).expect("second part")[1] -= 1.0 / b.sqrt();
        assert_eq!(rows.blocks[0].sides().len(), 1);
        let solved = solve(solver, &rows, &[-speed], FAR);
        // Inelastic collision: impulse by the reduced mass, equal and opposite.
        assert!((solved.lambda[0] - speed * a * b / (a + b)).abs() < 1e-12);
        assert!((solved.du[0] * a.sqrt() + solved.du[1] * b.sqrt()).abs() < 1e-12);
        assert!((solved.du[0] / a.sqrt() - solved.du[1] / b.sqrt() - speed).abs() < 1e-12);
    }
}

/// Mixed rows, some twice: the convex problem that all of them together are has one `w`.
#[test]
fn mixed_rows_agree_with_relaxation() {
    let mut random = Random(31);
    let mut compared = 0;
    for _ in 0..200 {
        let mut rows = sliders(4);
        let mut c = Vec::new();
        let velocity: Vec<f64> = (0..4).map(|_| random.real(-2.0, 2.0)).collect();
        for _ in 0..2 + random.index(6) {
            let set = match random.index(3) {
                0 => RowSet::Equality,
                1 => RowSet::HalfLine,
                _ => RowSet::Interval { lo: random.real(-2.0, 0.0), hi: random.real(0.0, 2.0) },
            };
            let (i, j) = (random.index(4), random.index(4));
            let sides = [(i, 1.0, 1.0), (j, 1.0, -0.6)];
            for _ in 0..1 + random.index(2) {
                row(&mut rows, set, &sides);
                c.push(velocity[i] - 0.6 * velocity[j]);
            }
        }
        let relaxed = solve(&GaussSeidel, &rows, &c, FAR);
        let pivoted = solve(&LcpPyramid, &rows, &c, FAR);
        assert!(pivoted.outcome.converged, "{:?}", rows.blocks);
        if relaxed.outcome.converged {
            compared += 1;
            assert!(distance(&relaxed.w, &pivoted.w) < 1e-6, "{:?} {:?}", relaxed.w, pivoted.w);
        }
    }
    assert!(compared > 150, "only {compared} of 200");
}

#[test]
fn what_is_not_a_number_gives_no_impulse() {
    for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
        let mut rows = sliders(1);
        row(&mut rows, RowSet::HalfLine, &[(0, 1.0, 1.0)]);
        let (mut lambda, mut du) = ([7.0], [0.0]);
        let outcome = solver.solve(&rows, &[0], &[f64::NAN], &mut lambda, &mut du, FAR);
        assert!(!outcome.converged && lambda == [0.0] && du == [0.0]);
    }
}

/// Ends that are in the wrong order are no reason to panic.
#[test]
fn an_empty_interval_does_not_panic() {
    for solver in solvers() {
        let mut rows = sliders(1);
        row(&mut rows, RowSet::Interval { lo: 2.0, hi: 1.0 }, &[(0, 1.0, 1.0)]);
        assert_eq!(solve(solver, &rows, &[-5.0], FAR).lambda, [1.0]);
    }
}

//! Soft rows: `w = c + (K + R)·λ`.

use super::{Bodies, FAR, Random, UP, distance, free, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, LcpPyramid, LcpSliding, RowSolver, residual};

fn solvers() -> [&'static dyn RowSolver; 3] {
    [&GaussSeidel, &LcpPyramid, &LcpSliding]
}

const FREE: RowSet = RowSet::Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

/// A row on one slider of mass `m`, or between two.
fn row(rows: &mut Rows, set: RowSet, compliance: f64, sides: &[(usize, f64, f64)]) {
    rows.push_soft(set, compliance);
    for (i, m, sign) in sides {
        rows.side(*i, 1).expect("two sides at most")[0] += sign / m.sqrt();
    }
}

/// `m·(v⁺ − v) = h·(kp·(q* − q − h·v⁺) + kd·(v* − v⁺))`, solved for `v⁺` by hand.
#[test]
fn an_implicit_drive_gives_the_velocity_found_by_hand() {
    let (m, v, q, wanted_q, wanted_v) = (3.0, 2.0, 0.1, 0.4, -0.5);
    for solver in solvers() {
        for (h, kp, kd) in [(0.01, 100.0, 5.0), (0.1, 1e6, 0.0), (1.0 / 240.0, 0.01, 0.0), (0.01, 0.0, 7.0)] {
            let expected = (m * v + h * (kp * (wanted_q - q) + kd * wanted_v)) / (m + h * (kd + h * kp));
            let compliance = 1.0 / (h * (kd + h * kp));
            let aim = (kp * (wanted_q - q) + kd * wanted_v) / (kd + h * kp);
            for set in [RowSet::Equality, FREE] {
                let mut rows = Rows::default();
                rows.clear(1);
                row(&mut rows, set, compliance, &[(0, m, 1.0)]);
                let solved = solve(solver, &rows, &[v - aim], FAR);
                let after = v + solved.du[0] / m.sqrt();
                assert!(
                    (after - expected).abs() < 1e-12 * aim.abs().max(1.0),
                    "{} {set:?} {kp} {kd}: {after} {expected}",
                    solver.name()
                );
                assert!(solved.outcome.converged);
            }
            // the same drive with half the impulse that it wants
            let wanted = m * (expected - v);
            let mut rows = Rows::default();
            rows.clear(1);
            row(
                &mut rows,
                RowSet::Interval { lo: -0.5 * wanted.abs(), hi: 0.5 * wanted.abs() },
                compliance,
                &[(0, m, 1.0)],
            );
            let lambda = solve(solver, &rows, &[v - aim], FAR).lambda[0];
            assert!((lambda - 0.5 * wanted).abs() < 1e-12 * wanted.abs(), "{}: {lambda} of {wanted}", solver.name());
        }
    }
}

/// Dashpots side by side, from stiff to weak: `v⁺ = (m·v + Σ vᵢ/Rᵢ)/(m + Σ 1/Rᵢ)`, each with its own part.
#[test]
fn springs_side_by_side_share_by_their_stiffness() {
    let (m, v) = (2.0, 1.5);
    let springs = [(1e-4, 0.3), (0.5, -2.0), (3.0, 4.0), (1e9, 7.0)];
    let (top, bottom) = springs.iter().fold((m * v, m), |(t, b), (r, aim)| (t + aim / r, b + 1.0 / r));
    let expected = top / bottom;
    for solver in solvers() {
        for set in [RowSet::Equality, FREE] {
            let mut rows = Rows::default();
            rows.clear(1);
            springs.iter().for_each(|(r, _)| row(&mut rows, set, *r, &[(0, m, 1.0)]));
            let solved = solve(solver, &rows, &springs.map(|(_, aim)| v - aim), FAR);
            assert!((v + solved.du[0] / m.sqrt() - expected).abs() < 1e-9, "{} {set:?}", solver.name());
            for (lambda, (r, aim)) in solved.lambda.iter().zip(springs) {
                assert!(
                    (lambda - (aim - expected) / r).abs() < 1e-8 * (1.0 + 1.0 / r),
                    "{} {set:?}: {lambda} at R = {r}",
                    solver.name()
                );
            }
        }
    }
}

/// A weak spring must not make a fixed joint beside it look redundant.
#[test]
fn a_fixed_joint_holds_beside_a_spring_a_million_million_times_weaker() {
    for solver in solvers() {
        let mut rows = Rows::default();
        rows.clear(2);
        row(&mut rows, RowSet::Equality, 1e15, &[(0, 1.0, 1.0)]);
        row(&mut rows, RowSet::Equality, 0.0, &[(0, 1.0, 1.0), (1, 2.0, -1.0)]);
        let solved = solve(solver, &rows, &[1.0, 3.0], FAR);
        assert!(
            solved.w.iter().all(|w| w.abs() < 1e-12) && (solved.lambda[1] + 2.0).abs() < 1e-12,
            "{}: {:?}",
            solver.name(),
            solved.lambda
        );
    }
}

/// Boxes pushed by soft drives, stops, rods and frictionless contacts: relaxation and pivoting agree, and the residual with both.
#[test]
fn relaxation_and_pivoting_agree_on_soft_rows() {
    let mut random = Random(77);
    let mut compared = 0;
    for _ in 0..100 {
        let count = 2 + random.index(4);
        let mut bodies = Bodies::cubes((0..count).map(|_| random.real(0.5, 5.0)).collect(), 0.5);
        for _ in 0..3 + random.index(8) {
            let bound = random.real(0.1, 2.0);
            let (set, soft) = match random.index(6) {
                0 | 1 => (RowSet::Interval { lo: -bound, hi: bound }, true),
                2 => (RowSet::Equality, true),
                3 => (RowSet::HalfLine, true),
                4 => (RowSet::Equality, false),
                _ => (RowSet::Cone { mu: 0.0 }, false),
            };
            let compliance = if soft { 10f64.powf(random.real(-2.0, 2.0)) } else { 0.0 };
            let (a, b) = (random.index(count), random.index(count));
            let arm = |random: &mut Random| [0; 3].map(|_| random.real(-0.3, 0.3));
            let sides = [(a != b).then(|| (a, arm(&mut random))), Some((b, arm(&mut random)))];
            bodies.push(set, sides, UP);
            let last = bodies.rows.blocks.len() - 1;
            bodies.rows.blocks[last].compliance = compliance;
        }
        let velocity: Vec<[f64; 6]> = (0..count).map(|_| [0; 6].map(|_| random.real(-1.0, 1.0))).collect();
        let (rows, c) = (&bodies.rows, free(&bodies.rows, &bodies.whiten(&velocity)));
        let relaxed = solve(&GaussSeidel, rows, &c, FAR);
        for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
            let pivoted = solve(solver, rows, &c, FAR);
            assert!(pivoted.outcome.converged, "{:?}", rows.blocks);
            assert!(residual(rows, &super::all(rows), &c, &pivoted.lambda, &pivoted.du) < 1e-9);
            if relaxed.outcome.converged {
                compared += 1;
                assert!(distance(&relaxed.w, &pivoted.w) < 1e-8, "{:?} {:?}", relaxed.w, pivoted.w);
                assert!(distance(&relaxed.du, &pivoted.du) < 1e-8, "{:?} {:?}", relaxed.du, pivoted.du);
                assert!(residual(rows, &super::all(rows), &c, &relaxed.lambda, &relaxed.du) < 1e-9);
            }
        }
    }
    assert!(compared >= 190, "only {compared} of 200");
}

/// `c = 1`, 1 kg: solved by `λ = −1/(1 + R)`; without `R·λ` it would be −1.
#[test]
fn the_residual_sees_the_compliance() {
    let compliance = 0.25;
    for set in [RowSet::Equality, FREE] {
        let mut rows = Rows::default();
        rows.clear(1);
        row(&mut rows, set, compliance, &[(0, 1.0, 1.0)]);
        let of = |lambda: f64| residual(&rows, &[0], &[1.0], &[lambda], &[lambda]);
        assert!(of(-0.8) < 1e-15 && (of(-1.0) - 0.25).abs() < 1e-15, "{set:?}: {} {}", of(-0.8), of(-1.0));
    }
}

/// A row without response gets no multiplier, however soft.
#[test]
fn a_soft_row_without_response_does_nothing() {
    for solver in solvers() {
        let mut rows = Rows::default();
        rows.clear(1);
        rows.push_soft(RowSet::Equality, 2.0);
        rows.side(0, 1).expect("first side");
        let solved = solve(solver, &rows, &[1.0], FAR);
        assert_eq!((solved.lambda[0], solved.du[0]), (0.0, 0.0), "{}", solver.name());
    }
}

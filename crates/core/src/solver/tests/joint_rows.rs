//! Parallel scalar rows, as a joint has them: two limits, dry friction, a drive.

use super::{FAR, Random, all, distance, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, LcpPyramid, SolverSettings, residual};

/// Adds a row of one object with the response `y`.
fn row(rows: &mut Rows, set: RowSet, compliance: f64, y: &[f64]) {
    rows.push_soft(set, compliance);
    rows.side(0, y.len()).expect("one side").copy_from_slice(y);
}

fn few(tolerance: f64) -> SolverSettings {
    SolverSettings { max_sweeps: 10, max_relaxations: 1000, tolerance, budget: None }
}

/// A slider of 2 kg at 1 m/s stops at a limit a hair away: friction takes its 0.3 N·s and the limit
/// the rest. Row by row, sweeps would pass 0.3 N·s between the two in portions of 1e-8.
#[test]
fn a_limit_a_hair_away_and_friction_share_the_load() {
    let (mass, gap) = (2.0_f64, 1e-8);
    let y = 1.0 / mass.sqrt();
    for sign in [1.0, -1.0] {
        let mut rows = Rows::default();
        rows.clear(1);
        row(&mut rows, RowSet::HalfLine, 0.0, &[sign * y]);
        row(&mut rows, RowSet::Interval { lo: -0.3, hi: 0.3 }, 0.0, &[y]);
        let solved = solve(&GaussSeidel, &rows, &[-1.0 + gap, -sign], few(1e-14));
        let expected = [mass * (1.0 - gap) - 0.3, sign * 0.3];
        assert!(solved.outcome.converged);
        assert!(distance(&solved.lambda, &expected) < 1e-14, "{sign}: {:?}", solved.lambda);
    }
}

/// The multiplier of a row at velocity `w` without its own compliance, by the definition of its set.
fn law(set: RowSet, compliance: f64, w: f64) -> f64 {
    let (lo, hi) = match set {
        RowSet::HalfLine => (0.0, f64::INFINITY),
        RowSet::Interval { lo, hi } => (lo, hi),
        _ => (f64::NEG_INFINITY, f64::INFINITY),
    };
    if compliance > 0.0 {
        (-w / compliance).max(lo).min(hi)
    } else if w < 0.0 {
        hi
    } else {
        lo
    }
}

/// A random row of a joint: a limit at either end, friction, a drive with or without limits.
fn random_row(random: &mut Random) -> (RowSet, f64, f64) {
    let soft = |random: &mut Random| random.real(0.1, 3.0);
    match random.index(5) {
        0 => (RowSet::HalfLine, 0.0, 1.0),
        1 => (RowSet::HalfLine, 0.0, -1.0),
        2 => {
            let f = random.real(0.0, 1.0);
            (RowSet::Interval { lo: -f, hi: f }, 0.0, 1.0)
        }
        3 => (RowSet::Interval { lo: -random.real(0.0, 1.0), hi: random.real(0.0, 1.0) }, soft(random), -1.0),
        _ => (RowSet::HalfLine, soft(random), 1.0),
    }
}

/// One direction with up to six rows, against bisection of the monotone equation for its velocity.
#[test]
fn a_group_is_solved_like_by_bisection() {
    let mut random = Random(11);
    for case in 0..2000 {
        let y = random.real(0.3, 3.0);
        let mut rows = Rows::default();
        rows.clear(1);
        let (mut c, mut made) = (Vec::new(), Vec::new());
        let free = random.real(-2.0, 2.0);
        for _ in 0..2 + random.index(5) {
            let (set, compliance, sign) = random_row(&mut random);
            row(&mut rows, set, compliance, &[sign * y]);
            // limits at opposite ends leave room between them
            let gap = if set == RowSet::HalfLine { random.real(0.0, 2.0) } else { random.real(-1.0, 1.0) };
            c.push(sign * free + gap);
            made.push((set, compliance, sign, gap));
        }
        let force =
            |v: f64| -> f64 { made.iter().map(|(set, r, sign, gap)| sign * law(*set, *r, sign * v + gap)).sum() };
        let (mut low, mut high) = (-1e3, 1e3);
        for _ in 0..200 {
            let v = 0.5 * (low + high);
            let (up, down) = (force(v).min(1e9), force(v).max(-1e9));
            let sum = if up == 1e9 { up } else { down };
            if v - free - y * y * sum < 0.0 { low = v } else { high = v }
        }
        let solved = solve(&GaussSeidel, &rows, &c, few(1e-12));
        let v = free + y * solved.du[0];
        assert!((v - low).abs() < 1e-9, "case {case}: {v} {low} {made:?} {:?}", solved.lambda);
        let left = residual(&rows, &all(&rows), &c, &solved.lambda, &solved.du);
        assert!(left < 1e-9, "case {case}: {left} {made:?} {:?}", solved.lambda);
        assert!(solved.outcome.converged, "case {case}");
    }
}

/// Joints of one object that are coupled, each with limits, friction and a drive: sweeps over groups
/// agree with pivoting over single rows.
#[test]
fn groups_agree_with_pivoting() {
    let mut random = Random(12);
    for case in 0..100 {
        let (dof, joints) = (5, 1 + random.index(5));
        let mut rows = Rows::default();
        rows.clear(dof);
        let mut c = Vec::new();
        let u: Vec<f64> = (0..dof).map(|_| random.real(-2.0, 2.0)).collect();
        for _ in 0..joints {
            let y: Vec<f64> = (0..dof).map(|_| random.real(-1.0, 1.0)).collect();
            for _ in 0..1 + random.index(4) {
                let (set, compliance, sign) = random_row(&mut random);
                let along: Vec<f64> = y.iter().map(|y| sign * y).collect();
                row(&mut rows, set, compliance, &along);
                let gap = if set == RowSet::HalfLine { random.real(0.0, 2.0) } else { 0.0 };
                c.push(along.iter().zip(&u).map(|(y, u)| y * u).sum::<f64>() + gap);
            }
        }
        let swept = solve(&GaussSeidel, &rows, &c, FAR);
        let pivoted = solve(&LcpPyramid, &rows, &c, FAR);
        assert!(swept.outcome.converged && pivoted.outcome.converged, "case {case}");
        assert!(distance(&swept.du, &pivoted.du) < 1e-9, "case {case}: {:?} {:?}", swept.du, pivoted.du);
    }
}

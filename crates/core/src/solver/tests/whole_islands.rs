//! Islands that sweeps do not finish: towers, walls, rows of all kinds together.

use super::{Bodies, FAR, Random, UP, all, distance, free, solve};
use crate::constraint::rows::RowSet;
use crate::solver::{GaussSeidel, LcpPyramid, RowSolver, SolverSettings, residual};

const EDGE: f64 = 0.4;
const SETTINGS: SolverSettings =
    SolverSettings { max_sweeps: 200, max_relaxations: 20_000, tolerance: 1e-9, budget: None };
const FALL: f64 = 9.81 / 60.0;

/// Four corners of the face between cube `upper` and what is below it, `shift` to its side.
fn face(bodies: &mut Bodies, mu: f64, lower: Option<usize>, upper: usize, shift: f64) {
    let (h, left, right) = (0.5 * EDGE, (-0.5 * EDGE).max(shift - 0.5 * EDGE), (0.5 * EDGE).min(shift + 0.5 * EDGE));
    for (x, y) in [(left, -h), (right, -h), (left, h), (right, h)] {
        let below = lower.map(|b| (b, [x - shift, y, h]));
        bodies.push(RowSet::Cone { mu }, [below, Some((upper, [x, y, -h]))], UP);
    }
}

fn tower(masses: Vec<f64>, mu: f64) -> Bodies {
    let count = masses.len();
    let mut bodies = Bodies::cubes(masses, EDGE);
    (0..count).for_each(|b| face(&mut bodies, mu, b.checked_sub(1), b, 0.0));
    bodies
}

/// A wall with one cube less in each row.
fn pyramid(rows: usize) -> Bodies {
    let mut bodies = Bodies::cubes(vec![64.0; rows * (rows + 1) / 2], EDGE);
    let (mut first, mut below) = (0, 0);
    for row in 0..rows {
        for i in 0..rows - row {
            if row == 0 {
                face(&mut bodies, 0.5, None, first + i, 0.0);
            } else {
                [(i, -0.21), (i + 1, 0.21)]
                    .iter()
                    .for_each(|(j, s)| face(&mut bodies, 0.5, Some(below + j), first + i, *s));
            }
        }
        (below, first) = (first, first + rows - row);
    }
    bodies
}

/// The free velocities of a step in which everything falls, and turns by up to `spin`, rad/s.
fn falling(bodies: &Bodies, spin: f64) -> Vec<f64> {
    let mut random = Random(3);
    let mut turn = || random.real(-spin, spin);
    let velocity: Vec<[f64; 6]> = bodies.mass.iter().map(|_| [turn(), turn(), turn(), turn(), turn(), -FALL]).collect();
    free(&bodies.rows, &bodies.whiten(&velocity))
}

/// Solves and checks the error by the code that shares none with the solver.
fn check(name: &str, bodies: &Bodies, c: &[f64], tolerance: f64) -> Vec<f64> {
    let solved = solve(&GaussSeidel, &bodies.rows, c, SETTINGS);
    let left = residual(&bodies.rows, &all(&bodies.rows), c, &solved.lambda, &solved.du);
    assert!(solved.outcome.converged && left <= tolerance, "{name}: {left} m/s, {:?}", solved.outcome);
    assert!(solved.outcome.iterations < 150, "{name}: {:?}", solved.outcome);
    solved.lambda
}

/// Sweeps carry the load of a tower of 100 down by one body at a time: 5e-3 m/s are left after 50.
#[test]
fn towers_are_solved_whatever_their_height() {
    for count in [10, 30, 100, 300] {
        let bodies = tower(vec![64.0; count], 0.5);
        let lambda = check(&format!("{count} cubes"), &bodies, &falling(&bodies, 0.0), 1e-8);
        // the corners of the lowest cube share the weight of all
        let corner = 0.25 * count as f64 * 64.0 * FALL;
        (0..4).for_each(|k| assert!((lambda[3 * k] / corner - 1.0).abs() < 1e-6, "{} {corner}", lambda[3 * k]));
    }
}

#[test]
fn walls_are_solved() {
    for rows in [4, 10, 20] {
        let bodies = pyramid(rows);
        check(&format!("{rows} rows"), &bodies, &falling(&bodies, 0.0), 1e-8);
    }
}

/// Heavy on light, up to ten thousand to one in each pair of neighbors.
#[test]
fn towers_of_unequal_masses_are_solved() {
    for ratio in [1e2, 1e4] {
        let bodies = tower((0..12).map(|b| if b % 2 == 0 { 1.0 } else { ratio }).collect(), 0.5);
        check(&format!("ratio {ratio}"), &bodies, &falling(&bodies, 0.0), 1e-8);
    }
}

/// Cubes that turn and slide as they meet: open, sticking and sliding contacts together.
#[test]
fn towers_that_turn_and_slide_are_solved() {
    for spin in [0.01, 0.1, 1.0] {
        let bodies = tower(vec![64.0; 20], 0.3);
        check(&format!("spin {spin}"), &bodies, &falling(&bodies, spin), 1e-8);
    }
}

/// Without friction the velocities after the solve are unique: those of the pivoting solver.
#[test]
fn velocities_without_friction_agree_with_pivoting() {
    let bodies = tower(vec![1.0; 12], 0.0);
    let c = falling(&bodies, 0.1);
    let (direct, pivoted) =
        (solve(&GaussSeidel, &bodies.rows, &c, SETTINGS), solve(&LcpPyramid, &bodies.rows, &c, FAR));
    assert!(distance(&direct.du, &pivoted.du) < 1e-7, "{}", distance(&direct.du, &pivoted.du));
}

/// Joints, joint friction with bounds, one-sided and soft rows in one tower.
#[test]
fn rows_of_all_kinds_are_solved_together() {
    let mut random = Random(11);
    for case in 0..20 {
        let count = 15;
        let mut bodies = tower((0..count).map(|_| random.real(1.0, 50.0)).collect(), 0.6);
        for b in 1..count {
            let at = [random.real(-0.2, 0.2), random.real(-0.2, 0.2), random.real(-0.2, 0.2)];
            let bound = random.real(0.0, 3.0);
            let set = match random.index(4) {
                0 => RowSet::Equality,
                1 => RowSet::HalfLine,
                2 => RowSet::Interval { lo: -bound, hi: 2.0 * bound },
                _ => RowSet::Interval { lo: f64::NEG_INFINITY, hi: bound },
            };
            let soft = if random.index(2) == 0 { random.real(0.0, 0.1) } else { 0.0 };
            bodies.rows.push_soft(set, soft);
            let rows = &mut bodies.rows;
            for (body, sign) in [(b - 1, -1.0), (b, 1.0)] {
                let y = rows.side(6 * body, 6).expect("two sides at most");
                (0..3).for_each(|k| (y[k], y[3 + k]) = (sign * at[k], sign * random.real(-1.0, 1.0)));
            }
        }
        let c = falling(&bodies, 0.1);
        let solved = solve(&GaussSeidel, &bodies.rows, &c, SETTINGS);
        let left = residual(&bodies.rows, &all(&bodies.rows), &c, &solved.lambda, &solved.du);
        assert!(solved.outcome.converged && left <= 1e-8, "case {case}: {left} m/s, {:?}", solved.outcome);
    }
}

/// Numbers that are not finite end as not converged, and nothing else.
#[test]
fn numbers_that_are_not_finite_are_reported() {
    let bodies = tower(vec![1.0; 12], 0.5);
    let mut c = falling(&bodies, 0.0);
    c[30] = f64::NAN;
    let (blocks, mut lambda, mut du) = (all(&bodies.rows), vec![0.0; bodies.rows.len], vec![0.0; bodies.rows.dof]);
    assert!(!GaussSeidel.solve(&bodies.rows, &blocks, &c, &mut lambda, &mut du, SETTINGS).converged);
}

/// A solve that ends early, from multipliers that are far too large, adds no energy: `λᵀ(c + w)/2`.
#[test]
fn a_solve_that_is_not_finished_adds_no_energy() {
    let bodies = pyramid(20);
    let c = falling(&bodies, 0.3);
    let blocks = all(&bodies.rows);
    let mut random = Random(11);
    for max_sweeps in [1, 2, 5, 20] {
        let mut lambda: Vec<f64> = c.iter().map(|_| random.real(0.0, 1e4)).collect();
        let mut du = vec![0.0; bodies.rows.dof];
        let settings = SolverSettings { max_sweeps, ..SETTINGS };
        let outcome = GaussSeidel.solve(&bodies.rows, &blocks, &c, &mut lambda, &mut du, settings);
        let mut w = c.clone();
        bodies.rows.add_velocity(&du, &mut w);
        let energy: f64 = lambda.iter().zip(c.iter().zip(&w)).map(|(l, (c, w))| 0.5 * l * (c + w)).sum();
        let scale: f64 = lambda.iter().zip(&c).map(|(l, c)| (l * c).abs()).sum();
        println!("{max_sweeps} sweeps: {energy} J of {scale}, {outcome:?}");
        assert!(!outcome.converged && energy <= 1e-9 * scale, "{max_sweeps} sweeps: {energy} J of {scale}");
    }
}

//! Nearly redundant contacts, which sweeps alone do not finish.

use super::{Bodies, Random, UP, all, free, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, RowSolver, SolverSettings, residual};

const USUAL: SolverSettings =
    SolverSettings { max_sweeps: 200, max_relaxations: 20_000, tolerance: 1e-9, budget: None };
const IMPULSE: f64 = 1.55 * 9.81 / 240.0;

/// A bowling pin on its foot: on the middle of it and on five points of the rim.
fn pin(mu: f64) -> Bodies {
    let mut bodies = Bodies::new(vec![1.55], vec![[0.0127, 0.0127, 0.002]]);
    let (radius, height) = (0.02579, 0.1475);
    bodies.push(RowSet::Cone { mu }, [None, Some((0, [0.0, 0.0, -height]))], UP);
    for angle in [0.2f64, 1.57, 2.75, 4.12, 5.3] {
        bodies.push(RowSet::Cone { mu }, [None, Some((0, [radius * angle.cos(), radius * angle.sin(), -height]))], UP);
    }
    bodies
}

/// How wrong the answer is, from all the weight on the middle of the foot.
fn wrong(rows: &Rows, c: &[f64]) -> f64 {
    let (blocks, mut lambda, mut du) = (all(rows), vec![0.0; rows.len], vec![0.0; rows.dof]);
    lambda[0] = IMPULSE;
    GaussSeidel.solve(rows, &blocks, c, &mut lambda, &mut du, USUAL);
    residual(rows, &blocks, c, &lambda, &du)
}

/// Sweeps alone leave up to 2e-5 m/s after 200 of them.
#[test]
fn a_pin_pushed_a_little_is_solved_within_the_usual_sweeps() {
    let (mut random, pin) = (Random(5), pin(0.14));
    for _ in 0..500 {
        let size = 10f64.powf(random.real(-7.0, -1.0));
        let mut push = |more: f64| size * more * random.real(-1.0, 1.0);
        let v = [push(10.0), push(10.0), push(10.0), push(1.0), push(1.0), push(0.3) - 9.81 / 240.0];
        let off = wrong(&pin.rows, &free(&pin.rows, &pin.whiten(&[v])));
        assert!(off < 2e-8, "pushed by {size} m/s: {off} m/s");
    }
}

/// Two boxes under one of a hundred times their mass, five contacts to a face: all is held, and the ground carries the weight.
#[test]
fn a_heavy_box_on_light_ones_is_solved_within_the_usual_sweeps() {
    let mut bodies = Bodies::cubes(vec![1.0, 1.0, 100.0], 1.0);
    for above in 0..3usize {
        for (x, y) in [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5), (0.0, 0.0)] {
            let below = above.checked_sub(1).map(|b| (b, [x, y, 0.5]));
            bodies.push(RowSet::Cone { mu: 0.5 }, [below, Some((above, [x, y, -0.5]))], UP);
        }
    }
    let v = [[0.0, 0.0, 0.0, 0.0, 0.0, -9.81 / 60.0]; 3];
    let c = free(&bodies.rows, &bodies.whiten(&v));
    let solved = solve(&GaussSeidel, &bodies.rows, &c, USUAL);
    assert!(solved.outcome.converged, "{:?}", solved.outcome);
    let ground: f64 = (0..5).map(|i| solved.lambda[3 * i]).sum();
    assert!((ground / (102.0 * 9.81 / 60.0) - 1.0).abs() < 1e-7, "the ground carries {ground} N·s");
    assert!(solved.w.iter().all(|w| w.abs() < 1e-7), "{:?}", solved.w);
}

//! Contacts with friction that sweeps alone do not solve: they conflict, or sweeps go in circles.

use super::{Bodies, UP, all, distance};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, RowSolver, SolverSettings, residual};

/// A block on two feet, one closer to its center, that are asked for accelerations which differ
/// along the line between them: no force gives that, so the feet are braced against each other
/// until the one that carries less slides.
#[test]
fn of_two_feet_that_conflict_the_one_that_carries_less_slides() {
    let (mu, near, far) = (0.5, 0.3, 0.5);
    let mut bodies = Bodies::cubes(vec![1.0], 1.0);
    for x in [-far, near] {
        bodies.push(RowSet::Cone { mu }, [None, Some((0, [x, 0.0, -0.5]))], UP);
    }
    for conflict in [1e-2, 1e-4, 1e-6] {
        let c = [-9.81, -conflict, 0.0, -9.81, 0.0, 0.0];
        let (mut lambda, mut du) = (vec![0.0; 6], vec![0.0; 6]);
        let settings = SolverSettings { max_sweeps: 2000, max_relaxations: 1_000_000, tolerance: 1e-9, budget: None };
        let outcome = GaussSeidel.solve(&bodies.rows, &all(&bodies.rows), &c, &mut lambda, &mut du, settings);
        // levers, and Coulomb at the foot that slides
        let (light, heavy) = (9.81 * near / (near + far), 9.81 * far / (near + far));
        let slides = [light, mu * light, 0.0, heavy, -mu * light, 0.0];
        assert!(
            outcome.converged && distance(&lambda, &slides) < 1e-7,
            "{conflict}: {outcome:?} {lambda:?} but {slides:?}"
        );
    }
}

/// Each of the recorded problems is solved to its own tolerance; the residual is computed by other
/// code.
#[test]
fn recorded_problems_are_solved() {
    assert_eq!(solve_all(include_str!("stubborn.txt"), u32::MAX), 10);
}

/// Four feet with friction that press each other through the joints of a robot: sweeps get no nearer than 1e-7 m/s,
/// and `|f|` has minima that are no solutions. Newton's method with held choices solves them; without it, all other
/// methods together end at 1e-8 to 1e-5 m/s after 350 factorizations.
#[test]
fn feet_that_are_braced_against_each_other_are_solved() {
    assert_eq!(solve_all(include_str!("braced.txt"), 100), 4);
}

/// Heaps in which all methods choose wrongly which contacts open, stick and slide: with the start from friction pyramids they are
/// solved, without it they end at 1e-8 to 1e-5 m/s.
#[test]
fn heaps_in_which_all_other_methods_choose_wrongly_are_solved() {
    assert_eq!(solve_all(include_str!("pyramids.txt"), 700), 6);
}

/// Solves recorded problems, each in at most a number of iterations, and returns their number.
fn solve_all(text: &str, most: u32) -> usize {
    let mut count = 0;
    for problem in text.split("problem ").skip(1) {
        let numbers = |line: &str| -> Vec<f64> { line.split(' ').skip(1).map(|x| x.parse().unwrap()).collect() };
        let mut lines = problem.lines();
        let head: Vec<f64> = lines.next().unwrap().split(' ').map(|x| x.parse().unwrap()).collect();
        let (mut rows, mut c, mut lambda) = (Rows::default(), Vec::new(), Vec::new());
        rows.clear(200);
        for line in lines {
            let x = numbers(line);
            if line.starts_with("cone") {
                rows.push_block(RowSet::Cone { mu: x[0] });
                c.extend(&x[1..4]);
                lambda.extend(&x[4..7]);
            } else if line.starts_with("half") {
                rows.push_block(RowSet::HalfLine);
                c.push(x[0]);
                lambda.push(x[1]);
            } else {
                rows.side(x[0] as usize, x[1] as usize).unwrap().copy_from_slice(&x[2..]);
            }
        }
        let blocks = all(&rows);
        let mut du = vec![0.0; 200];
        let settings = SolverSettings {
            max_sweeps: head[0] as u32,
            max_relaxations: head[1] as u32,
            tolerance: head[2],
            budget: None,
        };
        let outcome = GaussSeidel.solve(&rows, &blocks, &c, &mut lambda, &mut du, settings);
        let left = residual(&rows, &blocks, &c, &lambda, &du);
        assert!(
            outcome.converged && left < 20.0 * settings.tolerance && outcome.iterations <= most,
            "{} contacts: {outcome:?}, {left} of {}",
            blocks.len(),
            settings.tolerance
        );
        count += 1;
    }
    count
}

//! Friction where its answer is known: a block on a slope, a ball on a plane, fixed points of relaxation.

use super::contact::random_rows;
use super::{Bodies, FAR, Random, UP, all, distance, free, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, LcpPyramid, LcpSliding, RowSolver, residual};

const G: f64 = 9.81;
const H: f64 = 1.0 / 60.0;

fn solvers() -> [&'static dyn RowSolver; 3] {
    [&GaussSeidel, &LcpPyramid, &LcpSliding]
}

/// Velocity down the slope after one step, of a flat slab of 3 kg on four corners that had `speed`. World axes lie along the slope, which
/// falls towards `heading` in its own plane.
fn slab(solver: &dyn RowSolver, slope: f64, mu: f64, speed: f64, heading: f64) -> [f64; 6] {
    let mass = 3.0;
    let mut bodies = Bodies::new(vec![mass], vec![[mass / 12.0 * 1.01, mass / 12.0 * 1.01, mass / 6.0]]);
    for (x, y) in [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)] {
        bodies.push(RowSet::Cone { mu }, [None, Some((0, [x, y, -0.05]))], UP);
    }
    let down = speed + G * H * slope.sin();
    let u = bodies.whiten(&[[0.0, 0.0, 0.0, down * heading.cos(), down * heading.sin(), -G * H * slope.cos()]]);
    let solved = solve(solver, &bodies.rows, &free(&bodies.rows, &u), FAR);
    assert!(!solved.outcome.ray);
    let after: Vec<f64> = u.iter().zip(&solved.du).map(|(u, du)| u + du).collect();
    bodies.velocities(&after)[0]
}

/// Relaxation is slow near the threshold of sticking; pivoting is exact.
fn close(solver: &dyn RowSolver, v: [f64; 6], expected: [f64; 6]) {
    let tolerance = if solver.name() == "gauss_seidel" { 1e-6 } else { 1e-12 };
    assert!(distance(&v, &expected) < tolerance, "{}: {v:?}, not {expected:?}", solver.name());
}

#[test]
fn a_slab_sticks_exactly_where_mu_reaches_the_slope() {
    for solver in solvers() {
        for slope in [0.1f64, 0.4, 0.7] {
            for heading in [0.0, 0.3, 2.0] {
                for part in [0.5, 0.99, 0.999_999] {
                    let mu = part * slope.tan();
                    let v = G * H * (slope.sin() - mu * slope.cos());
                    let expected = [0.0, 0.0, 0.0, v * f64::cos(heading), v * f64::sin(heading), 0.0];
                    close(solver, slab(solver, slope, mu, 0.0, heading), expected);
                }
                for part in [1.000_001, 1.01, 2.0] {
                    close(solver, slab(solver, slope, part * slope.tan(), 0.0, heading), [0.0; 6]);
                }
            }
        }
    }
}

#[test]
fn a_sliding_slab_slows_as_coulomb_says() {
    for solver in solvers() {
        for (slope, mu, speed) in [(0.0f64, 0.3, 2.0), (0.3, 0.5, 1.0), (0.5, 0.2, 4.0)] {
            let v = speed + G * H * (slope.sin() - mu * slope.cos());
            close(
                solver,
                slab(solver, slope, mu, speed, 0.8),
                [0.0, 0.0, 0.0, v * 0.8f64.cos(), v * 0.8f64.sin(), 0.0],
            );
        }
        // Friction stops it within the step and does not throw it back.
        close(solver, slab(solver, 0.0, 0.5, 0.01, 0.8), [0.0; 6]);
    }
}

/// A ball: with `I = 2/5·m·r²` the tangent response is `1/m + r²/I = 7/(2m)`, so that
/// `λ_n = −m·c_n` and `λ_t = −min(μλ_n, 2m/7·|c_t|)·c_t/|c_t|`.
#[test]
fn one_contact_is_the_exact_cone_whatever_way_it_slides() {
    let mut random = Random(21);
    let mut stuck = 0;
    for _ in 0..200 {
        let (mass, r) = (random.real(0.1, 10.0), random.real(0.1, 2.0));
        let mut bodies = Bodies::new(vec![mass], vec![[0.4 * mass * r * r; 3]]);
        let mu = random.real(0.05, 1.5);
        bodies.push(RowSet::Cone { mu }, [None, Some((0, [0.0, 0.0, -r]))], UP);
        let c = [random.real(-2.0, -0.1), random.real(-3.0, 3.0), random.real(-3.0, 3.0)];
        let (normal, slide) = (-mass * c[0], c[1].hypot(c[2]));
        let friction = (mu * normal).min(2.0 / 7.0 * mass * slide);
        stuck += (friction < mu * normal) as u32;
        let expected = [normal, -friction * c[1] / slide, -friction * c[2] / slide];
        for solver in solvers() {
            let solved = solve(solver, &bodies.rows, &c, FAR);
            assert!(solved.outcome.converged);
            assert!(
                distance(&solved.lambda, &expected) < 1e-10 * (1.0 + normal),
                "{}: {:?}, not {expected:?}",
                solver.name(),
                solved.lambda
            );
            assert!(residual(&bodies.rows, &all(&bodies.rows), &c, &solved.lambda, &solved.du) < 1e-9);
        }
    }
    assert!((20..180).contains(&stuck), "{stuck} of 200 stick: the test wants both kinds");
}

#[test]
fn what_relaxation_converges_to_is_a_coulomb_solution() {
    let mut random = Random(22);
    let mut converged = 0;
    for _ in 0..200 {
        let (rows, c) = random_rows(&mut random, |r| RowSet::Cone { mu: r.real(0.0, 1.0) });
        let solved = solve(&GaussSeidel, &rows, &c, FAR);
        if !solved.outcome.converged {
            continue;
        }
        converged += 1;
        assert!(residual(&rows, &all(&rows), &c, &solved.lambda, &solved.du) < 1e-9);
        for block in &rows.blocks {
            // The definition, not the natural map.
            let RowSet::Cone { mu } = block.set else { continue };
            let i = block.row as usize;
            let (l, w) = (&solved.lambda[i..i + 3], &solved.w[i..i + 3]);
            let slip = w[1].hypot(w[2]);
            assert!(l[0].min(w[0]).abs() < 1e-8 && l[1].hypot(l[2]) <= mu * l[0] + 1e-9);
            assert!(
                (0..2).all(|t| (l[1 + t] * slip + mu * l[0] * w[1 + t]).abs() < 1e-7),
                "friction not against sliding: {l:?} {w:?}"
            );
        }
    }
    assert!(converged > 100, "only {converged} of 200 converged");
}

/// A tangent without response (out of a planar mechanism's plane) gets no multiplier, and a contact without any none at all.
#[test]
fn dead_rows_get_no_multiplier() {
    for solver in solvers() {
        let mut rows = crate::constraint::rows::Rows::default();
        rows.clear(2);
        rows.push_block(RowSet::Cone { mu: 0.5 });
        // Degrees of freedom x and z of 1 kg: normal z, first tangent x, second tangent dead.
        rows.side(0, 2).expect("first side").copy_from_slice(&[0.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        rows.push_block(RowSet::Cone { mu: 0.5 });
        rows.side(0, 2).expect("first side");
        rows.push_block(RowSet::HalfLine);
        let solved = solve(solver, &rows, &[-1.0, 3.0, 0.0, -1.0, 1.0, 1.0, -1.0], FAR);
        assert!(
            distance(&solved.lambda, &[1.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0]) < 1e-12,
            "{}: {:?}",
            solver.name(),
            solved.lambda
        );
    }
}

/// A foot of a robot that moves in a plane: across it a force moves nothing, whatever way the tangents point.
#[test]
fn a_contact_in_a_plane_sticks_at_once_and_slides_as_coulomb_says() {
    let (normal, along) = ([0.9, 1.0], [1.0, -0.2]);
    for heading in [0.0f64, 0.3, 1.5, 2.0] {
        let tangents = [heading.cos(), heading.sin()];
        let mut rows = Rows::default();
        rows.clear(2);
        rows.push_block(RowSet::Cone { mu: 1.5 });
        let y = rows.side(0, 2).expect("first side");
        (0..2).for_each(|i| y[i] = normal[i]);
        for (k, share) in tangents.iter().enumerate() {
            (0..2).for_each(|i| y[2 * (k + 1) + i] = share * along[i]);
        }
        // the velocity that a normal impulse of 2 and a tangential one of `stops` bring to rest
        let velocity = |stops: f64| [0, 1].map(|i| -2.0 * normal[i] - stops * along[i]);
        let stuck = solve(&GaussSeidel, &rows, &free(&rows, &velocity(1.0)), FAR);
        let expected = [2.0, tangents[0], tangents[1]];
        assert!(distance(&stuck.lambda, &expected) < 1e-12, "{heading}: {:?}", stuck.lambda);
        assert!(stuck.outcome.iterations <= 2, "{heading}: {}", stuck.outcome.iterations);
        let slides = solve(&GaussSeidel, &rows, &free(&rows, &velocity(4.0)), FAR);
        let [n, t] = [slides.lambda[0], tangents[0] * slides.lambda[1] + tangents[1] * slides.lambda[2]];
        let after = tangents[0] * slides.w[1] + tangents[1] * slides.w[2];
        assert!((t - 1.5 * n).abs() < 1e-12 && after < -0.1 && slides.w[0].abs() < 1e-12, "{heading}: {n} {t} {after}");
    }
}

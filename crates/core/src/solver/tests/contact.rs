//! Many contacts at once: pivoting against relaxation, redundant contacts, stacks.

use super::{Bodies, FAR, Random, Solved, UP, distance, free, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, Islands, LcpPyramid, LcpSliding, RowSolver, SolverSettings, residual};

const WEIGHT: f64 = 9.81 / 60.0;

/// Bodies in a random mess of contacts, each between two bodies or with the ground, some of them twice.
pub(super) fn random_rows(random: &mut Random, set: impl Fn(&mut Random) -> RowSet) -> (Rows, Vec<f64>) {
    let count = 1 + random.index(4);
    let mass: Vec<f64> = (0..count).map(|_| random.real(0.5, 3.0)).collect();
    let inertia = mass.iter().map(|m| [0.1 * m, 0.15 * m, 0.2 * m]).collect();
    let mut bodies = Bodies::new(mass, inertia);
    for _ in 0..1 + random.index(3 * count + 2) {
        let (a, b) = (random.index(count + 1), random.index(count));
        let mut arm = || [random.real(-1.0, 1.0), random.real(-1.0, 1.0), random.real(-1.0, 1.0)];
        let (at_a, at_b) = (arm(), arm());
        let sides = [(a != b && a < count).then_some((a, at_a)), Some((b, at_b))];
        let (set, frame) = (set(random), frame(random));
        for _ in 0..1 + random.index(2) {
            bodies.push(set, sides, frame);
        }
    }
    let u: Vec<f64> = (0..6 * count).map(|_| random.real(-1.0, 1.0)).collect();
    let c = free(&bodies.rows, &u);
    (bodies.rows, c)
}

/// A random right-handed frame.
fn frame(random: &mut Random) -> [[f64; 3]; 3] {
    use nalgebra::Vector3;
    let mut vector = || Vector3::from_fn(|_, _| random.real(-1.0, 1.0));
    let n = vector().normalize();
    let t = n.cross(&vector()).normalize();
    [n.into(), t.into(), n.cross(&t).into()]
}

fn complementarity(solved: &Solved) -> f64 {
    solved.lambda.iter().zip(&solved.w).map(|(l, w)| l.min(*w).abs()).fold(0.0, f64::max)
}

#[test]
fn pivoting_and_relaxation_agree_without_friction() {
    let mut random = Random(11);
    let mut compared = 0;
    for _ in 0..200 {
        let (rows, c) = random_rows(&mut random, |_| RowSet::HalfLine);
        let relaxed = solve(&GaussSeidel, &rows, &c, FAR);
        let wrong = residual(&rows, &super::all(&rows), &c, &relaxed.lambda, &relaxed.du);
        for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
            let pivoted = solve(solver, &rows, &c, FAR);
            assert!(pivoted.outcome.converged && !pivoted.outcome.ray);
            assert!(complementarity(&pivoted) < 1e-9, "{}", complementarity(&pivoted));
            if wrong < 1e-10 {
                assert!(distance(&pivoted.w, &relaxed.w) < 1e-6, "{}", distance(&pivoted.w, &relaxed.w));
                assert!(distance(&pivoted.du, &relaxed.du) < 1e-6, "{}", distance(&pivoted.du, &relaxed.du));
                compared += 1;
            }
        }
    }
    assert!(compared > 300, "only {compared} of 400 comparisons");
}

/// With `μ = 0` a cone is its normal row.
#[test]
fn a_cone_without_friction_is_a_half_line() {
    let seeds = 20..60;
    for seed in seeds {
        let (cones, c) = random_rows(&mut Random(seed), |_| RowSet::Cone { mu: 0.0 });
        let (lines, c_lines) = random_rows(&mut Random(seed), |_| RowSet::HalfLine);
        let (a, b) = (solve(&LcpPyramid, &cones, &c, FAR), solve(&LcpSliding, &lines, &c_lines, FAR));
        assert!(distance(&a.du, &b.du) < 1e-9);
    }
}

/// A pyramid solution lies inside the cone around the pyramid and dissipates at least as much as the square within it.
fn check_pyramid(rows: &Rows, solved: &Solved) {
    for block in &rows.blocks {
        let RowSet::Cone { mu } = block.set else { continue };
        let i = block.row as usize;
        let (l, w) = (&solved.lambda[i..i + 3], &solved.w[i..i + 3]);
        let (friction, slip) = (l[1].hypot(l[2]), w[1].hypot(w[2]));
        assert!(l[0].min(w[0]).abs() < 1e-9, "normal: {l:?} {w:?}");
        assert!(friction <= mu * l[0] + 1e-9, "in the cone: {l:?}");
        let power = l[1] * w[1] + l[2] * w[2];
        // A sliding contact dissipates at least what the inscribed square's nearest edge gives.
        assert!(power <= -mu * l[0] * slip / 2f64.sqrt() + 1e-8 * (1.0 + slip), "dissipates: {l:?} {w:?}");
    }
}

#[test]
fn the_pyramid_holds_on_random_frictional_contacts() {
    let mut random = Random(12);
    let mut iterations = 0;
    for _ in 0..200 {
        let (rows, c) = random_rows(&mut random, |r| RowSet::Cone { mu: r.real(0.0, 1.5) });
        let solved = solve(&LcpPyramid, &rows, &c, FAR);
        assert!(solved.outcome.converged && !solved.outcome.ray, "{:?}", solved.outcome);
        check_pyramid(&rows, &solved);
        iterations += solved.outcome.iterations;
    }
    assert!(iterations > 200);
}

/// The thesis's form: friction only along `−c_t`, at its bound where the contact still slides that way.
#[test]
fn the_sliding_form_holds_on_random_frictional_contacts() {
    let mut random = Random(13);
    for _ in 0..200 {
        let (rows, c) = random_rows(&mut random, |r| RowSet::Cone { mu: r.real(0.0, 1.5) });
        let solved = solve(&LcpSliding, &rows, &c, FAR);
        assert!(solved.outcome.converged && !solved.outcome.ray, "{:?}", solved.outcome);
        for block in &rows.blocks {
            let RowSet::Cone { mu } = block.set else { continue };
            let i = block.row as usize;
            let (l, w, size) = (&solved.lambda[i..i + 3], &solved.w[i..i + 3], c[i + 1].hypot(c[i + 2]));
            let d = [-c[i + 1] / size, -c[i + 2] / size];
            let (push, along, across) =
                (l[1] * d[0] + l[2] * d[1], w[1] * d[0] + w[2] * d[1], l[1] * d[1] - l[2] * d[0]);
            assert!(l[0].min(w[0]).abs() < 1e-9);
            assert!(across.abs() < 1e-12 && push > -1e-12 && push <= mu * l[0] + 1e-9);
            assert!(
                along >= 0.0 || (push - mu * l[0]).abs().min(along.abs()) < 1e-9,
                "slides below the bound: {push} {along}"
            );
            assert!(along <= 0.0 || push.abs().min(along) < 1e-9, "pushes past rest: {push} {along}");
        }
    }
}

/// Fixed joints, stops, motors and contacts in one problem: each row satisfies its own set.
#[test]
fn all_kinds_of_rows_are_solved_together() {
    let mut random = Random(16);
    let mut at_an_end = 0;
    for _ in 0..200 {
        let (rows, c) = random_rows(&mut random, |r| match r.index(8) {
            0 => RowSet::Equality,
            1 => RowSet::HalfLine,
            2 | 3 => RowSet::Interval { lo: r.real(-0.5, 0.0), hi: r.real(0.0, 0.5) },
            _ => RowSet::Cone { mu: r.real(0.0, 1.5) },
        });
        for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
            let solved = solve(solver, &rows, &c, FAR);
            assert!(solved.outcome.converged && !solved.outcome.ray, "{} {:?}", solver.name(), solved.outcome);
            for block in &rows.blocks {
                let (l, w) = (solved.lambda[block.row as usize], solved.w[block.row as usize]);
                let wrong = match block.set {
                    RowSet::Equality => w.abs(),
                    RowSet::HalfLine | RowSet::Cone { .. } => l.min(w).abs(),
                    RowSet::Interval { lo, .. } if w > 1e-9 => (l - lo).abs(),
                    RowSet::Interval { hi, .. } if w < -1e-9 => (l - hi).abs(),
                    RowSet::Interval { lo, hi } => (lo - l).max(l - hi).max(0.0),
                };
                assert!(wrong < 1e-9, "{} {:?}: {l} {w}", solver.name(), block.set);
                at_an_end += (matches!(block.set, RowSet::Interval { .. }) && w.abs() > 1e-6) as u32;
            }
        }
    }
    assert!(at_an_end > 50, "only {at_an_end} motors at an end");
}

/// A tower of cubes of 1 m, four contacts per face.
pub(super) fn tower(mass: Vec<f64>, set: RowSet) -> Bodies {
    let count = mass.len();
    let mut bodies = Bodies::cubes(mass, 1.0);
    for upper in 0..count {
        for (x, y) in [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)] {
            let below = (upper > 0).then(|| (upper - 1, [x, y, 0.5]));
            bodies.push(set, [below, Some((upper, [x, y, -0.5]))], UP);
        }
    }
    bodies
}

/// Normal impulses of each face against the weight that stands on it.
fn check_faces(bodies: &Bodies, solved: &Solved, tolerance: f64) {
    let rows = bodies.rows.blocks[0].set.rows();
    for face in 0..bodies.mass.len() {
        let carried: f64 = (0..4).map(|i| solved.lambda[rows * (4 * face + i)]).sum();
        let weight: f64 = bodies.mass[face..].iter().sum::<f64>() * WEIGHT;
        assert!((carried - weight).abs() < tolerance * weight, "face {face}: {carried} of {weight}");
    }
}

fn falling(bodies: &Bodies) -> Vec<f64> {
    bodies.whiten(&vec![[0.0, 0.0, 0.0, 0.0, 0.0, -WEIGHT]; bodies.mass.len()])
}

#[test]
fn a_tower_of_ten_stands_exactly() {
    let heavy: Vec<f64> = (0..10).map(|i| if i == 9 { 1000.0 } else { 1.0 }).collect();
    for mass in [vec![1.0; 10], heavy] {
        for set in [RowSet::HalfLine, RowSet::Cone { mu: 0.5 }] {
            let bodies = tower(mass.clone(), set);
            let c = free(&bodies.rows, &falling(&bodies));
            for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
                let solved = solve(solver, &bodies.rows, &c, FAR);
                assert!(solved.outcome.converged, "{} {:?}", solver.name(), solved.outcome);
                assert!(solved.w.iter().all(|w| w.abs() < 1e-9), "{}: {:?}", solver.name(), solved.w);
                assert!(solved.lambda.iter().step_by(set.rows()).all(|l| *l >= 0.0));
                check_faces(&bodies, &solved, 1e-9);
            }
        }
    }
}

/// Every cube pushed its own way: K singular (rank 60 of 120), many contacts sliding, some opening.
#[test]
fn a_shaken_tower_is_solved_exactly() {
    let mut random = Random(14);
    for top in [1.0, 1000.0] {
        for _ in 0..5 {
            let mut mass = vec![1.0; 10];
            mass[9] = top;
            let bodies = tower(mass, RowSet::Cone { mu: 0.5 });
            let mut u = falling(&bodies);
            u.iter_mut().for_each(|u| *u += random.real(-0.3, 0.3));
            let c = free(&bodies.rows, &u);
            for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
                let solved = solve(solver, &bodies.rows, &c, FAR);
                assert!(solved.outcome.converged, "{} {:?}", solver.name(), solved.outcome);
                if solver.name() == "lcp_pyramid" {
                    check_pyramid(&bodies.rows, &solved);
                }
            }
        }
    }
}

/// A body that fits exactly between two walls, and one that does not.
#[test]
fn walls_that_touch_are_no_contradiction_and_walls_that_crush_are() {
    let mut bodies = Bodies::cubes(vec![2.0], 1.0);
    let down = [[0.0, 0.0, -1.0], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    for (x, y) in [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)] {
        bodies.push(RowSet::HalfLine, [None, Some((0, [x, y, -0.5]))], UP);
        bodies.push(RowSet::HalfLine, [None, Some((0, [x, y, 0.5]))], down);
    }
    let mut c = free(&bodies.rows, &bodies.whiten(&[[0.1, 0.2, 0.0, 0.3, 0.0, -0.7]]));
    // Rounding that makes the rows contradict each other.
    c.iter_mut().for_each(|c| *c -= 1e-17);
    let solved = solve(&LcpPyramid, &bodies.rows, &c, FAR);
    assert!(solved.outcome.converged && !solved.outcome.ray);
    // All that the walls leave is sliding along x and y and spin about z.
    assert!(solved.w.iter().all(|w| w.abs() < 1e-12));

    // Both walls come at 1 m/s.
    let crushed = solve(
        &LcpPyramid,
        &bodies.rows,
        &vec![-1.0; bodies.rows.len],
        SolverSettings { max_sweeps: 10, max_relaxations: u32::MAX, tolerance: 1e-9, budget: None },
    );
    assert!(crushed.outcome.ray && !crushed.outcome.converged);
    assert!(crushed.lambda.iter().all(|l| l.is_finite() && *l >= 0.0));
}

#[test]
fn the_same_problem_gives_the_same_bits() {
    let make = || random_rows(&mut Random(99), |_| RowSet::Cone { mu: 0.7 });
    let ((rows, c), (again, c_again)) = (make(), make());
    let (a, b) = (solve(&LcpPyramid, &rows, &c, FAR), solve(LcpPyramid.fork().as_ref(), &again, &c_again, FAR));
    assert!(a.lambda.iter().zip(&b.lambda).all(|(a, b)| a.to_bits() == b.to_bits()));
}

/// Solved island by island, from a warm start, beside what other islands have already added to `du`: the same answer.
#[test]
fn islands_and_warm_starts_change_nothing() {
    let mut pair = Bodies::cubes(vec![1.0, 2.0, 3.0], 1.0);
    for (upper, x) in [(0, 0.5), (2, 0.3), (0, -0.5), (1, 0.2), (2, -0.1)] {
        pair.push(
            RowSet::Cone { mu: 0.4 },
            [(upper == 1).then_some((0, [x, 0.1, 0.5])), Some((upper, [x, 0.1, -0.5]))],
            UP,
        );
    }
    let mut random = Random(15);
    let u: Vec<f64> = (0..18).map(|_| random.real(-1.0, 0.2)).collect();
    let (rows, c) = (&pair.rows, free(&pair.rows, &u));
    let mut islands = Islands::default();
    islands.build(rows, |_| true);
    assert_eq!(islands.len(), 2);
    for solver in [&LcpPyramid as &dyn RowSolver, &LcpSliding] {
        let whole = solve(solver, rows, &c, FAR);
        let (mut lambda, mut du) = (vec![0.25; rows.len], vec![0.0; rows.dof]);
        for island in islands.iter() {
            assert!(solver.solve(rows, island, &c, &mut lambda, &mut du, FAR).converged);
        }
        assert!(distance(&whole.du, &du) < 1e-12);
        assert!(distance(&free(rows, &du), &free(rows, &whole.du)) < 1e-12);
    }
}

/// A thousand contacts are beyond pivoting: relaxation takes over and says so.
#[test]
fn too_many_contacts_go_to_relaxation() {
    let mut bodies = Bodies::cubes(vec![1.0; 501], 1.0);
    for body in 0..501 {
        bodies.push(RowSet::Cone { mu: 0.5 }, [None, Some((body, [0.0, 0.0, -0.5]))], UP);
    }
    let c = free(&bodies.rows, &falling(&bodies));
    let solved = solve(&LcpPyramid, &bodies.rows, &c, FAR);
    assert!(!solved.outcome.converged && !solved.outcome.ray);
    assert!(solved.lambda.iter().step_by(3).all(|l| (l - WEIGHT).abs() < 1e-12));
    assert!(solve(&LcpSliding, &bodies.rows, &c, FAR).outcome.converged, "1503 unknowns are within the cap");
}

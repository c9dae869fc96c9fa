//! Equality rows that are solved at once: chains and loops of boxes pinned to each other.

use super::{Bodies, Random, Solved, UP, all, distance, free, solve};
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{GaussSeidel, LcpPyramid, MAX_DIRECT_ROWS, SolverSettings, residual};
use nalgebra::{DMatrix, DVector};

/// The default settings of a step.
const STEP: SolverSettings = SolverSettings { max_sweeps: 200, max_relaxations: 20_000, tolerance: 1e-9, budget: None };
const GRAVITY: [f64; 6] = [0.0, 0.0, 0.0, 0.0, 0.0, -9.81 / 60.0];

/// Bars of 0.2 m along the sides of a regular polygon in a vertical plane (`closed`), or along a line.
struct Chain {
    bodies: Bodies,
    /// Half a bar, in world axes, of each.
    half: Vec<[f64; 3]>,
}

impl Chain {
    fn new(mass: Vec<f64>, closed: bool) -> Chain {
        let turn = if closed { std::f64::consts::TAU / mass.len() as f64 } else { 0.0 };
        let half =
            (0..mass.len()).map(|i| [0.1 * (turn * i as f64).cos(), 0.0, 0.1 * (turn * i as f64).sin()]).collect();
        let inertia = mass.iter().map(|m| [m * 0.04 / 12.0, m * 0.04 / 12.0, m * 0.01 / 12.0]).collect();
        Chain { bodies: Bodies::new(mass, inertia), half }
    }

    /// Pins the far end of bar `a` (or the world) to the near end of bar `b`: three rows.
    fn pin(&mut self, a: Option<usize>, b: usize) {
        let sides = [a.map(|a| (a, self.half[a])), Some((b, self.half[b].map(|x| -x)))];
        for axis in UP {
            self.bodies.push(RowSet::Equality, sides, [axis; 3]);
        }
    }

    /// Pins all in a row, the first to the world.
    fn hang(mass: Vec<f64>) -> Chain {
        let mut chain = Chain::new(mass, false);
        chain.pin(None, 0);
        (1..chain.half.len()).for_each(|b| chain.pin(Some(b - 1), b));
        chain
    }

    /// The velocities that gravity and a twist of every third bar give in a step.
    fn pulled(&self) -> Vec<f64> {
        let velocity: Vec<[f64; 6]> = (0..self.half.len())
            .map(|i| {
                let mut v = GRAVITY;
                v[i % 3] += 0.1 * (1 + i % 7) as f64;
                v
            })
            .collect();
        free(&self.bodies.rows, &self.bodies.whiten(&velocity))
    }
}

/// The equalities' answer by a pseudo-inverse: `Δu = −Y·(YᵀY + R)⁺·c`.
fn by_pseudo_inverse(rows: &Rows, c: &[f64]) -> Vec<f64> {
    let mut y = DMatrix::zeros(rows.dof, rows.len);
    for (i, block) in rows.blocks.iter().enumerate() {
        for side in block.sides() {
            (0..side.dof as usize).for_each(|k| y[(side.u as usize + k, i)] = rows.response(side, 0)[k]);
        }
    }
    let compliance = DVector::from_iterator(rows.len, rows.blocks.iter().map(|b| b.compliance));
    let k = y.transpose() * &y + DMatrix::from_diagonal(&compliance);
    let inverse = k.pseudo_inverse(1e-10).expect("a positive tolerance");
    (-(&y * (inverse * DVector::from_column_slice(c)))).as_slice().to_vec()
}

fn check(rows: &Rows, c: &[f64], tolerance: f64, sweeps: u32) -> Solved {
    let solved = solve(&GaussSeidel, rows, c, STEP);
    let left = residual(rows, &all(rows), c, &solved.lambda, &solved.du);
    assert!(solved.outcome.converged && left <= tolerance, "residual {left} after {:?}", solved.outcome);
    assert!(solved.outcome.iterations <= sweeps, "{:?}", solved.outcome);
    solved
}

#[test]
fn a_closed_chain_of_twenty_pulled_at_is_solved_at_once() {
    let mut chain = Chain::new(vec![1.0; 20], true);
    (0..20).for_each(|b| chain.pin(Some((b + 19) % 20), b));
    chain.pin(None, 3);
    let c = chain.pulled();
    let solved = check(&chain.bodies.rows, &c, 1e-9, 1);
    assert!(distance(&solved.du, &by_pseudo_inverse(&chain.bodies.rows, &c)) < 1e-9);
}

#[test]
fn pins_that_are_there_twice_change_nothing() {
    let (mut once, mut twice) = (Chain::new(vec![1.0; 12], true), Chain::new(vec![1.0; 12], true));
    for b in 0..12 {
        once.pin(Some((b + 11) % 12), b);
        (0..1 + b % 3).for_each(|_| twice.pin(Some((b + 11) % 12), b));
    }
    let du = check(&once.bodies.rows, &once.pulled(), 1e-9, 1).du;
    let solved = check(&twice.bodies.rows, &twice.pulled(), 1e-9, 1);
    assert!(distance(&du, &solved.du) < 1e-9);
    let largest = solved.lambda.iter().fold(0.0, |a: f64, l| a.max(l.abs()));
    assert!(largest < 100.0, "multipliers of an ordinary size: {largest}");
}

#[test]
fn a_thousandfold_mass_at_the_end_is_held() {
    for ratio in [1e3, 1e-3] {
        let mut mass = vec![1.0; 20];
        mass[19] = ratio;
        let chain = Chain::hang(mass);
        let c = chain.pulled();
        let solved = check(&chain.bodies.rows, &c, 1e-9, 1);
        assert!(distance(&solved.du, &by_pseudo_inverse(&chain.bodies.rows, &c)) < 1e-8 * ratio.max(1.0).sqrt());
    }
}

/// Pins that are springs, beside rigid ones and beside drives without limits, which are equalities too.
#[test]
fn soft_pins_and_drives_are_solved_with_the_others() {
    let mut random = Random(5);
    let mut chain = Chain::hang(vec![1.0; 10]);
    for (b, turning) in (0..10).zip([0, 1, 2].into_iter().cycle()) {
        let free = RowSet::Interval { lo: f64::NEG_INFINITY, hi: f64::INFINITY };
        chain.bodies.push(free, [None, Some((b, chain.half[b]))], [UP[turning]; 3]);
    }
    for block in chain.bodies.rows.blocks.iter_mut().filter(|b| b.row % 2 == 1) {
        block.compliance = 10f64.powf(random.real(-3.0, 3.0));
    }
    let c = chain.pulled();
    let solved = check(&chain.bodies.rows, &c, 1e-9, 1);
    assert!(distance(&solved.du, &by_pseudo_inverse(&chain.bodies.rows, &c)) < 1e-9);
}

/// A chain with a heavy end that lies on two blocks: contacts push all of it, with the joints held, and need few sweeps.
#[test]
fn contacts_move_what_hangs_on_the_body_that_they_touch() {
    for (mu, sweeps) in [(0.0, 8), (0.5, 30)] {
        let mut mass = vec![1.0; 20];
        mass[19] = 1000.0;
        let mut chain = Chain::hang(mass);
        for (b, at) in [(5, [0.0, 0.0, -0.05]), (12, [0.05, 0.0, -0.05]), (19, [0.1, 0.0, -0.05])] {
            chain.bodies.push(RowSet::Cone { mu }, [None, Some((b, at))], UP);
        }
        let c = chain.pulled();
        let relaxed = check(&chain.bodies.rows, &c, 1e-8, sweeps);
        if mu == 0.0 {
            let pivoted = solve(&LcpPyramid, &chain.bodies.rows, &c, STEP);
            assert!(distance(&relaxed.du, &pivoted.du) < 1e-6, "{}", distance(&relaxed.du, &pivoted.du));
        }
    }
}

/// Two rings, boxes between and under them, stops and motors with limits: the same as by pivoting.
#[test]
fn linkages_among_other_rows_agree_with_pivoting() {
    let mut random = Random(6);
    for _ in 0..40 {
        let mut chain = Chain::new((0..12).map(|_| random.real(0.3, 3.0)).collect(), true);
        for ring in [0, 4] {
            (0..4).for_each(|b| chain.pin(Some(ring + (b + 3) % 4), ring + b));
        }
        for _ in 0..1 + random.index(12) {
            let (a, b, bound) = (random.index(12), random.index(12), random.real(0.01, 1.0));
            let set = match random.index(4) {
                0 => RowSet::Interval { lo: -bound, hi: bound },
                1 => RowSet::HalfLine,
                _ => RowSet::Cone { mu: 0.0 },
            };
            let arm = |random: &mut Random| [0; 3].map(|_| random.real(-0.1, 0.1));
            chain.bodies.push(set, [(a != b).then(|| (a, arm(&mut random))), Some((b, arm(&mut random)))], UP);
            if random.index(3) == 0 && set.rows() == 1 {
                chain.bodies.rows.blocks.last_mut().expect("just pushed").compliance = random.real(0.1, 2.0);
            }
        }
        let (rows, c) = (&chain.bodies.rows, chain.pulled());
        let relaxed = solve(
            &GaussSeidel,
            rows,
            &c,
            SolverSettings { tolerance: 1e-12, max_sweeps: 20_000, max_relaxations: u32::MAX, budget: None },
        );
        let pivoted = solve(&LcpPyramid, rows, &c, STEP);
        assert!(relaxed.outcome.converged && pivoted.outcome.converged, "{:?}", relaxed.outcome);
        assert!(distance(&relaxed.du, &pivoted.du) < 1e-7, "{}", distance(&relaxed.du, &pivoted.du));
    }
}

/// A contact along a direction that the joints hold has nothing to move.
#[test]
fn a_stop_along_a_joint_does_nothing() {
    let mut bodies = Bodies::cubes(vec![2.0], 0.5);
    for axis in UP {
        bodies.push(RowSet::Equality, [None, Some((0, [0.0; 3]))], [axis; 3]);
    }
    bodies.push(RowSet::HalfLine, [None, Some((0, [0.0; 3]))], UP);
    bodies.push(RowSet::Cone { mu: 0.5 }, [None, Some((0, [0.0; 3]))], UP);
    let c = free(&bodies.rows, &bodies.whiten(&[[0.1, 0.2, 0.3, 1.0, 2.0, -3.0]]));
    let solved = check(&bodies.rows, &c, 1e-12, 2);
    // the pin takes 2 kg times the velocity; spin stays
    assert!(distance(&solved.lambda, &[6.0, -2.0, -4.0, 0.0, 0.0, 0.0, 0.0]) < 1e-12, "{:?}", solved.lambda);
}

/// Joints that contradict each other are reported.
#[test]
fn contradicting_joints_do_not_pass_for_solved() {
    let mut bodies = Bodies::cubes(vec![1.0], 0.5);
    (0..2).for_each(|_| bodies.push(RowSet::Equality, [None, Some((0, [0.0; 3]))], UP));
    assert!(!solve(&GaussSeidel, &bodies.rows, &[1.0, 2.0], STEP).outcome.converged);
}

/// Larger linkages are solved with all other rows of the island.
#[test]
fn a_linkage_that_is_too_large_for_a_dense_factor_is_solved() {
    let links = MAX_DIRECT_ROWS / 3;
    let small = Chain::hang(vec![1.0; links]);
    check(&small.bodies.rows, &small.pulled(), 1e-9, 1);
    for links in [links + 1, 10 * links] {
        let large = Chain::hang(vec![1.0; links]);
        let c = large.pulled();
        let settings = SolverSettings { max_sweeps: 200, max_relaxations: u32::MAX, tolerance: 1e-9, budget: None };
        let solved = solve(&GaussSeidel, &large.bodies.rows, &c, settings);
        let left = residual(&large.bodies.rows, &all(&large.bodies.rows), &c, &solved.lambda, &solved.du);
        assert!(solved.outcome.converged && left <= 1e-8, "{links} links: {left}");
    }
}

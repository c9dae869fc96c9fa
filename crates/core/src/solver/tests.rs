//! Tests of the solvers on problems built by hand.

mod contact;
mod friction;
mod islands;
mod joint_rows;
mod linkages;
mod pivoting;
mod redundant;
mod residuals;
mod robots;
mod scalar;
mod soft;
mod stubborn;
mod whole_islands;

use super::{RowSolver, SolveReport, SolverSettings};
use crate::constraint::rows::{RowSet, Rows};

/// As far as rounding lets an iteration go.
pub(super) const FAR: SolverSettings =
    SolverSettings { max_sweeps: 200_000, max_relaxations: u32::MAX, tolerance: 1e-14, budget: None };

/// A repeatable stream of numbers (splitmix64).
pub(super) struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    /// Between `a` and `b`.
    pub fn real(&mut self, a: f64, b: f64) -> f64 {
        a + (b - a) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Below `n`.
    pub fn index(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
}

/// Rigid boxes with 6 degrees of freedom `[ω; v]` each, axes along the world's.
pub(super) struct Bodies {
    pub mass: Vec<f64>,
    pub inertia: Vec<[f64; 3]>,
    pub rows: Rows,
}

impl Bodies {
    pub fn new(mass: Vec<f64>, inertia: Vec<[f64; 3]>) -> Bodies {
        let mut rows = Rows::default();
        rows.clear(6 * mass.len());
        Bodies { mass, inertia, rows }
    }

    /// Cubes of the given edge.
    pub fn cubes(mass: Vec<f64>, edge: f64) -> Bodies {
        let inertia = mass.iter().map(|m| [m * edge * edge / 6.0; 3]).collect();
        Bodies::new(mass, inertia)
    }

    /// Root of the mass matrix of body `b`.
    fn root(&self, b: usize) -> [f64; 6] {
        let (i, m) = (self.inertia[b], self.mass[b].sqrt());
        [i[0].sqrt(), i[1].sqrt(), i[2].sqrt(), m, m, m]
    }

    /// A block of `set` at arms `at` from the centers of up to two bodies; the second is pushed
    /// along `frame`, the first against it.
    pub fn push(&mut self, set: RowSet, at: [Option<(usize, [f64; 3])>; 2], frame: [[f64; 3]; 3]) {
        self.rows.push_block(set);
        for (sign, side) in [-1.0, 1.0].into_iter().zip(at) {
            let Some((body, r)) = side else { continue };
            let root = self.root(body);
            let y = self.rows.side(6 * body, 6).expect("two sides at most");
            for (k, d) in frame.iter().enumerate().take(set.rows()) {
                let j =
                    [r[1] * d[2] - r[2] * d[1], r[2] * d[0] - r[0] * d[2], r[0] * d[1] - r[1] * d[0], d[0], d[1], d[2]];
                (0..6).for_each(|i| y[6 * k + i] += sign * j[i] / root[i]);
            }
        }
    }

    /// Whitened velocity from `[ω; v]` of each body.
    pub fn whiten(&self, v: &[[f64; 6]]) -> Vec<f64> {
        v.iter().enumerate().flat_map(|(b, v)| self.root(b).into_iter().zip(*v).map(|(l, v)| l * v)).collect()
    }

    /// `[ω; v]` of each body from a whitened velocity.
    pub fn velocities(&self, u: &[f64]) -> Vec<[f64; 6]> {
        (0..self.mass.len()).map(|b| std::array::from_fn(|i| u[6 * b + i] / self.root(b)[i])).collect()
    }
}

/// The frame whose normal is `z`.
pub(super) const UP: [[f64; 3]; 3] = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

/// All blocks.
pub(super) fn all(rows: &Rows) -> Vec<u32> {
    (0..rows.blocks.len() as u32).collect()
}

/// Free values for a whitened velocity.
pub(super) fn free(rows: &Rows, u: &[f64]) -> Vec<f64> {
    let mut c = vec![0.0; rows.len];
    rows.add_velocity(u, &mut c);
    c
}

/// The solution of a problem by a solver.
pub(super) struct Solved {
    pub lambda: Vec<f64>,
    pub du: Vec<f64>,
    /// `c + (K + R)·λ`, by the dense `K + R`.
    pub w: Vec<f64>,
    pub outcome: SolveReport,
}

/// Solves everything as one island from nothing, and checks that `du` is `Y·λ`.
pub(super) fn solve(solver: &dyn RowSolver, rows: &Rows, c: &[f64], settings: SolverSettings) -> Solved {
    let blocks = all(rows);
    let (mut lambda, mut du) = (vec![0.0; rows.len], vec![0.0; rows.dof]);
    let outcome = solver.solve(rows, &blocks, c, &mut lambda, &mut du, settings);
    let (k, n) = (rows.dense(&blocks), rows.len);
    let w: Vec<f64> = (0..n).map(|i| c[i] + (0..n).map(|j| k[i * n + j] * lambda[j]).sum::<f64>()).collect();
    let size = c.iter().fold(1.0, |a: f64, c| a.max(c.abs()));
    let mut given: Vec<f64> = c.to_vec();
    rows.blocks.iter().for_each(|b| given[b.row as usize] += b.compliance * lambda[b.row as usize]);
    for (w, of_du) in w.iter().zip(free(rows, &du).iter().zip(&given).map(|(yu, c)| yu + c)) {
        assert!((w - of_du).abs() <= 1e-9 * size, "du is not Y·λ: {w} {of_du}");
    }
    Solved { lambda, du, w, outcome }
}

/// `|a − b|` of the numbers that differ most.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

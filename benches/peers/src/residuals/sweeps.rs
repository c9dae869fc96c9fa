//! Sweeps alone: projected Gauss–Seidel, and the same with Nesterov's extrapolation and restarts.
//!
//! `gauss_seidel` of tumble hands islands to its direct method after 25 sweeps, so its sweeps cannot be
//! followed further. These are the textbook form of the same iteration: the normal multiplier of a
//! contact is relaxed first, then both tangents together with the largest eigenvalue of their 2×2
//! block, and projected onto the disc of radius `μ·λ_n`. The fixed points are exact Coulomb solutions.

use super::Problem;
use tumble_core::rows::{Block, RowSet, Rows, Side};

/// Number of sweeps after which `Y·λ` is computed anew and the extrapolation restarts: it accumulates
/// rounding errors.
const REBUILD_INTERVAL: u32 = 1000;

/// Sweeps on a problem, from zero multipliers.
pub struct Sweeps<'a> {
    problem: &'a Problem,
    extrapolated: bool,
    /// Diagonal of `K + R` per row; of both tangents the largest eigenvalue of their block.
    diagonal: Vec<f64>,
    /// Multipliers and `Y·λ` after the last sweep, and after the one before.
    lambda: Vec<f64>,
    du: Vec<f64>,
    before: (Vec<f64>, Vec<f64>),
    theta: f64,
    count: u32,
}

impl<'a> Sweeps<'a> {
    /// Prepares sweeps.
    pub fn new(problem: &'a Problem, extrapolated: bool) -> Sweeps<'a> {
        let Problem { rows, blocks, .. } = problem;
        let mut diagonal = vec![0.0; rows.len];
        for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
            let first = block.row as usize;
            let entry = |i: usize, j: usize| product(rows, block, i, j);
            diagonal[first] = entry(0, 0) + block.compliance;
            if let RowSet::Cone { .. } = block.set {
                let (a, b, c) = (entry(1, 1), entry(1, 2), entry(2, 2));
                let largest = 0.5 * (a + c) + (0.25 * (a - c).powi(2) + b * b).sqrt();
                diagonal[first + 1..first + 3].fill(largest);
            }
        }
        let zero = (vec![0.0; rows.len], vec![0.0; rows.dof]);
        Sweeps {
            problem,
            extrapolated,
            diagonal,
            lambda: zero.0.clone(),
            du: zero.1.clone(),
            before: zero,
            theta: 1.0,
            count: 0,
        }
    }

    /// Returns the multipliers, and `Y·λ` computed from them.
    pub fn result(&self) -> (&[f64], Vec<f64>) {
        let Problem { rows, blocks, .. } = self.problem;
        let mut du = vec![0.0; rows.dof];
        for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
            for (k, row) in block.range().enumerate() {
                add(rows, block, k, self.lambda[row], &mut du);
            }
        }
        (&self.lambda, du)
    }

    /// Relaxes every block once.
    pub fn sweep(&mut self) {
        let extrapolated = self.extrapolate();
        let Problem { rows, blocks, c, .. } = self.problem;
        let mut against = 0.0;
        for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
            let first = block.row as usize;
            let d = self.diagonal[first];
            if d > 0.0 {
                let w = c[first] + speed(rows, block, 0, &self.du) + block.compliance * self.lambda[first];
                let free = self.lambda[first] - w / d;
                let new = match block.set {
                    RowSet::Equality => free,
                    RowSet::Interval { lo, hi } => free.max(lo).min(hi),
                    RowSet::HalfLine | RowSet::Cone { .. } => free.max(0.0),
                };
                against += self.set(block, 0, new);
            }
            if let RowSet::Cone { mu } = block.set {
                let free = [1, 2].map(|k| {
                    let (row, d) = (first + k, self.diagonal[first + k]);
                    let w = c[row] + speed(rows, block, k, &self.du);
                    if d > 0.0 { self.lambda[row] - w / d } else { 0.0 }
                });
                let (length, most) = (free[0].hypot(free[1]), mu * self.lambda[first]);
                let share = if length > most { most / length } else { 1.0 };
                against += self.set(block, 1, share * free[0]) + self.set(block, 2, share * free[1]);
            }
        }
        if extrapolated && against > 0.0 {
            self.theta = 1.0;
        }
        self.count += 1;
        if self.count.is_multiple_of(REBUILD_INTERVAL) {
            self.du = self.result().1;
            self.before = (self.lambda.clone(), self.du.clone());
            self.theta = 1.0;
        }
    }

    /// Sets a multiplier. Returns the share of its row in `(y − λ⁺)·(λ⁺ − λ)`: above 0 in sum, the sweep
    /// goes against the last change.
    fn set(&mut self, block: &Block, k: usize, new: f64) -> f64 {
        let row = block.row as usize + k;
        let start = std::mem::replace(&mut self.lambda[row], new);
        add(&self.problem.rows, block, k, new - start, &mut self.du);
        (start - new) * (new - self.before.0[row])
    }

    /// Moves on by `β` times the last change. Returns whether it did.
    fn extrapolate(&mut self) -> bool {
        if !self.extrapolated {
            return false;
        }
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.theta * self.theta).sqrt());
        let beta = (self.theta - 1.0) / next;
        self.theta = next;
        let step = |now: &mut [f64], before: &mut [f64]| {
            for (now, before) in now.iter_mut().zip(before) {
                let last = *now;
                *now += beta * (last - *before);
                *before = last;
            }
        };
        step(&mut self.lambda, &mut self.before.0);
        step(&mut self.du, &mut self.before.1);
        true
    }
}

fn own<'r>(side: &Side, u: &'r [f64]) -> &'r [f64] {
    &u[side.u as usize..(side.u + side.dof) as usize]
}

/// Returns the velocity of row `k` of a block by `u`.
fn speed(rows: &Rows, block: &Block, k: usize, u: &[f64]) -> f64 {
    block.sides().iter().map(|side| dot(rows.response(side, k), own(side, u))).sum()
}

/// Returns the entry of `K` of rows `i` and `j` of a block.
fn product(rows: &Rows, block: &Block, i: usize, j: usize) -> f64 {
    block.sides().iter().map(|side| dot(rows.response(side, i), rows.response(side, j))).sum()
}

/// Adds `Y·λ` of row `k` of a block to `u`.
fn add(rows: &Rows, block: &Block, k: usize, lambda: f64, u: &mut [f64]) {
    for side in block.sides() {
        let own = &mut u[side.u as usize..(side.u + side.dof) as usize];
        own.iter_mut().zip(rows.response(side, k)).for_each(|(u, y)| *u += lambda * y);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

//! The error of a solution, by a formula that shares no code with any solver.
//!
//! The natural map with De Saxcé's shift: for a contact, `λ` solves the problem if and only if `λ =
//! Π(λ − (w + μ·|w_t|·n) / d)`, with `Π` the projection onto the friction cone `|λ_t| ≤ μ·λ_n` and
//! any `d > 0`. The residual is `‖λ − Π(…)‖·d`, in m/s, with `d` the mean diagonal of the block of
//! `K`. The scalar sets have no shift and `Π` clamps; `w` of a soft row contains its `R·λ`. Source:
//! Acary and Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems*, 2008, ch. 13.

use crate::constraint::rows::{Block, RowSet, Rows, dot};
use crate::threads::Threads;

/// Minimum number of blocks of a piece on one thread.
const BLOCKS: usize = 256;

/// The largest residual of some blocks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LargestResidual {
    /// Residual, m/s.
    pub residual: f64,
    /// The first block with it; 0 if no block has any error.
    pub block: u32,
}

impl LargestResidual {
    fn or(self, other: LargestResidual) -> LargestResidual {
        // what is not a number is the largest
        if other.residual > self.residual || other.residual.is_nan() { other } else { self }
    }
}

/// Returns the largest residual of any block, m/s (m/s² if `c` holds accelerations). `du` must be
/// `Y·λ` of all blocks.
pub fn residual(rows: &Rows, blocks: &[u32], c: &[f64], lambda: &[f64], du: &[f64]) -> f64 {
    largest_residual(rows, blocks, c, lambda, du).residual
}

/// Returns the [`residual`] with its block.
pub(crate) fn largest_residual(rows: &Rows, blocks: &[u32], c: &[f64], lambda: &[f64], du: &[f64]) -> LargestResidual {
    let residual = |&block: &u32| LargestResidual {
        residual: block_residual(rows, &rows.blocks[block as usize], c, lambda, du),
        block,
    };
    blocks.iter().map(residual).fold(LargestResidual::default(), LargestResidual::or)
}

/// Returns the [`residual`] of an island with its block, computed on several threads.
pub(crate) fn largest_residual_on(
    threads: &Threads,
    rows: &Rows,
    blocks: &[u32],
    (c, lambda, du): (&[f64], &[f64], &[f64]),
) -> LargestResidual {
    if threads.count() == 1 || blocks.len() < 2 * BLOCKS {
        return largest_residual(rows, blocks, c, lambda, du);
    }
    let none = LargestResidual::default();
    let pieces = threads.pieces(blocks.len(), BLOCKS).into_iter();
    let mut largest: Vec<(&[u32], LargestResidual)> = pieces.map(|piece| (&blocks[piece], none)).collect();
    threads.each(largest.iter_mut(), |(blocks, largest)| *largest = largest_residual(rows, blocks, c, lambda, du));
    largest.into_iter().fold(none, |most, (_, largest)| most.or(largest))
}

fn block_residual(rows: &Rows, block: &Block, c: &[f64], lambda: &[f64], du: &[f64]) -> f64 {
    let n = block.set.rows();
    let (mut velocity, mut diagonal) = ([0.0; 3], 0.0);
    for side in block.sides() {
        let u = &du[side.u as usize..(side.u + side.dof) as usize];
        for (k, velocity) in velocity.iter_mut().enumerate().take(n) {
            let y = rows.response(side, k);
            *velocity += dot(y, u);
            diagonal += dot(y, y);
        }
    }
    let d = diagonal / n as f64;
    if d <= f64::MIN_POSITIVE {
        return 0.0;
    }
    let first = block.row as usize;
    let w = |k: usize| c[first + k] + velocity[k] + block.compliance * lambda[first + k];
    match block.set {
        RowSet::Equality => w(0).abs(),
        RowSet::HalfLine => scalar(lambda[first], w(0), d, 0.0, f64::INFINITY),
        RowSet::Interval { lo, hi } => scalar(lambda[first], w(0), d, lo, hi),
        RowSet::Cone { mu } => cone([lambda[first], lambda[first + 1], lambda[first + 2]], [w(0), w(1), w(2)], d, mu),
    }
}

fn scalar(lambda: f64, w: f64, d: f64, lo: f64, hi: f64) -> f64 {
    // `clamp` panics if `lo > hi`
    (lambda - (lambda - w / d).max(lo).min(hi)).abs() * d
}

fn cone(lambda: [f64; 3], w: [f64; 3], d: f64, mu: f64) -> f64 {
    let shift = mu * (w[1] * w[1] + w[2] * w[2]).sqrt();
    let moved = [lambda[0] - (w[0] + shift) / d, lambda[1] - w[1] / d, lambda[2] - w[2] / d];
    let onto = project(moved, mu);
    (0..3).map(|k| (lambda[k] - onto[k]).powi(2)).sum::<f64>().sqrt() * d
}

/// Returns the Euclidean projection onto `{ |x_t| ≤ μ·x_n }`.
fn project(x: [f64; 3], mu: f64) -> [f64; 3] {
    let t = (x[1] * x[1] + x[2] * x[2]).sqrt();
    if t <= mu * x[0] {
        return x;
    }
    if mu * t <= -x[0] {
        return [0.0; 3];
    }
    let n = (x[0] + mu * t) / (1.0 + mu * mu);
    let scale = mu * n / t;
    [n, scale * x[1], scale * x[2]]
}

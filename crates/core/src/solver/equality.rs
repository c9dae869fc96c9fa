//! Elimination of free multipliers: `w_E = 0` solved for `λ_E`, redundant rows included. `K`
//! contains the compliance of soft rows.
//!
//! ```text
//! w_E = c_E + K_EE·λ_E + K_EZ·z = 0                      K_EE = P·R·Rᵀ·Pᵀ, pivoted Cholesky, stopped at rank r
//! λ_E = −K_EE⁻¹(c_E + K_EZ·z)                            the rows past the rank get no multiplier
//! w_Z = (K_ZZ − TᵀT)·z + (c_Z − Tᵀt),   T = R⁻¹·K_EZ,  t = R⁻¹·c_E
//! ```
//!
//! A free multiplier could also be split into two nonnegative ones. Rounding then makes redundant
//! rows contradict each other, and a contradiction is a ray.
//!
//! Columns of `R` are mostly zero if rows couple to few others, as along a chain, and zeros are
//! skipped. Pivots of equal rank are taken in order, which takes every second joint of a chain
//! first.

use crate::constraint::rows::dot;
use smallvec::SmallVec;

/// A row depends on others if its pivot is below this fraction of its own diagonal. Rounding is
/// relative to the diagonal, however large other rows are.
pub(super) const RANK: f64 = 1e-11;
/// A row vanishes if elimination leaves less than this fraction of its diagonal.
pub(super) const VANISHED: f64 = 1e-12;

/// One number for each equality row; on the stack for the joints of one robot.
pub(super) type Numbers = SmallVec<[f64; 32]>;

/// A pivoted Cholesky factor of `K_EE`.
pub(super) struct Equalities {
    size: usize,
    /// Independent rows, as positions within E, in pivot order.
    order: Vec<usize>,
    /// `R` column by column, `size` numbers each, in the order of E; 0 at the rows of earlier
    /// pivots.
    columns: Vec<f64>,
}

impl Equalities {
    /// Factors `k`, `e × e`, row-major, symmetric positive semidefinite. It ends at a pivot of at
    /// most `rank` times its own diagonal.
    pub(super) fn new(k: &[f64], e: usize, rank: f64) -> Equalities {
        let whole: Vec<f64> = (0..e).map(|i| k[i * e + i]).collect();
        // Remaining fraction of each diagonal; negative once it was the pivot.
        let mut left: Vec<f64> = whole.iter().map(|d| if *d > 0.0 { 1.0 } else { 0.0 }).collect();
        let mut factor = Equalities { size: e, order: Vec::with_capacity(e), columns: Vec::with_capacity(e * e) };
        for _ in 0..e {
            let next = (0..e).fold(0, |best, i| if left[i] > left[best] { i } else { best });
            if left[next].is_nan() || left[next] <= rank {
                break;
            }
            factor.eliminate(k, next, left[next] * whole[next]);
            let column = factor.column(factor.order.len() - 1);
            (0..e).filter(|&i| column[i] != 0.0).for_each(|i| left[i] -= column[i] * column[i] / whole[i]);
            left[next] = f64::NEG_INFINITY;
        }
        factor
    }

    /// Appends the column of the pivot at `next`, whose remaining diagonal is `rest`: `(k − Σ
    /// earlier columns) / √rest`.
    fn eliminate(&mut self, k: &[f64], next: usize, rest: f64) {
        let e = self.size;
        let mut column = Numbers::from_slice(&k[next * e..(next + 1) * e]);
        for earlier in self.columns.chunks_exact(e).filter(|c| c[next] != 0.0) {
            add_multiple(earlier, -earlier[next], &mut column);
        }
        let root = rest.sqrt();
        column.iter_mut().for_each(|x| *x /= root);
        self.order.iter().for_each(|&i| column[i] = 0.0);
        column[next] = root;
        self.columns.extend_from_slice(&column);
        self.order.push(next);
    }

    /// Returns the number of independent rows.
    pub(super) fn rank(&self) -> usize {
        self.order.len()
    }

    /// Returns column `p` of `R`, with one number per row.
    pub(super) fn column(&self, p: usize) -> &[f64] {
        &self.columns[p * self.size..(p + 1) * self.size]
    }

    /// Returns `R⁻¹` of the independent entries of `x`, in pivot order.
    fn forward(&self, x: &[f64]) -> Numbers {
        let mut left = Numbers::from_slice(x);
        let mut t = Numbers::with_capacity(self.rank());
        for (p, &i) in self.order.iter().enumerate() {
            let next = if left[i] == 0.0 { 0.0 } else { left[i] / self.column(p)[i] };
            if next != 0.0 {
                add_multiple(self.column(p), -next, &mut left);
            }
            t.push(next);
        }
        t
    }

    /// Returns `K_EE⁻¹·x` on the independent rows, 0 elsewhere; as long as `x`.
    pub(super) fn solve(&self, x: &[f64]) -> Numbers {
        let t = self.forward(x);
        let mut out = Numbers::from_elem(0.0, x.len());
        for (p, &i) in self.order.iter().enumerate().rev() {
            let column = self.column(p);
            out[i] = (t[p] - dot(column, &out)) / column[i];
        }
        out
    }

    /// Computes `K_ZZ −= TᵀT` and `c_Z −= Tᵀt`. `coupling[j]` is column `j` of `K_EZ`; `k` is `n ×
    /// n` within rows of `stride`.
    pub(super) fn reduce(&self, coupling: &[Vec<f64>], free: &[f64], k: &mut [f64], stride: usize, c: &mut [f64]) {
        let t = self.forward(free);
        let columns: Vec<Numbers> = coupling.iter().map(|x| self.forward(x)).collect();
        let whole: Vec<f64> = (0..c.len()).map(|i| k[i * stride + i]).collect();
        for (i, a) in columns.iter().enumerate() {
            c[i] -= dot(a, &t);
            for (j, b) in columns.iter().enumerate() {
                k[i * stride + j] -= dot(a, b);
            }
        }
        for i in (0..c.len()).filter(|&i| k[i * stride + i] <= VANISHED * whole[i]).collect::<Vec<_>>() {
            for j in 0..c.len() {
                k[i * stride + j] = 0.0;
                k[j * stride + i] = 0.0;
            }
        }
    }
}

/// Returns the smallest pivot of a pivoted Cholesky factor of `k`, `e × e`, among the rows that are
/// independent to one part in 1e8; `None` if there is none.
pub(crate) fn smallest_pivot(k: &[f64], e: usize) -> Option<f64> {
    let factor = Equalities::new(k, e, 1e-8);
    (0..factor.rank()).map(|p| factor.column(p)[factor.order[p]].powi(2)).reduce(f64::min)
}

/// `to += scale·x`.
pub(super) fn add_multiple(x: &[f64], scale: f64, to: &mut [f64]) {
    let ((to, to_rest), (x, x_rest)) = (to.as_chunks_mut::<4>(), x.as_chunks::<4>());
    for (to, x) in to.iter_mut().zip(x) {
        let mut sum = *to; // a value, so the compiler knows that it does not overlap `x`
        for k in 0..4 {
            sum[k] += scale * x[k];
        }
        *to = sum;
    }
    to_rest.iter_mut().zip(x_rest).for_each(|(to, x)| *to += scale * x);
}

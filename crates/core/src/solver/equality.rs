//! Free multipliers taken out of a problem before pivoting: `w_E = 0` solved for `λ_E`, redundant rows included.
//!
//! ```text
//! w_E = c_E + K_EE·λ_E + K_EZ·z = 0                      K_EE = P·R·Rᵀ·Pᵀ, pivoted Cholesky, stopped at rank r
//! λ_E = −K_EE⁻¹(c_E + K_EZ·z)                            the rows past the rank get no multiplier
//! w_Z = (K_ZZ − TᵀT)·z + (c_Z − Tᵀt),   T = R⁻¹·K_EZ,  t = R⁻¹·c_E
//! ```
//!
//! Splitting a free multiplier into two nonnegative ones would serve as well, but rounding makes redundant rows contradict each other,
//! and a contradiction is a ray.

/// Rows whose pivot fell under this part of their own diagonal depend on the others: rounding is a part of that, however large others are.
const RANK: f64 = 1e-11;
/// What is left of a diagonal after the elimination, below which nothing is left of its row.
const VANISHED: f64 = 1e-12;

/// A pivoted Cholesky factor of `K_EE`.
pub(super) struct Equalities {
    /// Independent rows, as positions within E, in pivot order.
    order: Vec<usize>,
    /// `R`, lower triangular, row `i` with `i + 1` numbers.
    factor: Vec<Vec<f64>>,
}

impl Equalities {
    /// Factors `k`, `e × e`, row-major, symmetric positive semidefinite.
    pub(super) fn new(k: &[f64], e: usize) -> Equalities {
        let mut rest: Vec<f64> = (0..e).map(|i| k[i * e + i]).collect();
        let whole = rest.clone();
        let share = |rest: &[f64], i: usize| if whole[i] > 0.0 { rest[i] / whole[i] } else { 0.0 };
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut order: Vec<usize> = Vec::new();
        // Column by column; `columns[p][i]` is R of original row i and pivot p.
        while let Some(next) = (0..e).filter(|i| !order.contains(i)).reduce(|a, b| if share(&rest, b) > share(&rest, a) { b } else { a }) {
            if share(&rest, next) <= RANK {
                break;
            }
            let root = rest[next].sqrt();
            let below = |i: usize| k[i * e + next] - columns.iter().map(|c| c[i] * c[next]).sum::<f64>();
            let column: Vec<f64> = (0..e).map(|i| if i == next { root } else { below(i) / root }).collect();
            (0..e).for_each(|i| rest[i] -= column[i] * column[i]);
            columns.push(column);
            order.push(next);
        }
        let factor = order.iter().enumerate().map(|(p, &i)| columns[..=p].iter().map(|c| c[i]).collect()).collect();
        Equalities { order, factor }
    }

    /// `R⁻¹` of the independent entries of `x`.
    fn forward(&self, x: &[f64]) -> Vec<f64> {
        let mut t: Vec<f64> = Vec::with_capacity(self.order.len());
        for (row, &i) in self.factor.iter().zip(&self.order) {
            let sum: f64 = row.iter().zip(&t).map(|(r, t)| r * t).sum();
            t.push((x[i] - sum) / row[t.len()]);
        }
        t
    }

    /// `K_EE⁻¹·x` on the independent rows, 0 elsewhere; as long as `x`.
    pub(super) fn solve(&self, x: &[f64]) -> Vec<f64> {
        let mut t = self.forward(x);
        for p in (0..t.len()).rev() {
            let sum: f64 = (p + 1..t.len()).map(|l| self.factor[l][p] * t[l]).sum();
            t[p] = (t[p] - sum) / self.factor[p][p];
        }
        let mut out = vec![0.0; x.len()];
        self.order.iter().zip(&t).for_each(|(&i, t)| out[i] = *t);
        out
    }

    /// `K_ZZ −= TᵀT`, `c_Z −= Tᵀt`. `coupling[j]` is column `j` of `K_EZ`; `k` is `n × n` within rows of `stride`.
    pub(super) fn reduce(&self, coupling: &[Vec<f64>], free: &[f64], k: &mut [f64], stride: usize, c: &mut [f64]) {
        let t = self.forward(free);
        let columns: Vec<Vec<f64>> = coupling.iter().map(|x| self.forward(x)).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
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

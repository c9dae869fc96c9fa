//! Sums of squares of many small terms: the method of Levenberg and Marquardt.
//!
//! ```text
//! minimize  E(x) = Σ_i w(|r_i|) |r_i|² / σ_i² + Σ_j ((x_j − a_j) / s_j)²
//! (JᵀWJ + P + μ diag(JᵀWJ + P)) δ = −(JᵀW r + P (x − a))
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `r_i` | two numbers that depend on few of the unknowns; derivatives by central differences |
//! | `w` | weight of Huber: 1 up to `HUBER` standard deviations, then falling with the distance |
//! | `a_j`, `s_j` | expected value and standard deviation of an unknown; 0 keeps it at its value |
//! | `μ` | damping: a tenth after a step that lowers E, ten times after one that does not |
//!
//! Source: Marquardt (1963), Huber (1964).

use nalgebra::{DMatrix, DVector};

/// Standard deviations up to which a term counts in full.
const HUBER: f64 = 3.0;
const MAX_STEPS: usize = 60;

/// A term: two numbers of a few unknowns.
pub(crate) trait Term {
    /// The indices of its unknowns, each once.
    fn unknowns(&self) -> &[usize];
    /// Returns the difference in units of its standard deviation, from the values of `unknowns`; `None` where
    /// it has no meaning.
    fn residual(&self, local: &[f64]) -> Option<[f64; 2]>;
}

/// Knowledge of an unknown before the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Prior {
    /// Nothing.
    Free,
    /// Value and standard deviation.
    About(f64, f64),
    /// It keeps its value.
    Fixed,
}

/// The matrix `JᵀWJ + P` and the gradient at one place.
struct Normal {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
}

/// Returns E, and the number of terms that have no meaning.
fn cost<T: Term>(x: &[f64], terms: &[T], priors: &[Prior]) -> (f64, usize) {
    let mut lost = 0;
    let mut local = Vec::new();
    let mut sum: f64 = 0.0;
    for term in terms {
        gather(x, term.unknowns(), &mut local);
        match term.residual(&local) {
            Some([a, b]) => sum += huber(a.hypot(b)),
            None => {
                lost += 1;
                sum += huber(1e3);
            }
        }
    }
    for (x, prior) in x.iter().zip(priors) {
        if let Prior::About(at, sigma) = prior {
            sum += ((x - at) / sigma).powi(2);
        }
    }
    (sum, lost)
}

fn huber(distance: f64) -> f64 {
    if distance <= HUBER { distance * distance } else { HUBER * (2.0 * distance - HUBER) }
}

fn gather(x: &[f64], unknowns: &[usize], local: &mut Vec<f64>) {
    local.clear();
    local.extend(unknowns.iter().map(|i| x[*i]));
}

/// Returns the derivatives of a term, by unknown.
pub(crate) fn derivatives<T: Term>(term: &T, local: &mut [f64], fixed: impl Fn(usize) -> bool) -> Vec<[f64; 2]> {
    (0..local.len())
        .map(|k| {
            if fixed(k) {
                return [0.0; 2];
            }
            let (at, h) = (local[k], 1e-6 * local[k].abs().max(1.0));
            local[k] = at + h;
            let after = term.residual(local);
            local[k] = at - h;
            let before = term.residual(local);
            local[k] = at;
            match (after, before) {
                (Some(a), Some(b)) => [0, 1].map(|i| (a[i] - b[i]) / (2.0 * h)),
                _ => [0.0; 2],
            }
        })
        .collect()
}

fn normal<T: Term>(x: &[f64], terms: &[T], priors: &[Prior]) -> Normal {
    let n = x.len();
    let (mut matrix, mut gradient) = (DMatrix::zeros(n, n), DVector::zeros(n));
    let mut local = Vec::new();
    for term in terms {
        let unknowns = term.unknowns();
        gather(x, unknowns, &mut local);
        let Some(r) = term.residual(&local) else { continue };
        let distance = r[0].hypot(r[1]);
        let weight = if distance <= HUBER { 1.0 } else { HUBER / distance };
        let j = derivatives(term, &mut local, |k| priors[unknowns[k]] == Prior::Fixed);
        for (a, &row) in unknowns.iter().enumerate() {
            gradient[row] += weight * (j[a][0] * r[0] + j[a][1] * r[1]);
            for (b, &column) in unknowns.iter().enumerate().take(a + 1) {
                let product = weight * (j[a][0] * j[b][0] + j[a][1] * j[b][1]);
                matrix[(row, column)] += product;
                if row != column {
                    matrix[(column, row)] += product;
                }
            }
        }
    }
    for (i, prior) in priors.iter().enumerate() {
        match prior {
            Prior::About(at, sigma) => {
                matrix[(i, i)] += sigma.powi(-2);
                gradient[i] += (x[i] - at) * sigma.powi(-2);
            }
            Prior::Fixed => {
                matrix.row_mut(i).fill(0.0);
                matrix.column_mut(i).fill(0.0);
                matrix[(i, i)] = 1.0;
                gradient[i] = 0.0;
            }
            Prior::Free => {}
        }
    }
    Normal { matrix, gradient }
}

/// Moves `x` to a minimum, and returns E there.
pub(crate) fn minimize<T: Term>(x: &mut [f64], terms: &[T], priors: &[Prior]) -> f64 {
    let (mut now, _) = cost(x, terms, priors);
    let mut damping = 1e-3;
    for _ in 0..MAX_STEPS {
        let Normal { matrix, gradient } = normal(x, terms, priors);
        let mut progress = None;
        while damping < 1e12 {
            let mut damped = matrix.clone();
            for i in 0..x.len() {
                damped[(i, i)] += damping * matrix[(i, i)].max(1e-12);
            }
            let step = damped.cholesky().map(|factor| factor.solve(&-&gradient));
            let there = step.map(|step| x.iter().zip(step.iter()).map(|(x, d)| x + d).collect::<Vec<f64>>());
            let better = there.map(|there| (cost(&there, terms, priors).0, there)).filter(|(e, _)| *e < now);
            match better {
                Some((e, there)) => {
                    progress = Some(now - e);
                    x.copy_from_slice(&there);
                    now = e;
                    damping = (damping * 0.1).max(1e-12);
                    break;
                }
                None => damping *= 10.0,
            }
        }
        match progress {
            Some(gain) if gain > 1e-6 * now + 1e-15 => {}
            _ => break,
        }
    }
    now
}

/// Returns the covariance of the unknowns, in units in which terms have variance 1; `None` if the terms do
/// not determine them.
pub(crate) fn covariance<T: Term>(x: &[f64], terms: &[T], priors: &[Prior]) -> Option<DMatrix<f64>> {
    let Normal { mut matrix, .. } = normal(x, terms, priors);
    // unit diagonal, so that units do not decide whether it is singular
    let scale: Vec<f64> = (0..x.len()).map(|i| matrix[(i, i)].max(1e-300).sqrt()).collect();
    for (i, j) in (0..x.len()).flat_map(|i| (0..x.len()).map(move |j| (i, j))) {
        matrix[(i, j)] /= scale[i] * scale[j];
    }
    let mut inverse = matrix.cholesky()?.inverse();
    for (i, j) in (0..x.len()).flat_map(|i| (0..x.len()).map(move |j| (i, j))) {
        inverse[(i, j)] /= scale[i] * scale[j];
    }
    for (i, prior) in priors.iter().enumerate() {
        if *prior == Prior::Fixed {
            inverse.row_mut(i).fill(0.0);
            inverse.column_mut(i).fill(0.0);
        }
    }
    inverse.iter().all(|v| v.is_finite()).then_some(inverse)
}

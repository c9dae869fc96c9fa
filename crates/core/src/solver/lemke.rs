//! Lemke's complementary pivoting for a dense linear complementarity problem.
//!
//! Source: Cottle, Pang, Stone, *The Linear Complementarity Problem*, 1992, §4.4 (scheme I) and
//! §4.9 (lexicographic rule).
//!
//! ```text
//! find z ≥ 0 with w = M·z + q ≥ 0 and zᵀw = 0
//!
//! augmented:   w = q + M·z + d·z₀,  d > 0        a large z₀ makes w ≥ 0 at z = 0
//! dictionary:  x_B = b + A·x_N                   n basic variables B, n + 1 nonbasic ones N
//! pivot (r, s), p = A_rs:
//!     A_rs ← 1/p,  A_rj ← −A_rj/p,  b_r ← −b_r/p,  A_ij ← A_ij + A_is·A_rj,  b_i ← b_i + A_is·b_r
//! ratio test:  r = argmin { b_r / −A_rs : A_rs < 0 },  then the complement of the leaving variable enters
//! ```
//!
//! The walk ends when z₀ leaves (a solution) or when nothing bounds the entering variable (a
//! secondary ray).
//!
//! | symbol | meaning |
//! |---|---|
//! | `M`, `q` | the scaled problem: `S·M·S`, `S·q/σ` |
//! | `S`, `σ` | powers of two that bring rows and columns of `M`, and `q`, near 1 without rounding |
//! | `d`, `z₀` | covering vector, artificial variable |
//! | `ε` | lexicographic perturbation `q + (ε, ε², …, εⁿ)`; row `r` carries `−A_{r,w_j}` of `εʲ`, or 1 if `w_j` is its own variable |
//!
//! Departures from the source:
//!
//! - The perturbation is read from the dictionary and needs no columns of its own.
//! - Ratios within [`FEASIBLE`] count as tied. Ties go to `z₀`, then to the lexicographic minimum
//!   among pivots that are not small.
//! - The dictionary is computed anew from `M` and `q` at intervals and before a doubtful pivot,
//!   because a pivot on rounding errors makes the basis singular.
//! - The solution does not come from the dictionary with its accumulated errors. The final basis is
//!   solved again from `M` and `q` by LU with iterative refinement, and is accepted if `max |min(z,
//!   w)| ≤` [`ACCEPT`] in the scaled problem. If it is not, or the walk ended otherwise, a second
//!   walk starts with another `d`. This check also accepts a ray at which `z₀` is only rounding: a
//!   body that fits exactly between two walls.

use nalgebra::{DMatrix, DVector};

/// Result of the walk. `pivots` counts those of both walks.
#[derive(Clone, Debug, PartialEq)]
pub enum LcpResult {
    /// A complementary solution.
    Solution {
        /// `z`, at least 0.
        z: Vec<f64>,
        /// Number of pivots.
        pivots: u32,
    },
    /// Both walks ended on a secondary ray. If `M` is copositive-plus (as all symmetric positive
    /// semidefinite matrices are) no solution exists.
    Ray {
        /// Number of pivots.
        pivots: u32,
    },
    /// A walk reached the maximum number of pivots, or a basis whose solution is not accurate.
    PivotLimit {
        /// Number of pivots.
        pivots: u32,
    },
    /// `M` or `q` holds a number that is not finite.
    NotFinite,
}

/// Minimum size of a pivot, relative to the largest number of its column or to 1.
const PIVOT: f64 = 1e-10;
/// Amount by which a basic variable of the scaled problem may become negative in one step.
const FEASIBLE: f64 = 1e-11;
/// Ties in the ratio test prefer pivots within this factor of the strongest.
const WEAK: f64 = 1e-4;
/// The dictionary is computed anew after this many pivots, or after `n/8` if that is more,
const REBUILD: usize = 50;
/// and before a pivot below this.
const DOUBTFUL: f64 = 1e-6;
/// Difference below which numbers of the lexicographic rows count as equal.
const LEXICOGRAPHIC: f64 = 1e-9;
/// Largest accepted `|min(z, w)|` of the scaled problem.
const ACCEPT: f64 = 1e-10;

/// Solves the linear complementarity problem of `m` (`n × n`, row-major) and `q` (`n`). Time O(n²)
/// per pivot and O(n³) for every 50 or n/8 of them; n to 3n pivots as a rule.
///
/// # Panics
/// If `m.len() != q.len()²`.
pub fn lemke(m: &[f64], q: &[f64]) -> LcpResult {
    assert_eq!(m.len(), q.len() * q.len(), "M must be n × n, row-major");
    if !m.iter().chain(q).all(|x| x.is_finite()) {
        return LcpResult::NotFinite;
    }
    let problem = Scaled::new(m, q);
    let (mut pivots, mut rays) = (0, 0);
    for spread in [0, 1] {
        let cover = covering(q.len(), spread);
        let mut dictionary = Dictionary::new(&problem, &cover);
        let (end, taken) = walk(&mut dictionary, &problem, &cover, pivot_cap(q.len()));
        pivots += taken;
        if let Some(z) = best_solution(&problem, &cover, &dictionary) {
            return LcpResult::Solution { z: problem.unscale(z), pivots };
        }
        rays += (end == End::Ray) as u32;
    }
    if rays == 2 { LcpResult::Ray { pivots } } else { LcpResult::PivotLimit { pivots } }
}

fn pivot_cap(n: usize) -> u32 {
    20 * n as u32 + 100
}

/// Returns `d`: all ones if `spread` is 0; numbers between 1 and 2 by multiples of the golden ratio
/// if it is 1.
fn covering(n: usize, spread: u32) -> Vec<f64> {
    (1..=n).map(|i| 1.0 + f64::from(spread) * (i as f64 * 0.618_033_988_749_894_9).fract()).collect()
}

/// The problem with rows and columns of similar size: `z = σ·S·z'`, `w = σ·S⁻¹·w'`.
struct Scaled {
    n: usize,
    m: Vec<f64>,
    q: Vec<f64>,
    s: Vec<f64>,
    sigma: f64,
}

impl Scaled {
    fn new(m: &[f64], q: &[f64]) -> Scaled {
        let n = q.len();
        let s = equilibrate(m, n);
        let scaled_q: Vec<f64> = q.iter().zip(&s).map(|(q, s)| q * s).collect();
        let sigma = power_of_two(scaled_q.iter().fold(0.0, |a: f64, q| a.max(q.abs())));
        let m = (0..n * n).map(|k| s[k / n] * m[k] * s[k % n]).collect();
        Scaled { n, m, q: scaled_q.iter().map(|q| q / sigma).collect(), s, sigma }
    }

    fn unscale(&self, z: Vec<f64>) -> Vec<f64> {
        z.iter().zip(&self.s).map(|(z, s)| self.sigma * s * z).collect()
    }

    fn row(&self, i: usize) -> &[f64] {
        &self.m[i * self.n..(i + 1) * self.n]
    }

    /// Returns `max |min(z, Mz + q)|`; infinite if that is not a number.
    fn violation(&self, z: &[f64]) -> f64 {
        let row = |i: usize| self.q[i] + dot(self.row(i), z);
        let all = (0..self.n).map(|i| z[i].min(row(i)).abs() + 0.0 * row(i));
        all.fold(0.0, |a, v| if v.is_finite() { v.max(a) } else { f64::INFINITY })
    }
}

/// Returns the symmetric equilibration: `s_i ← s_i / √(largest of row and column i)` several times,
/// rounded to powers of two.
fn equilibrate(m: &[f64], n: usize) -> Vec<f64> {
    let mut s = vec![1.0; n];
    for _ in 0..8 {
        let mut largest = vec![0.0f64; n];
        for i in 0..n {
            for j in 0..n {
                let size = (m[i * n + j] * s[i] * s[j]).abs();
                largest[i] = largest[i].max(size);
                largest[j] = largest[j].max(size);
            }
        }
        s.iter_mut().zip(&largest).filter(|(_, l)| **l > f64::MIN_POSITIVE).for_each(|(s, l)| *s /= l.sqrt());
    }
    s.into_iter().map(power_of_two).collect()
}

/// Returns the power of two at or below `x`; 1 if `x` is 0, subnormal or not finite.
fn power_of_two(x: f64) -> f64 {
    if x.is_normal() { f64::from_bits(x.to_bits() & 0x7ff0_0000_0000_0000) } else { 1.0 }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Position of a variable. Variables: `w_i` is `i`, `z_i` is `n + i`, `z₀` is `2n`.
#[derive(Clone, Copy, Debug, PartialEq)]
enum VariablePlace {
    Row(usize),
    Column(usize),
}

/// `x_B = b + A·x_N`.
struct Dictionary {
    n: usize,
    a: Vec<f64>,
    b: Vec<f64>,
    basic: Vec<usize>,
    nonbasic: Vec<usize>,
    place: Vec<VariablePlace>,
}

impl Dictionary {
    fn new(problem: &Scaled, cover: &[f64]) -> Dictionary {
        let n = problem.n;
        let a = (0..n).flat_map(|i| problem.row(i).iter().copied().chain([cover[i]])).collect();
        let place = (0..n).map(VariablePlace::Row).chain((0..=n).map(VariablePlace::Column)).collect();
        Dictionary { n, a, b: problem.q.clone(), basic: (0..n).collect(), nonbasic: (n..=2 * n).collect(), place }
    }

    fn at(&self, r: usize, s: usize) -> f64 {
        self.a[r * (self.n + 1) + s]
    }

    /// Exchanges the variable of row `r` with that of column `s`.
    fn pivot(&mut self, r: usize, s: usize) {
        let width = self.n + 1;
        let inverse = 1.0 / self.at(r, s);
        let mut row: Vec<f64> = self.a[r * width..(r + 1) * width].iter().map(|a| -a * inverse).collect();
        row[s] = inverse;
        let constant = -self.b[r] * inverse;
        for i in (0..self.n).filter(|&i| i != r) {
            let target = &mut self.a[i * width..(i + 1) * width];
            let factor = target[s];
            if factor != 0.0 {
                target[s] = 0.0;
                target.iter_mut().zip(&row).for_each(|(a, row)| *a = cancel(*a, factor * row));
                self.b[i] = cancel(self.b[i], factor * constant);
            }
        }
        self.a[r * width..(r + 1) * width].copy_from_slice(&row);
        self.b[r] = constant;
        std::mem::swap(&mut self.basic[r], &mut self.nonbasic[s]);
        self.place[self.basic[r]] = VariablePlace::Row(r);
        self.place[self.nonbasic[s]] = VariablePlace::Column(s);
    }

    /// Computes the dictionary of this basis anew from the problem, without accumulated errors.
    /// Returns `false` if the basis is singular.
    ///
    /// With `R` the rows whose `w` is nonbasic, `Q` the others, `A` the basic `z` (`z₀` among
    /// them), `N` the nonbasic ones: `z_A = M_RA⁻¹(w_R − q_R − M_RN·z_N)`, `w_Q = q_Q + M_QA·z_A +
    /// M_QN·z_N`.
    fn rebuild(&mut self, problem: &Scaled, cover: &[f64]) -> bool {
        let n = self.n;
        let entry = |i: usize, v: usize| if v == 2 * n { cover[i] } else { problem.row(i)[v - n] };
        let (tight, active) = self.basis();
        let loose: Vec<usize> = (0..n).filter(|&i| matches!(self.place[i], VariablePlace::Row(_))).collect();
        // Columns as in the dictionary, the constants last.
        let given = |i: usize, s: usize| match self.nonbasic.get(s) {
            None => problem.q[i],
            Some(&v) if v < n => 0.0,
            Some(&v) => entry(i, v),
        };
        let right = |i: usize, s: usize| if self.nonbasic.get(s) == Some(&i) { 1.0 } else { -given(i, s) };
        let square = DMatrix::from_fn(tight.len(), active.len(), |i, j| entry(tight[i], active[j]));
        let mut z = DMatrix::from_fn(tight.len(), n + 2, |i, s| right(tight[i], s));
        if !active.is_empty() && !square.lu().solve_mut(&mut z) {
            return false;
        }
        let below = DMatrix::from_fn(loose.len(), active.len(), |i, j| entry(loose[i], active[j]));
        let mut w = DMatrix::from_fn(loose.len(), n + 2, |i, s| given(loose[i], s));
        // Column by column: a matrix product may use fused multiply-add on one processor and not on
        // another.
        (0..n + 2).for_each(|s| w.column_mut(s).gemv(1.0, &below, &z.column(s), 1.0));
        for (values, variables) in [(&z, &active), (&w, &loose)] {
            for (i, &v) in variables.iter().enumerate() {
                let VariablePlace::Row(r) = self.place[v] else { return false };
                (0..=n).for_each(|s| self.a[r * (n + 1) + s] = values[(i, s)]);
                self.b[r] = values[(i, n + 1)];
            }
        }
        self.a.iter().chain(&self.b).all(|x| x.is_finite())
    }

    /// Returns the rows whose `w` is nonbasic, and the basic `z`, which are equally many.
    fn basis(&self) -> (Vec<usize>, Vec<usize>) {
        let n = self.n;
        let active = (n..=2 * n).filter(|&v| matches!(self.place[v], VariablePlace::Row(_))).collect();
        ((0..n).filter(|&i| matches!(self.place[i], VariablePlace::Column(_))).collect(), active)
    }

    /// Returns the row that leaves when the variable of column `s` grows; `None` if nothing bounds
    /// it.
    fn leaving(&self, s: usize) -> Option<usize> {
        let largest = (0..self.n).map(|r| self.at(r, s).abs()).fold(1.0, f64::max);
        let falling = || (0..self.n).filter(|&r| self.at(r, s) < -PIVOT * largest);
        let ratio = |r: usize, slack: f64| (self.b[r].max(0.0) + slack) / -self.at(r, s);
        let bound = falling().map(|r| ratio(r, FEASIBLE)).fold(f64::INFINITY, f64::min);
        let tied: Vec<usize> = falling().filter(|&r| ratio(r, 0.0) <= bound).collect();
        if let Some(artificial) = tied.iter().find(|&&r| self.basic[r] == 2 * self.n) {
            return Some(*artificial);
        }
        let strongest = tied.iter().map(|&r| -self.at(r, s)).fold(0.0, f64::max);
        let strong = tied.into_iter().filter(|&r| -self.at(r, s) >= WEAK * strongest);
        strong.reduce(|best, r| if self.precedes(r, best, s) { r } else { best })
    }

    /// Returns whether the perturbation of row `r`, per unit of pivot, is lexicographically less
    /// than that of row `other`.
    fn precedes(&self, r: usize, other: usize, s: usize) -> bool {
        let (p, p_other) = (-self.at(r, s), -self.at(other, s));
        for j in 0..self.n {
            let (x, y) = (self.perturbation(r, j) / p, self.perturbation(other, j) / p_other);
            if (x - y).abs() > LEXICOGRAPHIC * (1.0 + x.abs()) {
                return x < y;
            }
        }
        false
    }

    /// Returns the coefficient of `εʲ` in row `r`.
    fn perturbation(&self, r: usize, j: usize) -> f64 {
        match self.place[j] {
            VariablePlace::Column(s) => -self.at(r, s),
            VariablePlace::Row(own) => f64::from(u8::from(own == r)),
        }
    }
}

/// Returns `a + b`, or 0 if only rounding remains.
#[inline]
fn cancel(a: f64, b: f64) -> f64 {
    let sum = a + b;
    if sum.abs() <= 1e-14 * a.abs() { 0.0 } else { sum }
}

/// How a walk ended.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    Complementary,
    Ray,
    Limit,
}

/// Walks by scheme I from the primary ray to a complementary dictionary or a secondary ray.
fn walk(dictionary: &mut Dictionary, problem: &Scaled, cover: &[f64], cap: u32) -> (End, u32) {
    let n = dictionary.n;
    let fresh_for = (n / 8).max(REBUILD);
    let mut age = 0;
    // The row with the largest deficit; among equals the last, whose εⁱ is the smallest.
    let need = |i: usize| -dictionary.b[i] / cover[i];
    let Some(first) = (0..n).reduce(|best, i| if need(i) >= need(best) { i } else { best }).filter(|&i| need(i) > 0.0)
    else {
        return (End::Complementary, 0);
    };
    let mut left = dictionary.basic[first];
    dictionary.pivot(first, n);
    for pivots in 1..cap {
        let entering = if left < n { left + n } else { left - n };
        let VariablePlace::Column(s) = dictionary.place[entering] else { return (End::Limit, pivots) };
        let mut choice = dictionary.leaving(s);
        let doubtful = choice.is_none_or(|r| -dictionary.at(r, s) < DOUBTFUL);
        if age >= fresh_for || (doubtful && age > 0) {
            if !dictionary.rebuild(problem, cover) {
                return (End::Limit, pivots);
            }
            age = 0;
            choice = dictionary.leaving(s);
        }
        let Some(r) = choice else { return (End::Ray, pivots) };
        age += 1;
        left = dictionary.basic[r];
        dictionary.pivot(r, s);
        if left == 2 * n {
            return (End::Complementary, pivots + 1);
        }
    }
    (End::Limit, cap)
}

/// Returns `z` of the dictionary's basis from LU or from the dictionary's own numbers, whichever is
/// more accurate; `None` if neither is accurate.
fn best_solution(problem: &Scaled, cover: &[f64], dictionary: &Dictionary) -> Option<Vec<f64>> {
    let n = problem.n;
    let mut own = vec![0.0; n];
    for i in 0..n {
        if let VariablePlace::Row(r) = dictionary.place[n + i] {
            own[i] = dictionary.b[r].max(0.0);
        }
    }
    let candidates = [solve_basis(problem, cover, dictionary), Some(own)];
    let measured = candidates.into_iter().flatten().map(|z| (problem.violation(&z), z));
    measured.reduce(|a, b| if b.0 < a.0 { b } else { a }).filter(|(violation, _)| *violation <= ACCEPT).map(|(_, z)| z)
}

/// Solves `M_RA·z_A + d_R·z₀ = −q_R`, with `A` the basic `z` and `R` the rows whose `w` is
/// nonbasic.
fn solve_basis(problem: &Scaled, cover: &[f64], dictionary: &Dictionary) -> Option<Vec<f64>> {
    let n = problem.n;
    let (tight, active) = dictionary.basis();
    if active.is_empty() {
        return Some(vec![0.0; n]);
    }
    let entry = |i: usize, v: usize| if v == 2 * n { cover[i] } else { problem.row(i)[v - n] };
    let matrix = DMatrix::from_fn(tight.len(), active.len(), |i, j| entry(tight[i], active[j]));
    let right = DVector::from_iterator(tight.len(), tight.iter().map(|&i| -problem.q[i]));
    let lu = matrix.clone().lu();
    let mut x = lu.solve(&right)?;
    for _ in 0..2 {
        let mut left = right.clone();
        left.gemv(-1.0, &matrix, &x, 1.0);
        x += lu.solve(&left)?;
    }
    let mut z = vec![0.0; n];
    active.iter().zip(x.iter()).filter(|(v, _)| **v < 2 * n).for_each(|(v, x)| z[v - n] = x.max(0.0));
    Some(z)
}

//! The method of multipliers on a small island, with dense matrices: a way to the right choices of redundant contacts, where
//! steps of Newton's method on Alart and Curnier's function go in circles (`newton.rs`).
//!
//! ```text
//! K + R = Yᵀ·Y                                                Y: r numbers per row, pivoted Cholesky
//! outer   s = μ·|w_t|·n,   minimize over v:  φ(v) = ½|v|² + Σ ½·ε·d·|Π(λ − (c + Yᵀv + s)/(ε·d))|²,   λ ← Π(…)
//! inner   (1 + Σ Y·Π'·Yᵀ/(ε·d))·δv = −∇φ,   v ← v + t·δv,   φ'(t) = 0 along δv
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `Π`, `Π'` | projection onto the set of a block, and its derivative |
//! | `d` | mean diagonal of a block |
//! | `s` | shift of De Saxcé, held in an inner iteration |
//!
//! `φ` is convex with one minimum for any `Y`, so the inner iteration ends from any start, and redundant rows keep the
//! multipliers nearest to those before. Its matrix has the rank of the island, not the number of rows. The shift follows
//! slowly; what it leaves is for Newton's method.

use super::cone::{M3, length, project};
use super::island::{Island, Kind, LocalBlock};
use crate::constraint::rows::dot;
use crate::solver::equality::Equalities;

/// A row depends on others below this fraction of its diagonal.
const RANK: f64 = 1e-12;
/// An inner iteration ends at this fraction of the error before, and of the goal.
const INNER: [f64; 2] = [0.1, 0.3];
/// Maximum number of steps of an inner iteration.
const STEPS: u32 = 20;
/// A point of the search along a step is good if `|φ'|` is at most this fraction of that at its beginning; one at its end may
/// have more.
const SEARCH: [f64; 2] = [0.05, 0.1];
/// Maximum number of points of a search, each way.
const POINTS: [usize; 2] = [6, 12];

/// A small island in as many numbers as its rank, while its multipliers are improved.
pub(super) struct Multipliers {
    rank: usize,
    /// Responses of all rows, row-major.
    y: Vec<f64>,
    v: Vec<f64>,
    /// Multipliers of the last outer step, and shifts of the blocks in the present one.
    center: Vec<f64>,
    shift: Vec<f64>,
    /// Row velocities, and their change by the step.
    w: Vec<f64>,
    along: Vec<f64>,
    slope: Vec<f64>,
    step: Vec<f64>,
    matrix: Vec<f64>,
}

impl Multipliers {
    /// `k` is `K + R` of the island.
    pub fn new(island: &Island, k: &[f64]) -> Multipliers {
        let count = island.c.len();
        let factor = Equalities::new(k, count, RANK);
        let rank = factor.rank();
        let mut y = vec![0.0; count * rank];
        for p in 0..rank {
            factor.column(p).iter().enumerate().for_each(|(row, value)| y[row * rank + p] = *value);
        }
        let [zero, rows] = [vec![0.0; rank], vec![0.0; count]];
        Multipliers {
            rank,
            y,
            v: zero.clone(),
            center: Vec::new(),
            shift: Vec::new(),
            w: rows.clone(),
            along: rows,
            slope: zero.clone(),
            step: zero,
            matrix: vec![0.0; rank * rank],
        }
    }

    /// Returns the rank of the island.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// Improves multipliers by `outer` outer steps with `ε = epsilon`; those have `error`, and `goal` is to be reached.
    /// Returns the number of factorizations.
    pub fn improve(
        &mut self,
        island: &Island,
        lambda: &mut [f64],
        (epsilon, outer): (f64, u32),
        (error, goal): (f64, f64),
    ) -> u32 {
        let mut taken = 0;
        let most = island.blocks.iter().map(|block| block.diagonal).fold(0.0, f64::max).sqrt();
        let enough = (INNER[0] * error).max(INNER[1] * goal);
        self.apply(lambda);
        for _ in 0..outer {
            self.velocities(island);
            self.center.clear();
            self.center.extend_from_slice(lambda);
            let shift = |block: &LocalBlock| match block.kind {
                Kind::Cone { mu } => mu * length(self.w[block.row + 1], self.w[block.row + 2]),
                _ => 0.0,
            };
            self.shift.clear();
            self.shift.extend(island.blocks.iter().map(shift));
            for _ in 0..STEPS {
                if !self.linearize(island, epsilon, lambda) {
                    return taken;
                }
                let size = dot(&self.slope, &self.slope).sqrt();
                let largest = most * size;
                if largest.is_nan() || largest <= enough {
                    break;
                }
                self.take_step(island, epsilon);
                taken += 1;
                self.velocities(island);
            }
            self.apply(lambda);
        }
        taken
    }

    /// Writes `v = Y·λ`.
    fn apply(&mut self, lambda: &[f64]) {
        self.v.fill(0.0);
        for (y, lambda) in self.y.chunks_exact(self.rank.max(1)).zip(lambda).filter(|(_, lambda)| **lambda != 0.0) {
            self.v.iter_mut().zip(y).for_each(|(v, y)| *v += lambda * y);
        }
    }

    /// Writes `w = c + Yᵀv`.
    fn velocities(&mut self, island: &Island) {
        for (i, (w, y)) in self.w.iter_mut().zip(self.y.chunks_exact(self.rank.max(1))).enumerate() {
            *w = island.c[i] + dot(y, &self.v);
        }
    }

    /// Returns the multipliers of a block with its row velocities, and their derivative.
    #[inline(always)]
    fn project(&self, (i, block): (usize, &LocalBlock), epsilon: f64, w: impl Fn(usize) -> f64) -> ([f64; 3], M3) {
        let (mut x, soft) = ([0.0; 3], epsilon * block.diagonal);
        for (k, x) in x.iter_mut().enumerate().take(block.rows) {
            let shift = if k == 0 { self.shift[i] } else { 0.0 };
            *x = self.center[block.row + k] - (w(block.row + k) + shift) / soft;
        }
        let scalar =
            |value: f64, free: bool| ([value, 0.0, 0.0], [[f64::from(u8::from(free)), 0.0, 0.0], [0.0; 3], [0.0; 3]]);
        match (block.kind, block.kind.bounds()) {
            (Kind::Cone { mu }, _) => project(x, mu),
            (Kind::Held, _) => scalar(self.center[block.row], false),
            (_, Some((lo, hi))) => scalar(x[0].max(lo).min(hi), x[0] > lo && x[0] < hi),
            _ => scalar(x[0], true),
        }
    }

    /// Writes the multipliers at `v`, `∇φ`, and the matrix of a step. Returns whether all are finite.
    fn linearize(&mut self, island: &Island, epsilon: f64, lambda: &mut [f64]) -> bool {
        let r = self.rank;
        let (mut slope, mut matrix) = (std::mem::take(&mut self.slope), std::mem::take(&mut self.matrix));
        slope.copy_from_slice(&self.v);
        matrix.fill(0.0);
        (0..r).for_each(|i| matrix[i * r + i] = 1.0);
        for (i, block) in island.blocks.iter().enumerate() {
            let (onto, derivative) = self.project((i, block), epsilon, |row| self.w[row]);
            lambda[block.range()].copy_from_slice(&onto[..block.rows]);
            let rows: [&[f64]; 3] = [0, 1, 2].map(|k| &self.y[(block.row + k.min(block.rows - 1)) * r..][..r]);
            for k in 0..block.rows {
                slope.iter_mut().zip(rows[k]).for_each(|(slope, y)| *slope -= onto[k] * y);
                let weights = derivative[k].map(|d| d / (epsilon * block.diagonal));
                if weights.iter().all(|weight| *weight == 0.0) {
                    continue;
                }
                for a in 0..r {
                    let to = &mut matrix[a * r..][..=a];
                    let [x, y, z] = weights.map(|weight| weight * rows[k][a]);
                    match block.rows {
                        1 => to.iter_mut().zip(rows[0]).for_each(|(to, row)| *to += x * row),
                        _ => {
                            let columns = rows[0].iter().zip(rows[1]).zip(rows[2]);
                            to.iter_mut().zip(columns).for_each(|(to, ((p, q), s))| *to += x * p + y * q + z * s);
                        }
                    }
                }
            }
        }
        (self.slope, self.matrix) = (slope, matrix);
        lambda.iter().all(|lambda| lambda.is_finite())
    }

    /// Takes a step to where `φ` is least along it.
    fn take_step(&mut self, island: &Island, epsilon: f64) {
        let (r, matrix) = (self.rank, &mut self.matrix);
        for i in 0..r {
            let (above, own) = matrix.split_at_mut(i * r);
            for (j, row) in above.chunks_exact(r).enumerate() {
                own[j] = (own[j] - dot(&own[..j], &row[..j])) * row[j];
            }
            own[i] = 1.0 / (own[i] - dot(&own[..i], &own[..i])).sqrt();
        }
        let step = &mut self.step;
        for (i, row) in matrix.chunks_exact(r.max(1)).enumerate() {
            step[i] = (-self.slope[i] - dot(&row[..i], &step[..i])) * row[i];
        }
        for (i, row) in matrix.chunks_exact(r.max(1)).enumerate().rev() {
            let own = step[i] * row[i];
            step[i] = own;
            step.iter_mut().zip(&row[..i]).for_each(|(step, row)| *step -= own * row);
        }
        for (along, y) in self.along.iter_mut().zip(self.y.chunks_exact(r.max(1))) {
            *along = dot(y, &self.step);
        }
        let length = self.length(island, epsilon);
        self.v.iter_mut().zip(&self.step).for_each(|(v, step)| *v += length * step);
    }

    /// Returns how far the step goes.
    fn length(&self, island: &Island, epsilon: f64) -> f64 {
        let (constant, linear) = (dot(&self.step, &self.v), dot(&self.step, &self.step));
        let rate = |t: f64| {
            let of_block = |(i, block): (usize, &LocalBlock)| {
                let onto = self.project((i, block), epsilon, |row| self.w[row] + t * self.along[row]).0;
                onto.iter().zip(&self.along[block.range()]).map(|(onto, along)| onto * along).sum::<f64>()
            };
            constant + t * linear - island.blocks.iter().enumerate().map(of_block).sum::<f64>()
        };
        let first = dot(&self.step, &self.slope);
        let (mut low, mut high, mut t) = ((0.0, first), (1.0, rate(1.0)), 1.0);
        if high.1.abs() <= SEARCH[1] * first.abs() {
            return 1.0;
        }
        for _ in 0..POINTS[0] {
            if high.1 >= 0.0 {
                break;
            }
            low = high;
            t *= 2.0;
            high = (t, rate(t));
        }
        for _ in 0..POINTS[1] {
            if high.1 <= 0.0 {
                break;
            }
            t = low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1)).clamp(0.1, 0.9);
            let now = rate(t);
            if now.abs() <= SEARCH[0] * first.abs() {
                break;
            }
            if now > 0.0 { high = (t, now) } else { low = (t, now) }
        }
        t
    }
}

#[cfg(test)]
mod tests {
    use super::{Island, Multipliers};
    use crate::constraint::rows::{RowSet, Rows};

    /// Two contacts at one place: from nothing, each takes half of the force, sticking or sliding.
    #[test]
    fn redundant_contacts_share_the_force() {
        for (slip, friction) in [(0.2, 0.1), (5.0, 0.15)] {
            let mut rows = Rows::default();
            rows.clear(3);
            for _ in 0..2 {
                rows.push_block(RowSet::Cone { mu: 0.3 });
                let y = rows.side(0, 3).expect("first side");
                (0..3).for_each(|k| y[k * 3 + k] = 1.0);
            }
            let c = [-1.0, slip, 0.0, -1.0, slip, 0.0];
            let (island, k) = (Island::new(&rows, &[0, 1], &c), rows.dense(&[0, 1]));
            let mut lambda = [0.0; 6];
            let taken = Multipliers::new(&island, &k).improve(&island, &mut lambda, (1e-5, 6), (1.0, 1e-12));
            assert!((1..=40).contains(&taken), "{taken}");
            // equal shares of redundant contacts; the shift of De Saxcé, and with it the force, follows slowly
            let (one, other) = lambda.split_at(3);
            assert!(one.iter().zip(other).all(|(a, b)| (a - b).abs() < 1e-12), "{lambda:?}");
            let error = (one[0] - 0.5).abs() + (one[1] + friction).abs() + one[2].abs();
            assert!(error < 1e-2, "{lambda:?}");
        }
    }
}

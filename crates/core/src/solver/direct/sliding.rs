//! The step of Newton's method (`newton.rs`) on an island with many contacts that slide, in fewer unknowns.
//!
//! ```text
//! slides      δλ_n = z₁,   δλ_t = (μ·z₁ + s)·t + z₂·p,   s = (μ·f_n − f_t·t)/((1 + ε)·d)
//!             δw_n + ε·d·z₁ = −f_n,      σ·p·δw_t + (1 − σ + ε)·d·z₂ = −f_t·p
//! is free     δλ = z,      δw + ε·d·z = −f
//! together    δλ = B·z + b,   (W·(K + R)·B + E)·z = −f̂ − W·(K + R)·b
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `t`, `p` | direction of `x_t` and the one across it, with `x` of `choice.rs` |
//! | `σ` | `μ·x_n/|x_t|`, at most 1 |
//! | `s` | what is left of the friction along `t` once it follows the normal force: no unknown |
//! | `z` | three unknowns of a contact that is free, two of one that slides, one of a scalar row |
//! | `b` | the known part of the change, with that of rows that are not coupled |
//! | `W`, `E` | the rows of the equations in `δw`, and their terms in `z` |
//!
//! The equations are those of `choice.rs`: the row of friction along `t` has no coefficient but its own once the row of the
//! normal is subtracted, `μ` times.

use super::choice::{Choice, Point};
use super::cone::length;
use super::dense;
use super::island::{Kind, LocalBlock};
use crate::constraint::rows::multiply;

/// A coupled block: its first row, and its unknowns from `first` on.
struct Member {
    row: usize,
    rows: usize,
    first: usize,
    /// `t` and `μ` of a contact that slides.
    slides: Option<([f64; 2], f64)>,
}

impl Member {
    fn unknowns(&self) -> usize {
        if self.slides.is_some() { 2 } else { self.rows }
    }

    /// Writes `xᵀ·B` of the numbers `x` of a row of a matrix at this block.
    #[inline(always)]
    fn narrow(&self, x: &[f64], out: &mut [f64]) {
        match (self.slides, x) {
            (Some((t, mu)), [n, a, b]) => {
                out[0] = n + mu * (t[0] * a + t[1] * b);
                out[1] = t[0] * b - t[1] * a;
            }
            (_, [n, a, b]) => (out[0], out[1], out[2]) = (*n, *a, *b),
            _ => out[0] = x[0],
        }
    }
}

/// Working memory.
#[derive(Default)]
pub(super) struct Sliding {
    members: Vec<Member>,
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// `W` and `E` of each unknown: up to two rows of the matrix with their weights, and the own term.
    equations: Vec<Equation>,
    pulled: Vec<f64>,
    /// A row of `W·(K + R)`.
    row: Vec<f64>,
}

struct Equation {
    terms: [(usize, f64); 2],
    own: f64,
}

impl Sliding {
    /// Adds `B·z + b` of the coupled blocks to `lambda`, which has the changes of the others. `k` is `K + R`. Returns whether the
    /// matrix is regular.
    pub fn change<'a>(
        &mut self,
        blocks: impl Iterator<Item = (&'a LocalBlock<'a>, Point, Choice)>,
        k: &[f64],
        epsilon: f64,
        lambda: &mut [f64],
    ) -> bool {
        self.collect(blocks, epsilon, lambda);
        let (count, n) = (lambda.len(), self.right.len());
        self.pulled.clear();
        self.pulled.resize(count, 0.0);
        multiply(k, lambda, &mut self.pulled);
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        self.row.resize(count, 0.0);
        for (i, equation) in self.equations.iter().enumerate() {
            let [(a, first), (b, second)] = equation.terms;
            self.right[i] -= first * self.pulled[a] + second * self.pulled[b];
            let (above, below) = (&k[a * count..][..count], &k[b * count..][..count]);
            for (row, (a, b)) in self.row.iter_mut().zip(above.iter().zip(below)) {
                *row = first * a + second * b;
            }
            let matrix = &mut self.matrix[i * n..][..n];
            for member in &self.members {
                member.narrow(&self.row[member.row..member.row + member.rows], &mut matrix[member.first..]);
            }
            matrix[i] += equation.own;
        }
        if !dense::solve(&mut self.matrix, &mut self.right) {
            return false;
        }
        for member in &self.members {
            let z = &self.right[member.first..member.first + member.unknowns()];
            let lambda = &mut lambda[member.row..member.row + member.rows];
            match member.slides {
                Some((t, mu)) => {
                    lambda[0] += z[0];
                    lambda[1] += mu * t[0] * z[0] - t[1] * z[1];
                    lambda[2] += mu * t[1] * z[0] + t[0] * z[1];
                }
                None => lambda.iter_mut().zip(z).for_each(|(lambda, z)| *lambda += z),
            }
        }
        true
    }

    /// Collects the coupled blocks and their equations, and adds what is known of their change to `lambda`.
    fn collect<'a>(
        &mut self,
        blocks: impl Iterator<Item = (&'a LocalBlock<'a>, Point, Choice)>,
        epsilon: f64,
        lambda: &mut [f64],
    ) {
        self.members.clear();
        self.equations.clear();
        self.right.clear();
        for (block, point, choice) in blocks {
            let (row, f, d) = (block.row, point.function(block, choice), block.diagonal);
            let mut member = Member { row, rows: block.rows, first: self.right.len(), slides: None };
            if let (Choice::Slide, Kind::Cone { mu }) = (choice, block.kind) {
                let x = point.moved(block);
                let size = length(x[1], x[2]);
                let (t, share) = ([x[1] / size, x[2] / size], mu * x[0] / size);
                let left = (mu * f[0] - (t[0] * f[1] + t[1] * f[2])) / ((1.0 + epsilon) * d);
                lambda[row + 1] += left * t[0];
                lambda[row + 2] += left * t[1];
                self.right.extend([-f[0], -(t[0] * f[2] - t[1] * f[1])]);
                self.equations.push(Equation { terms: [(row, 1.0), (row, 0.0)], own: epsilon * d });
                let terms = [(row + 1, -share * t[1]), (row + 2, share * t[0])];
                self.equations.push(Equation { terms, own: (1.0 - share + epsilon) * d });
                member.slides = Some((t, mu));
            } else {
                self.right.extend(f[..block.rows].iter().map(|f| -f));
                let own = (epsilon * d).max(f64::MIN_POSITIVE);
                let equation = |k: usize| Equation { terms: [(row + k, 1.0), (row + k, 0.0)], own };
                self.equations.extend((0..block.rows).map(equation));
            }
            self.members.push(member);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::constraint::rows::{RowSet, Rows};
    use crate::solver::direct::newton::SmallIsland;

    /// Contacts on a chain of nodes that pull at each other, half of which slide, and a few scalar rows: the step in fewer
    /// unknowns is that of all rows.
    #[test]
    fn the_step_is_that_of_all_rows() {
        let (nodes, mut seed) = (40, 11u64);
        let mut random = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let (mut rows, mut c, mut lambda) = (Rows::default(), Vec::new(), Vec::new());
        rows.clear(3 * nodes);
        for node in 0..nodes {
            let set = if node % 10 == 9 { RowSet::HalfLine } else { RowSet::Cone { mu: 0.4 } };
            rows.push_block(set);
            let y = rows.side(0, 3 * nodes).expect("first side");
            for (k, y) in y.chunks_exact_mut(3 * nodes).enumerate() {
                y[3 * node + k] = 1.0;
                y.iter_mut().skip(3 * node).take(6).for_each(|y| *y += 0.3 * random());
            }
            let slides = if node % 2 == 0 { 2.0 } else { 0.1 };
            c.extend((0..set.rows()).map(|k| if k == 0 { -0.5 } else { slides * random() }));
            lambda.extend((0..set.rows()).map(|k| if k == 0 { 0.5 } else { 0.1 * random() }));
        }
        let blocks: Vec<u32> = (0..nodes as u32).collect();
        let mut island = SmallIsland::new(&rows, &blocks, &c).expect("not too large");
        let [all, fewer] = [false, true].map(|fewer| island.step_for_test(&lambda, fewer).expect("regular"));
        let error = all.iter().zip(&fewer).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-11, "{error}");
    }
}

//! The solution of the contact problem near a known one, by the implicit function theorem on the
//! whitened rows.
//!
//! The problem `λ ∈ set, w = c + (K + R)·λ` of [`RowSet`] has equations on its *active set*:
//!
//! ```text
//! open, without response               λ = 0
//! presses without friction             w_n = 0,  λ_t = 0
//! equality; presses; inside bounds     w = 0
//! at a bound                           λ = bound
//! both bounds 0                        λ = the bound against w: friction in a direction in which nothing moves yet
//! sticks                               w_n = 0,  w_t = 0
//! slides                               w_n = 0,  λ_t = μ·λ_n·p/|p|,  p = d·λ_t − w_t
//! ```
//!
//! With `F(λ; rows) = 0` at the known solution `λ₀`, rows that differ by `δ` have the solution
//!
//! ```text
//! λ = λ₀ − (∂F/∂λ)⁻¹·F(λ₀; rows + δ)          exact to first order in δ
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `K`, `R`, `c`, `w` | as in [`rows`](crate::constraint::rows) |
//! | `d` | mean diagonal of the block of `K + R` |
//! | `∂F/∂λ` | at the known solution; singular where contacts are redundant (four corners of a box), where the solution nearest to `λ₀` is taken: velocities are the same for all |
//!
//! Where a row presses with no force, or slides with no velocity, the derivative is that of one side: the one on which
//! the row holds.

use super::branches::Switch;
use crate::constraint::rows::{RowSet, Rows};
use crate::solver::{RowSolver, SolveReport, SolverSettings};
use nalgebra::{DMatrix, DVector};
use std::sync::{Arc, Mutex, PoisonError};

/// Newton rounds that make the known solution exact.
const ROUNDS: usize = 12;
/// Number of lengths of a round that are tried, each half of the last.
const HALVINGS: i32 = 12;
/// Maximum number of active sets that are tried for a known solution.
const SETS: usize = 12;
/// Least number of rounds with the derivative at the known solution, for displaced rows, and most as long as they converge:
/// the first one makes the derivative right, the others the truncation of differences small.
const CHORDS: (usize, usize) = (3, 6);
/// Singular values below this fraction of the largest belong to redundant rows.
const RANK: f64 = 1e-10;
/// Redundant multipliers that change no row velocity by more than this, in units of their own, leave velocities determined.
const DETERMINED: f64 = 1e-6;
/// Row velocities below this are zero, m/s: ten times the tolerance with which solutions are found.
const STILL: f64 = 1e-9;

/// State of a block in the solution.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Active {
    Open,
    Holds,
    AtLow,
    AtHigh,
    /// Both bounds are one number, and move apart in displaced rows.
    Narrow,
    Sticks,
    Slides,
    /// Presses without friction.
    Smooth,
}

/// One solved island.
#[derive(Debug)]
struct Known {
    blocks: Vec<u32>,
    active: Vec<Active>,
    /// Multipliers of the rows of the blocks, in their order.
    lambda: Vec<f64>,
    /// The inverse of `∂F/∂λ`.
    inverse: DMatrix<f64>,
}

/// The solves of a step in their order.
#[derive(Debug, Default)]
pub(super) struct Tape {
    known: Vec<Known>,
    repeats: bool,
    next: usize,
    /// Whether a solve of this run had other blocks than the recorded one.
    torn: bool,
    /// Blocks of this run that leave their active set.
    switched: Vec<(Switch, usize)>,
    /// Largest error of the recorded solutions, m/s.
    pub residual: f64,
    /// Largest number of rows of a solve.
    pub largest: usize,
    /// Whether multipliers that are not determined change velocities.
    pub indeterminate: bool,
}

impl Tape {
    /// Starts to repeat.
    pub fn repeat(&mut self) {
        (self.repeats, self.next, self.torn) = (true, 0, false);
        self.switched.clear();
    }

    /// Returns the blocks that left their active sets in this run; `None` if it had other solves.
    pub fn switched(&self) -> Option<&[(Switch, usize)]> {
        (!self.torn && self.next == self.known.len()).then_some(&self.switched[..])
    }
}

/// Solves by another solver and records the active sets, or repeats them.
pub(super) struct HeldSolver {
    pub inner: Box<dyn RowSolver>,
    pub tape: Arc<Mutex<Tape>>,
}

impl RowSolver for HeldSolver {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport {
        // equalities have no active set, and are solved directly
        if blocks.iter().all(|&b| rows.blocks[b as usize].set == RowSet::Equality) {
            return self.inner.solve(rows, blocks, c, lambda, du, settings);
        }
        let mut tape = self.tape.lock().unwrap_or_else(PoisonError::into_inner);
        let problem = Problem::new(rows, blocks, c);
        if !tape.repeats {
            let outcome = self.inner.solve(rows, blocks, c, lambda, du, settings);
            let known = problem.know(lambda, &mut tape);
            tape.largest = tape.largest.max(problem.places.len());
            problem.write(&known.lambda, lambda, du);
            tape.known.push(known);
            return SolveReport { converged: true, ..outcome };
        }
        tape.next += 1;
        let fits = !tape.torn && tape.known.get(tape.next - 1).is_some_and(|known| known.blocks == blocks);
        if !fits {
            tape.torn = true;
            return self.inner.solve(rows, blocks, c, lambda, du, settings);
        }
        let Tape { known, next, switched, .. } = &mut *tape;
        let known = &known[*next - 1];
        let mut next = known.lambda.clone();
        let mut last = f64::INFINITY;
        for round in 0..CHORDS.1 {
            let after = problem.step(&known.active, &next, &known.inverse);
            let change = after.iter().zip(&next).fold(0.0, |most: f64, (a, b)| most.max((a - b).abs()));
            if round >= CHORDS.0 && (change.is_nan() || change >= last) {
                break;
            }
            (next, last) = (after, change);
        }
        problem.check(&known.active, &next, switched);
        problem.write(&next, lambda, du);
        SolveReport { iterations: 1, converged: true, ray: false, relaxations: 0 }
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        self.inner.fork()
    }
}

/// The contact problem of one island.
struct Problem<'a> {
    rows: &'a Rows,
    blocks: &'a [u32],
    c: &'a [f64],
    /// Row of `rows` of each unknown.
    places: Vec<usize>,
}

impl<'a> Problem<'a> {
    fn new(rows: &'a Rows, blocks: &'a [u32], c: &'a [f64]) -> Problem<'a> {
        let places = blocks.iter().flat_map(|&b| rows.blocks[b as usize].range()).collect();
        Problem { rows, blocks, c, places }
    }

    /// Returns `w` of all rows.
    fn velocities(&self, lambda: &[f64]) -> Vec<f64> {
        let (mut all, mut du) = (vec![0.0; self.rows.len], vec![0.0; self.rows.dof]);
        self.places.iter().zip(lambda).for_each(|(&row, &value)| all[row] = value);
        let blocks = || self.blocks.iter().map(|&b| &self.rows.blocks[b as usize]);
        blocks().for_each(|block| self.rows.apply_block(block, &all, &mut du));
        blocks()
            .flat_map(|block| block.range().enumerate().map(move |(k, row)| (block, k, row)))
            .map(|(block, k, row)| self.c[row] + self.rows.row_velocity(block, k, &du) + block.compliance * all[row])
            .collect()
    }

    /// Calls `each` with each block, its mean entry on the diagonal of `K`, and its first unknown.
    fn each_block(&self, mut each: impl FnMut(usize, RowSet, f64, usize)) {
        let mut first = 0;
        for (i, block) in self.blocks.iter().map(|&b| &self.rows.blocks[b as usize]).enumerate() {
            let n = block.set.rows();
            let diagonal = (0..n).map(|k| self.rows.own(block, k, k)).sum::<f64>() / n as f64 + block.compliance;
            each(i, block.set, diagonal, first);
            first += n;
        }
    }

    /// Returns the active set of a solution.
    fn active(&self, lambda: &[f64]) -> Vec<Active> {
        let w = self.velocities(lambda);
        let mut active = vec![Active::Open; self.blocks.len()];
        self.each_block(|i, set, d, k| {
            if d <= f64::MIN_POSITIVE {
                return;
            }
            let presses = |k: usize| d * lambda[k] - w[k] >= -STILL && w[k] <= STILL;
            active[i] = match set {
                RowSet::Equality => Active::Holds,
                RowSet::HalfLine if presses(k) => Active::Holds,
                RowSet::Interval { lo, hi } if d * (hi - lo) <= STILL => Active::Narrow,
                RowSet::Interval { lo, .. } if d * (lambda[k] - lo) < w[k] - STILL => Active::AtLow,
                RowSet::Interval { hi, .. } if d * (lambda[k] - hi) > w[k] + STILL => Active::AtHigh,
                RowSet::Interval { .. } => Active::Holds,
                RowSet::Cone { mu } if presses(k) && mu > 0.0 => {
                    let wanted = |k: usize| d * lambda[k] - w[k];
                    let sticks = hypot(wanted(k + 1), wanted(k + 2)) <= mu * d * lambda[k] + STILL;
                    if sticks { Active::Sticks } else { Active::Slides }
                }
                RowSet::Cone { .. } if presses(k) => Active::Smooth,
                RowSet::HalfLine | RowSet::Cone { .. } => Active::Open,
            };
        });
        active
    }

    /// Returns the solution near `lambda` exactly, with its active set and the inverse of the derivative.
    ///
    /// A solver ends within its tolerance, where a row that presses can look open. So the active set is that of the
    /// exact solution of its own equations: it is taken anew until that solution is inside it.
    fn know(&self, all: &[f64], tape: &mut Tape) -> Known {
        let mut best: Option<(f64, Known, bool)> = None;
        let mut start: Vec<f64> = self.places.iter().map(|&row| all[row]).collect();
        for _ in 0..SETS {
            let active = self.active(&start);
            if best.as_ref().is_some_and(|(_, best, _)| best.active == active) {
                break;
            }
            let (lambda, inverse, determined) = self.solution(&active, &start);
            let mut off = self.residual(&active, &lambda);
            self.leave(&active, &lambda, |_, _, by| off = if by > STILL { off.max(by) } else { off });
            start.clone_from(&lambda);
            if best.as_ref().is_none_or(|(least, ..)| off < *least) {
                best = Some((off, Known { blocks: self.blocks.to_vec(), active, lambda, inverse }, determined));
            }
            if off <= STILL {
                break;
            }
        }
        let (off, known, determined) = best.unwrap_or_else(|| {
            let empty = Known { blocks: Vec::new(), active: Vec::new(), lambda: start, inverse: DMatrix::zeros(0, 0) };
            (f64::INFINITY, empty, true)
        });
        tape.residual = tape.residual.max(off);
        tape.indeterminate |= !determined;
        known
    }

    /// Returns the solution of the equations of an active set near `lambda`, the inverse of their derivative, and whether it
    /// determines all velocities.
    fn solution(&self, active: &[Active], lambda: &[f64]) -> (Vec<f64>, DMatrix<f64>, bool) {
        let mut lambda = lambda.to_vec();
        let (mut inverse, mut determined) = self.inverse(active, &lambda);
        for _ in 0..ROUNDS {
            let (whole, before) = (self.step(active, &lambda, &inverse), self.size(active, &lambda));
            let part =
                |share: f64| -> Vec<f64> { lambda.iter().zip(&whole).map(|(a, b)| a + share * (b - a)).collect() };
            let falls = |next: &Vec<f64>| self.size(active, next) < before;
            let Some(next) = (0..HALVINGS).map(|k| part(0.5_f64.powi(k))).find(falls) else { break };
            lambda = next;
            (inverse, determined) = self.inverse(active, &lambda);
        }
        (lambda, inverse, determined)
    }

    /// Returns the largest error of row velocities, m/s: of sliding contacts that by which friction is not against the velocity.
    fn residual(&self, active: &[Active], lambda: &[f64]) -> f64 {
        let (f, w) = (self.equations(active, lambda), self.velocities(lambda));
        let mut most = 0.0_f64;
        self.each_block(|i, set, d, k| {
            let slides = if let (Active::Slides, RowSet::Cone { mu }) = (active[i], set) { Some(mu) } else { None };
            let (speed, load) = match slides {
                Some(mu) => (hypot(w[k + 1], w[k + 2]), d * mu * lambda[k]),
                None => (0.0, 0.0),
            };
            for j in k..k + set.rows() {
                let off = match slides {
                    Some(_) if j > k => (speed * d * lambda[j] + load * w[j]) / (speed + load).max(STILL),
                    _ => f[j],
                };
                most = most.max(off.abs());
            }
        });
        most
    }

    /// Returns `|F(λ)|`, which falls along a round.
    fn size(&self, active: &[Active], lambda: &[f64]) -> f64 {
        self.equations(active, lambda).iter().map(|f| f * f).sum::<f64>().sqrt()
    }

    /// Returns `F(λ)`, in m/s.
    fn equations(&self, active: &[Active], lambda: &[f64]) -> Vec<f64> {
        let mut f = self.velocities(lambda);
        self.each_block(|i, set, d, k| {
            let mu = if let RowSet::Cone { mu } = set { mu } else { 0.0 };
            let d = if d > f64::MIN_POSITIVE { d } else { 1.0 };
            match (active[i], set) {
                (Active::Open, _) => (k..k + set.rows()).for_each(|k| f[k] = d * lambda[k]),
                (Active::Smooth, _) => (k + 1..k + 3).for_each(|k| f[k] = d * lambda[k]),
                (Active::AtLow, RowSet::Interval { lo, .. }) => f[k] = d * (lambda[k] - lo),
                (Active::AtHigh, RowSet::Interval { hi, .. }) => f[k] = d * (lambda[k] - hi),
                (Active::Narrow, RowSet::Interval { lo, hi }) => {
                    f[k] = d * (lambda[k] - if f[k] > 0.0 { lo } else { hi });
                }
                (Active::Slides, _) => {
                    let (load, wanted) = (d * mu * lambda[k], [1, 2].map(|t| d * lambda[k + t] - f[k + t]));
                    let size = hypot(wanted[0], wanted[1]).max(f64::MIN_POSITIVE);
                    [1, 2].iter().zip(wanted).for_each(|(t, p)| f[k + t] = d * lambda[k + t] - load * p / size);
                }
                _ => {}
            }
        });
        f
    }

    /// Returns the inverse of `∂F/∂λ`, or the pseudo-inverse of a singular one, and whether it determines all
    /// velocities: four corners that slide and turn may share the load in many ways, with other moments of friction.
    fn inverse(&self, active: &[Active], lambda: &[f64]) -> (DMatrix<f64>, bool) {
        let n = self.places.len();
        let k_matrix = DMatrix::from_row_slice(n, n, &self.rows.dense(self.blocks));
        let (mut jacobian, w) = (k_matrix.clone(), self.velocities(lambda));
        let mut unit = vec![1.0; n];
        self.each_block(|i, set, d, k| {
            let d = if d > f64::MIN_POSITIVE { d } else { 1.0 };
            let mu = if let RowSet::Cone { mu } = set { mu } else { 0.0 };
            unit[k..k + set.rows()].fill(1.0 / d.sqrt());
            match active[i] {
                Active::Open | Active::AtLow | Active::AtHigh | Active::Narrow | Active::Smooth => {
                    let first = k + usize::from(active[i] == Active::Smooth);
                    for k in first..k + set.rows() {
                        jacobian.row_mut(k).fill(0.0);
                        jacobian[(k, k)] = d;
                    }
                }
                Active::Slides => {
                    let (load, wanted) = (d * mu * lambda[k], [1, 2].map(|t| d * lambda[k + t] - w[k + t]));
                    let size = hypot(wanted[0], wanted[1]).max(f64::MIN_POSITIVE);
                    let along = wanted.map(|p| p / size);
                    for j in [0, 1] {
                        let mut row = nalgebra::RowDVector::zeros(n);
                        for t in [0, 1] {
                            // of the direction by what is wanted, d·λ_t − w_t
                            let turn = load / size * (f64::from(u8::from(j == t)) - along[j] * along[t]);
                            row += turn * k_matrix.row(k + 1 + t);
                            row[k + 1 + t] -= turn * d;
                        }
                        row[k + 1 + j] += d;
                        row[k] -= d * mu * along[j];
                        jacobian.set_row(k + 1 + j, &row);
                    }
                }
                Active::Holds | Active::Sticks => {}
            }
        });
        // in units in which every row has a mass of about 1, small singular values are those of redundant rows
        let scale = DMatrix::from_diagonal(&DVector::from_vec(unit));
        let scaled = &scale * jacobian * &scale;
        let svd = scaled.svd(true, true);
        let least = RANK * svd.singular_values.max();
        let coupled = &scale * &k_matrix * &scale;
        let free =
            |(i, _): (usize, &f64)| svd.v_t.as_ref().map_or(0.0, |v_t| (&coupled * v_t.row(i).transpose()).amax());
        let undetermined = svd.singular_values.iter().enumerate().filter(|(_, s)| **s <= least);
        let determined = undetermined.map(free).fold(0.0, f64::max) <= DETERMINED;
        let inverse = svd.pseudo_inverse(least).unwrap_or_else(|_| DMatrix::zeros(n, n));
        (&scale * inverse * &scale, determined)
    }

    /// Returns `λ − (∂F/∂λ)⁻¹·F(λ)`.
    fn step(&self, active: &[Active], lambda: &[f64], inverse: &DMatrix<f64>) -> Vec<f64> {
        let change = inverse * DVector::from_vec(self.equations(active, lambda));
        lambda.iter().zip(change.iter()).map(|(lambda, change)| lambda - change).collect()
    }

    /// Adds the blocks whose multipliers or velocities leave the active set.
    fn check(&self, active: &[Active], lambda: &[f64], switched: &mut Vec<(Switch, usize)>) {
        self.leave(active, lambda, |i, switch, by| {
            if by > STILL {
                switched.push((switch, self.blocks[i] as usize));
            }
        });
    }

    /// Calls `each` with the blocks that are outside their active set, and by how much, m/s.
    fn leave(&self, active: &[Active], lambda: &[f64], mut each: impl FnMut(usize, Switch, f64)) {
        let w = self.velocities(lambda);
        self.each_block(|i, set, d, k| {
            let (switch, inside) = match (active[i], set) {
                (Active::Open, _) if d > f64::MIN_POSITIVE => (Switch::Force, w[k]),
                (Active::Holds, RowSet::HalfLine) | (Active::Smooth, _) => (Switch::Force, d * lambda[k]),
                (Active::Holds, RowSet::Interval { lo, hi }) => {
                    (Switch::Friction, d * (lambda[k] - lo).min(hi - lambda[k]))
                }
                (Active::AtLow, _) => (Switch::Friction, w[k]),
                (Active::AtHigh, _) => (Switch::Friction, -w[k]),
                (Active::Sticks | Active::Slides, _) if d * lambda[k] < -STILL => (Switch::Force, d * lambda[k]),
                (Active::Sticks, RowSet::Cone { mu }) => {
                    (Switch::Friction, d * (mu * lambda[k] - hypot(lambda[k + 1], lambda[k + 2])))
                }
                // friction along the velocity
                (Active::Slides, _) => {
                    let along = w[k + 1] * lambda[k + 1] + w[k + 2] * lambda[k + 2];
                    let speed = hypot(w[k + 1], w[k + 2]);
                    (Switch::Friction, if along > 0.0 { -d * along / speed - 2.0 * STILL } else { 0.0 })
                }
                _ => return,
            };
            if inside < 0.0 {
                each(i, switch, -inside);
            }
        });
    }

    /// Writes the multipliers, and adds their effect to `du`, where that of these blocks is removed before.
    fn write(&self, own: &[f64], lambda: &mut [f64], du: &mut [f64]) {
        let blocks = || self.blocks.iter().map(|&b| &self.rows.blocks[b as usize]);
        for side in blocks().flat_map(|block| block.sides()) {
            du[side.u as usize..(side.u + side.dof) as usize].fill(0.0);
        }
        self.places.iter().zip(own).for_each(|(&row, &value)| lambda[row] = value);
        blocks().for_each(|block| self.rows.apply_block(block, lambda, du));
    }
}

/// Returns `√(a² + b²)`, with the same bits on every platform.
fn hypot(a: f64, b: f64) -> f64 {
    nalgebra::ComplexField::hypot(a, b)
}

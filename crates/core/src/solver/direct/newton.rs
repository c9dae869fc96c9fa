//! Newton's method on the function of Alart and Curnier (`choice.rs`), with the matrix of the rows: small islands,
//! from multipliers that need not be near.
//!
//! ```text
//! f(λ, w) = 0,    w = c + (K + R)·λ
//! open, low, high:     (1 + ε)·d·δλ = −f
//! free, slide:         (∂f/∂λ + ε·d + ∂f/∂w·(K + R))·δλ = −f
//! bounds that follow normal forces,  −b ≤ λ ≤ b,  b = Σ aᵢ·λ_ni:
//! low, high            (1 + ε)·d·δλ ± d·Σ aᵢ·δλ_ni = −f
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `d` | mean diagonal of a block of `K` |
//! | `ε` | keeps redundant contacts regular; grows after a step along which `|f|` does not fall |
//!
//! With the right choices a step is exact except for the curve of sliding friction. The choices follow the iterate,
//! and a line search along `|f|` accepts some steps uphill. Four feet of a robot with friction press each other through
//! its joints, two contacts of a foot are redundant, and then the choices may go in circles. A second attempt after ten
//! sweeps alternates with the method of multipliers (`multipliers.rs`), which finds the choices that Newton's method
//! makes exact. Before that, of islands with few redundant rows, or after it, of others, the choices are *held*: those of
//! the multipliers that are there, then each with one block changed, in the order of how near the block is to that change.
//! Feet that are braced against each other need that: there `|f|` has minima that are no solutions. Other methods solve
//! the rest.

mod equations;
mod iterate;

use super::choice::{Choice, Point};
use super::cone::length;
use super::island::{Island, Kind, LocalBlock, largest};
use super::multipliers::Multipliers;
use super::sliding::Sliding;
use super::{Direct, Tolerance, work_of_blocks};
use crate::constraint::rows::{Rows, multiply};
use equations::Memory;
use iterate::Iterate;
use std::ops::Range;

/// Maximum number of rows of an island, and of one with a wide object, of which a sweep costs nearly as much as a step
/// of the elimination.
const MAX_ROWS: (usize, usize) = (128, 768);
/// Degrees of freedom of a wide object, such as a cloth.
const WIDE: u32 = 256;
/// Maximum number of steps of a first attempt, of a second one, and after each turn of the method of multipliers.
const STEPS: [u32; 3] = [12, 2, 4];
/// Maximum number of turns of the method of multipliers, and of its outer steps in one.
const TURNS: (i32, u32) = (6, 2);
/// Its `ε` in the first turn, ratio of the following ones, and bound.
const PENALTY: [f64; 3] = [1e-5, 0.1, 1e-7];
/// `ε`: least, first after a step that failed, growth and bound. With less, redundant contacts that disagree by rounding get
/// forces of any size.
const REGULAR: [f64; 4] = [1e-7, 1e-5, 100.0, 0.1];
/// Maximum number of steps with choices that are held, their `ε`, and the number of single changes that are tried.
const HELD_STEPS: u32 = 6;
const HELD: f64 = 1e-13;
const CHANGES: usize = 10;
/// Choices are held before the method of multipliers is tried, and not after it, if there are at most this number of rows for each
/// of the island's rank: then contacts are seldom redundant.
const BRACED: f64 = 1.25;
/// First `ε` where more rows are coupled than the island has velocities: without it the step has no bound.
const REDUNDANT: f64 = 1e-4;
/// A step is accepted if `|f|` falls below the largest of this number of last iterates: the way to the right choices
/// leads uphill now and then (Grippo, Lampariello and Lucidi, *A nonmonotone line search technique for Newton's
/// method*, 1986).
const MEMORY: usize = 6;
/// Number of lengths of a step that are tried, each half of the last.
const LENGTHS: u32 = 6;

/// A small island with the matrix of its rows.
pub(in crate::solver) struct SmallIsland<'a> {
    island: Island<'a>,
    /// `K + R`, row-major.
    k: Vec<f64>,
    /// Rows of the normal forces that each bound follows, with the factors `a`.
    bounds: Vec<Vec<(usize, f64)>>,
    memory: Memory,
    sliding: Sliding,
    /// With more coupled rows than this, contacts that slide have fewer unknowns (`sliding.rs`).
    fewer_from: usize,
}

/// The best multipliers so far.
struct Best {
    lambda: Vec<f64>,
    /// Those that are compared with them.
    other: Iterate,
    error: f64,
    /// Number of equations solved.
    taken: u32,
    tolerance: Tolerance,
}

impl Best {
    fn is_solved(&self) -> bool {
        self.error <= self.tolerance.solved
    }
}

impl<'a> SmallIsland<'a> {
    /// Returns `None` if the island has too many rows.
    pub fn new(rows: &'a Rows, blocks: &[u32], c: &[f64]) -> Option<SmallIsland<'a>> {
        let count: usize = blocks.iter().map(|&b| rows.blocks[b as usize].set.rows()).sum();
        let island = || Island::new(rows, blocks, c);
        let most = if is_wide(rows, blocks) { MAX_ROWS.1 } else { MAX_ROWS.0 };
        (count <= most).then(|| SmallIsland {
            island: island(),
            k: rows.dense(blocks),
            bounds: Vec::new(),
            memory: Memory::default(),
            sliding: Sliding::default(),
            fewer_from: MAX_ROWS.0,
        })
    }

    /// Returns the change of the multipliers in one step, with all unknowns or with fewer; `None` if there is none.
    #[cfg(test)]
    pub fn step_for_test(&mut self, lambda: &[f64], fewer: bool) -> Option<Vec<f64>> {
        self.fewer_from = if fewer { 0 } else { usize::MAX };
        let (at, mut choices, mut change) = (self.at(lambda.to_vec()), Vec::new(), Iterate::default());
        self.choose(&at, &mut choices);
        let slide = choices.iter().filter(|choice| **choice == Choice::Slide).count();
        assert!(slide > 10 && slide + 10 < choices.len(), "{slide} slide");
        self.change(&at, &choices, REGULAR[0], &mut change).then_some(change.lambda)
    }

    /// Sets the number of bounds that follow normal forces.
    pub fn set_bounds(&mut self, count: usize) {
        self.bounds.resize(count, Vec::new());
    }

    /// Sets the bound of a block, which follows the normal forces of other blocks with the factors `a`. Its present
    /// value is `now`.
    pub fn bind(&mut self, bound: usize, block: usize, now: f64, loads: impl Iterator<Item = (usize, f64)>) {
        let blocks = &mut self.island.blocks;
        self.bounds[bound].clear();
        self.bounds[bound].extend(loads.map(|(block, factor)| (blocks[block].row, factor)));
        if blocks[block].diagonal > f64::MIN_POSITIVE {
            (blocks[block].bound, blocks[block].kind) = (Some(bound as u32), Kind::Interval { lo: -now, hi: now });
        }
    }

    /// Sets the friction coefficient of a contact.
    pub fn set_friction(&mut self, block: usize, mu: f64) {
        let kind = &mut self.island.blocks[block].kind;
        if *kind != Kind::Held {
            *kind = if mu > 0.0 { Kind::Cone { mu } } else { Kind::HalfLine };
        }
    }

    /// Returns the cost of a step in sweeps, at most.
    pub fn cost(&self) -> f64 {
        (self.island.c.len() as f64).powi(3) / 3.0 / work_of_blocks(&self.island).1
    }

    /// Solves from the multipliers in `lambda`, and replaces them if it finds better ones. If `thorough`, the method of
    /// multipliers helps where the choices that follow the iterate fail; bounds that follow normal forces must not be there then.
    pub fn solve(&mut self, lambda: &mut [f64], tolerance: f64, thorough: bool) -> Direct {
        let tolerance = self.island.tolerance(tolerance);
        let own = self.island.read(lambda);
        let start = self.at(own.clone());
        let error = self.error(&start);
        let mut best = Best { lambda: own, other: Iterate::default(), error, taken: 0, tolerance };
        self.follow(start, &mut best, STEPS[usize::from(thorough)]);
        if thorough && !best.is_solved() && best.error.is_finite() {
            let method = Multipliers::new(&self.island, &self.k);
            let braced = self.island.c.len() as f64 <= BRACED * method.rank() as f64;
            if braced {
                self.hold(&mut best);
            }
            if !best.is_solved() {
                let first = self.island.read(lambda);
                self.alternate(&mut best, first, method);
            }
            if !braced && !best.is_solved() {
                self.hold(&mut best);
            }
        }
        if best.error < error {
            self.island.write(&best.lambda, lambda);
        }
        Direct { factorizations: best.taken, converged: best.is_solved() }
    }

    /// Takes at most `most` steps from other multipliers, one per row of the island, and replaces those in `lambda` if it
    /// finds better ones.
    pub fn solve_from(&mut self, start: &[f64], most: u32, lambda: &mut [f64], tolerance: f64) -> Direct {
        let tolerance = self.island.tolerance(tolerance);
        let before = self.error(&self.at(self.island.read(lambda)));
        let at = self.at(start.to_vec());
        let error = self.error(&at);
        let mut best = Best { lambda: start.to_vec(), other: Iterate::default(), error, taken: 0, tolerance };
        self.follow(at, &mut best, most);
        if best.error < before || before.is_nan() {
            self.island.write(&best.lambda, lambda);
        }
        Direct { factorizations: best.taken, converged: best.is_solved() }
    }

    /// Returns the multipliers of the island, one per row.
    pub fn read(&self, lambda: &[f64]) -> Vec<f64> {
        self.island.read(lambda)
    }

    /// Returns a force per row, in the direction of friction at contacts: against the velocity of those that slide, the
    /// multipliers of the others.
    pub fn directions(&self, lambda: &[f64]) -> Vec<f64> {
        let at = self.at(lambda.to_vec());
        let mut along = lambda.to_vec();
        for block in &self.island.blocks {
            let point = at.point(block);
            if point.choice(block) == Choice::Slide && length(point.w[1], point.w[2]) > 0.0 {
                along[block.range()].iter_mut().zip(point.w).for_each(|(along, w)| *along = -w);
            }
        }
        along
    }

    /// Returns the blocks but contacts that open by more than `far` of the fastest row, each with its rows.
    pub fn near(&self, lambda: &[f64], far: f64) -> Vec<(usize, Range<usize>)> {
        let at = self.at(lambda.to_vec());
        let is_near = |block: &LocalBlock| {
            let point = at.point(block);
            let opens = point.w[0] - block.diagonal * point.lambda[0] > far * self.island.fastest;
            !(opens && matches!(block.kind, Kind::Cone { .. }))
        };
        let blocks = self.island.blocks.iter().enumerate();
        blocks.filter(|(_, block)| is_near(block)).map(|(i, block)| (i, block.range())).collect()
    }

    /// Takes at most `most` steps with the choices that each iterate asks for.
    fn follow(&mut self, mut at: Iterate, best: &mut Best, most: u32) {
        let (mut choices, mut change) = (Vec::new(), Iterate::default());
        self.choose(&at, &mut choices);
        let coupled = self.island.blocks.iter().zip(&choices).filter(|(_, choice)| choice.is_coupled());
        let redundant = coupled.map(|(block, _)| block.rows).sum::<usize>() > self.island.dof;
        let mut epsilon = if redundant { REDUNDANT } else { REGULAR[0] };
        let mut sizes = vec![self.size(|block| at.point(block))];
        for _ in 0..most {
            if best.error <= best.tolerance.goal || !sizes.iter().all(|size| size.is_finite()) {
                return;
            }
            if !self.change(&at, &choices, epsilon, &mut change) {
                return;
            }
            best.taken += 1;
            let largest = sizes.iter().rev().take(MEMORY).fold(0.0, |a: f64, size| a.max(*size));
            let size = |t: f64| self.size(|block| at.point_along(&change, t, block));
            let falls = |t: &f64| size(*t) < (1.0 - 1e-4 * t) * largest;
            let length = match (0..LENGTHS).map(|k| 0.5_f64.powi(k as i32)).find(falls) {
                Some(length) => {
                    if length == 1.0 {
                        epsilon = (0.1 * epsilon).max(REGULAR[0]);
                    }
                    length
                }
                None if epsilon < REGULAR[3] => {
                    epsilon = (REGULAR[2] * epsilon).max(REGULAR[1]);
                    continue;
                }
                None => {
                    epsilon = REGULAR[0];
                    1.0
                }
            };
            at.advance(&change, length);
            self.choose(&at, &mut choices);
            self.consider(&at, &choices, best);
            sizes.push(self.size(|block| at.point(block)));
        }
    }

    /// Alternates between the method of multipliers and steps from what it finds.
    fn alternate(&mut self, best: &mut Best, mut lambda: Vec<f64>, mut method: Multipliers) {
        let mut error = best.error;
        for turn in 0..TURNS.0 {
            let epsilon = (PENALTY[0] * PENALTY[1].powi(turn)).max(PENALTY[2]);
            best.taken += method.improve(&self.island, &mut lambda, (epsilon, TURNS.1), (error, best.tolerance.goal));
            let at = self.at(lambda.clone());
            error = self.error(&at);
            if !error.is_finite() {
                return;
            }
            if error < best.error {
                best.error = error;
                best.lambda.copy_from_slice(&lambda);
            }
            if !best.is_solved() {
                self.follow(at, best, STEPS[2]);
            }
            if best.is_solved() {
                return;
            }
        }
    }

    /// Tries the choices of the best multipliers, and those with one block changed.
    fn hold(&mut self, best: &mut Best) {
        let start = self.at(best.lambda.clone());
        let (mut choices, mut changes) = (Vec::new(), Vec::new());
        self.choose(&start, &mut choices);
        for (i, block) in self.island.blocks.iter().enumerate() {
            start.point(block).others(block, |distance, choice| changes.push((distance, i, choice)));
        }
        changes.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.follow_held(start.clone(), &choices, best);
        for (_, i, choice) in changes.into_iter().take(CHANGES) {
            if best.is_solved() {
                return;
            }
            let before = std::mem::replace(&mut choices[i], choice);
            self.follow_held(start.clone(), &choices, best);
            choices[i] = before;
        }
    }

    /// Takes steps with the choices held.
    fn follow_held(&mut self, mut at: Iterate, choices: &[Choice], best: &mut Best) {
        let (mut last, mut change) = (f64::INFINITY, Iterate::default());
        let mut rises = 0;
        for _ in 0..HELD_STEPS {
            let size = self.size_held(&at, choices);
            rises += u32::from(size >= last);
            if !size.is_finite() || rises > 2 {
                return;
            }
            last = size;
            if !self.change(&at, choices, HELD, &mut change) {
                return;
            }
            best.taken += 1;
            at.advance(&change, 1.0);
            self.consider(&at, choices, best);
            if best.is_solved() {
                return;
            }
        }
    }

    /// Takes the multipliers that the choices ask for if they are the best.
    fn consider(&self, at: &Iterate, choices: &[Choice], best: &mut Best) {
        let other = &mut best.other;
        other.lambda.clear();
        other.lambda.resize(self.island.c.len(), 0.0);
        for (block, choice) in self.island.blocks.iter().zip(choices) {
            other.lambda[block.range()].copy_from_slice(&at.point(block).target(block, *choice)[..block.rows]);
        }
        self.move_rows(other);
        let error = self.error(other);
        if error < best.error {
            best.error = error;
            std::mem::swap(&mut best.lambda, &mut other.lambda);
        }
    }

    fn at(&self, lambda: Vec<f64>) -> Iterate {
        let mut at = Iterate { lambda, ..Iterate::default() };
        self.move_rows(&mut at);
        at
    }

    /// Writes the row velocities of the multipliers.
    fn move_rows(&self, at: &mut Iterate) {
        self.multiply(at);
        at.w.iter_mut().zip(&self.island.c).for_each(|(w, c)| *w += c);
    }

    /// Writes `(K + R)·λ` and the bounds that follow normal forces.
    fn multiply(&self, Iterate { lambda, w, bounds }: &mut Iterate) {
        w.resize(lambda.len(), 0.0);
        multiply(&self.k, lambda, w);
        bounds.clear();
        bounds.extend(self.bounds.iter().map(|loads| loads.iter().map(|(row, a)| a * lambda[*row]).sum::<f64>()));
    }

    fn error(&self, at: &Iterate) -> f64 {
        let error = |block: &LocalBlock| {
            let point = at.point(block);
            match block.bound {
                Some(_) => self.island.block_error(&block.within(point.bound), point.w, &point.lambda),
                None => self.island.block_error(block, point.w, &point.lambda),
            }
        };
        largest(self.island.blocks.iter().map(error))
    }

    /// Writes the choices that an iterate asks for.
    fn choose(&self, at: &Iterate, choices: &mut Vec<Choice>) {
        choices.clear();
        choices.extend(self.island.blocks.iter().map(|block| at.point(block).choice(block)));
    }

    /// Returns `|f|` with the choices that the points ask for.
    #[inline(always)]
    fn size(&self, point: impl Fn(&LocalBlock) -> Point) -> f64 {
        let square = |block: &LocalBlock| {
            let point = point(block);
            let f = point.function(block, point.choice(block));
            f[0] * f[0] + f[1] * f[1] + f[2] * f[2]
        };
        self.island.blocks.iter().map(square).sum::<f64>().sqrt()
    }

    /// Returns `|f|` with choices that are held.
    fn size_held(&self, at: &Iterate, choices: &[Choice]) -> f64 {
        let square = |(block, choice): (&LocalBlock, &Choice)| {
            let f = at.point(block).function(block, *choice);
            f[0] * f[0] + f[1] * f[1] + f[2] * f[2]
        };
        self.island.blocks.iter().zip(choices).map(square).sum::<f64>().sqrt()
    }
}

/// Returns whether an island has a wide object.
pub(in crate::solver) fn is_wide(rows: &Rows, blocks: &[u32]) -> bool {
    blocks.iter().flat_map(|&b| rows.blocks[b as usize].sides()).any(|side| side.dof >= WIDE)
}

#[cfg(test)]
mod tests {
    use super::SmallIsland;
    use crate::constraint::rows::{RowSet, Rows};

    /// A contact that presses, with a row that turns it: the moment is a fifth of the normal force, and moves the contact.
    #[test]
    fn a_bound_follows_the_normal_force_of_the_same_solution() {
        for sign in [1.0, -1.0] {
            let mut rows = Rows::default();
            rows.clear(4);
            rows.push_block(RowSet::Cone { mu: 0.5 });
            let y = rows.side(0, 4).expect("first side");
            (0..3).for_each(|k| y[k * 4 + k] = 1.0);
            rows.push_block(RowSet::Interval { lo: 0.0, hi: 0.0 });
            rows.side(0, 4).expect("first side").copy_from_slice(&[0.3, 0.0, 0.0, 1.0]);
            let mut island = SmallIsland::new(&rows, &[0, 1], &[-1.0, 0.0, 0.0, -5.0 * sign]).expect("small");
            island.set_bounds(1);
            island.bind(0, 1, 0.0, std::iter::once((0, 0.2)));
            let mut lambda = [0.0; 4];
            assert!(island.solve(&mut lambda, 1e-12, false).converged);
            // w_n = −1 + λ_n + 0.3·τ = 0,  τ = ±0.2·λ_n
            let normal = 1.0 / (1.0 + sign * 0.06);
            assert!((lambda[0] - normal).abs() < 1e-11, "{lambda:?}");
            assert!((lambda[3] - sign * 0.2 * normal).abs() < 1e-11, "{lambda:?}");
        }
    }
}

//! The equations of one step of Newton's method: those of the coupled rows, dense, after the others, which are
//! solved by themselves.

use super::{Iterate, SmallIsland};
use crate::constraint::rows::multiply;
use crate::solver::direct::choice::{Choice, Derivative};
use crate::solver::direct::dense;
use crate::solver::direct::island::LocalBlock;

/// Equations of the coupled rows.
#[derive(Default)]
pub(super) struct Memory {
    coupled: Vec<usize>,
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// The same rows as stretches: the first of each and their number.
    stretches: Vec<[usize; 2]>,
    /// `(K + R)·δλ` of the rows that are not coupled.
    pulled: Vec<f64>,
    /// Place of each row among the coupled ones; filled if bounds follow normal forces.
    places: Vec<Option<usize>>,
}

/// Returns whether the change of a block depends on those of others.
fn is_coupled(block: &LocalBlock, choice: &Choice) -> bool {
    choice.is_coupled() || block.bound.is_some()
}

impl Memory {
    /// Lists the coupled rows, and writes the change of all others into `lambda`.
    fn uncouple(
        &mut self,
        blocks: &[LocalBlock],
        choices: &[Choice],
        (at, epsilon): (&Iterate, f64),
        lambda: &mut [f64],
    ) {
        self.coupled.clear();
        self.stretches.clear();
        for (block, choice) in blocks.iter().zip(choices) {
            if is_coupled(block, choice) {
                self.coupled.extend(block.range());
                match self.stretches.last_mut() {
                    Some([first, len]) if *first + *len == block.row => *len += block.rows,
                    _ => self.stretches.push([block.row, block.rows]),
                }
            } else {
                let f = at.point(block).function(block, *choice);
                let scale = -1.0 / ((1.0 + epsilon) * block.diagonal.max(f64::MIN_POSITIVE));
                lambda[block.range()].iter_mut().zip(f).for_each(|(x, f)| *x = scale * f);
            }
        }
    }

    /// Clears the equations of the coupled rows.
    fn begin(&mut self, k: &[f64], lambda: &[f64], with_places: bool) {
        let (n, count) = (self.coupled.len(), lambda.len());
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        self.right.clear();
        self.pulled.clear();
        self.pulled.resize(count, 0.0);
        if lambda.iter().any(|x| *x != 0.0) {
            multiply(k, lambda, &mut self.pulled);
        }
        if with_places {
            self.places.clear();
            self.places.resize(count, None);
            self.coupled.iter().enumerate().for_each(|(place, &row)| self.places[row] = Some(place));
        }
    }

    /// Adds the equation of a row at a bound that follows normal forces, `(1 + ε)·d·δλ ± d·Σ aᵢ·δλ_ni = −f`. `loads` are
    /// these forces' rows with the factors `a`; none where the bound is 0.
    fn add_bound(
        &mut self,
        (block, choice): (&LocalBlock, Choice),
        f: f64,
        epsilon: f64,
        loads: &[(usize, f64)],
        lambda: &[f64],
    ) {
        let (n, first) = (self.coupled.len(), self.right.len());
        let row = &mut self.matrix[first * n..][..n];
        let d = block.diagonal.max(f64::MIN_POSITIVE);
        row[first] = (1.0 + epsilon) * d;
        let (mut known, sign) = (-f, if choice == Choice::Low { 1.0 } else { -1.0 });
        for &(of, a) in loads {
            match self.places[of] {
                Some(place) => row[place] += sign * d * a,
                None => known -= sign * d * a * lambda[of],
            }
        }
        self.right.push(known);
    }

    /// Adds the equations of a block, `(∂f/∂λ + ε·d + ∂f/∂w·(K + R))·δλ = −f`.
    fn add_block(&mut self, block: &LocalBlock, f: [f64; 3], derivative: &Derivative, k: &[f64], epsilon: f64) {
        let (n, first, count) = (self.coupled.len(), self.right.len(), self.pulled.len());
        let Derivative { by_lambda, by_w } = derivative;
        let pulls = [0, 1, 2].map(|i| if i < block.rows { self.pulled[block.row + i] } else { 0.0 });
        for i in 0..block.rows {
            let row = &mut self.matrix[(first + i) * n..][..n];
            for (j, weight) in by_w[i].iter().enumerate().filter(|(_, weight)| **weight != 0.0) {
                if j < block.rows {
                    let from = &k[(block.row + j) * count..][..count];
                    let mut rest = &mut row[..];
                    for &[first, len] in &self.stretches {
                        let (own, after) = rest.split_at_mut(len);
                        own.iter_mut().zip(&from[first..]).for_each(|(x, from)| *x += weight * from);
                        rest = after;
                    }
                }
            }
            (0..block.rows).for_each(|j| row[first + j] += by_lambda[i][j]);
            row[first + i] += (epsilon * block.diagonal).max(f64::MIN_POSITIVE);
            self.right.push(-f[i] - (0..block.rows).map(|j| by_w[i][j] * pulls[j]).sum::<f64>());
        }
    }
}

impl SmallIsland<'_> {
    /// Writes the change that makes the linearized function 0. Returns whether there is one.
    pub(super) fn change(&mut self, at: &Iterate, choices: &[Choice], epsilon: f64, change: &mut Iterate) -> bool {
        let (island, k, memory) = (&self.island, &self.k, &mut self.memory);
        let lambda = &mut change.lambda;
        lambda.clear();
        lambda.resize(island.c.len(), 0.0);
        memory.uncouple(&island.blocks, choices, (at, epsilon), lambda);
        if memory.coupled.len() > self.fewer_from && self.bounds.is_empty() {
            let with_choice = island.blocks.iter().zip(choices).filter(|(_, choice)| choice.is_coupled());
            let blocks = with_choice.map(|(block, choice)| (block, at.point(block), *choice));
            let solved = self.sliding.change(blocks, k, epsilon, lambda);
            if solved {
                self.multiply(change);
            }
            return solved;
        }
        memory.begin(k, lambda, !self.bounds.is_empty());
        for (block, choice) in island.blocks.iter().zip(choices).filter(|(block, choice)| is_coupled(block, choice)) {
            let point = at.point(block);
            let f = point.function(block, *choice);
            match block.bound.filter(|_| !choice.is_coupled()) {
                Some(bound) => {
                    let loads = &self.bounds[bound as usize][..];
                    let loads = if at.bounds[bound as usize] > 0.0 { loads } else { &[] };
                    memory.add_bound((block, *choice), f[0], epsilon, loads, lambda);
                }
                None => memory.add_block(block, f, &Derivative::new(block, &point, *choice), k, epsilon),
            }
        }
        if !dense::solve(&mut memory.matrix, &mut memory.right) {
            return false;
        }
        memory.coupled.iter().zip(&memory.right).for_each(|(&at, x)| lambda[at] = *x);
        self.multiply(change);
        true
    }
}

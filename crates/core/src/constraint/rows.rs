//! Constraint rows in whitened coordinates: the only input of a solver.
//!
//! With `M = LᵀL` per object and `u = L·v`, an impulse `λ` along the rows `J` changes `u` by `Y·λ`.
//! `Y = L⁻ᵀJᵀ` is the thesis's test impulse (§IV.B.3, Algorithms 2 and 3) in coordinates in which
//! every mass is 1. The matrix of the contact problem is `K = YᵀY`. Rows do not
//! distinguish rigid from articulated bodies.
//!
//! | symbol | meaning |
//! |---|---|
//! | `u`  | whitened velocity of all objects, one range of `dof` numbers each |
//! | `Y`  | whitened response, stored per side and row: a block of `r` rows on a side with `d` degrees of freedom is `r × d`, row-major |
//! | `c`  | free value of every row: the relative velocity (or acceleration) that the solve has to correct |
//! | `λ`  | multiplier of every row: impulse in N·s, or force in N at the acceleration level |
//! | `R`  | compliance of a scalar row, at least 0: the row yields by `R·λ` |

use super::gram::{Response, add_gram};
use crate::threads::Threads;
use std::ops::Range;

/// Minimum number of blocks of a piece on one thread.
const BLOCKS: usize = 256;
/// Degrees of freedom of an object whose responses have many zeros.
const WIDE: usize = 128;

/// The set of admissible multipliers of a block, and the condition on its row velocities `w = c +
/// (K + R)·λ`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowSet {
    /// `w = 0`, `λ` free (loop joint). One row.
    Equality,
    /// `0 ≤ λ ⟂ w ≥ 0` (joint limit, frictionless contact). One row.
    HalfLine,
    /// `lo ≤ λ ≤ hi`; `w = 0` inside, `w ≥ 0` at `lo`, `w ≤ 0` at `hi` (motor, joint friction). One
    /// row.
    Interval {
        /// Lower bound of the multiplier.
        lo: f64,
        /// Upper bound of the multiplier.
        hi: f64,
    },
    /// Contact with Coulomb friction. Three rows: normal, two tangents. `0 ≤ λ_n ⟂ w_n ≥ 0` and
    /// `|λ_t| ≤ μ·λ_n`, with `λ_t = −μ·λ_n·w_t/|w_t|` wherever `w_t ≠ 0`.
    Cone {
        /// Friction coefficient, at least 0.
        mu: f64,
    },
}

impl RowSet {
    /// Returns the number of rows in a block of this kind.
    pub fn rows(&self) -> usize {
        if let RowSet::Cone { .. } = self { 3 } else { 1 }
    }
}

/// The contribution of one object to a block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Side {
    /// First index of the object's range in `u`.
    pub u: u32,
    /// Degrees of freedom of the object.
    pub dof: u32,
    /// First index of the block's `rows × dof` numbers in [`Rows::y`].
    pub y: u32,
}

/// Rows that are solved together: one scalar row, or the three of a contact. A side that cannot
/// move (static, kinematic) is absent.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// Admissible multipliers.
    pub set: RowSet,
    /// First row of the block in `c` and `λ`.
    pub row: u32,
    /// `R` of a scalar row, (m/s)/(N·s): 0 for a rigid row, and for contacts.
    pub compliance: f64,
    sides: [Side; 2],
    side_count: u8,
}

impl Block {
    /// Returns the sides that can move: none, one or two, of different objects.
    pub fn sides(&self) -> &[Side] {
        &self.sides[..self.side_count as usize]
    }

    /// Returns the indices of the block's rows in `c` and `λ`.
    pub fn range(&self) -> Range<usize> {
        self.row as usize..self.row as usize + self.set.rows()
    }
}

/// All rows of one solve.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// The blocks, in the order in which they were added.
    pub blocks: Vec<Block>,
    /// Whitened responses of all sides.
    pub y: Vec<f64>,
    /// Number of rows: the length of `c` and `λ`.
    pub len: usize,
    /// Length of `u`.
    pub dof: usize,
}

impl Rows {
    /// Removes all rows and keeps the memory; `dof` is the length of `u`.
    pub fn clear(&mut self, dof: usize) {
        self.blocks.clear();
        self.y.clear();
        self.len = 0;
        self.dof = dof;
    }

    /// Starts a rigid block without sides and returns its index.
    pub fn push_block(&mut self, set: RowSet) -> usize {
        self.push_soft(set, 0.0)
    }

    /// Starts a block with a compliance and returns its index. Contacts ignore the compliance.
    pub fn push_soft(&mut self, set: RowSet, compliance: f64) -> usize {
        let compliance = if set.rows() == 1 { compliance } else { 0.0 };
        self.blocks.push(Block { set, row: self.len as u32, compliance, sides: [Side::default(); 2], side_count: 0 });
        self.len += set.rows();
        self.blocks.len() - 1
    }

    /// Adds a side to the *last* block and returns its `rows × dof` responses, to be **added to**.
    ///
    /// The side belongs to the object whose range in `u` starts at `u` and has `dof` numbers. A
    /// second part of the same object uses the existing side, so that the cross term is included.
    /// Returns `None` for a third object: a row acts on at most two.
    pub fn side(&mut self, u: usize, dof: usize) -> Option<&mut [f64]> {
        let start = self.y.len();
        let block = self.blocks.last_mut()?;
        let size = block.set.rows() * dof;
        let count = block.side_count as usize;
        if let Some(side) = block.sides[..count].iter().find(|s| s.u as usize == u) {
            let y = side.y as usize;
            return Some(&mut self.y[y..y + size]);
        }
        if count == 2 {
            return None;
        }
        block.sides[count] = Side { u: u as u32, dof: dof as u32, y: start as u32 };
        block.side_count += 1;
        self.y.resize(start + size, 0.0);
        Some(&mut self.y[start..])
    }

    /// Returns the response of row `k` (from 0 within the block) on one side: `dof` numbers.
    pub fn response(&self, side: &Side, k: usize) -> &[f64] {
        let d = side.dof as usize;
        let y = side.y as usize + k * d;
        &self.y[y..y + d]
    }

    /// Adds `(Yᵀu)_i` to `c_i` for every row.
    pub fn add_velocity(&self, u: &[f64], c: &mut [f64]) {
        for block in &self.blocks {
            for (k, row) in block.range().enumerate() {
                c[row] += self.row_velocity(block, k, u);
            }
        }
    }

    /// Adds `(Yᵀu)_i` to `c_i` for every row of a range of blocks, on several threads.
    pub(crate) fn add_velocity_on(&self, threads: &Threads, range: Range<usize>, u: &[f64], c: &mut [f64]) {
        if threads.count() == 1 || range.len() < 2 * BLOCKS {
            for block in &self.blocks[range] {
                for (k, row) in block.range().enumerate() {
                    c[row] += self.row_velocity(block, k, u);
                }
            }
            return;
        }
        let mut rest = &mut c[self.blocks[range.start].row as usize..];
        let pieces = threads.pieces(range.len(), BLOCKS).into_iter().map(|piece| {
            let blocks = &self.blocks[range.clone()][piece];
            let rows: usize = blocks.iter().map(|block| block.set.rows()).sum();
            let (c, after) = std::mem::take(&mut rest).split_at_mut(rows);
            rest = after;
            (blocks, c)
        });
        let pieces: Vec<(&[Block], &mut [f64])> = pieces.collect();
        threads.each(pieces, |(blocks, c)| {
            let start = blocks.first().map_or(0, |block| block.row as usize);
            for block in blocks {
                for (k, row) in block.range().enumerate() {
                    c[row - start] += self.row_velocity(block, k, u);
                }
            }
        });
    }

    /// Returns `(Yᵀu)` of row `k` of one block.
    #[inline]
    pub fn row_velocity(&self, block: &Block, k: usize, u: &[f64]) -> f64 {
        block.sides().iter().map(|s| self.side_velocity(s, k, u)).sum()
    }

    /// Returns the part of one side in [`row_velocity`](Self::row_velocity).
    #[inline]
    pub fn side_velocity(&self, side: &Side, k: usize, u: &[f64]) -> f64 {
        dot(self.response(side, k), &u[side.u as usize..(side.u + side.dof) as usize])
    }

    /// Adds `Y·λ` of one block to `u`.
    pub fn apply_block(&self, block: &Block, lambda: &[f64], u: &mut [f64]) {
        for (k, row) in block.range().enumerate() {
            for s in block.sides() {
                add_scaled(&mut u[s.u as usize..(s.u + s.dof) as usize], lambda[row], self.response(s, k));
            }
        }
    }

    /// Adds `Y·λ` of row `k` of one block to `u`.
    pub(crate) fn push_row(&self, block: &Block, k: usize, lambda: f64, u: &mut [f64]) {
        for s in block.sides() {
            add_scaled(&mut u[s.u as usize..(s.u + s.dof) as usize], lambda, self.response(s, k));
        }
    }

    /// Returns `K + R`, with `K = YᵀY`, of the given blocks: dense, row-major, in the order of
    /// their rows. For the pivoting solvers and tests.
    pub fn dense(&self, blocks: &[u32]) -> Vec<f64> {
        let n: usize = blocks.iter().map(|&b| self.blocks[b as usize].set.rows()).sum();
        let mut dense = vec![0.0; n * n];
        let mut responses: Vec<(u32, Response)> = Vec::with_capacity(2 * n);
        let mut row = 0;
        for block in blocks.iter().map(|&b| &self.blocks[b as usize]) {
            for k in 0..block.set.rows() {
                responses.extend(block.sides().iter().map(|side| (side.u, (row, self.response(side, k)))));
                dense[row * n + row] += block.compliance;
                row += 1;
            }
        }
        responses.sort_unstable_by_key(|&(u, (row, _))| (u, row));
        for of_object in responses.chunk_by(|a, b| a.0 == b.0) {
            if of_object[0].1.1.len() >= WIDE {
                let of_object: Vec<Response> = of_object.iter().map(|(_, response)| *response).collect();
                add_gram(&mut dense, n, &of_object);
                continue;
            }
            let trimmed: Vec<Response> = of_object.iter().map(|&(_, (row, y))| (row, without_zeros(y))).collect();
            for (end, &(i, a)) in trimmed.iter().enumerate() {
                let row = &mut dense[i * n..][..i + 1];
                trimmed[..=end].iter().for_each(|&(j, b)| row[j] += dot_of_shorter(a, b));
            }
        }
        for i in 0..n {
            (0..i).for_each(|j| dense[j * n + i] = dense[i * n + j]);
        }
        dense
    }

    /// Returns entry `(i, j)` of a block's diagonal block of `K`.
    pub fn own(&self, block: &Block, i: usize, j: usize) -> f64 {
        block.sides().iter().map(|s| dot(self.response(s, i), self.response(s, j))).sum()
    }

    /// Returns one entry of `K`: the velocity of row `ka` of `a` due to a unit multiplier of row
    /// `kb` of `b`.
    pub fn coupling(&self, a: &Block, ka: usize, b: &Block, kb: usize) -> f64 {
        let mut sum = 0.0;
        for sa in a.sides() {
            for sb in b.sides().iter().filter(|sb| sb.u == sa.u) {
                sum += dot(self.response(sa, ka), self.response(sb, kb));
            }
        }
        sum
    }
}

/// Returns `a·b`, in several sums that the processor computes in parallel: two for the six numbers of a
/// rigid body, eight for more.
#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    match (a.as_array::<6>(), b.as_array::<6>()) {
        (Some(a), Some(b)) => dot6(a, b),
        _ if a.len() < 8 => a.iter().zip(b).map(|(a, b)| a * b).sum(),
        _ => long_dot(a, b),
    }
}

/// Returns the numbers up to the last one that is not 0, by whole groups of [`sum_long`]: the response of a joint ends with
/// its own velocities.
fn without_zeros(y: &[f64]) -> &[f64] {
    if y.len() <= 8 {
        return y;
    }
    let used = y.iter().rposition(|x| *x != 0.0).map_or(0, |last| last + 1);
    &y[..used.next_multiple_of(8).min(y.len())]
}

/// Returns the product of two responses of one object [`without_zeros`], with the bits of [`dot`] of the whole ones.
#[inline]
fn dot_of_shorter(a: &[f64], b: &[f64]) -> f64 {
    let len = a.len().min(b.len());
    dot(&a[..len], &b[..len])
}

/// Writes the products of the rows of a row-major matrix with a vector, with the bits of [`dot`].
pub(crate) fn multiply(matrix: &[f64], vector: &[f64], out: &mut [f64]) {
    pulp::Arch::new().dispatch(Multiplication { matrix, vector, out });
}

/// A call of [`multiply`] that is compiled for the widest registers of the processor.
struct Multiplication<'a> {
    matrix: &'a [f64],
    vector: &'a [f64],
    out: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Multiplication<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Multiplication { matrix, vector, out } = self;
        let rows = matrix.chunks_exact(vector.len().max(1)).zip(out);
        match vector.len() {
            0..8 => rows.for_each(|(row, out)| *out = dot(row, vector)),
            _ => rows.for_each(|(row, out)| *out = sum_long(row, vector)),
        }
    }
}

fn long_dot(a: &[f64], b: &[f64]) -> f64 {
    if a.len() < WIDE { sum_long(a, b) } else { pulp::Arch::new().dispatch(Product { a, b }) }
}

/// A product of long responses that is compiled for the widest registers of the processor.
struct Product<'a> {
    a: &'a [f64],
    b: &'a [f64],
}

impl pulp::NullaryFnOnce for Product<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        sum_long(self.a, self.b)
    }
}

/// `to += factor·from` of responses.
#[inline]
pub(crate) fn add_scaled(to: &mut [f64], factor: f64, from: &[f64]) {
    let sum = Sum { to, factor, from };
    if sum.to.len() < WIDE { sum.add() } else { pulp::Arch::new().dispatch(sum) }
}

struct Sum<'a> {
    to: &'a mut [f64],
    factor: f64,
    from: &'a [f64],
}

impl Sum<'_> {
    #[inline(always)]
    fn add(self) {
        for (to, from) in self.to.iter_mut().zip(self.from) {
            *to += self.factor * from;
        }
    }
}

impl pulp::NullaryFnOnce for Sum<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.add();
    }
}

#[inline(always)]
fn sum_long(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7])) + rest
}

#[inline(always)]
pub(crate) fn dot6(a: &[f64; 6], b: &[f64; 6]) -> f64 {
    let half = |k: usize| a[k] * b[k] + a[k + 2] * b[k + 2] + a[k + 4] * b[k + 4];
    half(0) + half(1)
}

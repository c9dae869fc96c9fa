//! Soft rows of one object, such as the damping and the drives of a robot's joints, folded into the responses of
//! that object: the other rows of an island meet an object that yields to them.
//!
//! ```text
//! soft rows e of an object     w_e = c_e + y_eᵀ·δu + R_e·λ_e = 0
//! all impulses on it           δu = Y·λ + Σ y_e·λ_e
//! so                           B·δu = Y·λ − Σ y_e·c_e/R_e,        B = 1 + Σ y_e·y_eᵀ/R_e = G·Gᵀ    (Cholesky)
//! and with δû = Gᵀ·δu − b      δû = Ŷ·λ,     Ŷ = G⁻¹·Y,     b = −G⁻¹·Σ y_e·c_e/R_e
//!                              w = ĉ + Ŷᵀδû,     ĉ = c + Ŷᵀ·b
//! afterwards                   δu = G⁻ᵀ·(δû + b),     λ_e = −(c_e + y_eᵀ·δu)/R_e
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `Y`, `c`, `λ` | responses, free values and multipliers of the other rows, as in `rows.rs` |
//! | `Ŷ`, `ĉ`, `δû` | the same problem without the soft rows |
//!
//! The cost is `d³/6` for an object of `d` degrees of freedom, and `d²/2` for each other row. Rows far stiffer than
//! the object ([`STIFF`]) would cost digits; they are left to the linkages (`linkage.rs`).

use super::objects::{IslandObject, dof_of, objects_of, place_of};
use crate::constraint::rows::{Block, RowSet, Rows, dot};
use smallvec::{SmallVec, smallvec};

/// A row is folded if `|y_e|²/R_e` is at most this: `B` then costs no more than four of sixteen digits.
const STIFF: f64 = 1e4;
/// Maximum degrees of freedom of an object with soft rows that are folded.
const MAX_DOF: u32 = 128;

/// An island without the soft rows of its objects.
pub(super) struct Folded {
    pub rows: Rows,
    /// Indices of all blocks of [`rows`](Self::rows).
    pub blocks: Vec<u32>,
    pub c: Vec<f64>,
    pub lambda: Vec<f64>,
    /// Blocks of the island that are left, in their order, and those that are folded.
    members: SmallVec<[u32; 32]>,
    soft: SmallVec<[u32; 32]>,
    objects: Vec<IslandObject>,
    /// First number of the `G` of each object, if it has soft rows.
    factor: SmallVec<[Option<usize>; 4]>,
    /// `G` of all objects with soft rows, row-major, with the reciprocals of its diagonal on its diagonal.
    factors: SmallVec<[f64; 64]>,
    /// `b` of all objects.
    free: SmallVec<[f64; 32]>,
}

impl Folded {
    /// Returns `None` if no row can be folded.
    pub fn new(rows: &Rows, blocks: &[u32], (c, lambda): (&[f64], &[f64])) -> Option<Folded> {
        let (soft, members): (SmallVec<[u32; 32]>, SmallVec<[u32; 32]>) =
            blocks.iter().copied().partition(|&b| is_soft(rows, &rows.blocks[b as usize]));
        (!soft.is_empty()).then(|| Folded::of(rows, blocks, (c, lambda), (soft, members)))
    }

    /// Returns the island without its soft rows, if there are any.
    pub fn copied(rows: &Rows, blocks: &[u32], (c, lambda): (&[f64], &[f64])) -> Folded {
        let parts = blocks.iter().copied().partition(|&b| is_soft(rows, &rows.blocks[b as usize]));
        Folded::of(rows, blocks, (c, lambda), parts)
    }

    fn of(
        rows: &Rows,
        blocks: &[u32],
        (c, lambda): (&[f64], &[f64]),
        (soft, members): (SmallVec<[u32; 32]>, SmallVec<[u32; 32]>),
    ) -> Folded {
        let objects = objects_of(rows, blocks);
        let mut folded = Folded {
            rows: Rows::default(),
            blocks: (0..members.len() as u32).collect(),
            c: Vec::new(),
            lambda: Vec::new(),
            members,
            soft,
            factor: smallvec![None; objects.len()],
            objects,
            factors: SmallVec::new(),
            free: SmallVec::new(),
        };
        folded.factor(rows, c);
        folded.respond(rows, (c, lambda));
        folded
    }

    /// Returns the blocks of the island that are left, in their order.
    pub fn members(&self) -> &[u32] {
        &self.members
    }

    /// Returns the number of velocities of the island.
    pub fn dof(&self) -> usize {
        self.rows.dof
    }

    /// Factors `B` of each object with soft rows, and writes `b`.
    fn factor(&mut self, rows: &Rows, c: &[f64]) {
        self.rows.clear(dof_of(&self.objects));
        self.free.resize(self.rows.dof, 0.0);
        for &b in &self.soft {
            let block = &rows.blocks[b as usize];
            let side = &block.sides()[0];
            let place = place_of(&self.objects, side.u);
            let IslandObject { first: start, dof, .. } = self.objects[place];
            let end = self.factors.len();
            let first = *self.factor[place].get_or_insert(end);
            if first == end {
                self.factors.resize(end + dof * dof, 0.0);
                (0..dof).for_each(|i| self.factors[end + i * dof + i] = 1.0);
            }
            let (y, free) = (rows.response(side, 0), &mut self.free[start..][..dof]);
            let (weight, pull) = (1.0 / block.compliance, c[block.row as usize] / block.compliance);
            for (i, &own) in y.iter().enumerate().filter(|(_, y)| **y != 0.0) {
                free[i] -= own * pull;
                let row = &mut self.factors[first + i * dof..][..=i];
                row.iter_mut().zip(y).for_each(|(b, y)| *b += weight * own * y);
            }
        }
        for (object, factor) in self.objects.iter().zip(&self.factor) {
            if let Some(first) = *factor {
                let factor = &mut self.factors[first..][..object.dof * object.dof];
                cholesky(factor, object.dof);
                forward(factor, &mut self.free[object.first..][..object.dof]);
            }
        }
    }

    /// Writes the other blocks, with their responses and free values.
    fn respond(&mut self, rows: &Rows, (c, lambda): (&[f64], &[f64])) {
        let left = || self.members.iter().map(|&b| &rows.blocks[b as usize]);
        let count = left().map(|block| block.set.rows()).sum();
        let size = left().map(|b| b.set.rows() * b.sides().iter().map(|s| s.dof as usize).sum::<usize>()).sum();
        self.rows.blocks.reserve(self.members.len());
        self.rows.y.reserve(size);
        self.c.reserve(count);
        self.lambda.reserve(count);
        for block in self.members.iter().map(|&b| &rows.blocks[b as usize]) {
            let first = self.rows.len;
            self.rows.push_soft(block.set, block.compliance);
            self.c.extend_from_slice(&c[block.range()]);
            self.lambda.extend_from_slice(&lambda[block.range()]);
            for side in block.sides() {
                let place = place_of(&self.objects, side.u);
                let object = self.objects[place];
                let (start, dof) = (side.y as usize, object.dof);
                let Some(y) = self.rows.side(object.first, dof) else { continue };
                y.copy_from_slice(&rows.y[start..start + y.len()]);
                let Some(factor) = self.factor[place].map(|at| &self.factors[at..][..dof * dof]) else { continue };
                let free = &self.free[object.first..][..dof];
                for (k, y) in y.chunks_exact_mut(dof).enumerate() {
                    forward(factor, y);
                    self.c[first + k] += dot(y, free);
                }
            }
        }
    }

    /// Writes the solution, of which the multipliers `solved` of the blocks that are left and `du` of the island's velocities
    /// are a part: the multipliers of all blocks, and `all`, the velocities of all objects.
    pub fn write(
        &self,
        (rows, c): (&Rows, &[f64]),
        (solved, du): (&[f64], &mut [f64]),
        lambda: &mut [f64],
        all: &mut [f64],
    ) {
        for (block, &member) in self.rows.blocks.iter().zip(&self.members) {
            lambda[rows.blocks[member as usize].range()].copy_from_slice(&solved[block.range()]);
        }
        for (object, factor) in self.objects.iter().zip(&self.factor) {
            let own = &mut du[object.first..][..object.dof];
            if let Some(first) = *factor {
                own.iter_mut().zip(&self.free[object.first..]).for_each(|(du, b)| *du += b);
                backward(&self.factors[first..][..object.dof * object.dof], own);
            }
            all[object.start as usize..][..object.dof].iter_mut().zip(&*own).for_each(|(all, du)| *all += du);
        }
        for block in self.soft.iter().map(|&b| &rows.blocks[b as usize]) {
            let row = block.row as usize;
            lambda[row] = -(c[row] + rows.row_velocity(block, 0, all)) / block.compliance;
        }
    }
}

/// Returns whether a block is folded.
fn is_soft(rows: &Rows, block: &Block) -> bool {
    let free = match block.set {
        RowSet::Equality => true,
        RowSet::Interval { lo, hi } => lo == f64::NEG_INFINITY && hi == f64::INFINITY,
        _ => false,
    };
    let may_be = free && block.compliance > 0.0 && block.sides().len() == 1 && block.sides()[0].dof <= MAX_DOF;
    // a row without response gets no multiplier
    may_be && {
        let own = rows.own(block, 0, 0);
        own > f64::MIN_POSITIVE && own <= STIFF * block.compliance
    }
}

/// Replaces the lower half of a matrix that is at least 1 by its Cholesky factor, with the reciprocals of the
/// diagonal on its diagonal.
fn cholesky(a: &mut [f64], n: usize) {
    for i in 0..n {
        let (above, own) = a.split_at_mut(i * n);
        for (j, row) in above.chunks_exact(n).enumerate() {
            own[j] = (own[j] - dot(&own[..j], &row[..j])) * row[j];
        }
        own[i] = 1.0 / (own[i] - dot(&own[..i], &own[..i])).sqrt();
    }
}

/// Replaces `y` by `G⁻¹·y`.
fn forward(g: &[f64], y: &mut [f64]) {
    for (i, row) in g.chunks_exact(y.len()).enumerate() {
        y[i] = (y[i] - dot(&row[..i], &y[..i])) * row[i];
    }
}

/// Replaces `u` by `G⁻ᵀ·u`.
fn backward(g: &[f64], u: &mut [f64]) {
    for (i, row) in g.chunks_exact(u.len()).enumerate().rev() {
        let own = u[i] * row[i];
        u[i] = own;
        u.iter_mut().zip(&row[..i]).for_each(|(u, g)| *u -= own * g);
    }
}

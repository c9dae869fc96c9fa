//! A small island in as few numbers as it needs: its equality rows solved beforehand, its velocities as many
//! as its other rows.
//!
//! ```text
//! Z: rows that are not equalities,   E: equality rows                    w_E = 0 gives λ_E for any λ_Z
//! w_Z = c̃ + K̃·λ_Z,    K̃ = K_ZZ − K_ZE·A⁻¹·K_EZ,    c̃ = c_Z − K_ZE·A⁻¹·c_E,    A = K_EE + R_E   (`equality.rs`)
//! K̃   = Ŷᵀ·Ŷ,         Ŷ: r numbers per row                             pivoted Cholesky, r its rank
//! ```
//!
//! A humanoid with joint damping and two feet on the ground has 27 degrees of freedom, 21 equality rows and one or
//! two dozen others. Reduced, it is one object with no more degrees of freedom than it has other rows, so that sweeps
//! and factorizations cost less.

use super::equality::Equalities;
use super::joint_row::parallel_rows;
use super::linkage::Linkages;
use super::objects::{IslandObject, dof_of, objects_of, place_of};
use crate::constraint::rows::{Block, Rows, dot};

/// Maximum numbers of rows that are left, and of degrees of freedom before. There must be no more rows than degrees of
/// freedom: with more, to reduce the island costs more than it saves.
const MAX: (usize, usize) = (64, 256);
/// A row depends on others below this fraction of its diagonal of `K̃`.
const RANK: f64 = 1e-13;

/// The problem of the rows Z.
pub(super) struct Reduced {
    pub rows: Rows,
    /// Indices of all blocks of [`rows`](Self::rows).
    pub blocks: Vec<u32>,
    pub c: Vec<f64>,
    pub lambda: Vec<f64>,
    /// The block of the island that each of them is.
    members: Vec<u32>,
}

impl Reduced {
    /// Returns `None` if the island is too large, or would not become smaller.
    pub fn new(rows: &Rows, blocks: &[u32], (c, lambda): (&[f64], &[f64]), linkages: &Linkages) -> Option<Reduced> {
        let members = || blocks.iter().copied().filter(|&b| !linkages.contains_row(rows, &rows.blocks[b as usize]));
        let count: usize = members().map(|b| rows.blocks[b as usize].set.rows()).sum();
        if count == 0 || count > MAX.0 {
            return None;
        }
        let objects = objects_of(rows, blocks);
        let dof = dof_of(&objects);
        if dof > MAX.1 || linkages.is_empty() && 2 * count > dof {
            return None;
        }
        let members: Vec<u32> = members().collect();
        let mut reduced = Reduced {
            rows: Rows::default(),
            blocks: (0..members.len() as u32).collect(),
            c: Vec::with_capacity(count),
            lambda: Vec::with_capacity(count),
            members,
        };
        for block in reduced.members.iter().map(|&b| &rows.blocks[b as usize]) {
            reduced.c.extend_from_slice(&c[block.range()]);
            reduced.lambda.extend_from_slice(&lambda[block.range()]);
        }
        reduced.respond(rows, c, linkages, (&objects, dof));
        Some(reduced)
    }

    /// Eliminates the equality rows and writes the blocks with their responses `Ŷ`.
    fn respond(&mut self, rows: &Rows, c: &[f64], linkages: &Linkages, (objects, dof): (&[IslandObject], usize)) {
        let own = dense(rows, &self.members, (objects, dof));
        let count = self.c.len();
        let mut k = vec![0.0; count * count];
        for (i, y) in own.chunks_exact(dof).enumerate() {
            for (j, other) in own.chunks_exact(dof).take(i + 1).enumerate() {
                let value = dot(y, other);
                (k[i * count + j], k[j * count + i]) = (value, value);
            }
        }
        for (joints, factor) in linkages.each() {
            let held = dense(rows, joints, (objects, dof));
            let coupling = |y: &[f64]| held.chunks_exact(dof).map(|joint| dot(joint, y)).collect();
            let couplings: Vec<Vec<f64>> = own.chunks_exact(dof).map(coupling).collect();
            let free: Vec<f64> = joints.iter().map(|&b| c[rows.blocks[b as usize].row as usize]).collect();
            factor.reduce(&couplings, &free, &mut k, count, &mut self.c);
        }
        let factor = Equalities::new(&k, count, RANK);
        let rank = factor.rank().max(1);
        self.rows.clear(rank);
        let mut row = 0;
        for block in self.members.iter().map(|&b| &rows.blocks[b as usize]) {
            self.rows.push_soft(block.set, block.compliance);
            let size = block.set.rows();
            if let Some(y) = self.rows.side(0, rank) {
                for (k, y) in y.chunks_exact_mut(rank).enumerate() {
                    (0..factor.rank()).for_each(|p| y[p] = factor.column(p)[row + k]);
                }
            }
            row += size;
        }
        self.align_parallel_rows(rows, linkages);
    }

    /// Gives rows that were parallel the same responses to the last bit: the sweeps solve them as one.
    fn align_parallel_rows(&mut self, rows: &Rows, linkages: &Linkages) {
        let left = |block: &Block| !linkages.contains_row(rows, block);
        let groups = parallel_rows(rows, &self.members, left);
        let place = |b: u32| self.members.iter().position(|&member| member == b).unwrap_or_default();
        for group in &groups {
            let first = self.response_range(place(group[0].0));
            for &(b, sign) in &group[1..] {
                let own = self.response_range(place(b));
                for (from, to) in first.clone().zip(own) {
                    self.rows.y[to] = sign * self.rows.y[from];
                }
            }
        }
    }

    fn response_range(&self, block: usize) -> std::ops::Range<usize> {
        let side = self.rows.blocks[block].sides()[0];
        side.y as usize..(side.y + side.dof) as usize
    }

    /// Writes the solution: the multipliers of all blocks, and `du`.
    pub fn write(&self, rows: &Rows, c: &[f64], linkages: &Linkages, lambda: &mut [f64], du: &mut [f64]) {
        for (block, &member) in self.rows.blocks.iter().zip(&self.members) {
            let whole = &rows.blocks[member as usize];
            lambda[whole.range()].copy_from_slice(&self.lambda[block.range()]);
            rows.apply_block(whole, lambda, du);
        }
        linkages.solve_equalities(rows, c, lambda, du);
    }
}

/// Returns the responses of blocks to all velocities of the island, a row of `dof` numbers each.
fn dense(rows: &Rows, blocks: &[u32], (objects, dof): (&[IslandObject], usize)) -> Vec<f64> {
    let place = |u: u32| objects[place_of(objects, u)].first;
    let mut all = Vec::new();
    for block in blocks.iter().map(|&b| &rows.blocks[b as usize]) {
        for k in 0..block.set.rows() {
            let row = all.len();
            all.resize(row + dof, 0.0);
            for side in block.sides() {
                all[row + place(side.u)..][..side.dof as usize].copy_from_slice(rows.response(side, k));
            }
        }
    }
    all
}

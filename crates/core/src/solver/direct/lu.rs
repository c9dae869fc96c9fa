//! Sparse block LU factorization of an island's system matrix `1 + Σ Y·G·Yᵀ`.
//!
//! ```text
//! for each place j:   A_rj −= L_rk·U_kj,   A_jr −= L_jk·U_kr     for all earlier k coupled to j, r ≥ j
//!                     L_rj = A_rj·A_jj⁻¹,  U_jr = A_jr
//! ```
//!
//! The matrix is symmetric in structure but not in value: sliding friction makes `G` unsymmetric.
//! Pivots are chosen within diagonal blocks only; the identity in the matrix keeps those regular. The matrix of a
//! single object is not inverted: it has triangular factors.

use super::cone::M3;
use super::island::Island;
use super::structure::Structure;
use crate::constraint::rows::dot;

/// Factors of a system matrix, in the places of a [`Structure`].
pub(super) struct Factor {
    /// Inverses of the diagonal blocks, or the triangular factors of the only one, and `L` (row-major).
    lower: Vec<f64>,
    /// Row exchanges of the only diagonal block.
    exchanges: Vec<usize>,
    /// `U` above the diagonal: the block of row `j` and column `r`, row-major.
    upper: Vec<f64>,
    right: Vec<f64>,
    scratch: Scratch,
}

/// Copies of the blocks of one update.
#[derive(Default)]
struct Scratch {
    left: Vec<f64>,
    top: Vec<f64>,
    /// Start of the block of each place in the present column.
    at: Vec<usize>,
}

impl Factor {
    /// Returns a factor without numbers.
    pub fn new(s: &Structure) -> Factor {
        let scratch = Scratch { at: vec![0; s.order.len()], ..Scratch::default() };
        Factor { lower: vec![0.0; s.len], exchanges: Vec::new(), upper: vec![0.0; s.len], right: Vec::new(), scratch }
    }

    /// Factors `1 + Σ Y·G·Yᵀ` with `G` of each block; only the part for its rows is read. Returns
    /// whether all diagonal blocks are regular.
    pub fn factor(&mut self, s: &Structure, island: &Island, gains: &[M3]) -> bool {
        // with the widest registers of the processor and without fused operations: the same bits on all
        pulp::Arch::new().dispatch(Factorization { factor: self, structure: s, island, gains })
    }

    #[inline(always)]
    fn assemble(&mut self, s: &Structure, island: &Island, gains: &[M3]) {
        self.lower.fill(0.0);
        self.upper.fill(0.0);
        for (start, dof) in s.diagonal.iter().zip(&s.dof) {
            (0..*dof).for_each(|i| self.lower[start + i * dof + i] = 1.0);
        }
        let right = &mut self.right;
        for (block, gain) in island.blocks.iter().zip(gains) {
            let n = block.rows;
            for from in block.sides() {
                // G·Yᵀ of one object
                let columns = from.dof;
                right.clear();
                right.resize(n * columns, 0.0);
                for (k, row) in right.chunks_exact_mut(columns).enumerate() {
                    for (l, y) in island.responses(from, n).chunks_exact(columns).enumerate() {
                        add(row, gain[k][l], y);
                    }
                }
                for to in block.sides() {
                    let (row, column) = (s.place[to.object], s.place[from.object]);
                    let (matrix, start) = match row.cmp(&column) {
                        std::cmp::Ordering::Equal => (&mut self.lower, Some(s.diagonal[row])),
                        std::cmp::Ordering::Greater => (&mut self.lower, s.block(row, column)),
                        std::cmp::Ordering::Less => (&mut self.upper, s.block(column, row)),
                    };
                    let Some(start) = start else { continue };
                    let place = &mut matrix[start..start + to.dof * columns];
                    if [n, to.dof, columns] == [3, 6, 6] {
                        outer3(place, island.responses(to, n), right);
                        continue;
                    }
                    for (y, right) in island.responses(to, n).chunks_exact(to.dof).zip(right.chunks_exact(columns)) {
                        outer(place, y, right);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn eliminate(&mut self, s: &Structure, j: usize) -> bool {
        let Factor { lower, upper, exchanges, scratch: Scratch { left, top, at }, .. } = self;
        let dof = s.dof[j];
        s.columns[j].iter().for_each(|(r, start)| at[*r] = *start);
        for &(k, index) in &s.rows[j] {
            let column = &s.columns[k];
            let (inner, start) = (s.dof[k], column[index].1);
            copy(left, &lower[start..start + dof * inner]);
            copy(top, &upper[start..start + dof * inner]);
            subtract(&mut lower[s.diagonal[j]..][..dof * dof], left, top, [dof, inner, dof]);
            for &(r, from) in &column[index + 1..] {
                let (rows, to) = (s.dof[r], at[r]);
                // the blocks of an earlier column come first in the array
                let (earlier, column) = lower.split_at_mut(to);
                subtract(&mut column[..rows * dof], &earlier[from..from + rows * inner], top, [rows, inner, dof]);
                let (earlier, row) = upper.split_at_mut(to);
                subtract(&mut row[..rows * dof], left, &earlier[from..from + rows * inner], [dof, inner, rows]);
            }
        }
        let diagonal = &mut lower[s.diagonal[j]..][..dof * dof];
        if s.order.len() == 1 {
            return triangulate(diagonal, dof, exchanges);
        }
        if !invert(diagonal, dof, left) {
            return false;
        }
        copy(top, diagonal);
        for &(r, start) in &s.columns[j] {
            let block = &mut lower[start..start + s.dof[r] * dof];
            copy(left, block);
            left.iter_mut().for_each(|x| *x = -*x);
            block.fill(0.0);
            subtract(block, left, top, [s.dof[r], dof, dof]);
        }
        true
    }

    /// Replaces the right-hand side, in the order of the island's objects, by the solution.
    pub fn solve(&self, s: &Structure, island: &Island, x: &mut [f64], work: &mut Vec<f64>) {
        work.clear();
        for &object in &s.order {
            let object = &island.objects[object];
            work.extend_from_slice(&x[object.first..object.first + object.dof]);
        }
        for j in 0..s.order.len() {
            let (head, tail) = work.split_at_mut(s.start[j] + s.dof[j]);
            let own = &head[s.start[j]..];
            for &(r, start) in &s.columns[j] {
                let to = &mut tail[s.start[r] - head.len()..][..s.dof[r]];
                for (to, l) in to.iter_mut().zip(self.lower[start..].chunks_exact(own.len())) {
                    *to -= sum(l, own);
                }
            }
        }
        for j in (0..s.order.len()).rev() {
            let (head, tail) = work.split_at_mut(s.start[j] + s.dof[j]);
            let length = head.len();
            let own = &mut head[s.start[j]..];
            for &(r, start) in &s.columns[j] {
                let from = &tail[s.start[r] - length..][..s.dof[r]];
                for (to, u) in own.iter_mut().zip(self.upper[start..].chunks_exact(from.len())) {
                    *to -= sum(u, from);
                }
            }
            let place = island.objects[s.order[j]].first;
            let diagonal = &self.lower[s.diagonal[j]..][..own.len() * own.len()];
            if s.order.len() == 1 {
                solve_triangular(diagonal, &self.exchanges, own);
                x[place..place + own.len()].copy_from_slice(own);
                continue;
            }
            for (i, inverse) in diagonal.chunks_exact(own.len()).enumerate() {
                x[place + i] = sum(inverse, own);
            }
            own.copy_from_slice(&x[place..place + own.len()]);
        }
    }
}

/// A call of [`Factor::factor`] that is compiled for the instruction set of its caller. A Rust closure would not be:
/// its call is a function of its own.
struct Factorization<'f, 's> {
    factor: &'f mut Factor,
    structure: &'s Structure,
    island: &'s Island<'s>,
    gains: &'s [M3],
}

impl pulp::NullaryFnOnce for Factorization<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn call(self) -> bool {
        let Factorization { factor, structure, island, gains } = self;
        factor.assemble(structure, island, gains);
        for j in 0..structure.order.len() {
            if !factor.eliminate(structure, j) {
                return false;
            }
        }
        true
    }
}

fn copy(to: &mut Vec<f64>, from: &[f64]) {
    to.clear();
    to.extend_from_slice(from);
}

/// `to += scale·from`, eight numbers at a time, then four: a loop over the numbers would use wide registers for
/// long arrays only.
#[inline(always)]
fn add(to: &mut [f64], scale: f64, from: &[f64]) {
    let ((to, to_rest), (from, from_rest)) = (to.as_chunks_mut::<8>(), from.as_chunks::<8>());
    for (to, from) in to.iter_mut().zip(from) {
        *to = sum_of(*to, scale, *from);
    }
    let ((to, to_rest), (from, from_rest)) = (to_rest.as_chunks_mut::<4>(), from_rest.as_chunks::<4>());
    for (to, from) in to.iter_mut().zip(from) {
        *to = sum_of(*to, scale, *from);
    }
    for (to, from) in to_rest.iter_mut().zip(from_rest) {
        *to += scale * from;
    }
}

/// Returns `to + scale·from`. The arguments are values, so the compiler knows that they do not overlap.
#[inline(always)]
fn sum_of<const N: usize>(mut to: [f64; N], scale: f64, from: [f64; N]) -> [f64; N] {
    for k in 0..N {
        to[k] += scale * from[k];
    }
    to
}

#[inline(always)]
fn sum(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `matrix += y·rightᵀ`. A row of a link has no response to the links of other branches.
#[inline(always)]
fn outer(matrix: &mut [f64], y: &[f64], right: &[f64]) {
    for (row, y) in matrix.chunks_exact_mut(right.len()).zip(y).filter(|(_, y)| **y != 0.0) {
        add(row, *y, right);
    }
}

/// The same for the three rows of a contact of two rigid bodies.
#[inline(always)]
fn outer3(matrix: &mut [f64], y: &[f64], right: &[f64]) {
    let (Some(matrix), Some(y), Some(r)) = (matrix.as_mut_array::<36>(), y.as_array::<18>(), right.as_array::<18>())
    else {
        return;
    };
    for i in 0..6 {
        for j in 0..6 {
            matrix[6 * i + j] += (y[i] * r[j] + y[6 + i] * r[6 + j]) + y[12 + i] * r[12 + j];
        }
    }
}

/// `c −= a·b`, with the sizes `rows × inner × columns`.
#[inline(always)]
fn subtract(c: &mut [f64], a: &[f64], b: &[f64], [rows, inner, columns]: [usize; 3]) {
    if [rows, inner, columns] == [6, 6, 6]
        && let (Some(c), Some(a), Some(b)) = (c.as_mut_array::<36>(), a.as_array::<36>(), b.as_array::<36>())
    {
        for i in 0..6 {
            let mut sum = [0.0; 6];
            for k in 0..6 {
                for j in 0..6 {
                    sum[j] += a[6 * i + k] * b[6 * k + j];
                }
            }
            for j in 0..6 {
                c[6 * i + j] -= sum[j];
            }
        }
        return;
    }
    for (c, a) in c.chunks_exact_mut(columns).zip(a.chunks_exact(inner)) {
        for (a, b) in a.iter().zip(b.chunks_exact(columns)) {
            add(c, -a, b);
        }
    }
}

/// Replaces a matrix of size `n` by its triangular factors, with row exchanges. Returns whether it is regular.
#[inline(always)]
fn triangulate(m: &mut [f64], n: usize, exchanges: &mut Vec<usize>) -> bool {
    exchanges.clear();
    for column in 0..n {
        let size = |row: usize| m[row * n + column].abs();
        let pivot = (column..n).fold(column, |best, row| if size(row) > size(best) { row } else { best });
        let value = m[pivot * n + column];
        if value == 0.0 || !value.is_finite() {
            return false;
        }
        exchanges.push(pivot);
        if pivot != column {
            let (head, tail) = m.split_at_mut(pivot * n);
            head[column * n..(column + 1) * n].swap_with_slice(&mut tail[..n]);
        }
        let (head, tail) = m.split_at_mut((column + 1) * n);
        let from = &head[column * n + column + 1..];
        for row in tail.chunks_exact_mut(n) {
            let factor = row[column] / value;
            row[column] = factor;
            if factor != 0.0 {
                add(&mut row[column + 1..], -factor, from);
            }
        }
    }
    true
}

/// Replaces a right-hand side by the solution, with the factors of [`triangulate`].
fn solve_triangular(m: &[f64], exchanges: &[usize], x: &mut [f64]) {
    let n = x.len();
    exchanges.iter().enumerate().for_each(|(row, pivot)| x.swap(row, *pivot));
    for (row, m) in m.chunks_exact(n).enumerate() {
        x[row] -= dot(&m[..row], &x[..row]);
    }
    for (row, m) in m.chunks_exact(n).enumerate().rev() {
        x[row] = (x[row] - dot(&m[row + 1..], &x[row + 1..])) / m[row];
    }
}

/// Inverts a matrix of size `n` in place by Gauss–Jordan elimination with row exchanges. Returns
/// whether it is regular.
#[inline(always)]
fn invert(m: &mut [f64], n: usize, scratch: &mut Vec<f64>) -> bool {
    let width = 2 * n;
    let mut exchanged = false;
    scratch.clear();
    scratch.resize(n * width, 0.0);
    for (i, row) in scratch.chunks_exact_mut(width).enumerate() {
        row[..n].copy_from_slice(&m[i * n..(i + 1) * n]);
        row[n + i] = 1.0;
    }
    for column in 0..n {
        let size = |row: usize| scratch[row * width + column].abs();
        let pivot = (column..n).fold(column, |best, row| if size(row) > size(best) { row } else { best });
        let value = scratch[pivot * width + column];
        if value == 0.0 || !value.is_finite() {
            return false;
        }
        if pivot != column {
            exchanged = true;
            (0..width).for_each(|k| scratch.swap(pivot * width + k, column * width + k));
        }
        // columns before this one are done; without exchanges the inverse is still the identity after it
        let open = column..if exchanged { width } else { n + column + 1 };
        scratch[column * width..(column + 1) * width][open.clone()].iter_mut().for_each(|x| *x /= value);
        for row in (0..n).filter(|row| *row != column) {
            let factor = scratch[row * width + column];
            let (from, to) = if row < column {
                let (head, tail) = scratch.split_at_mut(column * width);
                (&tail[..width], &mut head[row * width..(row + 1) * width])
            } else {
                let (head, tail) = scratch.split_at_mut(row * width);
                (&head[column * width..(column + 1) * width], &mut tail[..width])
            };
            add(&mut to[open.clone()], -factor, &from[open.clone()]);
        }
    }
    for (i, row) in scratch.chunks_exact(width).enumerate() {
        m[i * n..(i + 1) * n].copy_from_slice(&row[n..]);
    }
    true
}

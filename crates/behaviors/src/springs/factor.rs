//! Sparse Cholesky factor of a matrix of 3 × 3 blocks, one per pair of nodes that a spring joins.
//!
//! ```text
//! P·A·Pᵀ = G·Gᵀ        G_jj = chol(A_jj),  G_ij = A_ij·G_jj⁻ᵀ,  A_ik −= G_ij·G_kjᵀ
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `A` | symmetric positive definite |
//! | `P` | order of elimination: nested dissection (George, 1973) by the places of the nodes |
//! | `G` | lower triangular, by columns of blocks; its pattern is found once |

use crate::error::{BehaviorError, check};
use nalgebra::Cholesky;
use tumble_collide::{Mat3, Vec3};

/// Number of nodes that are not divided further.
const LEAF: usize = 6;

/// Most pairs of blocks that change others: 200 MB.
const MOST_PAIRS: usize = 50_000_000;

/// The pattern of a factor: what depends on the springs alone.
#[derive(Clone, Debug)]
pub(super) struct Pattern {
    /// Place of each node in the order of elimination.
    pub place: Vec<usize>,
    /// First block of each column, and the number of blocks at the end; the first block of a column is on the diagonal.
    first: Vec<usize>,
    /// Row of each block.
    row: Vec<usize>,
    /// For each column, the block that each pair of its blocks below the diagonal changes.
    update: Vec<u32>,
    /// The block of each pair that a spring joins.
    joined: Vec<u32>,
}

/// The numbers of a factor.
#[derive(Clone, Debug, Default)]
pub(super) struct Factor {
    blocks: Vec<Mat3>,
}

impl Pattern {
    /// Finds the pattern for nodes at places, m, and the pairs that springs join.
    ///
    /// # Errors
    /// [`BehaviorError::Range`] if it would need more memory than is sensible.
    pub fn new(nodes: &[Vec3], pairs: impl Iterator<Item = [usize; 2]> + Clone) -> Result<Pattern, BehaviorError> {
        let mut joined = vec![Vec::new(); nodes.len()];
        for [a, b] in pairs.clone() {
            joined[a].push(b);
            joined[b].push(a);
        }
        let mut order = Vec::with_capacity(nodes.len());
        dissect(nodes, &joined, (0..nodes.len()).collect(), &mut vec![false; nodes.len()], &mut order);
        let mut place = vec![0; nodes.len()];
        order.iter().enumerate().for_each(|(k, node)| place[*node] = k);
        let mut columns: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
        let mut updated = 0;
        for (k, node) in order.iter().enumerate() {
            let mut rows = std::mem::take(&mut columns[k]);
            rows.extend(joined[*node].iter().map(|other| place[*other]).filter(|row| *row > k));
            rows.sort_unstable();
            rows.dedup();
            updated += rows.len() * (rows.len() + 1) / 2;
            check(
                "the number of pairs of blocks in the factor of the springs, as far as counted,",
                updated as f64,
                updated <= MOST_PAIRS,
                "at most 50 million: take fewer nodes, or let springs join nearer ones",
            )?;
            if let Some(&parent) = rows.first() {
                columns[parent].extend(rows.iter().skip(1)); // fill
            }
            columns[k] = rows;
        }
        let (mut first, mut row) = (vec![0], Vec::new());
        for (k, rows) in columns.iter().enumerate() {
            row.push(k);
            row.extend(rows);
            first.push(row.len());
        }
        let mut pattern = Pattern { place, first, row, update: Vec::new(), joined: Vec::new() };
        let updates = columns.iter().flat_map(|rows| {
            rows.iter().enumerate().flat_map(|(b, column)| rows[b..].iter().map(|row| (*row, *column)))
        });
        pattern.update = updates.map(|(row, column)| pattern.find(row, column) as u32).collect();
        let places = pairs.map(|pair| pair.map(|node| pattern.place[node]));
        pattern.joined = places.map(|[i, j]| pattern.find(i.max(j), i.min(j)) as u32).collect();
        Ok(pattern)
    }

    /// Returns the block in a row of a column, which has one.
    fn find(&self, row: usize, column: usize) -> usize {
        let rows = &self.row[self.first[column]..self.first[column + 1]];
        self.first[column] + rows.partition_point(|r| *r < row)
    }

    /// Clears a factor to the matrix 0.
    pub fn clear(&self, factor: &mut Factor) {
        factor.blocks.clear();
        factor.blocks.resize(self.row.len(), Mat3::zeros());
    }

    /// Adds a symmetric block for the nodes of a pair and its transpose.
    pub fn add_joined(&self, factor: &mut Factor, pair: usize, block: &Mat3) {
        factor.blocks[self.joined[pair] as usize] += block;
    }

    /// Adds a symmetric block for a node.
    pub fn add(&self, factor: &mut Factor, node: usize, block: &Mat3) {
        factor.blocks[self.first[self.place[node]]] += block;
    }

    /// Factors the matrix in place. Pivots that are not positive, which rounding alone makes, count as 1.
    pub fn factor(&self, factor: &mut Factor) {
        let blocks = &mut factor.blocks;
        let mut updates = self.update.iter();
        for column in self.first.windows(2) {
            let (diagonal, below) = (column[0], column[0] + 1..column[1]);
            let root = Cholesky::new(blocks[diagonal]).map_or_else(Mat3::identity, |root| root.l());
            blocks[diagonal] = root;
            let inverse = inverse_lower(&root).transpose();
            below.clone().for_each(|k| blocks[k] *= inverse);
            for b in below.clone() {
                let right = blocks[b].transpose();
                for (a, target) in (b..below.end).zip(&mut updates) {
                    let change = blocks[a] * right;
                    blocks[*target as usize] -= change;
                }
            }
        }
    }

    /// Writes `G⁻¹·b` over `b`, in the order of elimination.
    pub fn solve(&self, factor: &Factor, b: &mut [Vec3]) {
        // impulses on few nodes leave the columns before them alone
        let start = b.iter().position(|b| *b != Vec3::zeros()).unwrap_or(b.len());
        for k in start..b.len() {
            if b[k] == Vec3::zeros() {
                continue;
            }
            let column = self.first[k]..self.first[k + 1];
            b[k] = solve_lower(&factor.blocks[column.start], &b[k]);
            for i in column.skip(1) {
                let change = factor.blocks[i] * b[k];
                b[self.row[i]] -= change;
            }
        }
    }

    /// Writes `G⁻ᵀ·b` over `b`, in the order of elimination.
    pub fn solve_transposed(&self, factor: &Factor, b: &mut [Vec3]) {
        for k in (0..b.len()).rev() {
            let column = self.first[k]..self.first[k + 1];
            let root = &factor.blocks[column.start];
            let sum = column.skip(1).fold(b[k], |sum, i| sum - factor.blocks[i].tr_mul(&b[self.row[i]]));
            b[k] = inverse_lower(root).tr_mul(&sum);
        }
    }

    /// Writes `Gᵀ·b` over `b`, in the order of elimination.
    pub fn mul_transposed(&self, factor: &Factor, b: &mut [Vec3]) {
        for k in 0..b.len() {
            let column = self.first[k]..self.first[k + 1];
            b[k] = column.fold(Vec3::zeros(), |sum, i| sum + factor.blocks[i].tr_mul(&b[self.row[i]]));
        }
    }

    /// Writes `G·b` over `b`, in the order of elimination.
    pub fn mul(&self, factor: &Factor, b: &mut [Vec3]) {
        for k in (0..b.len()).rev() {
            let own = std::mem::replace(&mut b[k], Vec3::zeros());
            for i in self.first[k]..self.first[k + 1] {
                b[self.row[i]] += factor.blocks[i] * own;
            }
        }
    }
}

/// Appends the nodes in the order of elimination: two halves, then the nodes of the first that a spring joins to the
/// second. `beyond` marks nodes; it is false before and after.
fn dissect(nodes: &[Vec3], joined: &[Vec<usize>], mut own: Vec<usize>, beyond: &mut [bool], order: &mut Vec<usize>) {
    if own.len() <= LEAF {
        return order.append(&mut own);
    }
    let (low, high) =
        own.iter().fold((nodes[own[0]], nodes[own[0]]), |(low, high), n| (low.inf(&nodes[*n]), high.sup(&nodes[*n])));
    let axis = (high - low).imax();
    own.sort_by(|a, b| nodes[*a][axis].total_cmp(&nodes[*b][axis]).then(a.cmp(b)));
    let second = own.split_off(own.len() / 2);
    second.iter().for_each(|n| beyond[*n] = true);
    let (between, first): (Vec<usize>, Vec<usize>) =
        own.into_iter().partition(|n| joined[*n].iter().any(|other| beyond[*other]));
    second.iter().for_each(|n| beyond[*n] = false);
    if first.is_empty() {
        order.extend(second);
    } else {
        dissect(nodes, joined, first, beyond, order);
        dissect(nodes, joined, second, beyond, order);
    }
    order.extend(between);
}

/// Returns the inverse of a lower triangular block.
fn inverse_lower(l: &Mat3) -> Mat3 {
    let [a, b, c] = [l.m11, l.m22, l.m33].map(|x| 1.0 / x);
    let d = -l.m21 * a * b;
    let f = -l.m32 * b * c;
    let e = -(l.m31 * a + l.m32 * d) * c;
    Mat3::new(a, 0.0, 0.0, d, b, 0.0, e, f, c)
}

fn solve_lower(l: &Mat3, b: &Vec3) -> Vec3 {
    let x = b.x / l.m11;
    let y = (b.y - l.m21 * x) / l.m22;
    Vec3::new(x, y, (b.z - l.m31 * x - l.m32 * y) / l.m33)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_factor_is_that_of_the_dense_matrix() {
        let side = 7;
        let nodes: Vec<Vec3> = (0..side * side).map(|k| Vec3::new((k % side) as f64, (k / side) as f64, 0.0)).collect();
        let beside = |k: usize| [(k % side + 1 < side).then_some(k + 1), (k + side < side * side).then_some(k + side)];
        let pairs: Vec<[usize; 2]> =
            (0..side * side).flat_map(|k| beside(k).into_iter().flatten().map(move |other| [k, other])).collect();
        let pattern = Pattern::new(&nodes, pairs.iter().copied()).unwrap();
        let mut factor = Factor::default();
        pattern.clear(&mut factor);
        let n = nodes.len();
        let mut dense = nalgebra::DMatrix::<f64>::zeros(3 * n, 3 * n);
        let mut put = |a: usize, b: usize, block: &Mat3, pair: Option<usize>, factor: &mut Factor| {
            match pair {
                Some(pair) => pattern.add_joined(factor, pair, block),
                None => pattern.add(factor, a, block),
            }
            let (i, j) = (3 * pattern.place[a], 3 * pattern.place[b]);
            for (i, j) in if a == b { vec![(i, j)] } else { vec![(i, j), (j, i)] } {
                let mut view = dense.fixed_view_mut::<3, 3>(i, j);
                view += block;
            }
        };
        for (k, [a, b]) in pairs.iter().enumerate() {
            let u = Vec3::new(1.0, 0.3 * k as f64 % 1.7, 0.2 * k as f64 % 0.9).normalize();
            let block = u * u.transpose() * (2.0 + k as f64 % 5.0);
            put(*a, *b, &-block, Some(k), &mut factor);
            [a, b].into_iter().for_each(|node| put(*node, *node, &block, None, &mut factor));
        }
        (0..n).for_each(|k| put(k, k, &Mat3::identity(), None, &mut factor));
        pattern.factor(&mut factor);
        let b: Vec<Vec3> = (0..n).map(|k| Vec3::new(k as f64, 1.0 - k as f64, 3.0)).collect();
        let flat = nalgebra::DVector::from_iterator(3 * n, b.iter().flat_map(|b| b.iter().copied()));
        let exact = dense.clone().cholesky().unwrap().solve(&flat);
        let mut x = b.clone();
        pattern.solve(&factor, &mut x);
        pattern.solve_transposed(&factor, &mut x);
        let error = x.iter().flat_map(|x| x.iter()).zip(exact.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(error < 1e-11, "{error}");
        pattern.mul_transposed(&factor, &mut x);
        pattern.mul(&factor, &mut x);
        assert!(x.iter().zip(&b).all(|(x, b)| (x - b).norm() < 1e-10), "A·A⁻¹·b = b");
        assert!(pattern.row.len() < 7 * n, "{} blocks of {}", pattern.row.len(), n * (n + 1) / 2);
    }
}

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

use super::block::{Block, Columns};
use crate::error::{BehaviorError, check};
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
    blocks: Vec<Block>,
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
        factor.blocks.resize(self.row.len(), Block::default());
    }

    /// Adds a symmetric block for the nodes of a pair and its transpose.
    pub fn add_joined(&self, factor: &mut Factor, pair: usize, block: &Mat3) {
        factor.blocks[self.joined[pair] as usize].add(block);
    }

    /// Adds a symmetric block for a node.
    pub fn add(&self, factor: &mut Factor, node: usize, block: &Mat3) {
        factor.blocks[self.first[self.place[node]]].add(block);
    }

    /// Factors the matrix in place. Pivots that are not positive, which rounding alone makes, count as 1.
    pub fn factor(&self, factor: &mut Factor) {
        pulp::Arch::new().dispatch(Factorization { pattern: self, blocks: &mut factor.blocks });
    }

    /// Writes `G⁻¹·b` over `b`, in the order of elimination.
    pub fn solve(&self, factor: &Factor, b: &mut [Vec3]) {
        pulp::Arch::new().dispatch(Forward { pattern: self, blocks: &factor.blocks, b });
    }

    /// Writes `G⁻ᵀ·b` over `b`, in the order of elimination.
    pub fn solve_transposed(&self, factor: &Factor, b: &mut [Vec3]) {
        pulp::Arch::new().dispatch(Backward { pattern: self, blocks: &factor.blocks, b });
    }

    /// Calls `add` with the places that impulses on a node move and, for each, the part of `G⁻¹·b` there, for up to three
    /// right-hand sides on that node. `work` is 0 before and after.
    pub fn respond(
        &self,
        factor: &Factor,
        node: usize,
        b: Columns,
        work: &mut Vec<Columns>,
        mut add: impl FnMut(usize, &Columns),
    ) {
        work.resize(self.place.len(), Columns::default());
        let place = self.place[node];
        work[place] = b;
        pulp::Arch::new().dispatch(Response { pattern: self, blocks: &factor.blocks, place, b: work });
        let mut next = Some(place);
        while let Some(k) = next {
            add(k, &std::mem::take(&mut work[k]));
            next = self.parent(k);
        }
    }

    /// Returns the next place that the elimination of a place changes: all others that it changes are those that the next ones
    /// change.
    #[inline(always)]
    fn parent(&self, place: usize) -> Option<usize> {
        let below = self.first[place] + 1..self.first[place + 1];
        (!below.is_empty()).then(|| self.row[below.start])
    }

    /// Writes `Gᵀ·b` over `b`, in the order of elimination.
    pub fn mul_transposed(&self, factor: &Factor, b: &mut [Vec3]) {
        for k in 0..b.len() {
            let column = self.first[k]..self.first[k + 1];
            b[k] = column.fold(Vec3::zeros(), |sum, i| sum + factor.blocks[i].matrix().tr_mul(&b[self.row[i]]));
        }
    }

    /// Writes `G·b` over `b`, in the order of elimination.
    pub fn mul(&self, factor: &Factor, b: &mut [Vec3]) {
        for k in (0..b.len()).rev() {
            let own = std::mem::replace(&mut b[k], Vec3::zeros());
            for i in self.first[k]..self.first[k + 1] {
                b[self.row[i]] += factor.blocks[i].matrix() * own;
            }
        }
    }
}

/// A call of [`Pattern::factor`] that is compiled for the widest registers of the processor, as are the following.
struct Factorization<'a> {
    pattern: &'a Pattern,
    blocks: &'a mut [Block],
}

impl pulp::NullaryFnOnce for Factorization<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Factorization { pattern, blocks } = self;
        let mut update = 0;
        for k in 0..pattern.place.len() {
            let (diagonal, end) = (pattern.first[k], pattern.first[k + 1]);
            let root = blocks[diagonal].cholesky();
            blocks[diagonal] = root;
            let inverse = root.inverse_lower().transposed();
            for below in &mut blocks[diagonal + 1..end] {
                *below = below.times(&inverse);
            }
            for b in diagonal + 1..end {
                let right = blocks[b].transposed();
                let targets = &pattern.update[update..update + end - b];
                for (a, target) in (b..end).zip(targets) {
                    let change = blocks[a].times(&right);
                    blocks[*target as usize].subtract(&change);
                }
                update += end - b;
            }
        }
    }
}

struct Forward<'a> {
    pattern: &'a Pattern,
    blocks: &'a [Block],
    b: &'a mut [Vec3],
}

impl pulp::NullaryFnOnce for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Forward { pattern, blocks, b } = self;
        for k in 0..b.len() {
            if b[k] == Vec3::zeros() {
                continue;
            }
            let (diagonal, end) = (pattern.first[k], pattern.first[k + 1]);
            b[k] = blocks[diagonal].solve_lower(&b[k]);
            let own = b[k];
            for (block, row) in blocks[diagonal + 1..end].iter().zip(&pattern.row[diagonal + 1..end]) {
                b[*row] -= block.of(&own);
            }
        }
    }
}

struct Backward<'a> {
    pattern: &'a Pattern,
    blocks: &'a [Block],
    b: &'a mut [Vec3],
}

impl pulp::NullaryFnOnce for Backward<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Backward { pattern, blocks, b } = self;
        for k in (0..b.len()).rev() {
            let (diagonal, end) = (pattern.first[k], pattern.first[k + 1]);
            let mut sum = Columns::of_vector(&b[k]);
            for (block, row) in blocks[diagonal + 1..end].iter().zip(&pattern.row[diagonal + 1..end]) {
                sum.subtract_products(block, &b[*row]);
            }
            b[k] = blocks[diagonal].inverse_lower().transposed().of(&sum.sums());
        }
    }
}

struct Response<'a> {
    pattern: &'a Pattern,
    blocks: &'a [Block],
    place: usize,
    b: &'a mut [Columns],
}

impl pulp::NullaryFnOnce for Response<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Response { pattern, blocks, place, b } = self;
        let mut next = Some(place);
        while let Some(k) = next {
            let (diagonal, end) = (pattern.first[k], pattern.first[k + 1]);
            let own = b[k].solved_lower(&blocks[diagonal]);
            b[k] = own;
            for (block, row) in blocks[diagonal + 1..end].iter().zip(&pattern.row[diagonal + 1..end]) {
                b[*row].subtract_product(block, &own);
            }
            next = pattern.parent(k);
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
        // three right-hand sides at one node
        let (node, axes) = (17, [Vec3::new(0.6, 0.0, 0.8), Vec3::y(), Vec3::new(-0.8, 0.0, 0.6)]);
        let impulses = Columns(std::array::from_fn(|k| [axes[0][k], axes[1][k], axes[2][k], 0.0]));
        let (mut responses, mut work) = (vec![Columns::default(); n], Vec::new());
        for _ in 0..2 {
            pattern.respond(&factor, node, impulses, &mut work, |place, response| responses[place] = *response);
        }
        for (axis, v) in axes.iter().enumerate() {
            let mut b = vec![Vec3::zeros(); n];
            b[pattern.place[node]] = *v;
            pattern.solve(&factor, &mut b);
            let same = |(b, all): (&Vec3, &Columns)| (0..3).all(|k| b[k] == all.0[k][axis]);
            assert!(b.iter().zip(&responses).all(same), "axis {axis}");
        }
        assert!(pattern.row.len() < 7 * n, "{} blocks of {}", pattern.row.len(), n * (n + 1) / 2);
    }
}

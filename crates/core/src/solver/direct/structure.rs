//! Elimination order and fill of the system matrix of an island.
//!
//! The matrix has one block row and column per object, and an entry wherever a row couples two
//! objects. Objects are eliminated by minimum degree: always one that is coupled to the fewest
//! others. Its neighbors are coupled to each other from then on (fill). A tower, a chain or a tree
//! has no fill.
//!
//! Source: George and Liu, *The evolution of the minimum degree ordering algorithm*, 1989.

use std::collections::BTreeSet;

/// The order of elimination, and the places of all blocks in one array.
///
/// Positions in the order are called places. Column `j` holds the blocks below the diagonal of the
/// matrix; the same places hold the transposed blocks of row `j`.
pub(super) struct Structure {
    /// Object at each place.
    pub order: Vec<usize>,
    /// Place of each object.
    pub place: Vec<usize>,
    /// Degrees of freedom of the object at each place.
    pub dof: Vec<usize>,
    /// First unknown of each place.
    pub start: Vec<usize>,
    /// Start of each diagonal block.
    pub diagonal: Vec<usize>,
    /// Places after `j` that are coupled to `j`, ascending, with the start of each block.
    pub columns: Vec<Vec<(usize, usize)>>,
    /// For each place the earlier ones that are coupled to it, with the index in their columns.
    pub rows: Vec<Vec<(usize, usize)>>,
    /// Length of the array.
    pub len: usize,
    /// Multiplications of a factorization.
    pub work: f64,
}

impl Structure {
    /// Returns the structure for objects with these degrees of freedom and couplings; `None` if a
    /// factorization takes more than `max_work` multiplications.
    pub fn new(dof: &[usize], couplings: &[(usize, usize)], max_work: f64) -> Option<Structure> {
        let mut neighbors = vec![Vec::new(); dof.len()];
        for &(a, b) in couplings {
            neighbors[a].push(b);
            neighbors[b].push(a);
        }
        neighbors.iter_mut().for_each(|n| {
            n.sort_unstable();
            n.dedup();
        });
        let (order, work) = eliminate(&mut neighbors, dof, max_work)?;
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(j, object)| place[*object] = j);
        let mut s = Structure {
            dof: order.iter().map(|object| dof[*object]).collect(),
            start: Vec::with_capacity(order.len()),
            diagonal: Vec::with_capacity(order.len()),
            columns: Vec::with_capacity(order.len()),
            rows: vec![Vec::new(); order.len()],
            order,
            place,
            len: 0,
            work,
        };
        let mut start = 0;
        for j in 0..s.order.len() {
            s.start.push(start);
            start += s.dof[j];
            let diagonal = s.take(s.dof[j], s.dof[j]);
            s.diagonal.push(diagonal);
            let mut column: Vec<usize> = neighbors[s.order[j]].iter().map(|object| s.place[*object]).collect();
            column.sort_unstable();
            let column: Vec<_> = column.into_iter().map(|r| (r, s.take(s.dof[r], s.dof[j]))).collect();
            column.iter().enumerate().for_each(|(i, (r, _))| s.rows[*r].push((j, i)));
            s.columns.push(column);
        }
        Some(s)
    }

    /// Reserves a block and returns its start.
    fn take(&mut self, rows: usize, columns: usize) -> usize {
        let start = self.len;
        self.len += rows * columns;
        start
    }

    /// Returns the start of the block of two different places: `row` after `column`.
    pub fn block(&self, row: usize, column: usize) -> Option<usize> {
        let column = &self.columns[column];
        column.binary_search_by_key(&row, |(r, _)| *r).ok().map(|i| column[i].1)
    }
}

/// Eliminates all objects and returns their order and the multiplications. `neighbors` of each are
/// then those that are eliminated after it.
fn eliminate(neighbors: &mut [Vec<usize>], dof: &[usize], max_work: f64) -> Option<(Vec<usize>, f64)> {
    let mut queue: BTreeSet<(usize, usize)> = neighbors.iter().enumerate().map(|(i, n)| (n.len(), i)).collect();
    let (mut order, mut work, mut merged) = (Vec::with_capacity(dof.len()), 0.0, Vec::new());
    while let Some((_, object)) = queue.pop_first() {
        order.push(object);
        let around = std::mem::take(&mut neighbors[object]);
        let size: usize = around.iter().map(|i| dof[*i]).sum();
        let own = dof[object];
        work += (own * (own * own + 2 * size * size)) as f64;
        if work > max_work {
            return None;
        }
        for &i in &around {
            queue.remove(&(neighbors[i].len(), i));
            merge(&neighbors[i], &around, |x| x != i && x != object, &mut merged);
            neighbors[i].clone_from(&merged);
            queue.insert((merged.len(), i));
        }
        neighbors[object] = around;
    }
    Some((order, work))
}

/// Writes the union of two ascending lists, of those that `keep` accepts.
fn merge(a: &[usize], b: &[usize], keep: impl Fn(usize) -> bool, out: &mut Vec<usize>) {
    out.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() || j < b.len() {
        let next = match (a.get(i), b.get(j)) {
            (Some(&x), Some(&y)) => x.min(y),
            (Some(&x), None) => x,
            (None, y) => y.copied().unwrap_or_default(),
        };
        i += (a.get(i) == Some(&next)) as usize;
        j += (b.get(j) == Some(&next)) as usize;
        if keep(next) {
            out.push(next);
        }
    }
}

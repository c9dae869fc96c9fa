//! Disjoint sets of indices (union-find).
//!
//! Source: Tarjan, *Efficiency of a good but not linear set union algorithm* (1975), with path
//! halving. The representative of a set is its smallest member, so the result does not depend on
//! the order of the unions.

/// Disjoint sets of the indices `0..count`.
#[derive(Clone, Debug, Default)]
pub struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// Returns `count` sets of one index each.
    pub fn new(count: usize) -> UnionFind {
        UnionFind { parent: (0..count as u32).collect() }
    }

    /// Makes it `count` sets of one index each and keeps the memory.
    pub fn reset(&mut self, count: usize) {
        self.parent.clear();
        self.parent.extend(0..count as u32);
    }

    /// Returns the representative of the set of `i`: its smallest member.
    pub fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins the sets of `a` and `b`.
    pub fn union(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// Numbers the sets from 0 in the order of their smallest members. Returns the number of each
    /// index's set and how many sets there are.
    pub fn numbered(&mut self) -> (Vec<u32>, usize) {
        let (mut number, mut count) = (vec![0; self.parent.len()], 0);
        for i in 0..self.parent.len() {
            // the representative comes before the other members
            let root = self.find(i as u32) as usize;
            number[i] = if root == i { count } else { number[root] };
            count += u32::from(root == i);
        }
        (number, count as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_numbered_by_their_smallest_members() {
        for pairs in [[(4, 1), (5, 3), (3, 4)], [(3, 4), (4, 1), (5, 3)]] {
            let mut sets = UnionFind::new(6);
            pairs.iter().for_each(|&(a, b)| sets.union(a, b));
            assert_eq!(sets.numbered(), (vec![0, 1, 2, 1, 1, 1], 3));
            assert_eq!((0..6).map(|i| sets.find(i)).collect::<Vec<_>>(), [0, 1, 2, 1, 1, 1]);
            sets.reset(2);
            assert_eq!(sets.numbered(), (vec![0, 1], 2));
        }
    }
}

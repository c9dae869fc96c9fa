//! Islands: sets of blocks that share no moving object, found by union-find. Static objects do not
//! merge islands.

use crate::constraint::rows::Rows;
use tumble_collide::UnionFind;

/// The blocks of a solve, grouped by island. Islands are ordered by their first block, blocks
/// within an island as they were added.
#[derive(Clone, Debug, Default)]
pub struct Islands {
    blocks: Vec<u32>,
    starts: Vec<u32>,
    sets: UnionFind,
    island_of_root: Vec<u32>,
    count: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Islands {
    /// Groups the blocks of `rows` that satisfy `keep`; blocks without sides are left out.
    pub fn build(&mut self, rows: &Rows, keep: impl Fn(usize) -> bool) {
        self.sets.reset(rows.dof);
        for (b, block) in rows.blocks.iter().enumerate() {
            if let ([first, second], true) = (block.sides(), keep(b)) {
                self.sets.union(first.u, second.u);
            }
        }
        self.number(rows, &keep);
        self.sort(rows, &keep);
    }

    /// Returns the number of islands.
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Returns whether there is no island.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the blocks of island `i`.
    pub fn get(&self, i: usize) -> &[u32] {
        &self.blocks[self.starts[i] as usize..self.starts[i + 1] as usize]
    }

    /// Iterates over all islands in order.
    pub fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.len()).map(|i| self.get(i))
    }

    /// Numbers the islands by first block and counts their blocks.
    fn number(&mut self, rows: &Rows, keep: &impl Fn(usize) -> bool) {
        self.island_of_root.clear();
        self.island_of_root.resize(rows.dof, NONE);
        self.count.clear();
        for (b, block) in rows.blocks.iter().enumerate() {
            let Some(side) = block.sides().first().filter(|_| keep(b)) else { continue };
            let root = self.sets.find(side.u) as usize;
            if self.island_of_root[root] == NONE {
                self.island_of_root[root] = self.count.len() as u32;
                self.count.push(0);
            }
            self.count[self.island_of_root[root] as usize] += 1;
        }
    }

    /// Sorts the blocks by island (counting sort).
    fn sort(&mut self, rows: &Rows, keep: &impl Fn(usize) -> bool) {
        self.starts.clear();
        self.starts.push(0);
        for i in 0..self.count.len() {
            self.starts.push(self.starts[i] + self.count[i]);
        }
        let mut next = std::mem::take(&mut self.count);
        next.clone_from(&self.starts);
        self.blocks.clear();
        self.blocks.resize(*self.starts.last().unwrap_or(&0) as usize, 0);
        for (b, block) in rows.blocks.iter().enumerate() {
            let Some(side) = block.sides().first().filter(|_| keep(b)) else { continue };
            let root = self.sets.find(side.u) as usize;
            let island = self.island_of_root[root] as usize;
            self.blocks[next[island] as usize] = b as u32;
            next[island] += 1;
        }
        self.count = next;
    }
}

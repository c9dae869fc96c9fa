//! Point location by a walk from cell to cell.

use super::predicates::orient;
use super::{Delaunay, NONE};
use crate::Vec3;

impl Delaunay {
    /// Returns the finite cell that contains `p` (or one of them), or a ghost whose hull facet `p`
    /// is strictly beyond. Walks from `hint`, which can be any cell, also a removed one.
    ///
    /// The walk crosses any facet that has `p` strictly beyond it. In a Delaunay tetrahedralization
    /// that terminates (Devillers, Pion and Teillaud, *Walking in a triangulation*, 2002). The
    /// number of steps is limited all the same.
    pub fn locate(&self, p: &Vec3, hint: u32) -> u32 {
        let mut at = self.finite_near(hint);
        let mut from = NONE;
        for step in 0..self.cells.len() + 64 {
            let beyond = (0..4)
                .map(|k| (k + step) & 3)
                .find(|&k| self.cells[at as usize].across[k] != from && self.side(at, k, p) < 0.0);
            let Some(k) = beyond else { return at };
            from = at;
            at = self.cells[at as usize].across[k];
            if self.ghost_corner(at).is_some() {
                return at;
            }
        }
        self.locate_by_search(p)
    }

    fn locate_by_search(&self, p: &Vec3) -> u32 {
        let holds = |c: u32| match self.ghost_corner(c) {
            Some(k) => self.side(c, k, p) > 0.0,
            None => (0..4).all(|k| self.side(c, k, p) >= 0.0),
        };
        (0..self.cells.len() as u32).find(|&c| self.is_in_use(c) && holds(c)).unwrap_or(self.finite_near(NONE))
    }

    /// Returns `hint`, the finite neighbor of a ghost, or any finite cell.
    fn finite_near(&self, hint: u32) -> u32 {
        let finite = |c: &u32| (*c as usize) < self.cells.len() && self.is_finite(*c);
        if finite(&hint) {
            return hint;
        }
        if (hint as usize) < self.cells.len()
            && self.is_in_use(hint)
            && let Some(k) = self.ghost_corner(hint)
        {
            return self.cells[hint as usize].across[k];
        }
        // there always is one: the first four points made it
        (0..self.cells.len() as u32).find(finite).unwrap_or(0)
    }

    /// Returns the side of facet `k` on which a point lies: the orientation of the cell with corner
    /// `k` at `p`. Positive on the side of the cell.
    pub(super) fn side(&self, cell: u32, k: usize, p: &Vec3) -> f64 {
        let v = &self.cells[cell as usize].vertices;
        let at = |n: usize| if n == k { p } else { &self.points[v[n] as usize] };
        orient(at(0), at(1), at(2), at(3))
    }
}

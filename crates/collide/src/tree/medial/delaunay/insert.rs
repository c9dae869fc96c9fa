//! Insertion of one point: the cells whose spheres contain it are removed, and the cavity is filled
//! with cells around it.
//!
//! Source: Bowyer, *Computing Dirichlet tessellations*, and Watson, *Computing the n-dimensional
//! Delaunay tessellation* (both 1981).
//!
//! **Ties.** A cell is removed only if the point is *strictly* inside its sphere. This is the
//! symbolic perturbation of Devillers and Teillaud (*Perturbations for Delaunay and weighted
//! Delaunay 3D triangulations*, 2011), in which each point is lifted by far more than all before
//! it. So the cavity is connected and star-shaped even for points on one sphere. A facet coplanar
//! with the point is never on the cavity's boundary: in that plane the spheres of both its cells
//! are the facet's circle, so both are removed or both stay. A ghost is removed if the point is
//! strictly beyond its facet. In the plane of the facet the circle decides, that is, the sphere of
//! the finite cell behind it. So no flat cell is ever created.

use super::predicates::in_sphere;
use super::{Cell, Delaunay, GHOST, NONE};

/// Flag in `across` of a removed cell: the entry is the new cell on that facet.
const NEW: u32 = 1 << 31;

impl Delaunay {
    /// Inserts vertex `v`, whose point is stored, walking from `hint`. Returns `false` for a
    /// duplicate.
    pub(super) fn insert_vertex(&mut self, v: u32, hint: u32) -> bool {
        let p = self.points[v as usize];
        self.removed.clear();
        self.created.clear();
        let start = self.locate(&p, hint);
        let corners = self.cells[start as usize].vertices;
        if corners.iter().any(|&c| c != GHOST && self.points[c as usize] == p) {
            return false;
        }
        self.find_cavity(start, v);
        self.fill_cavity(v);
        self.link_created();
        for &c in &self.removed {
            self.cells[c as usize].vertices = [GHOST; 4];
            self.free.push(c);
        }
        true
    }

    /// Collects the cells to remove (`removed`) and the facets around the cavity
    /// (`cavity_boundary`).
    fn find_cavity(&mut self, start: u32, v: u32) {
        let p = self.points[v as usize];
        self.stamp += 2;
        let (goes, stays) = (self.stamp, self.stamp + 1);
        self.stamps[start as usize] = goes;
        self.cavity_boundary.clear();
        self.removed.push(start);
        let mut next = 0;
        while let Some(&c) = self.removed.get(next) {
            next += 1;
            for k in 0..4 {
                let n = self.cells[c as usize].across[k];
                if self.stamps[n as usize] < goes {
                    let conflict = self.in_conflict(n, &p);
                    self.stamps[n as usize] = if conflict { goes } else { stays };
                    if conflict {
                        self.removed.push(n);
                    }
                }
                if self.stamps[n as usize] == stays {
                    self.cavity_boundary.push((c, k));
                }
            }
        }
    }

    fn in_conflict(&self, c: u32, p: &crate::Vec3) -> bool {
        if let Some(k) = self.ghost_corner(c) {
            let side = self.side(c, k, p);
            let behind = self.cells[c as usize].across[k];
            return if side == 0.0 { self.in_conflict(behind, p) } else { side > 0.0 };
        }
        in_sphere(self.cells[c as usize].vertices.each_ref().map(|&v| &self.points[v as usize]), p) > 0.0
    }

    /// Creates one cell on each boundary facet, with corner `k` at the new vertex.
    fn fill_cavity(&mut self, v: u32) {
        for r in 0..self.cavity_boundary.len() {
            let (c, k) = self.cavity_boundary[r];
            let old = self.cells[c as usize];
            let mut cell = Cell { vertices: old.vertices, across: [NONE; 4] };
            cell.vertices[k] = v;
            cell.across[k] = old.across[k];
            let id = self.add(cell);
            let outside = &mut self.cells[old.across[k] as usize].across;
            outside.iter_mut().filter(|n| **n == c).for_each(|n| *n = id);
            self.cells[c as usize].across[k] = NEW | id;
            self.created.push(id);
        }
    }

    /// Links the new cells to one another: around each edge of the boundary, through the removed
    /// cells, to the other boundary facet at that edge.
    fn link_created(&mut self) {
        for r in 0..self.cavity_boundary.len() {
            let ((c, k), id) = (self.cavity_boundary[r], self.created[r]);
            for j in (0..4).filter(|&j| j != k) {
                if self.cells[id as usize].across[j] != NONE {
                    continue;
                }
                let (mut at, mut exit, mut kept) = (c, j, k);
                // the number of removed cells limits the turn
                let other = loop {
                    let next = self.cells[at as usize].across[exit];
                    if next & NEW != 0 {
                        break next ^ NEW;
                    }
                    let pivot = self.cells[at as usize].vertices[kept];
                    let cell = &self.cells[next as usize];
                    kept = position(&cell.across, at);
                    exit = position(&cell.vertices, pivot);
                    at = next;
                };
                self.cells[id as usize].across[j] = other;
                self.cells[other as usize].across[kept] = id;
            }
        }
    }

    /// Adds a cell, in a free slot if there is one.
    pub(super) fn add(&mut self, cell: Cell) -> u32 {
        let id = match self.free.pop() {
            Some(id) => id,
            None => {
                self.cells.push(cell);
                self.stamps.push(0);
                self.cells.len() as u32 - 1
            }
        };
        self.cells[id as usize] = cell;
        self.stamps[id as usize] = 0;
        id
    }
}

fn position(items: &[u32; 4], item: u32) -> usize {
    items.iter().position(|&i| i == item).unwrap_or(0)
}

//! Flags of the spheres, and the witness of each point.

use super::{MedialAxis, NONE, SLACK};
use crate::Vec3;
use crate::tree::sphere::Sphere;
use std::cmp::Reverse;

impl MedialAxis<'_> {
    /// Returns the tetrahedra that the last insertion created.
    pub(super) fn created(&self) -> Vec<u32> {
        let Some(voronoi) = self.voronoi.as_ref() else { return Vec::new() };
        voronoi.delaunay.created().iter().copied().filter(|&c| voronoi.delaunay.is_finite(c)).collect()
    }

    /// Flags a new cell if it is INTERNAL.
    pub(super) fn register_cell(&mut self, cell: u32) {
        if self.voronoi.as_ref().and_then(|v| v.sphere(cell)).is_some_and(|b| b.internal) {
            self.inner[cell as usize] = true;
            self.internal += 1;
            self.enqueue(cell);
        }
    }

    /// Assigns the points of a COVER sphere again.
    pub(super) fn reassign_witnesses(&mut self, cell: u32) {
        if self.inner[cell as usize] || self.first[cell as usize] == NONE {
            return;
        }
        let mut points = Vec::new();
        chain(self.first[cell as usize], &self.next, &mut points);
        self.first[cell as usize] = NONE;
        self.covering -= 1;
        for i in points {
            self.witness[i as usize] = NONE;
            self.assign_witness(i, cell);
        }
    }

    /// Assigns a witness to a point: the first INTERNAL sphere found that contains it, else the one
    /// with the least error. Returns the cell in which the point lies, walking from `hint`.
    pub(super) fn assign_witness(&mut self, i: u32, hint: u32) -> u32 {
        let mut best = (f64::INFINITY, NONE);
        let home = self.for_each_holder(i, hint, |c, axis| {
            if axis.inner[c as usize] {
                best.1 = c;
                return false;
            }
            let error = axis.error(c);
            if error < best.0 {
                best = (error, c);
            }
            true
        });
        if best.1 != NONE {
            self.set_witness(i, best.1);
        }
        home
    }

    /// Calls `visit` for all cells whose spheres contain point `i`, until it returns false. Returns
    /// the cell in which the point lies, walking from `hint`.
    pub(super) fn for_each_holder(&mut self, i: u32, hint: u32, mut visit: impl FnMut(u32, &mut Self) -> bool) -> u32 {
        let Some(voronoi) = self.voronoi.as_ref() else { return NONE };
        let p = self.points[i as usize];
        let home = voronoi.delaunay.locate(&p, hint);
        self.search += 1;
        self.seen[home as usize] = self.search;
        let mut stack = vec![home];
        while let Some(c) = stack.pop() {
            if self.contains(c, i) && !visit(c, self) {
                break;
            }
            let Some(voronoi) = self.voronoi.as_ref() else { break };
            for n in voronoi.delaunay.across(c) {
                // continue through slivers without a sphere
                let on = voronoi.delaunay.is_finite(n) && voronoi.sphere(n).is_none_or(|b| contains(&b.sphere, &p));
                if on && self.seen[n as usize] != self.search {
                    self.seen[n as usize] = self.search;
                    stack.push(n);
                }
            }
        }
        home
    }

    /// Makes a sphere the witness of a point.
    pub(super) fn set_witness(&mut self, i: u32, cell: u32) {
        let c = cell as usize;
        if self.first[c] == NONE && !self.inner[c] {
            self.covering += 1;
            self.enqueue(cell);
        }
        self.witness[i as usize] = cell;
        self.next[i as usize] = self.first[c];
        self.first[c] = i;
    }

    /// Queues a flagged sphere, once.
    pub(super) fn enqueue(&mut self, cell: u32) {
        let generation = self.generations[cell as usize];
        if self.queued[cell as usize] != generation {
            self.queued[cell as usize] = generation;
            let error = self.error(cell);
            self.queue.push((error.to_bits(), Reverse(cell), generation));
        }
    }

    pub(super) fn is_flagged(&self, cell: u32) -> bool {
        self.inner[cell as usize] || self.first[cell as usize] != NONE
    }

    /// Returns whether a flagged sphere contains a point of the region.
    pub(super) fn is_in_region(&self, cell: u32) -> bool {
        !self.partial
            || self.first[cell as usize] != NONE
            || (0..self.points.len() as u32).any(|i| self.contains(cell, i))
    }

    /// Returns an upper bound of how far the sphere extends outside the solid, meters.
    pub(super) fn error(&mut self, cell: u32) -> f64 {
        let Some(voronoi) = self.voronoi.as_mut() else { return 0.0 };
        let signed = voronoi.signed_distance(cell);
        voronoi.sphere(cell).map_or(0.0, |b| (b.sphere.radius + signed).max(0.0))
    }

    pub(super) fn contains(&self, cell: u32, i: u32) -> bool {
        self.voronoi
            .as_ref()
            .and_then(|v| v.sphere(cell))
            .is_some_and(|b| contains(&b.sphere, &self.points[i as usize]))
    }

    pub(super) fn grow_tables(&mut self) {
        let count = self.voronoi.as_ref().map_or(0, |v| v.delaunay.cell_count());
        self.first.resize(count, NONE);
        self.inner.resize(count, false);
        self.generations.resize(count, 0);
        self.queued.resize(count, NONE);
        self.seen.resize(count, 0);
    }
}

fn contains(sphere: &Sphere, p: &Vec3) -> bool {
    (p - sphere.center).norm_squared() <= sphere.radius * sphere.radius * (1.0 + SLACK)
}

/// Appends a linked list of points to `all`.
pub(super) fn chain(mut i: u32, next: &[u32], all: &mut Vec<u32>) {
    while i != NONE {
        all.push(i);
        i = next[i as usize];
    }
}

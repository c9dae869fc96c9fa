//! Adaptive medial spheres: Voronoi spheres of few sites, refined where they are worst.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree
//! construction* (2004), §4.
//!
//! - A sphere is INTERNAL if its center is inside the solid.
//! - For a cover point in no INTERNAL sphere, the best of the other spheres that contain it is
//!   flagged COVER. The spheres that contain a point are those of the cells that its insertion
//!   would remove, a connected set around the cell in which it lies. The set is never empty: the
//!   Voronoi cell of the nearest site is bounded and contains the point. So some vertex `v` of that
//!   cell is at least as far along from the site `s` as the point `p`, `(v − s)·(p − s) ≥ |p −
//!   s|²`, hence `|v − p| ≤ |v − s|`.
//! - The error of a sphere is at most `r + s(c)`, where `s` is the signed distance of its center.
//! - Refinement takes the worst flagged sphere and makes its closest surface point a site. That
//!   point is inside the sphere, so the sphere is removed.
//!
//! Each cover point has one flagged sphere as its *witness*. When a cell is removed, only the
//! points with this witness are assigned again. A COVER sphere is checked again before it is
//! refined, and at the end, since an INTERNAL sphere can contain its points by then.
//!
//! Departures from the paper: the best sphere is the one with the least error, not with the largest
//! radius minus distance. It is searched among all spheres that contain the point, not only those
//! of the nearest site.

#[cfg(test)]
mod tests;
mod witness;

use super::types::{CoverPoints, MedialSphere, RefineGoal};
use super::voronoi::Voronoi;
use crate::tree::Progress;
use crate::tree::builder::StageCount;
use crate::tree::sphere::Sphere;
use crate::{Aabb, MeshDistance, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;
/// Relative tolerance of containment; spheres are enlarged by it.
const SLACK: f64 = 1e-9;

/// Counts of a refinement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::tree) struct Counts {
    pub inserted: u64,
    pub internal: u64,
    pub cover: u64,
    /// Cover points in no sphere that floating point can represent; each gets a sphere of radius 0.
    pub alone: u64,
    /// Number of sites that existed before.
    pub duplicates: u64,
}

impl Counts {
    /// Returns the counts as stages of `level`.
    pub fn stages(&self, level: u32) -> Vec<StageCount> {
        [
            ("sites inserted", self.inserted),
            ("internal spheres", self.internal),
            ("cover spheres", self.cover),
            ("isolated points", self.alone),
            ("duplicate sites", self.duplicates),
        ]
        .map(|(stage, count)| StageCount { level, stage: stage.into(), count })
        .into()
    }
}

/// Voronoi spheres with their flags. Cover points are numbered by their index in the region.
pub(in crate::tree) struct MedialAxis<'a> {
    points: Vec<Vec3>,
    /// Whether the points are part of the surface only.
    partial: bool,
    distance: &'a MeshDistance,
    progress: &'a dyn Progress,
    /// `None` for a region of no extent.
    voronoi: Option<Voronoi<'a>>,
    /// Per cover point, the cell whose sphere is its witness.
    witness: Vec<u32>,
    /// Per cell, its points as a linked list: the first, and per point the next.
    first: Vec<u32>,
    next: Vec<u32>,
    /// Per cell, whether its sphere is INTERNAL.
    inner: Vec<bool>,
    /// Per cell, the number of its removals. Queue entries of earlier generations are invalid.
    generations: Vec<u32>,
    /// Per cell, the generation in which it was queued last.
    queued: Vec<u32>,
    /// Error (as ordered bits), cell, generation.
    queue: BinaryHeap<(u64, Reverse<u32>, u32)>,
    seen: Vec<u32>,
    search: u32,
    internal: usize,
    covering: usize,
    inserted: usize,
}

impl<'a> MedialAxis<'a> {
    /// Starts with `sites` of the region's points (at least 8), evenly spaced.
    pub fn new(
        cover: &CoverPoints,
        region: &[u32],
        distance: &'a MeshDistance,
        sites: usize,
        progress: &'a dyn Progress,
    ) -> MedialAxis<'a> {
        let points: Vec<Vec3> = region.iter().map(|&i| cover.points[i as usize]).collect();
        let stride = (points.len() / sites.max(8)).max(1);
        let first: Vec<Vec3> = points.iter().copied().step_by(stride).collect();
        let solid = Aabb::around(cover.points.iter().copied());
        let mut axis = MedialAxis {
            witness: vec![NONE; points.len()],
            next: vec![NONE; points.len()],
            partial: points.len() < cover.points.len(),
            points,
            distance,
            progress,
            voronoi: Voronoi::new(&first, &solid, distance),
            first: Vec::new(),
            inner: Vec::new(),
            generations: Vec::new(),
            queued: Vec::new(),
            queue: BinaryHeap::new(),
            seen: Vec::new(),
            search: 0,
            internal: 0,
            covering: 0,
            inserted: 0,
        };
        axis.grow_tables();
        for c in 0..axis.generations.len() as u32 {
            axis.register_cell(c);
        }
        let mut hint = 0;
        for i in (0..axis.points.len() as u32).take_while(|_| !progress.stopped()) {
            hint = axis.assign_witness(i, hint);
        }
        axis
    }

    /// Refines until the worst error is below the target and there are enough spheres, or the
    /// maximum number of insertions is reached.
    pub fn refine(&mut self, goal: &RefineGoal) {
        let most = self.inserted + goal.most;
        while self.inserted < most && !self.progress.stopped() {
            let Some((error, cell)) = self.worst() else { return };
            let enough = error < goal.target && self.internal + self.covering >= goal.least;
            if enough {
                self.queued[cell as usize] = NONE;
                self.enqueue(cell);
                return;
            }
            self.split(cell);
        }
    }

    /// Returns the flagged spheres, and a sphere of radius 0 for each point without one.
    pub fn spheres(&mut self) -> Vec<MedialSphere> {
        let progress = self.progress;
        for c in (0..self.first.len() as u32).take_while(|_| !progress.stopped()) {
            self.reassign_witnesses(c);
        }
        let mut spheres = Vec::with_capacity(self.internal + self.covering);
        for c in self.listed() {
            let outward = self.error(c);
            if let Some(b) = self.voronoi.as_ref().and_then(|v| v.sphere(c)) {
                let sphere = Sphere { center: b.sphere.center, radius: b.sphere.radius * (1.0 + SLACK) };
                spheres.push(MedialSphere { sphere, outward });
            }
        }
        let alone = (0..self.points.len()).filter(|&i| self.witness[i] == NONE).map(|i| self.points[i]);
        spheres.extend(alone.map(|center| MedialSphere { sphere: Sphere { center, radius: 0.0 }, outward: 0.0 }));
        spheres
    }

    /// Returns for each point the spheres of the last [`MedialAxis::spheres`] that contain it, up
    /// to rounding; at least one.
    pub fn holders(&mut self) -> Vec<Vec<u32>> {
        let mut place = vec![NONE; self.first.len()];
        let listed = self.listed();
        listed.iter().enumerate().for_each(|(n, &c)| place[c as usize] = n as u32);
        let (mut hint, mut alone) = (0, listed.len() as u32);
        let mut all = Vec::with_capacity(self.points.len());
        for i in 0..self.points.len() as u32 {
            let mut holders = Vec::new();
            if self.progress.stopped() {
                all.push(holders);
                continue;
            }
            hint = self.for_each_holder(i, hint, |c, _| {
                if place[c as usize] != NONE {
                    holders.push(place[c as usize]);
                }
                true
            });
            let witness = self.witness[i as usize];
            if witness == NONE {
                holders.push(alone);
                alone += 1;
            } else if !holders.contains(&place[witness as usize]) {
                holders.push(place[witness as usize]);
            }
            all.push(holders);
        }
        all
    }

    /// Returns the flagged cells of the region.
    fn listed(&self) -> Vec<u32> {
        (0..self.first.len() as u32).filter(|&c| self.is_flagged(c) && self.is_in_region(c)).collect()
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> Counts {
        Counts {
            inserted: self.inserted as u64,
            internal: self.internal as u64,
            cover: self.covering as u64,
            alone: self.witness.iter().filter(|w| **w == NONE).count() as u64,
            duplicates: self.voronoi.as_ref().map_or(0, |v| v.delaunay.duplicates()) as u64,
        }
    }

    /// Takes the worst flagged sphere from the queue.
    fn worst(&mut self) -> Option<(f64, u32)> {
        while let Some((bits, cell, generation)) = self.queue.pop() {
            if self.generations[cell.0 as usize] != generation {
                continue;
            }
            self.reassign_witnesses(cell.0);
            if self.is_flagged(cell.0) && self.is_in_region(cell.0) {
                return Some((f64::from_bits(bits), cell.0));
            }
            self.queued[cell.0 as usize] = NONE;
        }
        None
    }

    /// Makes the closest surface point of a sphere a site. If that point is a site already, the
    /// sphere cannot be improved.
    fn split(&mut self, cell: u32) {
        let Some(voronoi) = self.voronoi.as_mut() else { return };
        let Some(sphere) = voronoi.sphere(cell).map(|b| b.sphere) else { return };
        let site = self.distance.closest(&sphere.center).point;
        if (site - sphere.center).norm() >= sphere.radius * (1.0 - SLACK) || !voronoi.insert(site, cell) {
            return;
        }
        self.inserted += 1;
        let orphans = self.remove_cells();
        self.grow_tables();
        let created = self.created();
        for &c in &created {
            self.register_cell(c);
        }
        for i in orphans {
            match created.iter().find(|&&c| self.inner[c as usize] && self.contains(c, i)) {
                Some(&c) => self.set_witness(i, c),
                None => _ = self.assign_witness(i, created[0]),
            }
        }
    }

    /// Unregisters the removed cells. Returns the points whose witness they were.
    fn remove_cells(&mut self) -> Vec<u32> {
        let Some(voronoi) = self.voronoi.as_ref() else { return Vec::new() };
        let mut orphans = Vec::new();
        for &c in voronoi.delaunay.removed() {
            let c = c as usize;
            let before = orphans.len();
            witness::chain(self.first[c], &self.next, &mut orphans);
            if self.inner[c] {
                self.internal -= 1;
            } else if orphans.len() > before {
                self.covering -= 1;
            }
            self.inner[c] = false;
            self.first[c] = NONE;
            self.generations[c] += 1;
        }
        for &i in &orphans {
            self.witness[i as usize] = NONE;
        }
        orphans
    }
}

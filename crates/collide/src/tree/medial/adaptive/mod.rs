//! Adaptive medial balls: Voronoi balls of few sites, refined where they are worst.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree construction* (2004), §4.
//!
//! - A ball is INTERNAL if its centre is inside the solid.
//! - A cover point that no INTERNAL ball holds has the best of the other balls that hold it flagged COVER. The balls
//!   that hold a point are those of the cells that would go were it inserted, a connected set around the cell that it
//!   lies in. It is never empty: the Voronoi cell of the nearest site is bounded and holds the point, so that some vertex
//!   `v` of it is at least as far along from the site `s` as the point `p` is, `(v − s)·(p − s) ≥ |p − s|²`, hence
//!   `|v − p| ≤ |v − s|`.
//! - The error of a ball is at most `r + s(c)`, `s` the signed distance of its centre.
//! - Refinement takes the worst flagged ball and makes its closest surface point a site, which is inside the ball
//!   and so ends it.
//!
//! Each cover point keeps one flagged ball as its *witness*. When a cell goes, the points that it was witness of are
//! judged anew, and no others; a COVER ball is judged anew before it is refined, and at the end, since an INTERNAL one
//! may have come to hold its points.
//!
//! Departs from the paper: best is least error, not the largest radius less distance; and it is sought among all balls that
//! hold the point, not only those of the nearest site.

#[cfg(test)]
mod tests;
mod witness;

use super::spheres::{CoverPoints, MedialBall, Want};
use super::voronoi::Voronoi;
use crate::tree::Progress;
use crate::tree::ball::Ball;
use crate::tree::builder::StageCount;
use crate::{Aabb, MeshDistance, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;
/// A ball is told to hold a point up to this part of its radius, and is grown by it.
const SLACK: f64 = 1e-9;

/// What a refinement did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::tree) struct Counts {
    pub inserted: u64,
    pub internal: u64,
    pub cover: u64,
    /// Cover points that only a ball of no size holds, since floating point gives no other.
    pub alone: u64,
    /// Sites that were there already.
    pub duplicates: u64,
}

impl Counts {
    /// As an account of `level`.
    pub fn stages(&self, level: u32) -> Vec<StageCount> {
        [
            ("sites inserted", self.inserted),
            ("internal balls", self.internal),
            ("cover balls", self.cover),
            ("points alone", self.alone),
            ("duplicate sites", self.duplicates),
        ]
        .map(|(stage, count)| StageCount { level, stage: stage.into(), count })
        .into()
    }
}

/// Voronoi balls with their flags. Cover points are numbered by their place in the region.
pub(in crate::tree) struct Axis<'a> {
    points: Vec<Vec3>,
    /// Whether the points are of a part of the surface.
    partial: bool,
    distance: &'a MeshDistance,
    progress: &'a dyn Progress,
    /// `None` for a region of no extent.
    voronoi: Option<Voronoi<'a>>,
    /// Per cover point, the cell whose ball is its witness.
    witness: Vec<u32>,
    /// Per cell, its points, as a chain: the first, and per point the next.
    first: Vec<u32>,
    next: Vec<u32>,
    /// Per cell, whether its ball is INTERNAL.
    inner: Vec<bool>,
    /// Per cell, how often it went: entries of the queue of earlier lives are void.
    lives: Vec<u32>,
    /// Per cell, the life in which it was queued last.
    queued: Vec<u32>,
    /// Error (as ordered bits), cell, life.
    queue: BinaryHeap<(u64, Reverse<u32>, u32)>,
    seen: Vec<u32>,
    search: u32,
    internal: usize,
    covering: usize,
    inserted: usize,
}

impl<'a> Axis<'a> {
    /// Begins with `sites` of the region's points (at least 8), taken evenly.
    pub fn new(
        cover: &CoverPoints,
        region: &[u32],
        distance: &'a MeshDistance,
        sites: usize,
        progress: &'a dyn Progress,
    ) -> Axis<'a> {
        let points: Vec<Vec3> = region.iter().map(|&i| cover.points[i as usize]).collect();
        let stride = (points.len() / sites.max(8)).max(1);
        let first: Vec<Vec3> = points.iter().copied().step_by(stride).collect();
        let solid = Aabb::around(cover.points.iter().copied());
        let mut axis = Axis {
            witness: vec![NONE; points.len()],
            next: vec![NONE; points.len()],
            partial: points.len() < cover.points.len(),
            points,
            distance,
            progress,
            voronoi: Voronoi::new(&first, &solid, distance),
            first: Vec::new(),
            inner: Vec::new(),
            lives: Vec::new(),
            queued: Vec::new(),
            queue: BinaryHeap::new(),
            seen: Vec::new(),
            search: 0,
            internal: 0,
            covering: 0,
            inserted: 0,
        };
        axis.grow_tables();
        for c in 0..axis.lives.len() as u32 {
            axis.welcome(c);
        }
        let mut hint = 0;
        for i in (0..axis.points.len() as u32).take_while(|_| !progress.stopped()) {
            hint = axis.judge(i, hint);
        }
        axis
    }

    /// Refines until the worst error is below the target and there are enough balls, or no more may be inserted.
    pub fn refine(&mut self, want: &Want) {
        let most = self.inserted + want.most;
        while self.inserted < most && !self.progress.stopped() {
            let Some((error, cell)) = self.worst() else { return };
            let enough = error < want.target && self.internal + self.covering >= want.least;
            if enough {
                self.queued[cell as usize] = NONE;
                self.enqueue(cell);
                return;
            }
            self.split(cell);
        }
    }

    /// The flagged balls, of points that have none a ball of no size.
    pub fn balls(&mut self) -> Vec<MedialBall> {
        let progress = self.progress;
        for c in (0..self.first.len() as u32).take_while(|_| !progress.stopped()) {
            self.judge_again(c);
        }
        let mut balls = Vec::with_capacity(self.internal + self.covering);
        for c in self.listed() {
            let outward = self.error(c);
            if let Some(b) = self.voronoi.as_ref().and_then(|v| v.ball(c)) {
                let ball = Ball { center: b.ball.center, radius: b.ball.radius * (1.0 + SLACK) };
                balls.push(MedialBall { ball, outward });
            }
        }
        let alone = (0..self.points.len()).filter(|&i| self.witness[i] == NONE).map(|i| self.points[i]);
        balls.extend(alone.map(|center| MedialBall { ball: Ball { center, radius: 0.0 }, outward: 0.0 }));
        balls
    }

    /// Per point, the balls of the list that [`Axis::balls`] just gave which hold it: all that do, up to rounding; that
    /// is at least one.
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
            hint = self.each_holder(i, hint, |c, _| {
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

    /// The flagged cells that matter.
    fn listed(&self) -> Vec<u32> {
        (0..self.first.len() as u32).filter(|&c| self.is_flagged(c) && self.matters(c)).collect()
    }

    /// What was done so far.
    pub fn counts(&self) -> Counts {
        Counts {
            inserted: self.inserted as u64,
            internal: self.internal as u64,
            cover: self.covering as u64,
            alone: self.witness.iter().filter(|w| **w == NONE).count() as u64,
            duplicates: self.voronoi.as_ref().map_or(0, |v| v.delaunay.duplicates()) as u64,
        }
    }

    /// The worst flagged ball, taken from the queue.
    fn worst(&mut self) -> Option<(f64, u32)> {
        while let Some((bits, cell, life)) = self.queue.pop() {
            if self.lives[cell.0 as usize] != life {
                continue;
            }
            self.judge_again(cell.0);
            if self.is_flagged(cell.0) && self.matters(cell.0) {
                return Some((f64::from_bits(bits), cell.0));
            }
            self.queued[cell.0 as usize] = NONE;
        }
        None
    }

    /// Makes the closest surface point of a ball a site. A ball whose closest surface point is a site already is as good as it gets.
    fn split(&mut self, cell: u32) {
        let Some(voronoi) = self.voronoi.as_mut() else { return };
        let Some(ball) = voronoi.ball(cell).map(|b| b.ball) else { return };
        let site = self.distance.closest(&ball.center).point;
        if (site - ball.center).norm() >= ball.radius * (1.0 - SLACK) || !voronoi.insert(site, cell) {
            return;
        }
        self.inserted += 1;
        let orphans = self.dismiss();
        self.grow_tables();
        let made = self.made();
        for &c in &made {
            self.welcome(c);
        }
        for i in orphans {
            match made.iter().find(|&&c| self.inner[c as usize] && self.holds(c, i)) {
                Some(&c) => self.entrust(i, c),
                None => _ = self.judge(i, made[0]),
            }
        }
    }

    /// Forgets the cells that are gone; the points that they were witness of.
    fn dismiss(&mut self) -> Vec<u32> {
        let Some(voronoi) = self.voronoi.as_ref() else { return Vec::new() };
        let mut orphans = Vec::new();
        for &c in voronoi.delaunay.gone() {
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
            self.lives[c] += 1;
        }
        for &i in &orphans {
            self.witness[i as usize] = NONE;
        }
        orphans
    }
}

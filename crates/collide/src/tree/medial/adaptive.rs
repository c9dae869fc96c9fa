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

use super::spheres::{CoverPoints, MedialBall, Want};
use super::voronoi::Voronoi;
use crate::tree::ball::Ball;
use crate::tree::builder::StageCount;
use crate::{Aabb, MeshDistance, Vec3};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

const NONE: u32 = u32::MAX;
/// A ball is told to hold a point up to this part of its radius, and is grown by it.
const SLACK: f64 = 1e-9;
/// Sites to begin with, as a part of the balls asked for. A surface of `n` sites has about `3 n` inner balls.
const FIRST: usize = 12;

/// Balls that hold all cover points of `region` (indices), refined as `want` says, and what was done. Of the INTERNAL
/// ones those that hold some of the points. The order of the balls is a function of the input alone.
///
/// For the regions of a tree it is cheaper to refine one [`Axis`] of all points, and to hand each region the balls that
/// hold its points ([`Axis::holders`]).
pub(in crate::tree) fn adaptive(
    cover: &CoverPoints,
    region: &[u32],
    distance: &MeshDistance,
    want: &Want,
) -> (Vec<MedialBall>, Counts) {
    let mut axis = Axis::new(cover, region, distance, want.least / FIRST);
    axis.refine(want);
    (axis.balls(), axis.counts())
}

/// What a refinement did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::tree) struct Counts {
    pub inserted: u64,
    pub internal: u64,
    pub cover: u64,
    /// Cover points that only a ball of no size holds, since floating point gives no other.
    pub alone: u64,
}

impl Counts {
    /// As an account of `level`.
    pub fn stages(&self, level: u32) -> Vec<StageCount> {
        [
            ("sites inserted", self.inserted),
            ("internal balls", self.internal),
            ("cover balls", self.cover),
            ("points alone", self.alone),
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
    pub fn new(cover: &CoverPoints, region: &[u32], distance: &'a MeshDistance, sites: usize) -> Axis<'a> {
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
        for i in 0..axis.points.len() as u32 {
            hint = axis.judge(i, hint);
        }
        axis
    }

    /// Refines until the worst error is below the target and there are enough balls, or no more may be inserted.
    pub fn refine(&mut self, want: &Want) {
        let most = self.inserted + want.most;
        while self.inserted < most {
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
        for c in 0..self.first.len() as u32 {
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
            chain(self.first[c], &self.next, &mut orphans);
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

    /// The tetrahedra that the last insertion made.
    fn made(&self) -> Vec<u32> {
        let Some(voronoi) = self.voronoi.as_ref() else { return Vec::new() };
        voronoi.delaunay.made().iter().copied().filter(|&c| voronoi.delaunay.is_finite(c)).collect()
    }

    /// Flags a new cell, if it is INTERNAL.
    fn welcome(&mut self, cell: u32) {
        if self.voronoi.as_ref().and_then(|v| v.ball(cell)).is_some_and(|b| b.internal) {
            self.inner[cell as usize] = true;
            self.internal += 1;
            self.enqueue(cell);
        }
    }

    /// Judges anew the points of a COVER ball.
    fn judge_again(&mut self, cell: u32) {
        if self.inner[cell as usize] || self.first[cell as usize] == NONE {
            return;
        }
        let mut points = Vec::new();
        chain(self.first[cell as usize], &self.next, &mut points);
        self.first[cell as usize] = NONE;
        self.covering -= 1;
        for i in points {
            self.witness[i as usize] = NONE;
            self.judge(i, cell);
        }
    }

    /// Finds a point its witness: the first INTERNAL ball met that holds it, or else the one of least error. The cell it
    /// lies in, walking from `hint`.
    fn judge(&mut self, i: u32, hint: u32) -> u32 {
        let mut best = (f64::INFINITY, NONE);
        let home = self.each_holder(i, hint, |c, axis| {
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
            self.entrust(i, best.1);
        }
        home
    }

    /// Calls `visit` for all cells whose balls hold point `i`, until it says no. The cell it lies in, walking from `hint`.
    fn each_holder(&mut self, i: u32, hint: u32, mut visit: impl FnMut(u32, &mut Self) -> bool) -> u32 {
        let Some(voronoi) = self.voronoi.as_ref() else { return NONE };
        let p = self.points[i as usize];
        let home = voronoi.delaunay.locate(&p, hint);
        self.search += 1;
        self.seen[home as usize] = self.search;
        let mut stack = vec![home];
        while let Some(c) = stack.pop() {
            if self.holds(c, i) && !visit(c, self) {
                break;
            }
            let Some(voronoi) = self.voronoi.as_ref() else { break };
            for n in voronoi.delaunay.across(c) {
                // on through slivers that have no ball
                let on = voronoi.delaunay.is_finite(n) && voronoi.ball(n).is_none_or(|b| holds(&b.ball, &p));
                if on && self.seen[n as usize] != self.search {
                    self.seen[n as usize] = self.search;
                    stack.push(n);
                }
            }
        }
        home
    }

    /// Makes a ball the witness of a point.
    fn entrust(&mut self, i: u32, cell: u32) {
        let c = cell as usize;
        if self.first[c] == NONE && !self.inner[c] {
            self.covering += 1;
            self.enqueue(cell);
        }
        self.witness[i as usize] = cell;
        self.next[i as usize] = self.first[c];
        self.first[c] = i;
    }

    /// Queues a flagged ball, once.
    fn enqueue(&mut self, cell: u32) {
        let life = self.lives[cell as usize];
        if self.queued[cell as usize] != life {
            self.queued[cell as usize] = life;
            let error = self.error(cell);
            self.queue.push((error.to_bits(), Reverse(cell), life));
        }
    }

    fn is_flagged(&self, cell: u32) -> bool {
        self.inner[cell as usize] || self.first[cell as usize] != NONE
    }

    /// Whether a flagged ball is of the region: it holds some point of it.
    fn matters(&self, cell: u32) -> bool {
        !self.partial || self.first[cell as usize] != NONE || (0..self.points.len() as u32).any(|i| self.holds(cell, i))
    }

    /// Upper bound of how far the ball reaches out of the solid, metres.
    fn error(&mut self, cell: u32) -> f64 {
        let Some(voronoi) = self.voronoi.as_mut() else { return 0.0 };
        let signed = voronoi.signed_distance(cell);
        voronoi.ball(cell).map_or(0.0, |b| (b.ball.radius + signed).max(0.0))
    }

    fn holds(&self, cell: u32, i: u32) -> bool {
        self.voronoi.as_ref().and_then(|v| v.ball(cell)).is_some_and(|b| holds(&b.ball, &self.points[i as usize]))
    }

    fn grow_tables(&mut self) {
        let count = self.voronoi.as_ref().map_or(0, |v| v.delaunay.cell_count());
        self.first.resize(count, NONE);
        self.inner.resize(count, false);
        self.lives.resize(count, 0);
        self.queued.resize(count, NONE);
        self.seen.resize(count, 0);
    }
}

fn holds(ball: &Ball, p: &Vec3) -> bool {
    (p - ball.center).norm_squared() <= ball.radius * ball.radius * (1.0 + SLACK)
}

/// Appends a chain of points to `all`.
fn chain(mut i: u32, next: &[u32], all: &mut Vec<u32>) {
    while i != NONE {
        all.push(i);
        i = next[i as usize];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriMesh;

    fn check(mesh: &TriMesh, want: &Want) -> (Vec<MedialBall>, Counts) {
        let cover = CoverPoints::on(mesh, 2000);
        let distance = MeshDistance::new(mesh);
        let region: Vec<u32> = (0..cover.points.len() as u32).collect();
        let (balls, counts) = adaptive(&cover, &region, &distance, want);
        let far = |b: &MedialBall, p: &Vec3| (b.ball.center - p).norm() - b.ball.radius;
        for p in &cover.points {
            assert!(balls.iter().any(|b| far(b, p) <= 0.0), "{p} is bare");
        }
        for b in &balls {
            let s = distance.closest(&b.ball.center).signed_distance;
            assert!((b.outward - (b.ball.radius + s).max(0.0)).abs() <= 1e-7 * b.ball.radius);
        }
        assert_eq!(balls.len() as u64, counts.internal + counts.cover + counts.alone);
        let mut axis = Axis::new(&cover, &region, &distance, want.least / FIRST);
        axis.refine(want);
        assert_eq!(axis.balls(), balls);
        for (p, holders) in cover.points.iter().zip(axis.holders()) {
            let strictly: Vec<u32> =
                (0..balls.len() as u32).filter(|&k| far(&balls[k as usize], p) < -1e-6 * mesh.diagonal()).collect();
            assert!(strictly.iter().all(|k| holders.contains(k)), "{p}");
            assert!(!holders.is_empty() && holders.iter().all(|&k| far(&balls[k as usize], p) <= 0.0));
        }
        assert_eq!((balls.clone(), counts), adaptive(&cover, &region, &distance, want));
        (balls, counts)
    }

    #[test]
    fn a_box_is_refined_to_what_is_asked() {
        let mesh = TriMesh::box_(Vec3::new(0.5, 1.0, 0.2));
        let (balls, counts) = check(&mesh, &Want { target: 0.05, least: 100, most: 2000 });
        assert!(counts.inserted < 2000 && balls.len() >= 100, "{counts:?}");
        let worst = balls.iter().map(|b| b.outward).fold(0.0, f64::max);
        assert!(worst < 0.05, "{worst} {counts:?}");
        // no inner ball of the box is larger than half its least side
        assert!(balls.iter().all(|b| b.ball.radius - b.outward <= 0.2 + 1e-9));
    }

    #[test]
    fn more_insertions_than_allowed_are_not_made() {
        let mesh = TriMesh::torus(1.0, 0.3, 48, 24);
        let (_, counts) = check(&mesh, &Want { target: 0.0, least: 0, most: 100 });
        assert_eq!(counts.inserted, 100);
        assert_eq!(counts.alone, 0);
    }

    #[test]
    fn a_region_of_coplanar_points() {
        let mesh = TriMesh::box_(Vec3::new(0.5, 0.5, 0.5));
        let cover = CoverPoints::on(&mesh, 600);
        let region: Vec<u32> = (0..cover.points.len() as u32).filter(|&i| cover.points[i as usize].z == 0.5).collect();
        let distance = MeshDistance::new(&mesh);
        let (balls, _) = adaptive(&cover, &region, &distance, &Want { target: 0.02, least: 50, most: 500 });
        for &i in &region {
            let p = cover.points[i as usize];
            assert!(balls.iter().any(|b| (b.ball.center - p).norm() <= b.ball.radius), "{p} is bare");
        }
        let worst = balls.iter().map(|b| b.outward).fold(0.0, f64::max);
        assert!(worst < 0.02, "{worst}");
    }

    #[test]
    fn public_meshes_are_refined_in_time() {
        let Some(folder) = std::env::var_os("TUMBLE_MESHES") else { return };
        for name in ["spot", "panda_link5", "low/bunny1500", "low/fandisk1500", "low/hand1500", "cow"] {
            let text = std::fs::read_to_string(std::path::Path::new(&folder).join(format!("{name}.obj"))).unwrap();
            let mut mesh = TriMesh::from_obj(&text).unwrap();
            mesh.check_closed().unwrap();
            let scale = mesh.diagonal();
            let cover = CoverPoints::on(&mesh, 8000);
            let distance = MeshDistance::new(&mesh);
            let region: Vec<u32> = (0..cover.points.len() as u32).collect();
            for target in [0.02, 0.01, 0.005] {
                let start = std::time::Instant::now();
                let (balls, counts) = adaptive(&cover, &region, &distance, &Want { target: target * scale, least: 1000, most: 5000 });
                let worst = balls.iter().map(|b| b.outward).fold(0.0, f64::max) / scale;
                let mut axis = Axis::new(&cover, &region, &distance, 80);
                axis.refine(&Want { target: target * scale, least: 1000, most: 5000 });
                axis.balls();
                let t = std::time::Instant::now();
                let h = axis.holders();
                eprintln!("{:?} {}", t.elapsed(), h.iter().map(Vec::len).sum::<usize>() / h.len());
                let t = std::time::Instant::now();
                let (some, counts2) = adaptive(&cover, &region[1000..2000], &distance, &Want { target: target * scale, least: 200, most: 300 });
                eprintln!("part {counts2:?} {} {:?} worst {:.4}", some.len(), t.elapsed(), some.iter().map(|b| b.outward).fold(0.0, f64::max) / scale);
                eprintln!("{name} {target}: {} balls, worst {worst:.4}, {counts:?} {:?}", balls.len(), start.elapsed());
            }
        }
    }
}

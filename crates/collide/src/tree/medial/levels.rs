//! The levels of the tree, from the root down.

use super::adaptive::Axis;
use super::candidates::touching;
use super::gaps::add_gaps;
use super::group::Groups;
use super::optimise::Exchange;
use super::reduce::{WAYS, reduce};
use super::refit::{Fit, own};
use super::site::Site;
use super::spheres::{CoverPoints, Want};
use crate::tree::ball::{Ball, around_points};
use crate::tree::builder::{Cell, Job, StageCount};
use crate::tree::close::closed;
use rayon::prelude::*;
use std::sync::Mutex;

/// Candidates per region: medial balls, and balls that touch it.
const MEDIAL: usize = 200;
const TOUCHING: usize = 100;
/// Sites that the medial balls begin with.
const FIRST_SITES: usize = 100;
/// Medial balls for each region that is to be divided, and bounds of their number.
const BALLS_EACH: f64 = 120.0;
const LEAST_BALLS: f64 = 1000.0;
const MOST_BALLS: f64 = 8000.0;
/// Points of a region that the reducers look at; the last refit looks at all.
const LOOKED_AT: usize = 1200;
/// Exchanges tried per ball, and in one run.
const TRIES: usize = 3;
const MOST_TRIES: usize = 2000;
/// Cover points: at least, at most while there are 40 for each leaf, at most while there are ten.
const POINTS: (f64, f64, f64) = (6000.0, 20_000.0, 60_000.0);
/// The balls that a ball is divided into stay within what it would be if it reached out so much farther than the worst
/// of its level.
const FENCE: f64 = 1.15;
/// Shares of the work: dividing, exchanging, filling gaps.
const SHARES: [f64; 3] = [0.4, 0.3, 0.25];
/// Sizes of the gaps that are filled, one after the other; parts of the mesh's diagonal.
const GAPS: [f64; 4] = [8e-3, 4e-3, 2e-3, 1e-3];

pub(super) struct Levels<'a> {
    job: &'a Job<'a>,
    cover: CoverPoints,
    /// Per cover point, the ball that touches there.
    candidates: Vec<Site>,
    /// Adaptive medial balls, and per cover point those that hold it.
    medial: Vec<Site>,
    holders: Vec<Vec<u32>>,
    scale: f64,
    done: Mutex<f64>,
    pub stages: Vec<StageCount>,
}

/// A part covered by few balls.
struct Divided {
    fit: Fit,
    /// The way of reducing that won.
    way: Option<usize>,
    exchanges: u64,
}

impl<'a> Levels<'a> {
    pub fn new(job: &'a Job<'a>) -> Levels<'a> {
        let scale = job.mesh.diagonal();
        let balls = (f64::from(job.settings.branch)).powi(job.settings.depth as i32);
        let points = (balls * 40.0).clamp(POINTS.0, POINTS.1).max((balls * 10.0).min(POINTS.2));
        let cover = CoverPoints::on(job.mesh, points as usize);
        let mut levels = Levels {
            job,
            cover,
            candidates: Vec::new(),
            medial: Vec::new(),
            holders: Vec::new(),
            scale,
            done: Mutex::new(0.0),
            stages: Vec::new(),
        };
        levels.touch();
        levels
    }

    /// Candidates for the cover points that have none yet.
    fn touch(&mut self) {
        let new = self.candidates.len() as u32..self.cover.points.len() as u32;
        let touching = |i| match self.job.progress.stopped() {
            true => Site { center: self.cover.points[i as usize], depth: 0.0, fence: None },
            false => touching(&self.cover, i, self.job.distance, 0.5 * self.scale),
        };
        let more: Vec<Site> = new.into_par_iter().map(touching).collect();
        self.candidates.extend(more);
    }

    /// The whole of it.
    pub fn cells(&mut self) -> Cell {
        let (fit, parents) = self.leaves();
        let balls = closed(self.job.mesh, self.balls(&fit), self.job.progress);
        nested(&balls, &parents)
    }

    fn balls(&self, fit: &Fit) -> Vec<Ball> {
        fit.sites.iter().zip(&fit.parts).map(|(s, part)| s.ball(&own(&self.cover.points, part))).collect()
    }

    /// The leaves, and of each level the balls' parents.
    fn leaves(&mut self) -> (Fit, Vec<Vec<usize>>) {
        let all: Vec<u32> = (0..self.cover.points.len() as u32).collect();
        let alone = self.alone(&all);
        if alone.worst() <= self.enough() {
            return (alone, Vec::new());
        }
        let mut axis = Axis::new(&self.cover, &all, self.job.distance, FIRST_SITES, self.job.progress);
        let site = Site::at(self.cover.points[0], self.job.distance);
        let mut fit = Fit { sites: vec![site], parts: vec![all], errors: vec![self.scale] };
        let (mut parents, mut groups) = (Vec::new(), None);
        for level in 1..=self.job.settings.depth {
            if fit.worst() <= self.enough() || self.job.progress.stopped() {
                break;
            }
            let room = fit.sites.len() * self.job.settings.branch as usize;
            self.adapt(&mut axis, &fit, level);
            let (next, of) = self.next_level(&fit, level);
            let mut next_groups = self.grouped(&next, &of, groups.take());
            fit = self.exchanged(next, level, room, next_groups.as_mut());
            if level == self.job.settings.depth || fit.worst() <= self.enough() {
                fit = self.filled(fit, level, room, next_groups.as_mut());
            }
            fit.sites.iter_mut().for_each(|s| s.fence = None);
            let kept = fit.drop_empty();
            parents.push(match &mut next_groups {
                Some(groups) => groups.keep(&kept),
                None => vec![0; fit.sites.len()],
            });
            groups = next_groups;
        }
        (fit, parents)
    }

    /// One ball for all points.
    fn alone(&self, all: &[u32]) -> Fit {
        let center = around_points(&self.cover.points).center;
        let mut fit = Fit::of(vec![Site::at(center, self.job.distance)], &self.cover.points, all);
        fit.refit(4, &self.cover.points, all, self.job.distance);
        fit
    }

    /// An outward error that needs no dividing, metres.
    fn enough(&self) -> f64 {
        self.job.settings.error * self.scale
    }

    /// The balls of a level in those of the level above, from the second on.
    fn grouped(&self, fit: &Fit, of: &[usize], above: Option<Groups>) -> Option<Groups> {
        // the first level's balls lie in the root and nowhere else
        let root = of.iter().all(|g| *g == 0);
        (!root).then(|| Groups::new(self.balls(fit), of.to_vec(), self.job.settings, above, self.job.distance))
    }

    /// The leaves once more, with cover points where the surface between the others was left bare.
    fn filled(&mut self, mut fit: Fit, level: u32, room: usize, mut groups: Option<&mut Groups>) -> Fit {
        for (n, gap) in GAPS.into_iter().enumerate().take_while(|_| !self.job.progress.stopped()) {
            let balls = self.balls(&fit);
            let added = add_gaps(&mut self.cover, self.job.mesh, &balls, gap * self.scale, self.job.progress);
            self.count(level, "gaps filled", added as u64);
            self.touch();
            fit.refit_all(2, &self.cover.points, self.job);
            if n == 1 {
                fit = self.exchanged(fit, level, room, groups.as_deref_mut());
            }
            self.report(SHARES[2] / GAPS.len() as f64);
        }
        fit
    }

    /// Refines the medial balls for the division of a level's balls.
    fn adapt(&mut self, axis: &mut Axis, fit: &Fit, level: u32) {
        let parts = fit.errors.len() as f64;
        let least = (parts * BALLS_EACH).clamp(LEAST_BALLS, MOST_BALLS) as usize;
        // half the mean error of the level
        let target = 0.5 * fit.errors.iter().sum::<f64>() / parts;
        axis.refine(&Want { target, least, most: least / 2 });
        let balls = axis.balls();
        self.medial = balls.iter().map(|b| Site::about(b.ball.center, self.job.distance)).collect();
        self.holders = axis.holders();
        self.stages.extend(axis.counts().stages(level));
    }

    /// Candidates for a region: medial balls that hold points of it, and balls that touch it.
    fn candidates_of(&self, part: &[u32], fence: Option<Ball>) -> Vec<Site> {
        let mut holders: Vec<u32> =
            every(part, LOOKED_AT).iter().flat_map(|&i| self.holders[i as usize].iter().copied()).collect();
        holders.sort_unstable();
        holders.dedup();
        let medial = every(&holders, MEDIAL).into_iter().map(|k| self.medial[k as usize]);
        let touching = every(part, TOUCHING).into_iter().map(|i| self.candidates[i as usize]);
        medial.chain(touching).map(|site| Site { fence, ..site }).collect()
    }

    /// Balls exchanged among all regions of a level, as far as its groups allow, and refitted together.
    fn exchanged(&mut self, mut fit: Fit, level: u32, room: usize, groups: Option<&mut Groups>) -> Fit {
        let mut groups = groups;
        if let Some(groups) = groups.as_deref_mut() {
            groups.balls = self.balls(&fit);
            groups.refit(self.job.distance);
            (0..fit.sites.len()).for_each(|k| fit.sites[k].fence = groups.fence(k));
        }
        let exchange = self.exchange(room.max(fit.sites.len()));
        let (mut fit, exchanges) = exchange.run(fit, groups);
        fit.refit_all(3, &self.cover.points, self.job);
        self.count(level, "exchanges across regions", exchanges);
        self.report(SHARES[1] / f64::from(self.job.settings.depth));
        fit
    }

    fn exchange(&self, most: usize) -> Exchange<'_> {
        Exchange {
            points: &self.cover.points,
            candidates: &self.candidates,
            distance: self.job.distance,
            most,
            enough: self.enough(),
            tries: (TRIES * most).min(MOST_TRIES),
            progress: self.job.progress,
        }
    }

    /// Divides the balls of the deepest level.
    fn next_level(&mut self, fit: &Fit, level: u32) -> (Fit, Vec<usize>) {
        let divided: Vec<Divided> = fit
            .parts
            .par_iter()
            .zip(&fit.sites)
            .zip(&fit.errors)
            .map(|((part, site), error)| {
                if *error <= self.enough() || self.job.progress.stopped() {
                    let fit = Fit { sites: vec![*site], parts: vec![part.clone()], errors: vec![*error] };
                    Divided { fit, way: None, exchanges: 0 }
                } else {
                    // children stay within what the worst of the level reaches
                    let reach = site.depth + FENCE * fit.worst();
                    let fence = (level > 1).then_some(Ball { center: site.center, radius: reach });
                    self.divided(part, fence)
                }
            })
            .collect();
        for (n, way) in WAYS.iter().enumerate() {
            self.count(level, way, divided.iter().filter(|d| d.way == Some(n)).count() as u64);
        }
        self.count(level, "exchanges", divided.iter().map(|d| d.exchanges).sum());
        let mut next = Fit::default();
        let mut of = Vec::new();
        for (parent, Divided { fit, .. }) in divided.into_iter().enumerate() {
            of.extend(fit.sites.iter().map(|_| parent));
            next.sites.extend(fit.sites);
            next.parts.extend(fit.parts);
            next.errors.extend(fit.errors);
        }
        self.count(level, "balls", next.sites.len() as u64);
        (next, of)
    }

    /// The points of a part covered by at most `branch` balls.
    fn divided(&self, part: &[u32], fence: Option<Ball>) -> Divided {
        let most = self.job.settings.branch as usize;
        let points = &self.cover.points;
        let some = every(part, LOOKED_AT);
        let candidates = self.candidates_of(part, fence);
        let (mut fit, way) = reduce(&candidates, points, &some, most, self.job.distance);
        fit.refit(2, points, &some, self.job.distance);
        let (mut fit, exchanges) = self.exchange(most).run(fit, None);
        fit.assign(points, part);
        fit.refit(2, points, part, self.job.distance);
        fit.drop_empty();
        self.report(SHARES[0] * part.len() as f64 / (points.len() * self.job.settings.depth as usize) as f64);
        Divided { fit, way: Some(way), exchanges }
    }

    fn count(&mut self, level: u32, stage: &str, count: u64) {
        self.stages.push(StageCount { level, stage: stage.into(), count });
    }

    /// A further share of the work is done.
    fn report(&self, share: f64) {
        if let Ok(mut done) = self.done.lock() {
            *done = (*done + share).min(1.0);
            self.job.progress.at(*done);
        }
    }
}

/// Nested cells over the leaves' balls; `parents` of each level, the deepest last.
fn nested(balls: &[Ball], parents: &[Vec<usize>]) -> Cell {
    let mut below: Vec<Option<Cell>> = balls.iter().map(|ball| Some(Cell::Leaf(*ball))).collect();
    for of in parents.iter().rev() {
        let mut inside: Vec<Vec<Cell>> = Vec::new();
        inside.resize_with(of.iter().max().map_or(0, |p| p + 1), Vec::new);
        for (parent, cell) in of.iter().zip(below) {
            inside[*parent].extend(cell);
        }
        // a ball all of whose points went to others has no cells
        below = inside.into_iter().map(|cells| (!cells.is_empty()).then_some(Cell::Inner(cells))).collect();
    }
    below.into_iter().flatten().next().unwrap_or(Cell::Inner(Vec::new()))
}

/// At most `most` of the items, evenly.
fn every(items: &[u32], most: usize) -> Vec<u32> {
    items.iter().copied().step_by(items.len().div_ceil(most).max(1)).collect()
}

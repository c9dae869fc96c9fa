//! The levels of the tree, from the root down.

use super::candidates::touching;
use super::expand::expand;
use super::gaps::add_gaps;
use super::group::Groups;
use super::optimise::Exchange;
use super::refit::{Fit, keep, own};
use super::site::Site;
use super::spheres::CoverPoints;
use crate::Vec3;
use crate::tree::ball::Ball;
use crate::tree::close::closed;
use crate::tree::builder::{Cell, Job, StageCount};
use rayon::prelude::*;
use std::sync::Mutex;

/// Candidates per region.
const CANDIDATES: usize = 300;
/// Points of a region that the reducers look at; the last refit looks at all.
const LOOKED_AT: usize = 1200;
/// Exchanges tried per ball.
const TRIES: usize = 3;
/// Sizes of the gaps that are filled, one after the other; parts of the mesh's diagonal.
const GAPS: [f64; 4] = [8e-3, 4e-3, 2e-3, 1e-3];

pub(super) struct Levels<'a> {
    job: &'a Job<'a>,
    cover: CoverPoints,
    candidates: Vec<Site>,
    scale: f64,
    done: Mutex<f64>,
    pub stages: Vec<StageCount>,
}

impl<'a> Levels<'a> {
    pub fn new(job: &'a Job<'a>) -> Levels<'a> {
        let scale = job.mesh.diagonal();
        let balls = (f64::from(job.settings.branch)).powi(job.settings.depth as i32);
        let cover = CoverPoints::on(job.mesh, (balls * 40.0).clamp(6000.0, 20_000.0) as usize);
        let mut levels =
            Levels { job, cover, candidates: Vec::new(), scale, done: Mutex::new(0.0), stages: Vec::new() };
        levels.touch();
        levels
    }

    /// Candidates for the cover points that have none yet.
    fn touch(&mut self) {
        let new = self.candidates.len() as u32..self.cover.points.len() as u32;
        let more: Vec<Site> =
            new.into_par_iter().map(|i| touching(&self.cover, i, self.job.distance, 0.5 * self.scale)).collect();
        self.candidates.extend(more);
    }

    /// The whole of it.
    pub fn cells(&mut self) -> Cell {
        let (fit, parents) = self.leaves();
        let balls = closed(self.job.mesh, self.balls(&fit));
        nested(&balls, &parents)
    }

    fn balls(&self, fit: &Fit) -> Vec<Ball> {
        fit.sites.iter().zip(&fit.parts).map(|(s, part)| s.ball(&own(&self.cover.points, part))).collect()
    }

    /// The leaves, and of each level the balls' parents.
    fn leaves(&mut self) -> (Fit, Vec<Vec<usize>>) {
        let all: Vec<u32> = (0..self.cover.points.len() as u32).collect();
        let center = Site::at(self.cover.points[0], self.job.distance);
        let mut fit = Fit { sites: vec![center], parts: vec![all], errors: vec![self.scale] };
        let enough = self.job.settings.error * self.scale;
        let mut parents = Vec::new();
        for level in 1..=self.job.settings.depth {
            if fit.worst() <= enough {
                break;
            }
            let (next, of) = self.next_level(&fit, level, enough);
            let mut groups = (level > 1).then(|| {
                let room = self.job.settings.branch as usize;
                Groups::new(self.balls(&next), of.clone(), room, slack(), self.job.distance)
            });
            self.debug(&next, "level");
            fit = self.exchanged(next, level, &mut groups);
            if level == self.job.settings.depth {
                for gap in GAPS {
                    let balls = self.balls(&fit);
                    let added = add_gaps(&mut self.cover, self.job.mesh, &balls, gap * self.scale);
                    self.touch();
                    fit.refit_all(2, &self.cover.points, self.job.distance);
                    self.debug(&fit, &format!("gaps {added}"));
        self.debug_groups(&fit, &groups, "gaps");
                    if gap == GAPS[1] {
                        fit = self.exchanged(fit, level, &mut groups);
                    }
                }
            }
            let kept = fit.drop_empty();
            fit.sites.iter_mut().for_each(|s| s.fence = None);
            let mut of = groups.map_or(of, |g| g.of);
            keep(&mut of, &kept);
            parents.push(of);
        }
        (fit, parents)
    }

    fn exchanged(&mut self, mut fit: Fit, level: u32, groups: &mut Option<Groups>) -> Fit {
        if let Some(groups) = groups {
            groups.balls = self.balls(&fit);
            groups.worst(self.job.distance);
            (0..fit.sites.len()).for_each(|k| fit.sites[k].fence = groups.fence(k));
        }
        let exchange = Exchange {
            points: &self.cover.points,
            candidates: &self.candidates,
            distance: self.job.distance,
            most: fit.sites.len(),
            tries: 3 * fit.sites.len(),
        };
        self.debug_groups(&fit, groups, "before");
        let (mut fit, wins) = exchange.run(fit, groups);
        self.debug_groups(&fit, groups, "after");
        self.debug(&fit, &format!("exchanges {wins}"));
        fit.refit_all(3, &self.cover.points, self.job.distance);
        self.debug(&fit, "refit");
        self.debug_groups(&fit, groups, "refit");
        self.stages.push(StageCount { level, stage: "exchanges won across".into(), count: wins });
        fit
    }

    fn debug_groups(&self, fit: &Fit, groups: &Option<Groups>, what: &str) {
        if std::env::var_os("DBG").is_none() { return; }
        if let Some(g) = groups {
            let mut g = g.clone();
            g.balls = self.balls(fit);
            let w = g.worst(self.job.distance);
            eprintln!("   {what} budget {:.4} worst {:.4}", g.budget / self.scale, w / self.scale);
        }
    }

    fn debug(&self, fit: &Fit, what: &str) {
        if std::env::var_os("DBG").is_some() {
            let mut e: Vec<f64> = fit.errors.iter().map(|e| e / self.scale).collect();
            e.sort_by(|a, b| b.total_cmp(a));
            let n = e.len();
            eprintln!("{what}: {n} balls, errors {:.4} {:.4} {:.4} {:.4} {:.4}", e[0], e[n / 8], e[n / 4], e[n / 2], e[n - 1]);
        }
    }

    /// Divides the balls of the deepest level.
    fn next_level(&mut self, fit: &Fit, level: u32, enough: f64) -> (Fit, Vec<usize>) {
        let divided: Vec<(Fit, u64)> = fit
            .parts
            .par_iter()
            .zip(&fit.sites)
            .zip(&fit.errors)
            .map(|((part, site), error)| {
                if *error <= enough {
                    (Fit { sites: vec![*site], parts: vec![part.clone()], errors: vec![*error] }, 0)
                } else {
                    self.divided(part)
                }
            })
            .collect();
        let wins = divided.iter().map(|f| f.1).sum();
        let mut next = Fit::default();
        let mut of = Vec::new();
        for (parent, (fit, _)) in divided.into_iter().enumerate() {
            of.extend(fit.sites.iter().map(|_| parent));
            next.sites.extend(fit.sites);
            next.parts.extend(fit.parts);
            next.errors.extend(fit.errors);
        }
        self.stages.push(StageCount { level, stage: "exchanges won".into(), count: wins });
        self.stages.push(StageCount { level, stage: "balls".into(), count: next.sites.len() as u64 });
        (next, of)
    }

    /// The points of a part covered by at most `branch` balls.
    fn divided(&self, part: &[u32]) -> (Fit, u64) {
        let most = self.job.settings.branch as usize;
        let points = &self.cover.points;
        let some = every(part, LOOKED_AT);
        let candidates: Vec<Site> =
            every(part, CANDIDATES).iter().map(|&i| self.candidates[i as usize]).collect();
        let chosen = expand(&candidates, &own(points, &some), most);
        let mut fit = Fit::of(chosen, points, &some);
        fit.refit(4, points, &some, self.job.distance);
        let exchange = Exchange {
            points,
            candidates: &self.candidates,
            distance: self.job.distance,
            most,
            tries: TRIES * most,
        };
        let (mut fit, wins) = exchange.run(fit, &mut None);
        fit.assign(points, part);
        fit.refit(2, points, part, self.job.distance);
        fit.drop_empty();
        self.report(part.len());
        (fit, wins)
    }

    fn report(&self, points: usize) {
        let share = points as f64 / (self.cover.points.len() * self.job.settings.depth as usize) as f64;
        if let Ok(mut done) = self.done.lock() {
            *done = (*done + 0.95 * share).min(0.95);
            self.job.progress.at(*done);
        }
    }
}

/// Nested cells over the leaves' balls; `parents` of each level, the deepest last.
fn nested(balls: &[Ball], parents: &[Vec<usize>]) -> Cell {
    let mut below: Vec<Cell> = balls.iter().map(|ball| Cell::Leaf(*ball)).collect();
    for of in parents.iter().rev() {
        let mut inside: Vec<Vec<Cell>> = Vec::new();
        inside.resize_with(of.iter().max().map_or(0, |p| p + 1), Vec::new);
        for (parent, cell) in of.iter().zip(below) {
            inside[*parent].push(cell);
        }
        below = inside.into_iter().map(Cell::Inner).collect();
    }
    below.pop().unwrap_or(Cell::Inner(Vec::new()))
}

fn slack() -> f64 {
    std::env::var("SLACK").ok().and_then(|s| s.parse().ok()).unwrap_or(1.1)
}

/// At most `most` of the items, evenly.
fn every(items: &[u32], most: usize) -> Vec<u32> {
    items.iter().copied().step_by(items.len().div_ceil(most).max(1)).collect()
}

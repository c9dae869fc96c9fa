//! The levels of the tree, from the root down.

use super::candidates::touching;
use super::expand::expand;
use super::optimise::Exchange;
use super::refit::{Fit, moved};
use super::site::Site;
use super::spheres::CoverPoints;
use crate::tree::ball::Ball;
use crate::tree::builder::{Cell, Job, StageCount};
use crate::{MeshDistance, Vec3};
use rayon::prelude::*;
use std::sync::Mutex;

/// Candidates per region.
const CANDIDATES: usize = 300;
/// Points of a region that the reducers look at; the last refit looks at all.
const LOOKED_AT: usize = 1200;
/// Exchanges tried per region.
const TRIES: usize = 24;

/// A ball of a level: its site and the points it is for.
#[derive(Clone, Debug)]
struct Node {
    parent: usize,
    site: Site,
    points: Vec<u32>,
    error: f64,
}

pub(super) struct Levels<'a> {
    job: &'a Job<'a>,
    cover: CoverPoints,
    candidates: Vec<Site>,
    levels: Vec<Vec<Node>>,
    scale: f64,
    done: Mutex<f64>,
    pub stages: Vec<StageCount>,
}

impl<'a> Levels<'a> {
    pub fn new(job: &'a Job<'a>) -> Levels<'a> {
        let scale = job.mesh.diagonal();
        let balls = (f64::from(job.settings.branch)).powi(job.settings.depth as i32);
        let cover = CoverPoints::on(job.mesh, (balls * 40.0).clamp(6000.0, 20_000.0) as usize);
        let candidates = (0..cover.points.len() as u32)
            .into_par_iter()
            .map(|i| touching(&cover, i, job.distance, 0.5 * scale))
            .collect();
        let points = (0..cover.points.len() as u32).collect();
        let root = Node { parent: 0, site: Site { center: Vec3::zeros(), depth: 0.0 }, points, error: scale };
        Levels { job, cover, candidates, levels: vec![vec![root]], scale, done: Mutex::new(0.0), stages: Vec::new() }
    }

    /// Divides the balls of the deepest level, unless that is the last.
    pub fn next_level(&mut self) -> bool {
        let level = self.levels.len() as u32;
        let settings = self.job.settings;
        if level > settings.depth {
            return false;
        }
        let last = self.levels.last().map_or(&[][..], |l| l);
        let enough = settings.error * self.scale;
        if last.iter().all(|n| n.error <= enough) {
            return false;
        }
        let fits: Vec<(Fit, u64)> = last
            .par_iter()
            .map(|node| if node.error <= enough { self.kept(node) } else { self.divided(node) })
            .collect();
        let wins = fits.iter().map(|f| f.1).sum();
        let nodes: Vec<Node> = fits
            .into_iter()
            .enumerate()
            .flat_map(|(parent, (fit, _))| {
                let parts = fit.parts.into_iter().zip(fit.errors);
                fit.sites
                    .into_iter()
                    .zip(parts)
                    .map(move |(site, (points, error))| Node { parent, site, points, error })
            })
            .collect();
        self.stages.push(StageCount { level, stage: "exchanges won".into(), count: wins });
        self.stages.push(StageCount { level, stage: "balls".into(), count: nodes.len() as u64 });
        self.levels.push(nodes);
        self.relax();
        true
    }

    fn kept(&self, node: &Node) -> (Fit, u64) {
        (Fit { sites: vec![node.site], parts: vec![node.points.clone()], errors: vec![node.error] }, 0)
    }

    /// The points of a node covered by at most `branch` balls.
    fn divided(&self, node: &Node) -> (Fit, u64) {
        let most = self.job.settings.branch as usize;
        let points = &self.cover.points;
        let some = every(&node.points, LOOKED_AT);
        let looked: Vec<Vec3> = some.iter().map(|&i| points[i as usize]).collect();
        let mut candidates: Vec<Site> =
            every(&node.points, CANDIDATES).iter().map(|&i| self.candidates[i as usize]).collect();
        candidates.push(node.site);
        let chosen = expand(&candidates, &looked, most);
        let fit = Fit::assigned(chosen, points, &some).refit(4, points, &some, self.job.distance);
        let exchange = Exchange {
            points,
            region: &some,
            candidates: &candidates,
            distance: self.job.distance,
            most,
            tries: TRIES,
        };
        let (fit, wins) = exchange.run(fit);
        let fit = Fit::assigned(fit.sites, points, &node.points).refit(3, points, &node.points, self.job.distance);
        self.report(node.points.len());
        (fit, wins)
    }

    /// All balls of the deepest level refitted together, across regions.
    fn relax(&mut self) {
        for _ in 0..3 {
            self.reassign();
            let (points, distance) = (&self.cover.points, self.job.distance);
            if let Some(nodes) = self.levels.last_mut() {
                nodes.par_iter_mut().for_each(|n| n.refit(points, distance));
            }
        }
        self.reassign();
    }

    fn reassign(&mut self) {
        let Some(nodes) = self.levels.last_mut() else { return };
        let sites: Vec<Site> = nodes.iter().map(|n| n.site).collect();
        let owner: Vec<usize> = self.cover.points.par_iter().map(|p| least(&sites, p)).collect();
        nodes.iter_mut().for_each(|n| n.points.clear());
        for (i, k) in owner.into_iter().enumerate() {
            nodes[k].points.push(i as u32);
        }
        nodes.retain(|n| !n.points.is_empty());
        for n in nodes {
            n.error = n.site.worst(&own(&self.cover.points, &n.points)).max(0.0);
        }
    }

    fn report(&self, points: usize) {
        let share = points as f64 / (self.cover.points.len() * self.job.settings.depth as usize) as f64;
        if let Ok(mut done) = self.done.lock() {
            *done = (*done + 0.95 * share).min(0.95);
            self.job.progress.at(*done);
        }
    }

    /// The balls of the deepest level and their parents.
    pub fn leaves(&self) -> (Vec<Ball>, Vec<usize>) {
        let nodes = self.levels.last().map_or(&[][..], |l| l);
        (
            nodes.iter().map(|n| n.site.ball(&own(&self.cover.points, &n.points))).collect(),
            nodes.iter().map(|n| n.parent).collect(),
        )
    }

    /// Nested cells over the leaves' balls.
    pub fn cells(&self, balls: &[Ball], parents: &[usize]) -> Cell {
        let mut below: Vec<(usize, Cell)> =
            parents.iter().zip(balls).map(|(p, ball)| (*p, Cell::Leaf(*ball))).collect();
        for level in (0..self.levels.len() - 1).rev() {
            let nodes = &self.levels[level];
            let mut inside: Vec<Vec<Cell>> = nodes.iter().map(|_| Vec::new()).collect();
            for (parent, cell) in below {
                inside[parent].push(cell);
            }
            below = nodes
                .iter()
                .zip(inside)
                .filter(|(_, cells)| !cells.is_empty())
                .map(|(n, cells)| (n.parent, Cell::Inner(cells)))
                .collect();
        }
        below.pop().map_or(Cell::Inner(Vec::new()), |(_, cell)| cell)
    }
}

impl Node {
    fn refit(&mut self, points: &[Vec3], distance: &MeshDistance) {
        self.site = moved(self.site, &own(points, &self.points), distance);
    }
}

fn own(points: &[Vec3], part: &[u32]) -> Vec<Vec3> {
    part.iter().map(|&i| points[i as usize]).collect()
}

/// At most `most` of the items, evenly.
fn every(items: &[u32], most: usize) -> Vec<u32> {
    items.iter().copied().step_by(items.len().div_ceil(most).max(1)).collect()
}

fn least(sites: &[Site], p: &Vec3) -> usize {
    let mut best = (f64::INFINITY, 0);
    for (k, site) in sites.iter().enumerate() {
        let need = site.need(p);
        if need < best.0 {
            best = (need, k);
        }
    }
    best.1
}

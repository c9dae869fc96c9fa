//! Construction of the levels of the tree, starting at the root.

use super::adaptive::MedialAxis;
use super::candidates::touching;
use super::group::Groups;
use super::optimize::Exchange;
use super::reduce::{METHODS, reduce};
use super::refit::{Fit, points_of};
use super::site::Site;
use super::types::{CoverPoints, RefineGoal};
use super::uncovered::add_uncovered;
use crate::tree::builder::{Cell, Job, StageCount};
use crate::tree::grow_to_cover::grown_to_cover;
use crate::tree::sphere::{Sphere, around_points};
use rayon::prelude::*;
use std::sync::Mutex;

/// Maximum number of candidates per region: medial spheres, and touching spheres.
const MEDIAL: usize = 200;
const TOUCHING: usize = 100;
/// Initial number of sites of the medial axis.
const FIRST_SITES: usize = 100;
/// Number of medial spheres for each region that is divided, and the limits of their total.
const SPHERES_PER_REGION: f64 = 120.0;
const MIN_SPHERES: f64 = 1000.0;
const MAX_SPHERES: f64 = 8000.0;
/// Maximum number of points of a region for the reducers; the last refit uses all points.
const MAX_SAMPLES: usize = 1200;
/// Number of exchanges tried per sphere, and the maximum of one run.
const TRIES_PER_SPHERE: usize = 3;
const MAX_TRIES: usize = 2000;
/// Number of cover points: minimum, maximum at 40 per leaf, maximum at ten per leaf.
const POINTS: (f64, f64, f64) = (6000.0, 20_000.0, 60_000.0);
/// The children of a sphere stay within the sphere enlarged to this multiple of the worst error of
/// its level.
const PARENT_BOUND_FACTOR: f64 = 1.15;
/// Fractions of the work: division, exchange, filling of gaps.
const PROGRESS_SHARES: [f64; 3] = [0.4, 0.3, 0.25];
/// Sizes of the gaps that are filled one after the other, as fractions of the mesh's diagonal.
const GAP_SIZES: [f64; 4] = [8e-3, 4e-3, 2e-3, 1e-3];

pub(super) struct Levels<'a> {
    job: &'a Job<'a>,
    cover: CoverPoints,
    /// Per cover point, the sphere that touches there.
    candidates: Vec<Site>,
    /// Adaptive medial spheres, and per cover point the ones that contain it.
    medial: Vec<Site>,
    holders: Vec<Vec<u32>>,
    scale: f64,
    done: Mutex<f64>,
    pub stages: Vec<StageCount>,
}

/// A region covered by few spheres.
struct Divided {
    fit: Fit,
    /// The reduction method that won.
    method: Option<usize>,
    exchanges: u64,
}

impl<'a> Levels<'a> {
    pub fn new(job: &'a Job<'a>) -> Levels<'a> {
        let scale = job.mesh.diagonal();
        let spheres = (f64::from(job.settings.branch)).powi(job.settings.depth as i32);
        let points = (spheres * 40.0).clamp(POINTS.0, POINTS.1).max((spheres * 10.0).min(POINTS.2));
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
        levels.add_candidates();
        levels
    }

    /// Computes candidates for the cover points that have none yet.
    fn add_candidates(&mut self) {
        let new = self.candidates.len() as u32..self.cover.points.len() as u32;
        let touching = |i| match self.job.progress.stopped() {
            true => Site { center: self.cover.points[i as usize], depth: 0.0, parent_bound: None },
            false => touching(&self.cover, i, self.job.distance, 0.5 * self.scale),
        };
        let more: Vec<Site> = new.into_par_iter().map(touching).collect();
        self.candidates.extend(more);
    }

    /// Builds the tree and returns its cells.
    pub fn cells(&mut self) -> Cell {
        let (fit, parents) = self.leaves();
        let spheres = grown_to_cover(self.job.mesh, self.spheres(&fit), self.job.progress);
        nested(&spheres, &parents)
    }

    fn spheres(&self, fit: &Fit) -> Vec<Sphere> {
        fit.sites.iter().zip(&fit.parts).map(|(s, part)| s.sphere(&points_of(&self.cover.points, part))).collect()
    }

    /// Returns the leaves, and for each level the parents of its spheres.
    fn leaves(&mut self) -> (Fit, Vec<Vec<usize>>) {
        let all: Vec<u32> = (0..self.cover.points.len() as u32).collect();
        let alone = self.single_sphere(&all);
        if alone.worst() <= self.target_error() {
            return (alone, Vec::new());
        }
        let mut axis = MedialAxis::new(&self.cover, &all, self.job.distance, FIRST_SITES, self.job.progress);
        let site = Site::at(self.cover.points[0], self.job.distance);
        let mut fit = Fit { sites: vec![site], parts: vec![all], errors: vec![self.scale] };
        let (mut parents, mut groups) = (Vec::new(), None);
        for level in 1..=self.job.settings.depth {
            if fit.worst() <= self.target_error() || self.job.progress.stopped() {
                break;
            }
            let room = fit.sites.len() * self.job.settings.branch as usize;
            self.refine_medial(&mut axis, &fit, level);
            let (next, of) = self.next_level(&fit, level);
            let mut next_groups = self.grouped(&next, &of, groups.take());
            fit = self.with_exchanges(next, level, room, next_groups.as_mut());
            if level == self.job.settings.depth || fit.worst() <= self.target_error() {
                fit = self.with_gaps_filled(fit, level, room, next_groups.as_mut());
            }
            fit.sites.iter_mut().for_each(|s| s.parent_bound = None);
            let kept = fit.drop_empty();
            parents.push(match &mut next_groups {
                Some(groups) => groups.keep(&kept),
                None => vec![0; fit.sites.len()],
            });
            groups = next_groups;
        }
        (fit, parents)
    }

    /// Fits one sphere to all points.
    fn single_sphere(&self, all: &[u32]) -> Fit {
        let center = around_points(&self.cover.points).center;
        let mut fit = Fit::of(vec![Site::at(center, self.job.distance)], &self.cover.points, all);
        fit.refit(4, &self.cover.points, all, self.job.distance);
        fit
    }

    /// Returns the outward error at which a sphere is not divided, meters.
    fn target_error(&self) -> f64 {
        self.job.settings.error * self.scale
    }

    /// Returns the groups of a level, from the second level on.
    fn grouped(&self, fit: &Fit, of: &[usize], above: Option<Groups>) -> Option<Groups> {
        // all spheres of the first level belong to the root
        let root = of.iter().all(|g| *g == 0);
        (!root).then(|| Groups::new(self.spheres(fit), of.to_vec(), self.job.settings, above, self.job.distance))
    }

    /// Refits the leaves with further cover points on the surface that they left uncovered.
    fn with_gaps_filled(&mut self, mut fit: Fit, level: u32, room: usize, mut groups: Option<&mut Groups>) -> Fit {
        for (n, gap) in GAP_SIZES.into_iter().enumerate().take_while(|_| !self.job.progress.stopped()) {
            let spheres = self.spheres(&fit);
            let added = add_uncovered(&mut self.cover, self.job.mesh, &spheres, gap * self.scale, self.job.progress);
            self.count_stage(level, "gaps filled", added as u64);
            self.add_candidates();
            fit.refit_all(2, &self.cover.points, self.job);
            if n == 1 {
                fit = self.with_exchanges(fit, level, room, groups.as_deref_mut());
            }
            self.report(PROGRESS_SHARES[2] / GAP_SIZES.len() as f64);
        }
        fit
    }

    /// Refines the medial spheres for the division of a level.
    fn refine_medial(&mut self, axis: &mut MedialAxis, fit: &Fit, level: u32) {
        let parts = fit.errors.len() as f64;
        let least = (parts * SPHERES_PER_REGION).clamp(MIN_SPHERES, MAX_SPHERES) as usize;
        // half the mean error of the level
        let target = 0.5 * fit.errors.iter().sum::<f64>() / parts;
        axis.refine(&RefineGoal { target, least, most: least / 2 });
        let spheres = axis.spheres();
        self.medial = spheres.iter().map(|b| Site::approximate(b.sphere.center, self.job.distance)).collect();
        self.holders = axis.holders();
        self.stages.extend(axis.counts().stages(level));
    }

    /// Returns the candidates of a region: medial spheres that contain points of it, and spheres
    /// that touch it.
    fn candidates_of(&self, part: &[u32], parent_bound: Option<Sphere>) -> Vec<Site> {
        let mut holders: Vec<u32> =
            sample_evenly(part, MAX_SAMPLES).iter().flat_map(|&i| self.holders[i as usize].iter().copied()).collect();
        holders.sort_unstable();
        holders.dedup();
        let medial = sample_evenly(&holders, MEDIAL).into_iter().map(|k| self.medial[k as usize]);
        let touching = sample_evenly(part, TOUCHING).into_iter().map(|i| self.candidates[i as usize]);
        medial.chain(touching).map(|site| Site { parent_bound, ..site }).collect()
    }

    /// Exchanges spheres among all regions of a level, as far as the groups allow, and refits them
    /// together.
    fn with_exchanges(&mut self, mut fit: Fit, level: u32, room: usize, groups: Option<&mut Groups>) -> Fit {
        let mut groups = groups;
        if let Some(groups) = groups.as_deref_mut() {
            groups.spheres = self.spheres(&fit);
            groups.refit(self.job.distance);
            (0..fit.sites.len()).for_each(|k| fit.sites[k].parent_bound = groups.parent_bound(k));
        }
        let exchange = self.exchange(room.max(fit.sites.len()));
        let (mut fit, exchanges) = exchange.run(fit, groups);
        fit.refit_all(3, &self.cover.points, self.job);
        self.count_stage(level, "exchanges across regions", exchanges);
        self.report(PROGRESS_SHARES[1] / f64::from(self.job.settings.depth));
        fit
    }

    fn exchange(&self, most: usize) -> Exchange<'_> {
        Exchange {
            points: &self.cover.points,
            candidates: &self.candidates,
            distance: self.job.distance,
            most,
            enough: self.target_error(),
            tries: (TRIES_PER_SPHERE * most).min(MAX_TRIES),
            progress: self.job.progress,
        }
    }

    /// Divides the spheres of the deepest level.
    fn next_level(&mut self, fit: &Fit, level: u32) -> (Fit, Vec<usize>) {
        let divided: Vec<Divided> = fit
            .parts
            .par_iter()
            .zip(&fit.sites)
            .zip(&fit.errors)
            .map(|((part, site), error)| {
                if *error <= self.target_error() || self.job.progress.stopped() {
                    let fit = Fit { sites: vec![*site], parts: vec![part.clone()], errors: vec![*error] };
                    Divided { fit, method: None, exchanges: 0 }
                } else {
                    // children stay within the sphere at the worst error of the level
                    let reach = site.depth + PARENT_BOUND_FACTOR * fit.worst();
                    let parent_bound = (level > 1).then_some(Sphere { center: site.center, radius: reach });
                    self.divide_region(part, parent_bound)
                }
            })
            .collect();
        for (n, method) in METHODS.iter().enumerate() {
            self.count_stage(level, method, divided.iter().filter(|d| d.method == Some(n)).count() as u64);
        }
        self.count_stage(level, "exchanges", divided.iter().map(|d| d.exchanges).sum());
        let mut next = Fit::default();
        let mut of = Vec::new();
        for (parent, Divided { fit, .. }) in divided.into_iter().enumerate() {
            of.extend(fit.sites.iter().map(|_| parent));
            next.sites.extend(fit.sites);
            next.parts.extend(fit.parts);
            next.errors.extend(fit.errors);
        }
        self.count_stage(level, "spheres", next.sites.len() as u64);
        (next, of)
    }

    /// Covers the points of a region by at most `branch` spheres.
    fn divide_region(&self, part: &[u32], parent_bound: Option<Sphere>) -> Divided {
        let most = self.job.settings.branch as usize;
        let points = &self.cover.points;
        let some = sample_evenly(part, MAX_SAMPLES);
        let candidates = self.candidates_of(part, parent_bound);
        let (mut fit, method) = reduce(&candidates, points, &some, most, self.job.distance);
        fit.refit(2, points, &some, self.job.distance);
        let (mut fit, exchanges) = self.exchange(most).run(fit, None);
        fit.assign(points, part);
        fit.refit(2, points, part, self.job.distance);
        fit.drop_empty();
        self.report(PROGRESS_SHARES[0] * part.len() as f64 / (points.len() * self.job.settings.depth as usize) as f64);
        Divided { fit, method: Some(method), exchanges }
    }

    fn count_stage(&mut self, level: u32, stage: &str, count: u64) {
        self.stages.push(StageCount { level, stage: stage.into(), count });
    }

    /// Reports that a further fraction of the work is done.
    fn report(&self, share: f64) {
        if let Ok(mut done) = self.done.lock() {
            *done = (*done + share).min(1.0);
            self.job.progress.report(*done);
        }
    }
}

/// Returns nested cells over the leaves' spheres; `parents` lists each level, the deepest last.
fn nested(spheres: &[Sphere], parents: &[Vec<usize>]) -> Cell {
    let mut below: Vec<Option<Cell>> = spheres.iter().map(|sphere| Some(Cell::Leaf(*sphere))).collect();
    for of in parents.iter().rev() {
        let mut inside: Vec<Vec<Cell>> = Vec::new();
        inside.resize_with(of.iter().max().map_or(0, |p| p + 1), Vec::new);
        for (parent, cell) in of.iter().zip(below) {
            inside[*parent].extend(cell);
        }
        // a sphere all of whose points went to others has no cells
        below = inside.into_iter().map(|cells| (!cells.is_empty()).then_some(Cell::Inner(cells))).collect();
    }
    below.into_iter().flatten().next().unwrap_or(Cell::Inner(Vec::new()))
}

/// Returns at most `most` of the items, evenly spaced.
fn sample_evenly(items: &[u32], most: usize) -> Vec<u32> {
    items.iter().copied().step_by(items.len().div_ceil(most).max(1)).collect()
}

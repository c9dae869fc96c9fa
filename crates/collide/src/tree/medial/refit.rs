//! Refit: points choose their spheres, spheres move to where their points need least.
//!
//! One pass assigns each point to the site of least need (an additively weighted Voronoi partition) and then moves
//! each site by Nelder and Mead's simplex (*A simplex method for function minimization*, 1965) to lower
//! `max |p − c| + s(c)` over its own points. Neither half can raise the worst need.

use super::site::Site;
use crate::tree::builder::Job;
use crate::tree::nelder_mead::nelder_mead;
use crate::tree::sphere::SEARCH_TRIANGLES;
use crate::{MeshDistance, Vec3};
use rayon::prelude::*;

/// Evaluations of the simplex per site and pass.
const EVALUATIONS: usize = 36;

/// Sites and the points that each must hold.
#[derive(Clone, Debug, Default)]
pub(super) struct Fit {
    pub sites: Vec<Site>,
    /// Points of each site.
    pub parts: Vec<Vec<u32>>,
    /// The worst need of each part, meters; at least 0.
    pub errors: Vec<f64>,
}

impl Fit {
    /// Assigns the points of `region` to the sites.
    pub fn of(sites: Vec<Site>, points: &[Vec3], region: &[u32]) -> Fit {
        let mut fit = Fit { sites, ..Fit::default() };
        fit.assign(points, region);
        fit
    }

    /// Assigns the points of `region`, each to the site it needs least of.
    pub fn assign(&mut self, points: &[Vec3], region: &[u32]) {
        self.parts.resize(self.sites.len(), Vec::new());
        self.parts.iter_mut().for_each(Vec::clear);
        self.errors = vec![0.0; self.sites.len()];
        self.add_points(points, region);
    }

    /// Gives further points to the sites.
    pub fn add_points(&mut self, points: &[Vec3], region: &[u32]) {
        for &i in region {
            let (need, k) = least(&self.sites, &points[i as usize]);
            self.parts[k].push(i);
            self.errors[k] = self.errors[k].max(need);
        }
    }

    /// Drops the sites without points; which were kept.
    pub fn drop_empty(&mut self) -> Vec<bool> {
        let kept: Vec<bool> = self.parts.iter().map(|p| !p.is_empty()).collect();
        keep(&mut self.sites, &kept);
        keep(&mut self.errors, &kept);
        keep(&mut self.parts, &kept);
        kept
    }

    /// The greatest error.
    pub fn worst(&self) -> f64 {
        self.errors.iter().copied().fold(0.0, f64::max)
    }

    /// What the reducers compare and lower: the sum of the errors' eighth powers, each as a part of `scale`, so that
    /// the worst counts most and the others are not forgotten.
    pub fn cost(&self, scale: f64) -> f64 {
        self.errors.iter().map(|e| (e / scale).powi(8)).sum()
    }

    /// `passes` times: move the sites, assign anew.
    pub fn refit(&mut self, passes: usize, points: &[Vec3], region: &[u32], distance: &MeshDistance) {
        let mut settled = vec![Vec::new(); self.sites.len()];
        for _ in 0..passes {
            let changed: Vec<usize> = (0..self.sites.len()).filter(|&k| self.parts[k] != settled[k]).collect();
            if changed.is_empty() {
                break;
            }
            settled.clone_from(&self.parts);
            for k in changed {
                self.sites[k] = optimized(self.sites[k], &points_of(points, &self.parts[k]), distance);
            }
            self.assign(points, region);
        }
    }

    /// The same for many sites, on all threads.
    pub fn refit_all(&mut self, passes: usize, points: &[Vec3], job: &Job) {
        for _ in (0..passes).take_while(|_| !job.progress.stopped()) {
            self.assign_all(points, job);
            let moved_to = |(site, part): (&Site, &Vec<u32>)| match job.progress.stopped() {
                true => *site,
                false => optimized(*site, &points_of(points, part), job.distance),
            };
            self.sites = self.sites.par_iter().zip(&self.parts).map(moved_to).collect();
        }
        self.assign_all(points, job);
    }

    /// Assigns all points there are, on all threads.
    fn assign_all(&mut self, points: &[Vec3], job: &Job) {
        let least = |p: &Vec3| if job.progress.stopped() { (0.0, 0) } else { least(&self.sites, p) };
        let owners: Vec<(f64, usize)> = points.par_iter().map(least).collect();
        self.parts = vec![Vec::new(); self.sites.len()];
        self.errors = vec![0.0; self.sites.len()];
        for (i, (need, k)) in owners.into_iter().enumerate() {
            self.parts[k].push(i as u32);
            self.errors[k] = self.errors[k].max(need);
        }
    }
}

/// Keeps the items marked.
pub(super) fn keep<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut marks = kept.iter();
    items.retain(|_| *marks.next().unwrap_or(&true));
}

/// The points of a part.
pub(super) fn points_of(points: &[Vec3], part: &[u32]) -> Vec<Vec3> {
    part.iter().map(|&i| points[i as usize]).collect()
}

/// The least need of the sites and which has it, the first of equals.
fn least(sites: &[Site], p: &Vec3) -> (f64, usize) {
    sites
        .iter()
        .enumerate()
        .fold((f64::INFINITY, 0), |best, (k, site)| site.need_below(p, best.0).map_or(best, |n| (n, k)))
}

/// The site moved to where its points need less.
pub(super) fn optimized(site: Site, own: &[Vec3], distance: &MeshDistance) -> Site {
    if own.is_empty() {
        return site;
    }
    let start = site.worst(own);
    let radius = start + site.depth;
    if start <= 1e-9 * radius {
        return site;
    }
    let step = (start * 2.0).min(0.3 * radius).max(1e-3 * radius);
    let mut depth = site.depth;
    let before = start + site.bound_penalty(&site.center, radius);
    let mut best = (site.center, before);
    nelder_mead(site.center, step, EVALUATIONS, |c| {
        let reach = own.iter().map(|p| (p - c).norm_squared()).fold(0.0, f64::max).sqrt();
        // depths differ by no more than the centers do
        let bound = reach - site.depth - (c - site.center).norm();
        if bound >= 2.0 * start {
            return bound;
        }
        let here = -distance.closest_approximate(c, SEARCH_TRIANGLES).signed_distance;
        let cost = reach - here + site.bound_penalty(c, reach);
        if cost < best.1 {
            best = (*c, cost);
            depth = here;
        }
        cost
    });
    // measured exactly, where the search may have looked at too little
    let exact = if best.0 == site.center { site.depth } else { -distance.closest(&best.0).signed_distance };
    if best.1 + depth - exact < before { Site { center: best.0, depth: exact, ..site } } else { site }
}

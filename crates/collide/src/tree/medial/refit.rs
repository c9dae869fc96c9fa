//! Refit: points select their spheres, spheres move to reduce the needs of their points.
//!
//! One pass assigns each point to the site with the smallest need (an additively weighted Voronoi
//! partition). Then it moves each site by Nelder and Mead's simplex (*A simplex method for function
//! minimization*, 1965) to reduce `max |p − c| + s(c)` over its own points. Neither step can
//! increase the worst need.

use super::site::Site;
use crate::tree::builder::Job;
use crate::tree::nelder_mead::nelder_mead;
use crate::tree::sphere::SEARCH_TRIANGLES;
use crate::{MeshDistance, Vec3};
use rayon::prelude::*;

/// Function evaluations of the simplex per site and pass.
const EVALUATIONS: usize = 36;

/// Sites and the points that each must contain.
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

    /// Assigns each point of `region` to the site with the smallest need.
    pub fn assign(&mut self, points: &[Vec3], region: &[u32]) {
        self.parts.resize(self.sites.len(), Vec::new());
        self.parts.iter_mut().for_each(Vec::clear);
        self.errors = vec![0.0; self.sites.len()];
        self.add_points(points, region);
    }

    /// Assigns further points to the sites.
    pub fn add_points(&mut self, points: &[Vec3], region: &[u32]) {
        for &i in region {
            let (need, k) = least(&self.sites, &points[i as usize]);
            self.parts[k].push(i);
            self.errors[k] = self.errors[k].max(need);
        }
    }

    /// Drops the sites without points. Returns the marks of the sites that were kept.
    pub fn drop_empty(&mut self) -> Vec<bool> {
        let kept: Vec<bool> = self.parts.iter().map(|p| !p.is_empty()).collect();
        keep(&mut self.sites, &kept);
        keep(&mut self.errors, &kept);
        keep(&mut self.parts, &kept);
        kept
    }

    /// Returns the largest error.
    pub fn worst(&self) -> f64 {
        self.errors.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the cost that the reducers compare: the sum of the eighth powers of the errors,
    /// relative to `scale`. The worst error dominates, but the others count too.
    pub fn cost(&self, scale: f64) -> f64 {
        self.errors.iter().map(|e| (e / scale).powi(8)).sum()
    }

    /// Moves the sites and assigns the points again, `passes` times.
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

    /// Like [`Fit::refit`], for many sites, on all threads.
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

    /// Assigns all points, on all threads.
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

/// Keeps the marked items.
pub(super) fn keep<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut marks = kept.iter();
    items.retain(|_| *marks.next().unwrap_or(&true));
}

/// Returns the points of a part.
pub(super) fn points_of(points: &[Vec3], part: &[u32]) -> Vec<Vec3> {
    part.iter().map(|&i| points[i as usize]).collect()
}

/// Returns the smallest need of the sites and its site, the first of equals.
fn least(sites: &[Site], p: &Vec3) -> (f64, usize) {
    sites
        .iter()
        .enumerate()
        .fold((f64::INFINITY, 0), |best, (k, site)| site.need_below(p, best.0).map_or(best, |n| (n, k)))
}

/// Returns the site, moved to reduce the needs of its points.
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
        // depths differ by no more than the distance of the centers
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
    // measured exactly, as the search examines a limited number of triangles
    let exact = if best.0 == site.center { site.depth } else { -distance.closest(&best.0).signed_distance };
    if best.1 + depth - exact < before { Site { center: best.0, depth: exact, ..site } } else { site }
}

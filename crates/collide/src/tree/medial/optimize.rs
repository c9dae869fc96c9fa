//! Optimize: splits the worst sphere in two and, to keep the count, removes the sphere with the
//! smallest removal need.
//!
//! A removal assigns the points of a sphere to the others; the removal need is the largest need of
//! these points there. After each exchange the affected spheres are refitted, and the exchange is
//! kept if their cost decreases. All other spheres stay unchanged, so an exchange costs the same
//! among 500 spheres as among eight.

use super::group::{Change, Groups};
use super::refit::{Fit, optimized, points_of};
use super::site::Site;
use crate::tree::Progress;
use crate::{MeshDistance, Vec3};

/// Maximum number of consecutive exchanges without improvement.
const MAX_FAILURES: usize = 12;
/// Number of spheres tried for removal per split, as groups can refuse.
const MAX_BURSTS: usize = 4;
/// Maximum number of candidates for one half of a split sphere.
const MAX_CANDIDATES: usize = 48;

/// The input of the exchanges.
pub(super) struct Exchange<'a> {
    pub points: &'a [Vec3],
    /// Per point, the sphere that touches there.
    pub candidates: &'a [Site],
    pub distance: &'a MeshDistance,
    /// Maximum number of spheres.
    pub most: usize,
    /// Outward error at which a sphere is not split, meters.
    pub enough: f64,
    /// Maximum number of exchanges tried.
    pub tries: usize,
    pub progress: &'a dyn Progress,
}

impl Exchange<'_> {
    /// Returns the fit after the exchanges that improved it, and their number. Updates `groups`.
    pub fn run(&self, mut fit: Fit, mut groups: Option<&mut Groups>) -> (Fit, u64) {
        let mut removal_need: Vec<f64> = (0..fit.sites.len())
            .map(|k| if self.progress.stopped() { 0.0 } else { self.removal_need(&fit, k).0 })
            .collect();
        // spheres that were split without success, until a sphere near them changes
        let mut failed = vec![false; fit.sites.len()];
        let (mut wins, mut failures) = (0, 0);
        for _ in 0..self.tries {
            let worst = (0..fit.sites.len())
                .filter(|&k| !failed[k] && fit.errors[k] > self.enough)
                .max_by(|&a, &b| fit.errors[a].total_cmp(&fit.errors[b]).then(b.cmp(&a)));
            let Some(worst) = worst.filter(|_| failures < MAX_FAILURES && !self.progress.stopped()) else { break };
            let done = self
                .bursts(&fit, worst, &removal_need, groups.as_deref())
                .into_iter()
                .find_map(|burst| self.exchanged(&fit, worst, burst, groups.as_deref_mut()));
            let Some((places, after)) = done else {
                failed[worst] = true;
                failures += 1;
                continue;
            };
            store(&mut fit, &places, after);
            removal_need.resize(fit.sites.len(), 0.0);
            failed.resize(fit.sites.len(), false);
            for k in places {
                removal_need[k] = self.removal_need(&fit, k).0;
                failed[k] = false;
            }
            if let Some(groups) = groups.as_deref() {
                (0..fit.sites.len()).for_each(|k| fit.sites[k].parent_bound = groups.parent_bound(k));
            }
            (wins, failures) = (wins + 1, 0);
        }
        (fit, wins)
    }

    /// Returns the spheres to remove for a half of `worst`, in the order of trial: those with a
    /// removal need below the error of `worst`, and one of the same group. While there is room, no
    /// removal is tried first.
    fn bursts(&self, fit: &Fit, worst: usize, removal_need: &[f64], groups: Option<&Groups>) -> Vec<Option<usize>> {
        let mut order: Vec<usize> =
            (0..removal_need.len()).filter(|&k| k != worst && removal_need[k] < fit.errors[worst]).collect();
        order.sort_by(|&a, &b| removal_need[a].total_cmp(&removal_need[b]).then(a.cmp(&b)));
        let same = groups.and_then(|g| order.iter().copied().find(|&k| g.of[k] == g.of[worst]));
        order.truncate(if groups.is_some() { MAX_BURSTS } else { 1 });
        order.extend(same.filter(|k| !order.contains(k)));
        let room = fit.sites.len() < self.most;
        room.then_some(None).into_iter().chain(order.into_iter().map(Some)).collect()
    }

    /// Returns the affected spheres after an exchange, with their indices in `fit` (the halves
    /// last), if their cost decreases.
    fn exchanged(
        &self,
        fit: &Fit,
        worst: usize,
        burst: Option<usize>,
        groups: Option<&mut Groups>,
    ) -> Option<(Vec<usize>, Fit)> {
        let halves = self.halves(fit, worst)?;
        let mut touched: Vec<usize> = burst.map(|b| self.removal_need(fit, b).1).unwrap_or_default();
        touched.extend(self.removal_need(fit, worst).1);
        touched.sort_unstable();
        touched.dedup();
        touched.retain(|k| *k != worst && Some(*k) != burst);
        let gone = [Some(worst), burst];
        let before = || touched.iter().copied().chain(gone.into_iter().flatten());
        let region: Vec<u32> = before().flat_map(|k| fit.parts[k].iter().copied()).collect();
        let scale = fit.errors[worst];
        let old: f64 = before().map(|k| (fit.errors[k] / scale).powi(8)).sum();
        let mut after = Fit { sites: touched.iter().map(|&k| fit.sites[k]).chain(halves).collect(), ..Fit::default() };
        after.assign(self.points, &region);
        after.refit(3, self.points, &region, self.distance);
        if after.cost(scale) >= 0.995 * old {
            return None;
        }
        touched.push(worst);
        touched.push(burst.unwrap_or(fit.sites.len()));
        if let Some(present) = groups {
            let sphere = |n: usize| after.sites[n].sphere(&points_of(self.points, &after.parts[n]));
            let last = touched.len() - 1;
            let spheres = (0..last).map(|n| (touched[n], sphere(n))).collect();
            *present = present
                .with_change(&Change { spheres, new: (touched[last], sphere(last)), split: worst }, self.distance)?;
        }
        Some((touched, after))
    }

    /// Returns two sites for the two halves of the points of a part.
    fn halves(&self, fit: &Fit, k: usize) -> Option<[Site; 2]> {
        let part = &fit.parts[k];
        let farthest = |from: &Vec3| {
            let square = |i: &u32| (self.points[*i as usize] - from).norm_squared();
            part.iter().copied().max_by(|a, b| square(a).total_cmp(&square(b))).map(|i| self.points[i as usize])
        };
        let a = farthest(&fit.sites[k].center)?;
        let b = farthest(&a)?;
        let nearer = |i: &u32| {
            let p = self.points[*i as usize];
            (p - a).norm_squared() < (p - b).norm_squared()
        };
        let (near_a, near_b): (Vec<u32>, Vec<u32>) = part.iter().partition(|i| nearer(i));
        if near_a.is_empty() || near_b.is_empty() {
            return None;
        }
        Some([near_a, near_b].map(|half| self.best_for(&half, fit.sites[k])))
    }

    /// Returns the best of the spheres that touch at the points, and of `old`, after optimization.
    fn best_for(&self, part: &[u32], old: Site) -> Site {
        let own = points_of(self.points, part);
        let some = part.iter().step_by(part.len().div_ceil(MAX_CANDIDATES));
        let best = some.map(|&i| Site { parent_bound: old.parent_bound, ..self.candidates[i as usize] }).fold(
            (old.worst(&own), old),
            |best, c| {
                let need = c.worst(&own);
                if need < best.0 { (need, c) } else { best }
            },
        );
        optimized(best.1.exact(self.distance), &own, self.distance)
    }

    /// Returns the largest need of the points of a part at the other sites, and those sites.
    fn removal_need(&self, fit: &Fit, k: usize) -> (f64, Vec<usize>) {
        let mut takers = Vec::new();
        let mut worst: f64 = 0.0;
        for &i in &fit.parts[k] {
            let p = &self.points[i as usize];
            let mut best = (f64::INFINITY, k);
            for (n, site) in fit.sites.iter().enumerate() {
                if let Some(need) = site.need_below(p, best.0).filter(|_| n != k) {
                    best = (need, n);
                }
            }
            worst = worst.max(best.0);
            if best.1 != k && !takers.contains(&best.1) {
                takers.push(best.1);
            }
        }
        (worst, takers)
    }
}

/// Stores the affected spheres at their indices.
fn store(fit: &mut Fit, places: &[usize], mut after: Fit) {
    for (n, &k) in places.iter().enumerate() {
        if k == fit.sites.len() {
            fit.sites.push(after.sites[n]);
            fit.parts.push(Vec::new());
            fit.errors.push(0.0);
        }
        fit.sites[k] = after.sites[n];
        fit.parts[k] = std::mem::take(&mut after.parts[n]);
        fit.errors[k] = after.errors[n];
    }
}

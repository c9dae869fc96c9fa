//! Optimise: the worst ball is split in two, and to keep the count the ball that is missed least is burst.
//!
//! Bursting hands the points of a ball to the others; the ball missed least is the one whose points then need least
//! of those. After each exchange the balls that it touches are refitted; it is kept if their cost falls. Whatever it
//! does not touch stays as it is, so that an exchange costs the same among 500 balls as among eight.

use super::refit::{Fit, moved};
use super::site::Site;
use crate::{MeshDistance, Vec3};

/// After so many exchanges in a row that did not pay, the worst balls are left as they are.
const FAILURES: usize = 12;
/// Candidates looked at for one half of a ball that is split.
const LOOKED_AT: usize = 48;

/// What the exchanges work on.
pub(super) struct Exchange<'a> {
    pub points: &'a [Vec3],
    /// Per point, the ball that touches there.
    pub candidates: &'a [Site],
    pub distance: &'a MeshDistance,
    /// Greatest number of balls.
    pub most: usize,
    /// Exchanges tried.
    pub tries: usize,
}

impl Exchange<'_> {
    /// The fit after the exchanges that paid, and their number.
    pub fn run(&self, mut fit: Fit) -> (Fit, u64) {
        let mut missed: Vec<f64> = (0..fit.sites.len()).map(|k| self.missed(&fit, k).0).collect();
        // balls that were split in vain, until something near them changes
        let mut vain = vec![false; fit.sites.len()];
        let (mut wins, mut failures) = (0, 0);
        for _ in 0..self.tries {
            let worst = (0..fit.sites.len())
                .filter(|&k| !vain[k])
                .max_by(|&a, &b| fit.errors[a].total_cmp(&fit.errors[b]).then(b.cmp(&a)));
            let Some(worst) = worst.filter(|_| failures < FAILURES) else { break };
            let burst = (fit.sites.len() >= self.most)
                .then(|| (0..missed.len()).filter(|k| *k != worst).min_by(|&a, &b| missed[a].total_cmp(&missed[b])));
            if burst == Some(None) || burst.flatten().is_some_and(|b| missed[b] >= fit.errors[worst]) {
                break;
            }
            match self.exchanged(&fit, worst, burst.flatten()) {
                Some(touched) => {
                    let changed = self.put_back(&mut fit, worst, burst.flatten(), touched);
                    missed.resize(fit.sites.len(), 0.0);
                    vain.resize(fit.sites.len(), false);
                    for k in changed {
                        missed[k] = self.missed(&fit, k).0;
                        vain[k] = false;
                    }
                    (wins, failures) = (wins + 1, 0);
                }
                None => {
                    vain[worst] = true;
                    failures += 1;
                }
            }
        }
        fit.drop_empty();
        (fit, wins)
    }

    /// The touched balls after an exchange, with their places in `fit` (those of the halves last), if they cost less
    /// than before.
    fn exchanged(&self, fit: &Fit, worst: usize, burst: Option<usize>) -> Option<(Vec<usize>, Fit)> {
        let halves = self.halves(fit, worst)?;
        let mut touched: Vec<usize> = burst.map(|b| self.missed(fit, b).1).unwrap_or_default();
        touched.extend(self.missed(fit, worst).1);
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
        (after.cost(scale) < 0.995 * old).then_some((touched, after))
    }

    /// Puts what was touched back in its place; the places that changed.
    fn put_back(&self, fit: &mut Fit, worst: usize, burst: Option<usize>, touched: (Vec<usize>, Fit)) -> Vec<usize> {
        let (mut places, mut after) = touched;
        places.push(worst);
        places.push(burst.unwrap_or(fit.sites.len()));
        if burst.is_none() {
            fit.sites.push(after.sites[0]);
            fit.parts.push(Vec::new());
            fit.errors.push(0.0);
        }
        for (n, &k) in places.iter().enumerate() {
            fit.sites[k] = after.sites[n];
            fit.parts[k] = std::mem::take(&mut after.parts[n]);
            fit.errors[k] = after.errors[n];
        }
        places
    }

    /// Two sites for the two halves of the points of a part.
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

    /// Of the balls that touch at the points, and `old`, the one they need least of, moved.
    fn best_for(&self, part: &[u32], old: Site) -> Site {
        let own: Vec<Vec3> = part.iter().map(|&i| self.points[i as usize]).collect();
        let some = part.iter().step_by(part.len().div_ceil(LOOKED_AT));
        let best = some.map(|&i| self.candidates[i as usize]).fold((old.worst(&own), old), |best, c| {
            let need = c.worst(&own);
            if need < best.0 { (need, c) } else { best }
        });
        moved(best.1, &own, self.distance)
    }

    /// The greatest need of the points of a part of all other sites, and which those are.
    fn missed(&self, fit: &Fit, k: usize) -> (f64, Vec<usize>) {
        let mut takers = Vec::new();
        let mut worst: f64 = 0.0;
        for &i in &fit.parts[k] {
            let p = &self.points[i as usize];
            let mut best = (f64::INFINITY, k);
            for (n, site) in fit.sites.iter().enumerate() {
                let need = site.need(p);
                if need < best.0 && n != k {
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

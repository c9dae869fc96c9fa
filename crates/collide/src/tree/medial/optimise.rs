//! Optimise: the worst ball is split in two, and to keep the count the ball that is missed least is burst.
//!
//! Each exchange is followed by refitting and kept if the cost falls. Bursting hands the points of a ball to the
//! others; the ball missed least is the one whose points then need least.

use super::refit::{Fit, moved};
use super::site::Site;
use crate::{MeshDistance, Vec3};

/// What the exchanges work on.
pub(super) struct Exchange<'a> {
    pub points: &'a [Vec3],
    pub region: &'a [u32],
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
        let (mut wins, mut failed) = (0, 0);
        for _ in 0..self.tries {
            let scale = fit.worst();
            let mut order: Vec<usize> = (0..fit.sites.len()).collect();
            order.sort_by(|&a, &b| fit.errors[b].total_cmp(&fit.errors[a]).then(a.cmp(&b)));
            let Some(&worst) = order.get(failed) else { break };
            if scale <= 0.0 || failed > 3 {
                break;
            }
            match self.exchanged(&fit, worst) {
                Some(next) if next.cost(scale) < 0.999 * fit.cost(scale) => {
                    (fit, wins, failed) = (next, wins + 1, 0);
                }
                _ => failed += 1,
            }
        }
        (fit, wins)
    }

    /// `worst` split, one other burst.
    fn exchanged(&self, fit: &Fit, worst: usize) -> Option<Fit> {
        let halves = self.halves(fit, worst)?;
        let mut sites = fit.sites.clone();
        sites[worst] = halves[0];
        sites.push(halves[1]);
        if sites.len() > self.most {
            let burst = self.missed_least(&sites, fit, worst)?;
            sites.remove(burst);
        }
        Some(Fit::assigned(sites, self.points, self.region).refit(3, self.points, self.region, self.distance))
    }

    /// Two sites for the two halves of the points of a part.
    fn halves(&self, fit: &Fit, k: usize) -> Option<[Site; 2]> {
        let own: Vec<Vec3> = fit.parts[k].iter().map(|&i| self.points[i as usize]).collect();
        let farthest = |from: &Vec3| {
            own.iter().copied().max_by(|a, b| (a - from).norm_squared().total_cmp(&(b - from).norm_squared()))
        };
        let a = farthest(&fit.sites[k].center)?;
        let b = farthest(&a)?;
        let (near_a, near_b): (Vec<Vec3>, Vec<Vec3>) =
            own.iter().partition(|p| (*p - a).norm_squared() < (*p - b).norm_squared());
        if near_a.is_empty() || near_b.is_empty() {
            return None;
        }
        Some([near_a, near_b].map(|half| self.best_for(&half, fit.sites[k])))
    }

    /// The candidate of least need, moved.
    fn best_for(&self, own: &[Vec3], old: Site) -> Site {
        let best = self
            .candidates
            .iter()
            .fold((old.worst(own), old), |best, c| {
                let need = c.worst(own);
                if need < best.0 { (need, *c) } else { best }
            })
            .1;
        moved(best, own, self.distance)
    }

    /// Of the sites but the two halves (`worst` and the last), the one whose points need least of the others.
    fn missed_least(&self, sites: &[Site], fit: &Fit, worst: usize) -> Option<usize> {
        let without = |k: usize| {
            let others = |p: &Vec3| {
                sites.iter().enumerate().filter(|(n, _)| *n != k).map(|(_, s)| s.need(p)).fold(f64::INFINITY, f64::min)
            };
            fit.parts[k].iter().map(|&i| others(&self.points[i as usize])).fold(0.0, f64::max)
        };
        let needs: Vec<(f64, usize)> =
            (0..fit.sites.len()).filter(|k| *k != worst).map(|k| (without(k), k)).collect();
        needs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
    }
}

//! Burst: removes spheres one by one, cheapest first, and assigns their points to the others.
//!
//! Source: Bradshaw and O'Sullivan, *Adaptive medial-axis approximation for sphere-tree
//! construction* (2004), §5. The cost of a removal is the growth of the sum of the sixth powers of
//! all errors.

use super::refit::Fit;
use super::site::Site;
use crate::Vec3;

/// Returns the sites that remain of `fit` when at most `most` are left.
pub(super) fn burst(points: &[Vec3], mut fit: Fit, most: usize) -> Vec<Site> {
    while fit.sites.len() > most.max(1) {
        let costs = (0..fit.sites.len()).map(|k| (cost(points, &fit, k), k));
        let Some((_, removed)) = costs.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
        let orphans = fit.parts.swap_remove(removed);
        fit.sites.swap_remove(removed);
        fit.errors.swap_remove(removed);
        fit.add_points(points, &orphans);
    }
    fit.sites
}

/// Returns the cost of removing site `k`.
fn cost(points: &[Vec3], fit: &Fit, k: usize) -> f64 {
    let mut grown: Vec<(usize, f64)> = Vec::new();
    for &i in &fit.parts[k] {
        let p = &points[i as usize];
        let others = fit.sites.iter().enumerate().filter(|(n, _)| *n != k);
        let (need, taker) =
            others.fold((f64::INFINITY, k), |best, (n, s)| s.need_below(p, best.0).map_or(best, |need| (need, n)));
        match grown.iter_mut().find(|g| g.0 == taker) {
            Some(g) => g.1 = g.1.max(need),
            None => grown.push((taker, need)),
        }
    }
    let more = |(taker, need): &(usize, f64)| need.max(fit.errors[*taker]).powi(6) - fit.errors[*taker].powi(6);
    grown.iter().map(more).sum::<f64>() - fit.errors[k].powi(6)
}

//! Reduce: three methods select few spheres from many candidates, and the best result is kept.

use super::burst::burst;
use super::expand::expand;
use super::merge::merge;
use super::refit::{Fit, points_of};
use super::site::Site;
use crate::{MeshDistance, Vec3};

/// Merge and burst start with this multiple of the number of spheres to be left.
const START_FACTOR: usize = 5;
/// Refit passes of each result before the comparison.
const REFIT_PASSES: usize = 3;

/// Names of the methods in the stage counts.
pub(super) const METHODS: [&str; 3] = ["expand won", "merge won", "burst won"];

/// Covers the points of `region` by at most `most` spheres. Also returns the method that won.
pub(super) fn reduce(
    candidates: &[Site],
    points: &[Vec3],
    region: &[u32],
    most: usize,
    distance: &MeshDistance,
) -> (Fit, usize) {
    let region_points = points_of(points, region);
    let mut start = Fit::of(expand(candidates, &region_points, START_FACTOR * most), points, region);
    start.drop_empty();
    let candidate_sets =
        [expand(candidates, &region_points, most), merge(candidates, points, &start, most), burst(points, start, most)];
    let fits = candidate_sets.map(|sites| {
        let sites = sites.into_iter().map(|s| s.exact(distance)).collect();
        let mut fit = Fit::of(sites, points, region);
        fit.refit(REFIT_PASSES, points, region, distance);
        fit
    });
    let mut best = 0;
    for n in 1..fits.len() {
        if fits[n].worst() < fits[best].worst() {
            best = n;
        }
    }
    let mut fits = Vec::from(fits);
    (fits.swap_remove(best), best)
}

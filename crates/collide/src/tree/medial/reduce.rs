//! Reduce: many candidates come to few balls in three ways, and the best of the three is kept.

use super::burst::burst;
use super::expand::expand;
use super::merge::merge;
use super::refit::{Fit, own};
use super::site::Site;
use crate::{MeshDistance, Vec3};

/// Merge and burst begin with this many balls for each that is to be left.
const EACH: usize = 5;
/// Passes of refitting that each way gets before they are compared.
const PASSES: usize = 3;

/// The ways, in the words of the account.
pub(super) const WAYS: [&str; 3] = ["expand won", "merge won", "burst won"];

/// The points of `region` covered by at most `most` balls, and which way won.
pub(super) fn reduce(
    candidates: &[Site],
    points: &[Vec3],
    region: &[u32],
    most: usize,
    distance: &MeshDistance,
) -> (Fit, usize) {
    let looked = own(points, region);
    let mut start = Fit::of(expand(candidates, &looked, EACH * most), points, region);
    start.drop_empty();
    let ways = [expand(candidates, &looked, most), merge(candidates, points, &start, most), burst(points, start, most)];
    let fits = ways.map(|sites| {
        let sites = sites.into_iter().map(|s| s.exact(distance)).collect();
        let mut fit = Fit::of(sites, points, region);
        fit.refit(PASSES, points, region, distance);
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

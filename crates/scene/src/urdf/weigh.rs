//! The weight between coverage and tightness.
//!
//! A set `S` of spheres of a link with the solid `M` and the outer surface `A` has
//!
//! ```text
//! U(S) = area of the pieces of A that lie in no sphere of S / area of A        uncovered
//! V(S) = volume of the union of S outside M / volume of M                      outside
//! J(S) = w U(S) + (1 − w) V(S)                                                 0 ≤ w ≤ 1
//! ```
//!
//! [`candidates`] makes sets that do not depend on `w`, and [`best`] takes the one with the least `J`;
//! among equals the one with the least `U`, then the first. The first covers all, so it is the result of
//! `w = 1`. **More weight never uncovers more and never reaches less outside:** let `S` and `S'` be the
//! results of `w < w'`. Neither is better at the other's weight, so
//!
//! ```text
//! w (U − U') + (1 − w)(V − V') ≤ 0    and    w' (U' − U) + (1 − w')(V' − V) ≤ 0
//! ```
//!
//! Their sum is `U − U' ≥ V − V'`. If `U < U'`, then `V < V'` as well, which contradicts the second. So
//! `U ≥ U'`, and `V ≤ V'` by the first.
//!
//! **The sets.** The covering is loosened share by share ([`Covering::loosen`]): pieces of the greatest need
//! are left out and the spheres are fitted again. From the centers of each, radii are found for several
//! weights: one sphere at a time gets the radius of least `J` with the others held, which is exact because
//! `J` only decreases where the sphere reaches another piece. A sphere that stays inside `M` costs nothing,
//! so no radius is smaller than the depth of the center.

use tumble_core::collide::{Covering, CoveringSphere, SolidSamples, Vec3};

/// Shares of the outer surface at which radii are found, beside 1.
const SHARES: [f64; 11] = [0.975, 0.95, 0.9, 0.85, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2];
/// Weights for which radii are found.
const WEIGHTS: [f64; 21] = [
    0.98, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.55, 0.5, 0.45, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.05, 0.0,
];
/// Number of pieces that the surface is split into at least.
const PIECES: usize = 20_000;
/// Maximum number of times that each sphere gets a new radius.
const ROUNDS: usize = 6;
/// Maximum number of pairs of a sphere and a piece or sample that are compared.
const MAX_PAIRS: usize = 100_000_000;
/// Relative growth of a sphere, so that its pieces lie inside in floating point.
const ROUNDING: f64 = 1e-12;

/// A set of spheres that may be chosen.
pub(super) struct Candidate<S> {
    pub spheres: S,
    /// Share of the outer surface that lies in no sphere.
    pub uncovered: f64,
    /// Volume outside, as a fraction of that of the solid.
    pub outside: f64,
}

/// Returns the candidate with the least `J`.
pub(super) fn best<S>(candidates: Vec<Candidate<S>>, weight: f64) -> Option<Candidate<S>> {
    let cost = |one: &Candidate<S>| weight * one.uncovered + (1.0 - weight) * one.outside;
    let less = |a: &Candidate<S>, b: &Candidate<S>| {
        cost(a).total_cmp(&cost(b)).then(a.uncovered.total_cmp(&b.uncovered)).is_lt()
    };
    candidates.into_iter().reduce(|best, one| if less(&one, &best) { one } else { best })
}

/// Returns sets that cover at least the share `least` of the surface, made from a covering of all of it.
/// `samples` are of the link, and of what is around it up to the largest outward error of the covering.
pub(super) fn candidates(
    mut covering: Covering,
    least: f64,
    samples: &SolidSamples<'_>,
) -> Vec<Candidate<Vec<CoveringSphere>>> {
    let reach = covering.worst();
    covering.split_pieces(PIECES);
    let mut found = Vec::new();
    for share in [1.0].into_iter().chain(SHARES.into_iter().filter(|share| *share > least)).chain([least]) {
        if share <= 0.0 {
            continue;
        }
        covering.loosen(share);
        let spheres: Vec<CoveringSphere> = covering.spheres().collect();
        let balls: Vec<(Vec3, f64)> = spheres.iter().map(|s| (s.center, s.radius)).collect();
        let outside = samples.volume_outside(&balls) / samples.volume();
        found.push(Candidate { uncovered: 1.0 - covering.coverage(), outside, spheres });
        if let Some(radii) = Radii::new(&covering, samples, reach) {
            found.extend(WEIGHTS.iter().map(|weight| radii.for_weight(*weight)));
        }
    }
    found.retain(|one| 1.0 - one.uncovered >= least);
    found
}

/// The pieces and samples that spheres of any radius about fixed centers reach.
struct Radii {
    spheres: Vec<Ball>,
    /// Area of each piece, as a fraction of the surface.
    areas: Vec<f64>,
    samples: usize,
    /// Volume of each sample, as a fraction of that of the solid.
    share: f64,
}

/// A sphere of variable radius.
struct Ball {
    sphere: CoveringSphere,
    /// Signed distance of the center to the link, negative inside, meters.
    depth: f64,
    /// Pieces with the radius from which they are inside, ascending; samples likewise.
    pieces: Vec<(f64, u32)>,
    samples: Vec<(f64, u32)>,
}

/// Radii, and in how many spheres each piece and each sample is.
struct State {
    radii: Vec<f64>,
    pieces: Vec<u32>,
    samples: Vec<u32>,
}

impl Radii {
    /// Spheres reach at most `reach` meters outside. `None` if there are too many pairs.
    fn new(covering: &Covering, samples: &SolidSamples<'_>, reach: f64) -> Option<Radii> {
        let (pieces, points) = (covering.pieces(), samples.outside());
        if covering.count() * (pieces.len() + points.len()) > MAX_PAIRS {
            return None;
        }
        let ball = |sphere: CoveringSphere| {
            let depth = covering.signed_distance(&sphere.center);
            let most = sphere.radius.max(reach - depth);
            let ascending = |all: &mut dyn Iterator<Item = f64>| {
                let mut near: Vec<(f64, u32)> = all.zip(0..).filter(|(radius, _)| *radius <= most).collect();
                near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                near
            };
            let grown = |radius: f64| radius * (1.0 + ROUNDING);
            let pieces = ascending(&mut pieces.iter().map(|piece| grown(piece.reach(&sphere.center))));
            let samples = ascending(&mut points.iter().map(|p| (p - sphere.center).norm()));
            Ball { sphere, depth, pieces, samples }
        };
        let spheres: Vec<CoveringSphere> = covering.spheres().collect();
        let area: f64 = pieces.iter().map(|piece| piece.area()).sum();
        Some(Radii {
            spheres: spheres.into_iter().map(ball).collect(),
            areas: pieces.iter().map(|piece| piece.area() / area).collect(),
            samples: points.len(),
            share: samples.share() / samples.volume(),
        })
    }

    /// Returns the spheres with the radii for a weight.
    fn for_weight(&self, weight: f64) -> Candidate<Vec<CoveringSphere>> {
        let mut state = State {
            radii: self.spheres.iter().map(|ball| ball.sphere.radius).collect(),
            pieces: vec![0; self.areas.len()],
            samples: vec![0; self.samples],
        };
        (0..self.spheres.len()).for_each(|k| self.count(&mut state, k, 1));
        for _ in 0..ROUNDS {
            let before = state.radii.clone();
            for k in 0..self.spheres.len() {
                self.count(&mut state, k, u32::MAX);
                state.radii[k] = self.radius(&state, k, weight);
                self.count(&mut state, k, 1);
            }
            if state.radii == before {
                break;
            }
        }
        let resized = |(ball, radius): (&Ball, &f64)| CoveringSphere {
            radius: *radius,
            outward: (radius + ball.depth).max(0.0),
            ..ball.sphere
        };
        let spheres = self.spheres.iter().zip(&state.radii).filter(|(_, radius)| **radius > 0.0).map(resized);
        let empty = state.pieces.iter().zip(&self.areas).filter(|(count, _)| **count == 0);
        Candidate {
            spheres: spheres.collect(),
            uncovered: empty.map(|(_, area)| area).sum::<f64>().min(1.0),
            outside: state.samples.iter().filter(|count| **count > 0).count() as f64 * self.share,
        }
    }

    /// Adds `one`, which wraps, to the counts of all that is in a sphere.
    fn count(&self, state: &mut State, k: usize, one: u32) {
        let ball = &self.spheres[k];
        let within = |list: &[(f64, u32)], counts: &mut [u32]| {
            let inside = list.iter().take_while(|(radius, _)| *radius <= state.radii[k]);
            inside.for_each(|(_, n)| counts[*n as usize] = counts[*n as usize].wrapping_add(one));
        };
        within(&ball.pieces, &mut state.pieces);
        within(&ball.samples, &mut state.samples);
    }

    /// Returns the radius of least `J` of a sphere that is not counted, meters.
    fn radius(&self, state: &State, k: usize, weight: f64) -> f64 {
        let ball = &self.spheres[k];
        let (mut best, mut cost) = ((0.0, (-ball.depth).max(0.0)), 0.0);
        let mut samples = ball.samples.iter().peekable();
        for (radius, n) in ball.pieces.iter().filter(|(_, n)| state.pieces[*n as usize] == 0) {
            while let Some((_, sample)) = samples.next_if(|(other, _)| other <= radius) {
                cost += (1.0 - weight) * self.share * f64::from(state.samples[*sample as usize] == 0);
            }
            cost -= weight * self.areas[*n as usize];
            if cost < best.0 {
                best = (cost, radius.max(best.1));
            }
        }
        best.1
    }
}

//! The distance from one straight edge or corner along a line: a hyperbola.
//!
//! ```text
//! d(s) = √(f² + k (s − s*)²)        k = 1 − (u·w)²      of a corner 1
//! s*   = s₀ − d₀·g₀/k               f² = d₀² (1 − g₀²/k)
//! d'(s) = m   at   s* + m·f/√(k (k − m²))
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `u`, `w` | directions of the line and of the edge |
//! | `s₀`, `d₀`, `g₀` | a place where the edge or corner is closest, the distance there, its slope per meter |
//! | `s*`, `f` | the foot: the closest place, and the distance there |
//!
//! The distance from a whole surface is at most this, so the foot of the closest feature is a good
//! next sample. If a line runs over a face and beyond its edge, the plane of the face and the
//! distance from that edge are tangent: there the slope `m` is that of the face.

use crate::Vec3;
use crate::sdf::{Feature, Hit};

/// Smallest squared sine between lines that are not treated as parallel.
const MIN_ACROSS: f64 = 1e-6;

/// The distance from a straight edge or a corner along a line.
pub(super) struct Hyperbola {
    /// `s*`, the position of the minimum.
    pub foot: f64,
    /// `f²`.
    least: f64,
    /// `k`.
    across: f64,
}

impl Hyperbola {
    /// Returns the hyperbola of the closest feature at `s`, where the distance changes by `slope`
    /// along the line. `None` for a face, for parallel directions, and from inside, where no edge
    /// is the closest feature.
    pub fn new(hit: &Hit, s: f64, slope: f64, along: &Vec3) -> Option<Hyperbola> {
        let across = match hit.feature {
            Feature::Face => return None,
            Feature::Line(way) | Feature::Edge(way) => 1.0 - way.dot(along).powi(2),
            Feature::Point => 1.0,
        };
        let least = hit.distance * hit.distance * (1.0 - slope * slope / across);
        let fits = hit.distance > 0.0 && across > MIN_ACROSS && least > 0.0;
        fits.then(|| Hyperbola { foot: s - hit.distance * slope / across, least, across })
    }

    pub fn height(&self, s: f64) -> f64 {
        (self.least + self.across * (s - self.foot).powi(2)).sqrt()
    }

    /// Returns the position of this slope.
    pub fn at_slope(&self, slope: f64) -> Option<f64> {
        let steepest = self.across - slope * slope;
        (steepest > 0.0).then(|| self.foot + slope * (self.least / (self.across * steepest)).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The line y = 2, z = 1 past the edge along z through the origin, and past the corner there.
    #[test]
    fn foot_and_slopes_of_an_edge_and_of_a_corner() {
        let at = Vec3::new(1.5, 2.0, 1.0);
        let along = Vec3::x();
        for (feature, closest, least) in
            [(Feature::Edge(Vec3::z()), Vec3::new(0.0, 0.0, 1.0), 2.0), (Feature::Point, Vec3::zeros(), 5.0_f64.sqrt())]
        {
            let (offset, s) = (at - closest, 7.5);
            let normal = offset.normalize();
            let hit = Hit { distance: offset.norm(), nearest: offset.norm(), normal, core: 0.0, feature, facing: true };
            let arc = Hyperbola::new(&hit, s, normal.dot(&along), &along).unwrap();
            assert!((arc.foot - 6.0).abs() < 1e-12, "x = 0 is at s = 6, not {}", arc.foot);
            assert!((arc.height(6.0) - least).abs() < 1e-12);
            // the slope is x/d: 3/5 where x is three quarters of the least distance
            let place = arc.at_slope(0.6).unwrap();
            assert!((place - 6.0 - 0.75 * least).abs() < 1e-12, "{place}");
        }
    }

    /// Past an edge at 45° to the line: at s the closest point of the edge is s/2 along both.
    #[test]
    fn a_slanting_edge() {
        let way = Vec3::new(1.0, 1.0, 0.0).normalize();
        let (along, s) = (Vec3::x(), 3.0);
        let (at, closest) = (Vec3::new(s, 0.0, 1.0), Vec3::new(0.5 * s, 0.5 * s, 0.0));
        let normal = (at - closest).normalize();
        let distance = (at - closest).norm();
        let hit = Hit { distance, nearest: distance, normal, core: 0.0, feature: Feature::Line(way), facing: true };
        let arc = Hyperbola::new(&hit, s, normal.dot(&along), &along).unwrap();
        assert!(arc.foot.abs() < 1e-12 && (arc.height(0.0) - 1.0).abs() < 1e-12);
        assert!((arc.height(2.0) - 3.0_f64.sqrt()).abs() < 1e-12);
    }
}

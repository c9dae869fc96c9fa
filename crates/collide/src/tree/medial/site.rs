//! A site: the center of a sphere and its depth, which determine the sphere's error.
//!
//! A sphere about `c` that contains the points `P` has the radius `max |p − c|` and extends outside
//! the solid by at most
//!
//! ```text
//! need(c, P) = max over p in P of |p − c| + s(c)
//! ```
//!
//! where `s` is the signed distance of the center (negative inside). Each point has its own need.
//! Assigning each point to the site with its smallest need reduces the worst need, and so does
//! moving each site to reduce the needs of its points. Fitting alternates the two.

use crate::tree::sphere::{SEARCH_TRIANGLES, Sphere};
use crate::{MeshDistance, Vec3};

/// The center of a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Site {
    /// Meters.
    pub center: Vec3,
    /// Depth below the surface, meters; negative outside.
    pub depth: f64,
    /// The sphere of the level above within which this sphere has to stay.
    pub parent_bound: Option<Sphere>,
}

/// Penalty per meter beyond the parent bound, in meters of need.
const BOUND_PENALTY: f64 = 4.0;

impl Site {
    pub fn at(center: Vec3, distance: &MeshDistance) -> Site {
        Site { center, depth: -distance.closest(&center).signed_distance, parent_bound: None }
    }

    /// Returns the site with an approximate depth, faster; it can be a little too deep.
    pub fn approximate(center: Vec3, distance: &MeshDistance) -> Site {
        Site {
            center,
            depth: -distance.closest_approximate(&center, SEARCH_TRIANGLES).signed_distance,
            parent_bound: None,
        }
    }

    /// Returns the site with its exact depth.
    #[must_use]
    pub fn exact(self, distance: &MeshDistance) -> Site {
        Site { parent_bound: self.parent_bound, ..Site::at(self.center, distance) }
    }

    /// Returns the penalty of a sphere about `c` of radius `r` that leaves the parent bound,
    /// meters.
    #[inline]
    pub fn bound_penalty(&self, c: &Vec3, r: f64) -> f64 {
        self.parent_bound.map_or(0.0, |f| BOUND_PENALTY * ((c - f.center).norm() + r - f.radius).max(0.0))
    }

    /// Returns the outward error of the sphere about this site that contains `p`, meters.
    #[inline]
    pub fn need(&self, p: &Vec3) -> f64 {
        (p - self.center).norm() - self.depth + self.bound_penalty(p, 0.0)
    }

    /// Returns the need of `p` if it is below `bar`; most points are rejected without a square
    /// root.
    #[inline]
    pub fn need_below(&self, p: &Vec3, bar: f64) -> Option<f64> {
        let radius = bar + self.depth;
        if radius <= 0.0 || (p - self.center).norm_squared() >= radius * radius {
            return None;
        }
        Some(self.need(p)).filter(|need| *need < bar)
    }

    /// Returns the largest need of the points; `-∞` for no points.
    pub fn worst(&self, points: &[Vec3]) -> f64 {
        let square = points.iter().map(|p| (p - self.center).norm_squared()).fold(f64::NEG_INFINITY, f64::max);
        square.sqrt() - self.depth
    }

    /// Returns the smallest sphere about this site that contains the points.
    pub fn sphere(&self, points: &[Vec3]) -> Sphere {
        Sphere::about(self.center, points)
    }
}

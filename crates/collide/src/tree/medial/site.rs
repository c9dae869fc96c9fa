//! A center and its depth, which is all that a sphere needs to be judged by.
//!
//! A sphere about `c` that holds the points `P` has the radius `max |p − c|` and reaches at most
//!
//! ```text
//! need(c, P) = max over p in P of |p − c| + s(c)
//! ```
//!
//! out of the solid, `s` the signed distance of the center (negative inside). Each point has its own need, so that
//! points choose among centers by it: that choice lowers the worst need, as does moving each center to where the need
//! of its own points is least. The two in turn are the whole of fitting.

use crate::tree::sphere::{SEARCH_TRIANGLES, Sphere};
use crate::{MeshDistance, Vec3};

/// A center.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Site {
    /// Meters.
    pub center: Vec3,
    /// How far below the surface it lies, meters; negative outside.
    pub depth: f64,
    /// The sphere of the level above in which it is to stay.
    pub parent_bound: Option<Sphere>,
}

/// What a meter beyond the fence costs, in meters of need.
const BOUND_PENALTY: f64 = 4.0;

impl Site {
    pub fn at(center: Vec3, distance: &MeshDistance) -> Site {
        Site { center, depth: -distance.closest(&center).signed_distance, parent_bound: None }
    }

    /// The same, found faster and maybe a little too deep.
    pub fn approximate(center: Vec3, distance: &MeshDistance) -> Site {
        Site {
            center,
            depth: -distance.closest_approximate(&center, SEARCH_TRIANGLES).signed_distance,
            parent_bound: None,
        }
    }

    /// The same center measured exactly.
    #[must_use]
    pub fn exact(self, distance: &MeshDistance) -> Site {
        Site { parent_bound: self.parent_bound, ..Site::at(self.center, distance) }
    }

    /// The penalty of a sphere about `c` of radius `r` that leaves the fence, meters.
    #[inline]
    pub fn bound_penalty(&self, c: &Vec3, r: f64) -> f64 {
        self.parent_bound.map_or(0.0, |f| BOUND_PENALTY * ((c - f.center).norm() + r - f.radius).max(0.0))
    }

    /// How far out of the solid the sphere about this center must reach to hold `p`, meters.
    #[inline]
    pub fn need(&self, p: &Vec3) -> f64 {
        (p - self.center).norm() - self.depth + self.bound_penalty(p, 0.0)
    }

    /// The need of `p` if it is below `bar`; most are refused without a root.
    #[inline]
    pub fn need_below(&self, p: &Vec3, bar: f64) -> Option<f64> {
        let radius = bar + self.depth;
        if radius <= 0.0 || (p - self.center).norm_squared() >= radius * radius {
            return None;
        }
        Some(self.need(p)).filter(|need| *need < bar)
    }

    /// The greatest need of the points; `-∞` for none.
    pub fn worst(&self, points: &[Vec3]) -> f64 {
        let square = points.iter().map(|p| (p - self.center).norm_squared()).fold(f64::NEG_INFINITY, f64::max);
        square.sqrt() - self.depth
    }

    /// The sphere about this center that just holds the points.
    pub fn sphere(&self, points: &[Vec3]) -> Sphere {
        Sphere::about(self.center, points)
    }
}

//! A centre and its depth, which is all that a ball needs to be judged by.
//!
//! A ball about `c` that holds the points `P` has the radius `max |p − c|` and reaches at most
//!
//! ```text
//! need(c, P) = max over p in P of |p − c| + s(c)
//! ```
//!
//! out of the solid, `s` the signed distance of the centre (negative inside). Each point has its own need, so that
//! points choose among centres by it: that choice lowers the worst need, as does moving each centre to where the need
//! of its own points is least. The two in turn are the whole of fitting.

use crate::tree::ball::Ball;
use crate::{MeshDistance, Vec3};

/// A centre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Site {
    /// Metres.
    pub center: Vec3,
    /// How far below the surface it lies, metres; negative outside.
    pub depth: f64,
    /// The ball of the level above in which it is to stay.
    pub fence: Option<Ball>,
}

/// What a metre beyond the fence costs, in metres of need.
const BEYOND: f64 = 4.0;

impl Site {
    pub fn at(center: Vec3, distance: &MeshDistance) -> Site {
        Site { center, depth: -distance.closest(&center).signed_distance, fence: None }
    }

    /// The penalty of a ball about `c` of radius `r` that leaves the fence, metres.
    #[inline]
    pub fn beyond(&self, c: &Vec3, r: f64) -> f64 {
        self.fence.map_or(0.0, |f| BEYOND * ((c - f.center).norm() + r - f.radius).max(0.0))
    }

    /// How far out of the solid the ball about this centre must reach to hold `p`, metres.
    #[inline]
    pub fn need(&self, p: &Vec3) -> f64 {
        (p - self.center).norm() - self.depth + self.beyond(p, 0.0)
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

    /// The ball about this centre that just holds the points.
    pub fn ball(&self, points: &[Vec3]) -> Ball {
        Ball::holding(self.center, points)
    }
}

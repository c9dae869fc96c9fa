//! Small enclosing balls of points and of balls.
//!
//! Source: Bădoiu and Clarkson, *Smaller core-sets for balls* (2003): step from the centre towards the farthest item,
//! by a falling share of the way; after `n` steps the radius is within `1/√n` of the least. The ball returned
//! encloses exactly.

use super::simplex::simplex;
use crate::{MeshDistance, Vec3};

const STEPS: usize = 100;

/// A ball; metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ball {
    pub center: Vec3,
    pub radius: f64,
}

impl Ball {
    /// Upper bound of how far the ball reaches outside the solid.
    pub fn outward(&self, distance: &MeshDistance) -> f64 {
        (self.radius + distance.closest(&self.center).signed_distance).max(0.0)
    }

    /// The ball about `center` that just holds the points.
    pub fn holding(center: Vec3, points: &[Vec3]) -> Ball {
        let square = points.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max);
        Ball { center, radius: square.sqrt() }
    }
}

/// A ball around points, close to the smallest; zero for none.
pub(super) fn around_points(points: &[Vec3]) -> Ball {
    let bounds = crate::Aabb::around(points.iter().copied());
    let mut center = 0.5 * (bounds.min + bounds.max);
    let mut best = Ball::holding(center, points);
    for n in 0..STEPS {
        let Some(far) =
            points.iter().max_by(|p, q| (*p - center).norm_squared().total_cmp(&(*q - center).norm_squared()))
        else {
            return Ball { center: Vec3::zeros(), radius: 0.0 };
        };
        center += (far - center) / (n + 2) as f64;
        let ball = Ball::holding(center, points);
        if ball.radius < best.radius {
            best = ball;
        }
    }
    best
}

/// A ball around balls, close to the smallest, grown by a rounding's worth so that containment holds in floating
/// point.
pub(super) fn around_balls(balls: &[Ball]) -> Ball {
    let reach = |center: &Vec3, b: &Ball| (b.center - center).norm() + b.radius;
    let holding = |center: Vec3| Ball { center, radius: balls.iter().map(|b| reach(&center, b)).fold(0.0, f64::max) };
    let corners = balls.iter().flat_map(|b| [b.center.add_scalar(-b.radius), b.center.add_scalar(b.radius)]);
    let bounds = crate::Aabb::around(corners);
    let mut center = 0.5 * (bounds.min + bounds.max);
    let mut best = holding(center);
    for n in 0..STEPS {
        let Some(far) = balls.iter().max_by(|p, q| reach(&center, p).total_cmp(&reach(&center, q))) else { break };
        let offset = far.center - center;
        let length = offset.norm();
        if length > 0.0 {
            // the farthest point of that ball
            center += offset * ((length + far.radius) / length / (n + 2) as f64);
        }
        let ball = holding(center);
        if ball.radius < best.radius {
            best = ball;
        }
    }
    Ball { radius: best.radius * (1.0 + 1e-12), ..best }
}

/// Of the balls around balls the one that reaches out of the solid least, so far as a search finds it: its centre
/// lies deeper than that of the smallest.
pub(super) fn deep_around(balls: &[Ball], distance: &MeshDistance) -> Ball {
    let smallest = around_balls(balls);
    let holding = |c: &Vec3| balls.iter().map(|b| (b.center - c).norm() + b.radius).fold(0.0, f64::max);
    let mut best = (f64::INFINITY, smallest);
    for step in [0.3, -0.1] {
        simplex(best.1.center, step * smallest.radius, 50, |c| {
            let radius = holding(c);
            let outward = radius + distance.closest(c).signed_distance;
            if outward < best.0 {
                best = (outward, Ball { center: *c, radius: radius * (1.0 + 1e-12) });
            }
            outward
        });
    }
    best.1
}

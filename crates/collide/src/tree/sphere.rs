//! Spheres, and small enclosing spheres of points.
//!
//! Source: Bădoiu and Clarkson, *Smaller core-sets for balls* (2003): step from the center towards
//! the farthest item by a decreasing fraction of the distance. After `n` steps the radius is within
//! `1/√n` of the smallest. The returned sphere contains all points exactly.

use super::enclose::smallest_around;
use super::nelder_mead::nelder_mead;
use crate::{MeshDistance, Vec3};

/// Triangles that a center search examines per distance query; its result is measured exactly.
pub(super) const SEARCH_TRIANGLES: usize = 400;
const STEPS: usize = 100;
/// Evaluations of each of the two searches for the center of an enclosing sphere.
const EVALUATIONS: usize = 40;

/// A sphere; lengths in meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sphere {
    pub center: Vec3,
    pub radius: f64,
}

impl Sphere {
    /// Returns an upper bound of how far the sphere extends outside the solid.
    pub fn outward(&self, distance: &MeshDistance) -> f64 {
        (self.radius + distance.closest(&self.center).signed_distance).max(0.0)
    }

    /// Returns the smallest sphere about `center` that contains the points.
    pub fn about(center: Vec3, points: &[Vec3]) -> Sphere {
        let square = points.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max);
        Sphere { center, radius: square.sqrt() }
    }
}

/// Returns a sphere around points that is close to the smallest; zero for no points.
pub(crate) fn around_points(points: &[Vec3]) -> Sphere {
    let bounds = crate::Aabb::around(points.iter().copied());
    let mut center = 0.5 * (bounds.min + bounds.max);
    let Some((mut far, mut square)) = farthest(points, &center) else {
        return Sphere { center: Vec3::zeros(), radius: 0.0 };
    };
    let mut best = Sphere { center, radius: square.sqrt() };
    for n in 0..STEPS {
        center += (far - center) / (n + 2) as f64;
        (far, square) = farthest(points, &center).unwrap_or((far, square));
        let radius = square.sqrt();
        if radius < best.radius {
            best = Sphere { center, radius };
        }
    }
    best
}

/// Returns the last of the points farthest from `center`, and its squared distance.
fn farthest(points: &[Vec3], center: &Vec3) -> Option<(Vec3, f64)> {
    let squares = points.iter().map(|p| (*p, (p - center).norm_squared()));
    squares.reduce(|a, b| if b.1 >= a.1 { b } else { a })
}

/// Returns the sphere around spheres that extends least outside the solid, as far as a search finds
/// it. Its center lies deeper than that of the smallest enclosing sphere.
pub(super) fn min_outward_enclosing(spheres: &[Sphere], distance: &MeshDistance) -> Sphere {
    let smallest = smallest_around(spheres);
    let mut best = (smallest.radius + distance.closest(&smallest.center).signed_distance, smallest);
    for step in [0.3, -0.1] {
        let start = best.1.center;
        nelder_mead(start, step * smallest.radius, EVALUATIONS, |c| {
            let radius = spheres.iter().map(|b| (b.center - c).norm() + b.radius).fold(0.0, f64::max);
            let outward = radius + distance.closest_approximate(c, SEARCH_TRIANGLES).signed_distance;
            if outward < best.0 {
                best = (outward, Sphere { center: *c, radius: radius * (1.0 + 1e-12) });
            }
            outward
        });
    }
    best.1
}

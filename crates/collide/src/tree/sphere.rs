//! Spheres, and small enclosing ones of points.
//!
//! Source: Bădoiu and Clarkson, *Smaller core-sets for balls* (2003): step from the center towards the farthest item,
//! by a falling share of the way; after `n` steps the radius is within `1/√n` of the least. The sphere returned
//! encloses exactly.

use super::enclose::smallest_around;
use super::nelder_mead::nelder_mead;
use crate::{MeshDistance, Vec3};

/// Triangles that a search for a center looks at for each distance; what the search comes to is measured exactly.
pub(super) const SEARCH_TRIANGLES: usize = 400;
const STEPS: usize = 100;
/// Evaluations of each of the two searches for the center of a sphere that lies deep.
const EVALUATIONS: usize = 40;

/// A sphere; meters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sphere {
    pub center: Vec3,
    pub radius: f64,
}

impl Sphere {
    /// Upper bound of how far the sphere reaches outside the solid.
    pub fn outward(&self, distance: &MeshDistance) -> f64 {
        (self.radius + distance.closest(&self.center).signed_distance).max(0.0)
    }

    /// The sphere about `center` that just holds the points.
    pub fn about(center: Vec3, points: &[Vec3]) -> Sphere {
        let square = points.iter().map(|p| (p - center).norm_squared()).fold(0.0, f64::max);
        Sphere { center, radius: square.sqrt() }
    }
}

/// A sphere around points, close to the smallest; zero for none.
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

/// The last of the points that are farthest from `center`, and the square of its distance.
fn farthest(points: &[Vec3], center: &Vec3) -> Option<(Vec3, f64)> {
    let squares = points.iter().map(|p| (*p, (p - center).norm_squared()));
    squares.reduce(|a, b| if b.1 >= a.1 { b } else { a })
}

/// Of the spheres around spheres the one that reaches out of the solid least, so far as a search finds it: its center
/// lies deeper than that of the smallest.
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

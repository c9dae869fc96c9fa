//! What the stages of the medial builders hand to one another.

use crate::Vec3;
use crate::tree::sphere::Sphere;

/// A sphere that may stand for a part of the solid, and how well it does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tree) struct MedialSphere {
    pub sphere: Sphere,
    /// Upper bound of how far it reaches outside the solid, meters.
    pub outward: f64,
}

/// Points of the surface that are to be covered.
#[derive(Clone, Debug, Default)]
pub(in crate::tree) struct CoverPoints {
    /// Meters.
    pub points: Vec<Vec3>,
    /// Outward, of length one (zero where the triangle has no area).
    pub normals: Vec<Vec3>,
    /// The triangle that each point lies on.
    pub triangles: Vec<u32>,
}

/// What is asked of a source of candidate spheres for a region: refine until the worst outward error is below `target`
/// and there are at least `least` spheres, with at most `most` insertions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tree) struct RefineGoal {
    /// Meters.
    pub target: f64,
    pub least: usize,
    pub most: usize,
}

//! Data that the stages of the medial builders exchange.

use crate::Vec3;
use crate::tree::sphere::Sphere;

/// A candidate sphere and its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tree) struct MedialSphere {
    pub sphere: Sphere,
    /// Upper bound of how far the sphere extends outside the solid, meters.
    pub outward: f64,
}

/// Points of the surface that must be covered.
#[derive(Clone, Debug, Default)]
pub(in crate::tree) struct CoverPoints {
    /// Meters.
    pub points: Vec<Vec3>,
    /// Unit outward normals (zero for triangles without area).
    pub normals: Vec<Vec3>,
    /// The triangle of each point.
    pub triangles: Vec<u32>,
}

/// The goal of a refinement: a worst outward error below `target` and at least `least` spheres,
/// with at most `most` insertions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::tree) struct RefineGoal {
    /// Meters.
    pub target: f64,
    pub least: usize,
    pub most: usize,
}

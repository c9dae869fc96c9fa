//! The cylinder shape, with a sphere tree of a surrounding prism for the `spheres` contact mode.

use super::axis;
use crate::{Aabb, Pose, ShapeError, SphereTree, TreeSettings, TriMesh};
use std::sync::OnceLock;

/// Relative margin of a bound that is computed by another formula than what it bounds.
const ROUNDING: f64 = 1e-9;

/// A cylinder along local z about the origin. The sphere tree of a closed mesh around it is built
/// on first use: the `surface` contact mode needs none.
#[derive(Clone, Debug)]
pub struct CylinderShape {
    radius: f64,
    half_length: f64,
    mesh: TriMesh,
    tree: OnceLock<SphereTree>,
    /// Radius of a cylinder around prism and leaves, meters.
    outer_radius: f64,
    outer_half_length: f64,
}

/// All other fields are computed from these.
impl PartialEq for CylinderShape {
    fn eq(&self, other: &CylinderShape) -> bool {
        (self.radius, self.half_length) == (other.radius, other.half_length)
    }
}

/// Number of sides of the prism for the tree: its edges lie `1/cos(π/48)`, 0.2 % of the radius,
/// outside.
const SIDES: usize = 48;

impl CylinderShape {
    /// Returns a cylinder of `radius` and `length`, meters.
    ///
    /// # Errors
    /// [`ShapeError`] if a size is too small or too large for a mesh around it.
    pub fn new(radius: f64, length: f64) -> Result<CylinderShape, ShapeError> {
        let half_length = 0.5 * length;
        // the prism is around the cylinder, so that its tree covers the true surface
        let outer = radius / nalgebra::ComplexField::cos(std::f64::consts::PI / SIDES as f64);
        let mesh = TriMesh::cylinder(outer, length, SIDES);
        mesh.check_data()?;
        // the leaves of an octree that ends by its error, not by its depth, extend no further; this
        // holds for a prism
        let error = TreeSettings::octree().error * mesh.diagonal() * (1.0 + ROUNDING);
        let (outer_radius, outer_half_length) = (outer + error, half_length + error);
        Ok(CylinderShape { radius, half_length, mesh, tree: OnceLock::new(), outer_radius, outer_half_length })
    }

    /// Returns the radius, meters.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Returns the distance from the center to a flat face, meters.
    pub fn half_length(&self) -> f64 {
        self.half_length
    }

    /// Returns the box in world axes around the leaves.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let here = pose.translation.vector;
        // a disc extends by r·sin of the angle between its axis and the direction
        let half =
            axis(pose).map(|e| self.outer_half_length * e.abs() + self.outer_radius * (1.0 - e * e).max(0.0).sqrt());
        Aabb { min: here - half, max: here + half }
    }

    /// Returns the prism around the cylinder from which the tree is built.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Returns the spheres around the surface, built on first use; a single sphere if the build
    /// fails.
    pub fn tree(&self) -> &SphereTree {
        let build = || SphereTree::build(&self.mesh, &TreeSettings::octree());
        self.tree.get_or_init(|| build().unwrap_or_else(|_| SphereTree::bounding_sphere(&self.mesh)))
    }

    /// Returns whether the tree is built.
    pub fn is_built(&self) -> bool {
        self.tree.get().is_some()
    }
}

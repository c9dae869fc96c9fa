//! The shape of a cylinder, with a sphere tree around a prism for contacts by spheres.

use super::axis;
use crate::{Aabb, Pose, ShapeError, SphereTree, TreeSettings, TriMesh};
use std::sync::OnceLock;

/// Relative margin of a bound that is computed by another formula than what it bounds.
const ROUNDING: f64 = 1e-9;

/// A cylinder along local z about the origin. The sphere tree of a closed mesh around it is built when first asked for: contacts by surfaces need none.
#[derive(Clone, Debug)]
pub struct CylinderShape {
    radius: f64,
    half_length: f64,
    mesh: TriMesh,
    tree: OnceLock<SphereTree>,
    /// Of a cylinder around prism and leaves, meters.
    outer_radius: f64,
    outer_half_length: f64,
}

/// The rest is made of these two.
impl PartialEq for CylinderShape {
    fn eq(&self, other: &CylinderShape) -> bool {
        (self.radius, self.half_length) == (other.radius, other.half_length)
    }
}

/// Sides of the prism that stands for a cylinder: its edges lie `1/cos(π/48)`, 0.2 % of the radius, outside.
const SIDES: usize = 48;

impl CylinderShape {
    /// A cylinder of `radius` and `length`, meters.
    ///
    /// # Errors
    /// [`ShapeError`] if a size is too small or too large for a mesh around it.
    pub fn new(radius: f64, length: f64) -> Result<CylinderShape, ShapeError> {
        let half_length = 0.5 * length;
        // the prism is around the cylinder, so that its tree covers the true surface
        let outer = radius / nalgebra::ComplexField::cos(std::f64::consts::PI / SIDES as f64);
        let mesh = TriMesh::cylinder(outer, length, SIDES);
        mesh.check_data()?;
        // leaves of an octree that ends for its error and not for its depth reach no further; a prism's does
        let error = TreeSettings::octree().error * mesh.diagonal() * (1.0 + ROUNDING);
        let (outer_radius, outer_half_length) = (outer + error, half_length + error);
        Ok(CylinderShape { radius, half_length, mesh, tree: OnceLock::new(), outer_radius, outer_half_length })
    }

    /// Meters.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// From the center to a flat face, meters.
    pub fn half_length(&self) -> f64 {
        self.half_length
    }

    /// The box in world axes around the leaves.
    pub(crate) fn aabb(&self, pose: &Pose) -> Aabb {
        let here = pose.translation.vector;
        // a disc reaches r·sin of the angle between its axis and the direction asked for
        let half =
            axis(pose).map(|e| self.outer_half_length * e.abs() + self.outer_radius * (1.0 - e * e).max(0.0).sqrt());
        Aabb { min: here - half, max: here + half }
    }

    /// The prism around the cylinder that the tree is made of.
    pub fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// The balls around the surface, built when first asked for; one ball where that fails.
    pub fn tree(&self) -> &SphereTree {
        let build = || SphereTree::build(&self.mesh, &TreeSettings::octree());
        self.tree.get_or_init(|| build().unwrap_or_else(|_| SphereTree::bounding_sphere(&self.mesh)))
    }

    /// Whether that has happened.
    pub fn is_built(&self) -> bool {
        self.tree.get().is_some()
    }
}

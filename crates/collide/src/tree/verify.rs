//! The promises of a sphere tree, checked by code that shares nothing with the builders.

use super::builder::check_stopped;
use super::{Progress, SphereNode, SphereTree};
use crate::{MeshError, TriMesh, Vec3};

/// A piece of surface smaller than this part of the mesh's diagonal that lies across spheres is covered if its corners
/// are.
const MIN_PIECE: f64 = 1e-5;

impl SphereTree {
    /// Every parent contains its children: `|c − c'| + r' ≤ r`, to rounding.
    ///
    /// # Errors
    /// [`MeshError::Tree`] if a node is not within its parent.
    pub fn check_nesting(&self) -> Result<(), MeshError> {
        for (n, parent) in self.nodes.iter().enumerate() {
            for child in parent.child_range() {
                let c = &self.nodes[child];
                let excess = (c.center - parent.center).norm() + c.radius - parent.radius;
                if excess > 1e-12 * parent.radius {
                    return Err(MeshError::Tree {
                        what: format!("sphere {child} sticks out of its parent {n} by {excess:e} m"),
                    });
                }
            }
        }
        Ok(())
    }

    /// The leaves cover the surface of `mesh`. A triangle lies in a sphere iff its corners do, so each is halved
    /// until every piece lies in one sphere, or is tiny (1e-5 of the diagonal) and each of its corners lies in some
    /// sphere.
    ///
    /// # Errors
    /// [`MeshError::Tree`] if a level does not cover the surface.
    pub fn check_coverage(&self, mesh: &TriMesh) -> Result<(), MeshError> {
        self.check_coverage_watched(mesh, &())
    }

    /// The same; `progress` can end it.
    pub(super) fn check_coverage_watched(&self, mesh: &TriMesh, progress: &dyn Progress) -> Result<(), MeshError> {
        let tiny = MIN_PIECE * mesh.diagonal();
        for t in 0..mesh.triangles.len() {
            check_stopped(progress)?;
            if let Err(point) = self.cover(&mesh.corners(t), tiny, 80) {
                let what = format!("triangle {} is not covered near ({}, {}, {})", t + 1, point.x, point.y, point.z);
                return Err(MeshError::Tree { what });
            }
        }
        Ok(())
    }

    fn cover(&self, triangle: &[Vec3; 3], tiny: f64, splits: u32) -> Result<(), Vec3> {
        if self.leaf_holding(0, triangle) {
            return Ok(());
        }
        let [a, b, c] = *triangle;
        let size = (a - b).norm().max((b - c).norm()).max((c - a).norm());
        if size < tiny || splits == 0 {
            return match triangle.iter().find(|p| !self.leaf_holding(0, &[**p])) {
                Some(point) => Err(*point),
                None => Ok(()),
            };
        }
        // at the middle of the longest side, so that slivers make few pieces
        let k = (0..3).find(|&k| (triangle[(k + 1) % 3] - triangle[k]).norm() == size).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|n| triangle[(k + n) % 3]);
        let middle = 0.5 * (a + b);
        [[a, middle, c], [middle, b, c]].iter().try_for_each(|t| self.cover(t, tiny, splits - 1))
    }

    /// Whether one leaf below `node` holds all the points. Spheres nest, so a node that does not hold them has no such
    /// leaf.
    fn leaf_holding(&self, node: usize, points: &[Vec3]) -> bool {
        let here = &self.nodes[node];
        points.iter().all(|p| holds(here, p))
            && (here.is_leaf() || here.child_range().any(|c| self.leaf_holding(c, points)))
    }
}

fn holds(sphere: &SphereNode, p: &Vec3) -> bool {
    (p - sphere.center).norm_squared() <= sphere.radius * sphere.radius * (1.0 + 1e-12)
}

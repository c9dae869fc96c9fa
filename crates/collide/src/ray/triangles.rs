//! Rays against the triangles of a mesh.
//!
//! The test is that of Woop, Benthin and Wald, *Watertight ray/triangle intersection* (2013), in
//! double precision: the space is sheared so that the ray is the z axis, and the signs of three
//! edge functions decide.
//!
//! ```text
//! U = C_x B_y − C_y B_x      (V, W cyclic)      det = U + V + W      t = (U A_z + V B_z + W C_z)/det
//! ```
//!
//! Two triangles evaluate the function of their common edge with the same products, so no ray
//! passes between them.

use super::box_tree::BoxTree;
use crate::{Aabb, TriMesh, Vec3};

/// The triangles of a mesh in a tree of boxes.
#[derive(Clone, Debug)]
pub(crate) struct RayMesh {
    tree: BoxTree,
    /// Corners in the order of the tree's slots, meters.
    corners: Vec<[Vec3; 3]>,
}

/// A hit of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    /// Meters along the unit direction.
    pub distance: f64,
    pub triangle: u32,
}

/// A ray in sheared coordinates.
pub(crate) struct ShearedRay {
    origin: Vec3,
    /// Axes: z has the greatest component of the direction.
    axes: [usize; 3],
    shear: [f64; 3],
    /// Sign of the edge functions of a triangle that is hit on its front.
    front: f64,
}

impl ShearedRay {
    /// Prepares a ray along a unit vector.
    pub fn new(origin: &Vec3, direction: &Vec3) -> ShearedRay {
        let z = direction.iamax();
        let [x, y] = [(z + 1) % 3, (z + 2) % 3];
        let scale = 1.0 / direction[z];
        // a cyclic permutation keeps the orientation; the scale mirrors it along z alone
        let front = direction[z].signum();
        ShearedRay {
            origin: *origin,
            axes: [x, y, z],
            shear: [direction[x] * scale, direction[y] * scale, scale],
            front,
        }
    }

    /// Returns the distance at which the ray meets a triangle, at least 0, and whether it meets the
    /// front.
    #[inline]
    pub fn meet(&self, corners: &[Vec3; 3]) -> Option<(f64, bool)> {
        let [x, y, z] = self.axes;
        let [shear_x, shear_y, shear_z] = self.shear;
        let sheared = |corner: &Vec3| {
            let p = corner - self.origin;
            [p[x] - shear_x * p[z], p[y] - shear_y * p[z], shear_z * p[z]]
        };
        let [a, b, c] = [sheared(&corners[0]), sheared(&corners[1]), sheared(&corners[2])];
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        if det == 0.0 {
            return None; // edge on
        }
        let t = (u * a[2] + v * b[2] + w * c[2]) / det;
        (t >= 0.0).then_some((t, det * self.front > 0.0))
    }
}

impl RayMesh {
    /// Builds the tree of a mesh.
    pub fn new(mesh: &TriMesh) -> RayMesh {
        let all: Vec<[Vec3; 3]> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let tree = BoxTree::new(&all.iter().map(|corners| Aabb::around(*corners)).collect::<Vec<_>>());
        RayMesh { corners: tree.order().iter().map(|&t| all[t as usize]).collect(), tree }
    }

    /// Returns the box around the mesh, slightly larger.
    pub fn bounds(&self) -> Option<&Aabb> {
        self.tree.bounds()
    }

    /// Returns the first triangle whose front the ray meets within `max` meters; of several at one
    /// distance, the first of the mesh. `direction` is a unit vector.
    pub fn cast(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<TriangleHit> {
        self.first(origin, direction, max, |_, _, front| front)
    }

    /// As [`cast`](Self::cast), for the hits that `counts` accepts by triangle, distance, and whether the front is hit.
    pub fn first(
        &self,
        origin: &Vec3,
        direction: &Vec3,
        max: f64,
        counts: impl Fn(u32, f64, bool) -> bool,
    ) -> Option<TriangleHit> {
        let ray = ShearedRay::new(origin, direction);
        let (mut limit, mut hit) = (max, None::<TriangleHit>);
        self.tree.visit_along(origin, direction, &mut limit, |slot, limit| {
            let Some((distance, front)) = ray.meet(&self.corners[slot]) else { return };
            let triangle = self.tree.order()[slot];
            let first = distance < *limit || distance == *limit && hit.is_none_or(|hit| triangle < hit.triangle);
            if first && counts(triangle, distance, front) {
                (*limit, hit) = (distance, Some(TriangleHit { distance, triangle }));
            }
        });
        hit
    }
}

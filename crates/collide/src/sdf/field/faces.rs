//! Queries of a mesh's field for searches over faces.

use super::MeshField;
use crate::Vec3;
use crate::mesh::{BestFirstSearch, closest_on_triangle};

impl MeshField {
    /// Returns the corners of all triangles.
    pub fn faces(&self) -> &[[Vec3; 3]] {
        &self.triangles.corners
    }

    /// Returns the outward normal of triangle `t`; zero if it has no area.
    pub fn face_normal(&self, t: usize) -> Vec3 {
        self.triangles.normals[t][0]
    }

    /// Returns the signed distance of `p` and the closest triangle.
    pub fn closest_face(&self, p: &Vec3) -> (f64, usize) {
        let listed = self.tree.locate(p, &self.triangles).and_then(|place| self.closest(p, &place));
        let closest = listed.unwrap_or_else(|| self.closest_by_tree(p));
        (self.triangles.describe(p, &closest).distance, closest.triangle)
    }

    /// Returns the distance of `p` from triangle `t`.
    pub fn distance_from_face(&self, t: usize, p: &Vec3) -> f64 {
        (p - closest_on_triangle(p, &self.triangles.corners[t]).0).norm()
    }

    /// Calls `each` for the triangles within `radius` of `p`.
    pub fn faces_within(&self, p: &Vec3, radius: f64, each: &mut dyn FnMut(usize)) {
        self.boxes().within(p, radius, &mut |face, _, _| each(face));
    }

    /// Searches the tree of boxes around the triangles.
    pub fn search_faces(&self, to: &mut impl BestFirstSearch) {
        self.boxes().descend(to);
    }
}

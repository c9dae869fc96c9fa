//! Triangle meshes: readers, validation, repair, generators, integrals and distance queries.

mod aabb_tree;
mod check;
mod crossing;
mod distance;
mod ear_clipping;
mod edges;
mod generate;
mod holes;
mod hull;
mod integrals;
mod isosurface;
mod morton;
mod obj;
mod pairing;
mod ply;
mod polygon;
mod repair;
mod shells;
mod stl;
mod strip;
mod terrain;
mod text;
mod thicken;
mod triangle;
mod union;
mod winding;

pub(crate) use aabb_tree::AabbTree;
pub use check::ClosedReport;
pub(crate) use crossing::crossing_shells;
pub(crate) use distance::{BestFirstSearch, box_distance_squared, face_normals, pseudonormals};
pub use distance::{ClosestPoint, MeshDistance};
pub(crate) use edges::{EdgeGroups, edge_groups};
pub(crate) use generate::revolve;
pub(crate) use morton::morton_codes;
pub use polygon::PolygonTriangulator;
pub use repair::{RepairReport, RepairSettings};
pub(crate) use shells::shells;
pub use text::{decode_text, obj_lines};
pub(crate) use triangle::closest_on_triangle;
pub use winding::WindingNumber;

use crate::{Aabb, MeshError, Vec3};

/// Largest allowed coordinate, meters: products of coordinates stay within the range of floating
/// point.
const FARTHEST: f64 = 1e9;
/// Smallest allowed diagonal of the bounding box, meters, for the same reason.
const SMALLEST: f64 = 1e-30;

/// A surface of triangles, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TriMesh {
    /// Positions, meters.
    pub vertices: Vec<Vec3>,
    /// Three indices into `vertices` each.
    pub triangles: Vec<[u32; 3]>,
}

impl TriMesh {
    /// Returns the corners of triangle `t`; the index must be in range.
    pub fn corners(&self, t: usize) -> [Vec3; 3] {
        self.triangles[t].map(|v| self.vertices[v as usize])
    }

    /// Returns the box around all vertices, used or not; empty (`min > max`) without vertices.
    pub fn aabb(&self) -> Aabb {
        Aabb::around(self.vertices.iter().copied())
    }

    /// Returns the diagonal of the bounding box, meters; 0 for an empty mesh.
    pub fn diagonal(&self) -> f64 {
        if self.vertices.is_empty() { 0.0 } else { (self.aabb().max - self.aabb().min).norm() }
    }

    /// Returns the area of all triangles, m².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.corners(t)).map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum()
    }

    /// Returns the mesh moved by `offset` meters.
    #[must_use]
    pub fn translated(mut self, offset: &Vec3) -> TriMesh {
        self.vertices.iter_mut().for_each(|v| *v += offset);
        self
    }

    /// Returns the mesh scaled about the origin.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> TriMesh {
        self.vertices.iter_mut().for_each(|v| *v *= factor);
        self
    }

    /// Checks that the mesh is not empty, that vertices are finite and within 1e9 m, that the mesh
    /// is at least 1e-30 m across, and that indices are in range.
    ///
    /// # Errors
    /// [`MeshError`] names the first fault; numbers count from 1, as in an OBJ file.
    pub fn check_data(&self) -> Result<(), MeshError> {
        if self.triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        if let Some(n) = self.vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            let v = self.vertices[n];
            return Err(MeshError::NotFinite { vertex: n + 1, x: v.x, y: v.y, z: v.z });
        }
        if let Some(n) = self.vertices.iter().position(|v| v.amax() > FARTHEST) {
            return Err(MeshError::TooFar { vertex: n + 1, value: self.vertices[n].amax() });
        }
        let count = self.vertices.len();
        for (n, triangle) in self.triangles.iter().enumerate() {
            if let Some(&v) = triangle.iter().find(|&&v| v as usize >= count) {
                return Err(MeshError::IndexOutOfRange { face: n + 1, index: i64::from(v) + 1, count });
            }
        }
        self.check_size()
    }

    fn check_size(&self) -> Result<(), MeshError> {
        let diagonal = self.diagonal();
        if diagonal < SMALLEST { Err(MeshError::TooSmall { diagonal }) } else { Ok(()) }
    }
}

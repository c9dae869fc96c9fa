//! A solid behind an open surface: rooms, walls, tunnels, and any other sheet of triangles.
//!
//! A vertex `p` of the surface has its copy at
//!
//! ```text
//! p − t m      m: the shortest least-squares solution of  nᵢ·m = 1  over the faces i of its fan
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `nᵢ` | unit normal of a face, weighted by its angle at the vertex |
//! | `t` | thickness, m; smaller where something lies behind the surface within `t / ROOM` |
//!
//! If the faces at a vertex have up to three different normals, `m` solves all equations, and the copy
//! of each face lies in a parallel plane at the distance `t`. A fan is what is connected at a vertex
//! across edges; if more than two faces meet at an edge, those that continue each other most straight are
//! connected.

use super::pairing::{BOUNDARY, Pairing};
use super::{FARTHEST, TriMesh};
use crate::ray::RayMesh;
use crate::{MeshError, Vec3};
use nalgebra::{ComplexField, Matrix3};

/// Default thickness as a fraction of the diagonal.
const DEFAULT_THICKNESS: f64 = 0.01;
/// Fraction of the way to what lies behind a surface that its solid may reach.
const ROOM: f64 = 0.4;
/// Maximum length of `m`: that of a fold of 29°.
const MITER: f64 = 4.0;
/// Eigenvalues below this fraction of the largest are no direction of their own.
const LEAST_EIGENVALUE: f64 = 1e-6;
/// Smallest cosine between a ray and the normal of a face that it hits: others lie beside the ray.
const BESIDE: f64 = 1e-3;
/// Fraction of the diagonal within which a face touches the start of a ray.
const TOUCHING: f64 = 1e-9;

impl TriMesh {
    /// Returns the solid that reaches `thickness` meters behind an open surface (`None`: a hundredth of its
    /// diagonal), or, if `centered`, half as far to both sides of it. The surface is any set of triangles: with
    /// holes, several pieces, edges with more than two faces. Faces look to the free side, counter-clockwise seen
    /// from there; a piece whose faces disagree gets the direction of most of its area.
    ///
    /// A closed piece whose faces look outward is a solid already and stays. Where something lies behind the
    /// surface, the solid reaches at most 0.4 of the way to it. The faces themselves are kept unless `centered`.
    ///
    /// ```
    /// use tumble_collide::{TriMesh, Vec3};
    /// // a room: a box whose faces look inward
    /// let mut room = TriMesh::cuboid(Vec3::new(4.0, 4.0, 3.0));
    /// room.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    /// let walls = room.thickened(Some(0.5), false)?;
    /// assert!((walls.signed_volume() - (5.0 * 5.0 * 4.0 - 4.0 * 4.0 * 3.0)).abs() < 1e-12);
    /// # Ok::<(), tumble_collide::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// As [`check_data`](Self::check_data); [`MeshError::Flat`] if no face has an area, and
    /// [`MeshError::Extrusion`] for a thickness that is not above 0 and at most 1e9 m.
    pub fn thickened(&self, thickness: Option<f64>, centered: bool) -> Result<TriMesh, MeshError> {
        self.check_data()?;
        let thickness = thickness.unwrap_or(DEFAULT_THICKNESS * self.diagonal());
        if !(thickness > 0.0 && thickness <= FARTHEST) {
            let what = format!("the thickness is {thickness} m, but must be above 0 and at most 1e9 m");
            return Err(MeshError::Extrusion { what, face: None });
        }
        let mut mesh = self.with_shared_vertices().0;
        let mut face_of: Vec<usize> = (0..mesh.triangles.len()).collect();
        mesh.drop_degenerate(true, &mut face_of);
        mesh.drop_duplicates(&mut face_of);
        if centered {
            mesh.drop_backs();
        }
        if mesh.triangles.is_empty() {
            return Err(MeshError::Flat { faces: self.triangles.len() });
        }
        mesh.face_one_way();
        Ok(Sheet::of(&mesh).thickened(thickness, centered))
    }

    /// Reverses faces that disagree with their neighbors. Each piece gets the direction of most of its area.
    fn face_one_way(&mut self) {
        let given = self.triangles.clone();
        if self.unify_winding() == 0 {
            return;
        }
        let pairing = Pairing::flattest(self);
        let mut kept = vec![0.0; pairing.pieces];
        for (t, before) in given.iter().enumerate() {
            let sign = if self.triangles[t] == *before { 1.0 } else { -1.0 };
            kept[pairing.piece[t] as usize] += sign * self.scaled_normal(t).norm();
        }
        for (t, triangle) in self.triangles.iter_mut().enumerate() {
            if kept[pairing.piece[t] as usize] < 0.0 {
                triangle.swap(1, 2);
            }
        }
    }

    /// Drops each face that has the same corners as an earlier one in the opposite orientation.
    fn drop_backs(&mut self) {
        let mut seen = std::collections::BTreeSet::new();
        self.triangles.retain(|t| {
            let mut corners = *t;
            corners.sort_unstable();
            seen.insert(corners)
        });
    }

    /// Returns the normal of a face with the length of twice its area.
    fn scaled_normal(&self, t: usize) -> Vec3 {
        let [a, b, c] = self.corners(t);
        (b - a).cross(&(c - a))
    }
}

/// A surface with its fans.
struct Sheet<'a> {
    mesh: &'a TriMesh,
    pairing: Pairing,
    /// The fan of each corner `3t + k`.
    fan: Vec<u32>,
    /// Vertex of each fan.
    vertex: Vec<u32>,
    /// The vector `m` of each fan.
    miter: Vec<Vec3>,
    /// Whether each face is on a piece that is a solid already.
    solid: Vec<bool>,
}

impl Sheet<'_> {
    fn of(mesh: &TriMesh) -> Sheet<'_> {
        let pairing = Pairing::flattest(mesh);
        let (fan, fans) = pairing.fans();
        let mut vertex = vec![0; fans];
        for (corner, &f) in fan.iter().enumerate() {
            vertex[f as usize] = mesh.triangles[corner / 3][corner % 3];
        }
        let solid_piece = solid_pieces(mesh, &pairing);
        let solid = pairing.piece.iter().map(|&piece| solid_piece[piece as usize]).collect();
        Sheet { mesh, miter: miters(mesh, &fan, fans), pairing, fan, vertex, solid }
    }

    fn thickened(&self, thickness: f64, centered: bool) -> TriMesh {
        let [ahead, behind] = if centered { [0.5, 0.5] } else { [0.0, 1.0] }.map(|part| part * thickness);
        let obstacles = RayMesh::new(self.mesh);
        let place = |t: f64, sign: f64| -> Vec<Vec3> {
            let reach = if t > 0.0 { self.reach(&obstacles, t, sign) } else { vec![0.0; self.vertex.len()] };
            let fans = self.vertex.iter().zip(&self.miter).zip(reach);
            fans.map(|((&v, m), reach)| self.mesh.vertices[v as usize] + m * (sign * reach)).collect()
        };
        let copies = self.vertex.len() as u32;
        let mut made = TriMesh { vertices: place(ahead, 1.0), triangles: Vec::new() };
        made.vertices.extend(place(behind, -1.0));
        let given = made.vertices.len() as u32;
        made.vertices.extend_from_slice(&self.mesh.vertices);
        for (t, triangle) in self.mesh.triangles.iter().enumerate() {
            if self.solid[t] {
                made.triangles.push(triangle.map(|v| v + given));
                continue;
            }
            let [a, b, c] = std::array::from_fn(|k| self.fan[3 * t + k]);
            made.triangles.push([a, b, c]);
            made.triangles.push([a + copies, c + copies, b + copies]);
            for (k, [u, v]) in [[a, b], [b, c], [c, a]].into_iter().enumerate() {
                if self.pairing.partner[3 * t + k] == BOUNDARY {
                    made.push_quad([v, u, u + copies, v + copies]);
                }
            }
        }
        made.compacted()
    }

    /// Returns how far each fan may move along `sign m`, meters: at most `t`, and a part of the way to any face
    /// that its vertex, or the middle of one of its faces, would meet.
    fn reach(&self, obstacles: &RayMesh, t: f64, sign: f64) -> Vec<f64> {
        let mut reach = vec![t; self.vertex.len()];
        let touching = TOUCHING * self.mesh.diagonal();
        let free = |from: &Vec3, way: &Vec3, own: &dyn Fn(&[u32; 3]) -> bool| {
            let length = way.norm();
            let Some(direction) = way.try_normalize(0.0) else { return t };
            let met = |triangle: u32, distance: f64| {
                let triangle = triangle as usize;
                let normal = self.mesh.scaled_normal(triangle);
                distance > touching
                    && normal.dot(&direction).abs() > BESIDE * normal.norm()
                    && !own(&self.mesh.triangles[triangle])
            };
            let hit =
                obstacles.first(from, &direction, t * length / ROOM, |triangle, distance, _| met(triangle, distance));
            hit.map_or(t, |hit| ROOM * hit.distance / length)
        };
        for (f, (&v, m)) in self.vertex.iter().zip(&self.miter).enumerate() {
            let from = &self.mesh.vertices[v as usize];
            reach[f] = reach[f].min(free(from, &(m * sign), &|corners| corners.contains(&v)));
        }
        for (face, corners) in self.mesh.triangles.iter().enumerate().filter(|(face, _)| !self.solid[*face]) {
            let middle = self.mesh.corners(face).iter().sum::<Vec3>() / 3.0;
            let Some(normal) = self.mesh.scaled_normal(face).try_normalize(0.0) else { continue };
            let free = free(&middle, &(normal * sign), &|other| other == corners);
            for k in 0..3 {
                let f = self.fan[3 * face + k] as usize;
                reach[f] = reach[f].min(free);
            }
        }
        reach
    }
}

/// Returns which pieces are closed and enclose a volume: solids already.
fn solid_pieces(mesh: &TriMesh, pairing: &Pairing) -> Vec<bool> {
    let origin = mesh.corners(0)[0];
    let mut volume = vec![0.0; pairing.pieces];
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t).map(|p| p - origin);
        volume[pairing.piece[t] as usize] += a.dot(&b.cross(&c));
    }
    pairing.has_boundary().iter().zip(volume).map(|(open, volume)| !open && volume > 0.0).collect()
}

/// Returns the vector `m` of each fan.
fn miters(mesh: &TriMesh, fan: &[u32], fans: usize) -> Vec<Vec3> {
    let mut equations = vec![(Matrix3::zeros(), Vec3::zeros()); fans];
    for t in 0..mesh.triangles.len() {
        let Some(normal) = mesh.scaled_normal(t).try_normalize(0.0) else { continue };
        let p = mesh.corners(t);
        for k in 0..3 {
            let [u, v] = [p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]];
            let angle = ComplexField::acos((u.dot(&v) / (u.norm() * v.norm())).clamp(-1.0, 1.0));
            let (matrix, sum) = &mut equations[fan[3 * t + k] as usize];
            *matrix += normal * normal.transpose() * angle;
            *sum += normal * angle;
        }
    }
    equations.iter().map(|(matrix, sum)| shortest(matrix, sum)).collect()
}

/// Returns the shortest least-squares solution of symmetric equations, no longer than [`MITER`].
fn shortest(matrix: &Matrix3<f64>, sum: &Vec3) -> Vec3 {
    let eigen = matrix.symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    let along = |k: usize| {
        let (value, axis) = (eigen.eigenvalues[k], eigen.eigenvectors.column(k));
        if value > LEAST_EIGENVALUE * largest { axis * (axis.dot(sum) / value) } else { Vec3::zeros() }
    };
    let solution: Vec3 = (0..3).map(along).sum();
    let length = solution.norm();
    if length > MITER { solution * (MITER / length) } else { solution }
}

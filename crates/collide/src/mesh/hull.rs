//! Convex hull of a mesh's vertices: quickhull (Barber, Dobkin and Huhdanpaa 1996) on integers,
//! without degenerate cases.
//!
//! Vertices are rounded to a grid of 2²⁰ cells along the longest side of their box, where the sign
//! of
//!
//! ```text
//! d(f, p) = (b − a) × (c − a) · (p − a),     f = (a, b, c) counter-clockwise seen from outside
//! ```
//!
//! is exact in 64 bits: products of three differences of at most 2²⁰ sum to less than 2⁶³. A face
//! is visible from `p` iff `d > 0`. The faces visible from a point form one patch with one simple
//! horizon, and no new face has zero area: if `p` were collinear with a horizon edge, it would lie
//! in the plane of the visible face at that edge.
//!
//! Departure from the paper: points in the plane of a face are not merged into it, so a flat side
//! consists of several triangles.

use super::TriMesh;
use crate::{MeshError, Vec3};
use std::collections::BTreeMap;

/// Number of grid cells along the longest side.
const GRID_CELLS: f64 = 1_048_576.0;

type Point = [i64; 3];

/// An edge of the horizon: from point, to point, the face beyond it, and the number of the edge in
/// that face.
type HorizonEdge = (u32, u32, usize, usize);

/// A triangle of the growing hull.
struct Face {
    corners: [u32; 3],
    /// The face beyond the edge from corner `k` to the next.
    beyond: [usize; 3],
    /// Points outside this face that are assigned to it.
    outside: Vec<u32>,
    active: bool,
}

impl TriMesh {
    /// Returns the convex hull of the vertices used by triangles: closed and outward-wound. Its
    /// vertices differ from the original ones by at most half a millionth of the longest side of
    /// the bounding box.
    ///
    /// # Errors
    /// As [`check_data`](Self::check_data); [`MeshError::NoVolume`] if all vertices lie in a plane
    /// (to that accuracy).
    pub fn convex_hull(&self) -> Result<TriMesh, MeshError> {
        self.check_data()?;
        let mesh = self.welded();
        let (least, cell) = (mesh.aabb().min, (mesh.aabb().max - mesh.aabb().min).max() / GRID_CELLS);
        if cell == 0.0 {
            return Err(MeshError::NoVolume { volume: 0.0 });
        }
        let mut points: Vec<Point> =
            mesh.vertices.iter().map(|v| ((v - least) / cell).map(|x| x.round() as i64).into()).collect();
        points.sort_unstable();
        points.dedup();
        let faces = Hull::of(&points).ok_or(MeshError::NoVolume { volume: 0.0 })?.triangles();
        let place = |p: &Point| least + cell * Vec3::new(p[0] as f64, p[1] as f64, p[2] as f64);
        Ok(TriMesh { vertices: points.iter().map(place).collect(), triangles: faces }.welded())
    }
}

struct Hull<'p> {
    points: &'p [Point],
    faces: Vec<Face>,
    /// Faces that can have points outside.
    pending: Vec<usize>,
}

impl<'p> Hull<'p> {
    /// Computes the hull; `None` if all points lie in a plane.
    fn of(points: &'p [Point]) -> Option<Hull<'p>> {
        let mut hull = Hull { points, faces: Vec::new(), pending: Vec::new() };
        hull.initial_tetrahedron()?;
        while let Some(face) = hull.pending.pop() {
            if hull.faces[face].active && !hull.faces[face].outside.is_empty() {
                hull.add_farthest(face);
            }
        }
        Some(hull)
    }

    /// Creates a tetrahedron of distant points and assigns all others to its faces.
    fn initial_tetrahedron(&mut self) -> Option<()> {
        let points = self.points;
        let all = || 0..points.len() as u32;
        let (a, b) = (0, points.len() as u32 - 1);
        let area = |p: &u32| {
            cross(points[a as usize], points[b as usize], points[*p as usize])
                .iter()
                .map(|x| i128::from(*x).pow(2))
                .sum::<i128>()
        };
        let c = all().max_by_key(area).filter(|p| area(p) > 0)?;
        let height = |p: &u32| self.signed_volume(&[a, b, c], *p).abs();
        let d = all().max_by_key(height).filter(|p| height(p) > 0)?;
        let [a, b] = if self.signed_volume(&[a, b, c], d) < 0 { [a, b] } else { [b, a] };
        for corners in [[a, b, c], [b, a, d], [c, b, d], [a, c, d]] {
            self.faces.push(Face { corners, beyond: [0; 3], outside: Vec::new(), active: true });
        }
        for (face, beyond) in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].into_iter().enumerate() {
            self.faces[face].beyond = beyond;
        }
        let others = all().filter(|p| ![a, b, c, d].contains(p)).collect();
        self.assign_points(others, 0);
        Some(())
    }

    /// Returns `d(f, p)`: positive if the face is visible from the point.
    fn signed_volume(&self, corners: &[u32; 3], p: u32) -> i64 {
        let [a, b, c] = corners.map(|v| self.points[v as usize]);
        let (n, p) = (cross(a, b, c), self.points[p as usize]);
        (0..3).map(|k| n[k] * (p[k] - a[k])).sum()
    }

    /// Assigns each point to the first face from `first` on that is visible from it. A point that
    /// sees no face is inside.
    fn assign_points(&mut self, points: Vec<u32>, first: usize) {
        for p in points {
            if let Some(face) = (first..self.faces.len()).find(|&f| self.signed_volume(&self.faces[f].corners, p) > 0) {
                self.faces[face].outside.push(p);
            }
        }
        self.pending.extend((first..self.faces.len()).filter(|&f| !self.faces[f].outside.is_empty()));
    }

    /// Replaces all faces visible from the farthest point of `face` by a cone from their horizon to
    /// it.
    fn add_farthest(&mut self, face: usize) {
        let corners = self.faces[face].corners;
        let Some(apex) = self.faces[face].outside.iter().copied().max_by_key(|&p| (self.signed_volume(&corners, p), p))
        else {
            return;
        };
        let (visible_patch, horizon) = self.visible_patch(face, apex);
        let first = self.faces.len();
        let number: BTreeMap<u32, usize> =
            horizon.iter().enumerate().map(|(k, (from, ..))| (*from, first + k)).collect();
        let before: BTreeMap<u32, usize> =
            horizon.iter().enumerate().map(|(k, (_, to, ..))| (*to, first + k)).collect();
        for (k, &(from, to, beyond, edge)) in horizon.iter().enumerate() {
            self.faces[beyond].beyond[edge] = first + k;
            self.faces.push(Face {
                corners: [from, to, apex],
                beyond: [beyond, number[&to], before[&from]],
                outside: Vec::new(),
                active: true,
            });
        }
        let mut left = Vec::new();
        for gone in visible_patch {
            self.faces[gone].active = false;
            left.extend(std::mem::take(&mut self.faces[gone].outside).into_iter().filter(|&p| p != apex));
        }
        self.assign_points(left, first);
    }

    /// Returns the faces visible from `apex`, and their horizon.
    fn visible_patch(&self, face: usize, apex: u32) -> (Vec<usize>, Vec<HorizonEdge>) {
        let mut visible_patch = vec![face];
        let mut inside: BTreeMap<usize, bool> = BTreeMap::from([(face, true)]);
        let mut horizon = Vec::new();
        let mut next = 0;
        while next < visible_patch.len() {
            let here = &self.faces[visible_patch[next]];
            next += 1;
            for k in 0..3 {
                let other = here.beyond[k];
                let seen = *inside.entry(other).or_insert_with(|| {
                    let seen = self.signed_volume(&self.faces[other].corners, apex) > 0;
                    if seen {
                        visible_patch.push(other);
                    }
                    seen
                });
                if !seen {
                    let (from, to) = (here.corners[k], here.corners[(k + 1) % 3]);
                    let edge = self.faces[other].corners.iter().position(|v| *v == to).unwrap_or(0);
                    horizon.push((from, to, other, edge));
                }
            }
        }
        (visible_patch, horizon)
    }

    fn triangles(self) -> Vec<[u32; 3]> {
        self.faces.into_iter().filter(|face| face.active).map(|face| face.corners).collect()
    }
}

/// `(b − a) × (c − a)`.
fn cross(a: Point, b: Point, c: Point) -> Point {
    let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

//! Convex hull of points: quickhull (Barber, Dobkin and Huhdanpaa 1996) on integers, without
//! degenerate cases.
//!
//! Points are rounded to a grid of 2⁴⁰ cells along the longest side of their box, where the sign of
//!
//! ```text
//! d(f, p) = (b − a) × (c − a) · (p − a),     f = (a, b, c) counter-clockwise seen from outside
//! ```
//!
//! is exact in 128 bits: products of three differences of at most 2⁴⁰ sum to less than 2¹²⁷. A face
//! is visible from `p` iff `d > 0`. The faces visible from a point form one patch with one simple
//! horizon, and no new face has zero area: if `p` were collinear with a horizon edge, it would lie
//! in the plane of the visible face at that edge.
//!
//! A point becomes a vertex only if it is more than [`FLAT`] outside the hull of those before it, so
//! that the rounding of a file adds no facets to a flat side. At the end all points left out are
//! compared with all faces, and vertices on an edge between two others are removed.
//!
//! Departure from the paper: points in the plane of a face are not merged into it, so a flat side
//! consists of several triangles.

use super::{FARTHEST, SMALLEST, TriMesh};
use crate::{Aabb, MeshError, Vec3};
use std::collections::{BTreeMap, BTreeSet};

/// Number of grid cells along the longest side.
const GRID_CELLS: f64 = 1_099_511_627_776.0;
/// Largest distance by which a point may be outside the hull, as a fraction of the longest side:
/// about the rounding of `f32` and of files with six digits.
const FLAT: f64 = 5e-7;
/// Height of a triangle below which one of its corners is on its longest side, as a fraction of the
/// longest side of the hull: its normal would be rounding.
const SLIVER: f64 = 5e-10;
/// Least volume, in cubes of the diagonal: a little above that of
/// [`check_closed`](TriMesh::check_closed).
const LEAST_VOLUME: f64 = 2e-12;
/// Maximum number of points.
const MAX_POINTS: usize = 10_000_000;

type Point = [i64; 3];
type Product = [i128; 3];

/// An edge of the horizon: from point, to point, the face beyond it, and the number of the edge in
/// that face.
type HorizonEdge = (u32, u32, usize, usize);

/// A triangle of the growing hull.
struct Face {
    corners: [u32; 3],
    /// The face beyond the edge from corner `k` to the next.
    beyond: [usize; 3],
    /// Points more than [`FLAT`] outside this face that are assigned to it.
    outside: Vec<u32>,
    /// Length of `(b − a) × (c − a)` in grid cells, for distances.
    double_area: f64,
    active: bool,
}

impl TriMesh {
    /// Returns the convex hull of the vertices used by triangles, as [`hull_of`](Self::hull_of).
    ///
    /// # Errors
    /// As [`check_data`](Self::check_data) and [`hull_of`](Self::hull_of).
    pub fn convex_hull(&self) -> Result<TriMesh, MeshError> {
        self.check_data()?;
        TriMesh::hull_of(&self.welded().vertices)
    }

    /// Returns the convex hull of points in meters: closed and outward-wound. Its vertices are given
    /// points, and no point is outside by more than half a millionth of the longest side of their
    /// bounding box.
    ///
    /// # Errors
    /// [`MeshError::Points`] if there are less than 4 points or more than 10 million,
    /// [`MeshError::NotFinite`] and [`MeshError::TooFar`] for the first wrong one,
    /// [`MeshError::Coplanar`] if all lie in a plane (to that accuracy), [`MeshError::NoVolume`] for a
    /// needle, and [`MeshError::TooSmall`].
    pub fn hull_of(points: &[Vec3]) -> Result<TriMesh, MeshError> {
        check_points(points)?;
        let bounds = Aabb::around(points.iter().copied());
        let (least, cell) = (bounds.min, (bounds.max - bounds.min).max() / GRID_CELLS);
        if (bounds.max - bounds.min).norm() < SMALLEST {
            return Err(MeshError::TooSmall { diagonal: (bounds.max - bounds.min).norm() });
        }
        // of the points in one cell, the first one
        let mut cells: Vec<(Point, u32)> = Vec::with_capacity(points.len());
        cells.extend(points.iter().zip(0..).map(|(p, n)| (((p - least) / cell).map(|x| x.round() as i64).into(), n)));
        cells.sort_unstable();
        cells.dedup_by_key(|(cell, _)| *cell);
        loop {
            let grid: Vec<Point> = cells.iter().map(|(cell, _)| *cell).collect();
            let triangles = Hull::of(&grid).ok_or(MeshError::Coplanar { points: points.len() })?.triangles();
            let redundant = on_edges(&grid, &triangles);
            if redundant.is_empty() {
                let vertices = cells.iter().map(|(_, n)| points[*n as usize]).collect();
                let hull = TriMesh { vertices, triangles }.welded();
                let volume = hull.clone().translated(&-least).signed_volume();
                return if volume > LEAST_VOLUME * hull.diagonal().powi(3) {
                    Ok(hull)
                } else {
                    Err(MeshError::NoVolume { volume })
                };
            }
            let mut kept: Vec<u32> = triangles.into_iter().flatten().filter(|v| !redundant.contains(v)).collect();
            kept.sort_unstable();
            kept.dedup();
            cells = kept.into_iter().map(|v| cells[v as usize]).collect();
        }
    }
}

/// Returns vertices that lie on the longest side of a triangle within [`SLIVER`]; of neighbors, one.
fn on_edges(points: &[Point], triangles: &[[u32; 3]]) -> BTreeSet<u32> {
    let (mut found, mut touched) = (BTreeSet::<u32>::new(), BTreeSet::<u32>::new());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|v| points[v as usize]);
        let sides = [(b, c), (c, a), (a, b)].map(|(u, v)| length(&difference(u, v)));
        let opposite = if sides[0] >= sides[1].max(sides[2]) { 0 } else { 1 + usize::from(sides[2] > sides[1]) };
        let flat = length(&cross(a, b, c)) < SLIVER * GRID_CELLS * sides[opposite];
        if flat && triangle.iter().all(|v| !touched.contains(v)) {
            found.insert(triangle[opposite]);
            touched.extend(triangle);
        }
    }
    found
}

fn check_points(points: &[Vec3]) -> Result<(), MeshError> {
    if !(4..=MAX_POINTS).contains(&points.len()) {
        return Err(MeshError::Points { count: points.len(), most: MAX_POINTS });
    }
    for (point, n) in points.iter().zip(1..) {
        if !point.iter().all(|x| x.is_finite()) {
            return Err(MeshError::NotFinite { vertex: n, x: point.x, y: point.y, z: point.z });
        }
        if point.amax() > FARTHEST {
            return Err(MeshError::TooFar { vertex: n, value: point.amax() });
        }
    }
    Ok(())
}

struct Hull<'p> {
    points: &'p [Point],
    faces: Vec<Face>,
    /// Faces that can have points outside.
    pending: Vec<usize>,
    /// Points that were outside by less than [`FLAT`].
    left_out: Vec<u32>,
}

impl<'p> Hull<'p> {
    /// Computes the hull; `None` if all points lie in a plane.
    fn of(points: &'p [Point]) -> Option<Hull<'p>> {
        let mut hull = Hull { points, faces: Vec::new(), pending: Vec::new(), left_out: Vec::new() };
        hull.initial_tetrahedron()?;
        loop {
            while let Some(face) = hull.pending.pop() {
                if hull.faces[face].active && !hull.faces[face].outside.is_empty() {
                    hull.add_farthest(face);
                }
            }
            // a point near one face can be far from another
            let left_out = std::mem::take(&mut hull.left_out);
            let faces: Vec<usize> = (0..hull.faces.len()).filter(|&f| hull.faces[f].active).collect();
            for p in left_out {
                if let Some(&face) = faces.iter().find(|&&f| hull.height(f, p) > FLAT * GRID_CELLS) {
                    hull.faces[face].outside.push(p);
                    hull.pending.push(face);
                }
            }
            if hull.pending.is_empty() {
                return Some(hull);
            }
        }
    }

    /// Creates a tetrahedron of distant points and assigns all others to its faces.
    fn initial_tetrahedron(&mut self) -> Option<()> {
        let points = self.points;
        let all = || 0..points.len() as u32;
        let a = extreme(all().map(|p| (p, length(&difference(points[0], points[p as usize])))), |_| 0.0)?;
        let from = |origin: u32| move |p: u32| length(&difference(points[origin as usize], points[p as usize]));
        let b = extreme(all().map(|p| (p, from(a)(p))), |_| 0.0)?;
        let area = |p: u32| length(&cross(points[a as usize], points[b as usize], points[p as usize]));
        let c = extreme(all().map(|p| (p, area(p) / from(a)(b))), from(a))?;
        let height = |p: u32| (self.signed_volume(&[a, b, c], p) as f64 / area(c)).abs();
        let d = extreme(all().map(|p| (p, height(p))), from(a))?;
        let [a, b] = if self.signed_volume(&[a, b, c], d) < 0 { [a, b] } else { [b, a] };
        for corners in [[a, b, c], [b, a, d], [c, b, d], [a, c, d]] {
            self.add_face(corners, [0; 3]);
        }
        for (face, beyond) in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]].into_iter().enumerate() {
            self.faces[face].beyond = beyond;
        }
        let others = all().filter(|p| ![a, b, c, d].contains(p)).collect();
        self.assign_points(others, 0);
        Some(())
    }

    /// Returns `d(f, p)`: positive if the face is visible from the point.
    fn signed_volume(&self, corners: &[u32; 3], p: u32) -> i128 {
        let [a, b, c] = corners.map(|v| self.points[v as usize]);
        let (n, p) = (cross(a, b, c), self.points[p as usize]);
        (0..3).map(|k| n[k] * i128::from(p[k] - a[k])).sum()
    }

    /// Returns the height of a point above a face, in grid cells.
    fn height(&self, face: usize, p: u32) -> f64 {
        self.signed_volume(&self.faces[face].corners, p) as f64 / self.faces[face].double_area
    }

    fn add_face(&mut self, corners: [u32; 3], beyond: [usize; 3]) {
        let [a, b, c] = corners.map(|v| self.points[v as usize]);
        let double_area = length(&cross(a, b, c));
        self.faces.push(Face { corners, beyond, outside: Vec::new(), double_area, active: true });
    }

    /// Assigns each point to the first face from `first` on that it is outside of by more than
    /// [`FLAT`]. A point that sees no face is inside.
    fn assign_points(&mut self, points: Vec<u32>, first: usize) {
        for p in points {
            let heights = (first..self.faces.len()).map(|f| (f, self.height(f, p)));
            let mut highest = f64::NEG_INFINITY;
            let far = heights.inspect(|(_, h)| highest = highest.max(*h)).find(|(_, h)| *h > FLAT * GRID_CELLS);
            match far {
                Some((face, _)) => self.faces[face].outside.push(p),
                None if highest > 0.0 => self.left_out.push(p),
                None => {}
            }
        }
        self.pending.extend((first..self.faces.len()).filter(|&f| !self.faces[f].outside.is_empty()));
    }

    /// Replaces all faces visible from the farthest point of `face` by a cone from their horizon to
    /// it.
    fn add_farthest(&mut self, face: usize) {
        let corners = self.faces[face].corners;
        let heights = self.faces[face].outside.iter().map(|&p| (p, self.height(face, p)));
        let near = self.points[corners[0] as usize];
        let Some(apex) = extreme(heights, |p| length(&difference(near, self.points[p as usize]))) else { return };
        let (visible_patch, horizon) = self.visible_patch(face, apex);
        let first = self.faces.len();
        let number: BTreeMap<u32, usize> =
            horizon.iter().enumerate().map(|(k, (from, ..))| (*from, first + k)).collect();
        let before: BTreeMap<u32, usize> =
            horizon.iter().enumerate().map(|(k, (_, to, ..))| (*to, first + k)).collect();
        for (k, &(from, to, beyond, edge)) in horizon.iter().enumerate() {
            self.faces[beyond].beyond[edge] = first + k;
            self.add_face([from, to, apex], [beyond, number[&to], before[&from]]);
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

/// Returns the highest point if it is more than [`FLAT`] high. Of those within [`FLAT`] of it, the one
/// that is farthest along a flat side, which is a corner of it.
fn extreme(heights: impl Iterator<Item = (u32, f64)> + Clone, along: impl Fn(u32) -> f64) -> Option<u32> {
    let flat = FLAT * GRID_CELLS;
    let highest = heights.clone().map(|(_, h)| h).fold(flat, f64::max);
    let ties = heights.filter(|(_, h)| *h > flat && *h >= highest - flat).map(|(p, h)| (p, along(p), h));
    ties.max_by(|x, y| x.1.total_cmp(&y.1).then(x.2.total_cmp(&y.2)).then(y.0.cmp(&x.0))).map(|(p, ..)| p)
}

/// `b − a`.
fn difference(a: Point, b: Point) -> Product {
    [0, 1, 2].map(|k| i128::from(b[k] - a[k]))
}

/// `(b − a) × (c − a)`.
fn cross(a: Point, b: Point, c: Point) -> Product {
    let [u, v] = [difference(a, b), difference(a, c)];
    [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
}

fn length(v: &Product) -> f64 {
    Vec3::from(v.map(|x| x as f64)).norm()
}

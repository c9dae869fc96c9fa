//! Solids under open surfaces: height fields, and surfaces closed by a copy of themselves.

use super::{FARTHEST, TriMesh};
use crate::{MeshError, Vec3};

/// Maximum number of heights: 2048 × 2048.
const MAX_HEIGHTS: usize = 4_194_304;
/// Smallest sine of the angle between a face and the direction of extrusion.
const STEEPEST: f64 = 1e-6;
/// Default thickness as a fraction of the longer horizontal side.
const DEFAULT_THICKNESS: f64 = 0.1;

impl TriMesh {
    /// Returns the solid under a grid of heights: closed, with a flat bottom and vertical walls.
    ///
    /// `heights` in meters run along x first, in rows of `columns` from the smallest y to the
    /// largest. The grid has `size` meters along x and y and is centered on the origin; a height is
    /// a z coordinate. Each cell is two triangles, with the diagonal from its least x and y to its
    /// largest. The bottom is `thickness` meters below the lowest height; `None` is
    /// a tenth of the longer side.
    ///
    /// ```
    /// use tumble_collide::TriMesh;
    /// let ramp = TriMesh::height_field(&[0.0, 1.0, 0.0, 1.0], 2, [4.0, 3.0], Some(0.5))?;
    /// assert!((ramp.signed_volume() - 4.0 * 3.0 * (0.5 + 0.5)).abs() < 1e-12);
    /// # Ok::<(), tumble_collide::MeshError>(())
    /// ```
    ///
    /// # Errors
    /// [`MeshError::HeightField`]: less than 2 rows or columns, more than 4,194,304 heights, an
    /// incomplete row, a height that is not finite or beyond 1e9 m, or a size or thickness that is
    /// not above 0.
    pub fn height_field(
        heights: &[f64],
        columns: usize,
        size: [f64; 2],
        thickness: Option<f64>,
    ) -> Result<TriMesh, MeshError> {
        check_heights(heights, columns)?;
        let thickness = thickness.unwrap_or(DEFAULT_THICKNESS * size[0].max(size[1]));
        for (what, value) in [("size x", size[0]), ("size y", size[1]), ("thickness", thickness)] {
            if !(value > 0.0 && value <= FARTHEST) {
                let what = format!("has a {what} of {value} m, but it must be above 0 and at most 1e9 m");
                return Err(MeshError::HeightField { what });
            }
        }
        let rows = heights.len() / columns;
        let bottom = heights.iter().copied().fold(f64::INFINITY, f64::min) - thickness;
        let coordinate = |n: usize, count: usize, size: f64| size * (n as f64 / (count - 1) as f64 - 0.5);
        let place = |n: usize| {
            let (x, y) = (coordinate(n % columns, columns, size[0]), coordinate(n / columns, rows, size[1]));
            Vec3::new(x, y, heights[n])
        };
        let mut mesh = TriMesh { vertices: (0..heights.len()).map(place).collect(), triangles: Vec::new() };
        let at = |i: usize, j: usize| (j * columns + i) as u32;
        for j in 0..rows - 1 {
            for i in 0..columns - 1 {
                mesh.push_quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        // once around, counter-clockwise seen from above
        let (right, back) = (columns - 1, rows - 1);
        let front_edge = (0..right).map(|i| at(i, 0));
        let right_edge = (0..back).map(|j| at(right, j));
        let back_edge = (1..=right).rev().map(|i| at(i, back));
        let left_edge = (1..=back).rev().map(|j| at(0, j));
        let around: Vec<u32> = front_edge.chain(right_edge).chain(back_edge).chain(left_edge).collect();
        let below = mesh.vertices.len() as u32;
        for v in &around {
            let v = mesh.vertices[*v as usize];
            mesh.vertices.push(Vec3::new(v.x, v.y, bottom));
        }
        let middle = mesh.vertices.len() as u32;
        mesh.vertices.push(Vec3::new(0.0, 0.0, bottom));
        for (k, next) in (0..around.len()).map(|k| (k, (k + 1) % around.len())) {
            let [low, low_next] = [k, next].map(|k| below + k as u32);
            mesh.push_quad([around[k], low, low_next, around[next]]);
            mesh.triangles.push([middle, low_next, low]);
        }
        Ok(mesh)
    }

    /// Returns the solid that reaches `thickness` meters straight down from an open surface; `None` is
    /// a tenth of the longer horizontal side. See [`extruded`](Self::extruded).
    ///
    /// # Errors
    /// As [`extruded`](Self::extruded), and [`MeshError::Extrusion`] for a thickness that is not above
    /// 0 and at most 1e9 m.
    pub fn terrain(&self, thickness: Option<f64>) -> Result<TriMesh, MeshError> {
        self.check_data()?;
        let size = self.aabb().max - self.aabb().min;
        let thickness = thickness.unwrap_or(DEFAULT_THICKNESS * size.x.max(size.y));
        if !(thickness > 0.0 && thickness <= FARTHEST) {
            let what = format!("the thickness is {thickness} m, but must be above 0 and at most 1e9 m");
            return Err(MeshError::Extrusion { what, face: None });
        }
        self.extruded(Vec3::new(0.0, 0.0, -thickness))
    }

    /// Returns the solid between an open surface and its copy moved by `offset` meters: for terrain,
    /// straight down. The surface may have holes. All of its faces must look away from `offset`, or
    /// all towards it, which turns them.
    ///
    /// # Errors
    /// As [`check_data`](Self::check_data); [`MeshError::Extrusion`] for an offset of 0 or not
    /// finite, and for a face along the offset or on the other side than the first one.
    pub fn extruded(&self, offset: Vec3) -> Result<TriMesh, MeshError> {
        self.check_data()?;
        let length = offset.norm();
        if !(length > 0.0 && length <= FARTHEST) {
            let what = format!("the offset is {length} m long, but must be above 0 and at most 1e9 m");
            return Err(MeshError::Extrusion { what, face: None });
        }
        let mut mesh = self.with_shared_vertices().0;
        let slope = |mesh: &TriMesh, t: usize| {
            let [a, b, c] = mesh.corners(t);
            let normal = (b - a).cross(&(c - a));
            let area = normal.norm();
            (area > 0.0).then(|| -normal.dot(&offset) / (area * length))
        };
        let slopes: Vec<Option<f64>> = (0..mesh.triangles.len()).map(|t| slope(&mesh, t)).collect();
        let Some(first) = slopes.iter().flatten().next().copied() else {
            return Err(MeshError::Flat { faces: mesh.triangles.len() });
        };
        for (t, slope) in slopes.iter().enumerate() {
            if let Some(slope) = slope.filter(|slope| slope * first.signum() < STEEPEST) {
                let angle = nalgebra::ComplexField::acos(slope.clamp(-1.0, 1.0)).to_degrees();
                let what = format!(
                    "face {} is turned by {angle:.1}° from the direction of extrusion; all faces must look to one side \
                     of it, none along it",
                    t + 1
                );
                return Err(MeshError::Extrusion { what, face: Some(t + 1) });
            }
        }
        let mut kept = slopes.iter().map(Option::is_some);
        mesh.triangles.retain(|_| kept.next() == Some(true));
        if first < 0.0 {
            mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        Ok(mesh.closed_by_copy(&offset))
    }

    fn closed_by_copy(mut self, offset: &Vec3) -> TriMesh {
        let directed = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
        let mut edges: Vec<(u32, u32)> = self.triangles.iter().flat_map(directed).collect();
        edges.sort_unstable();
        let open: Vec<(u32, u32)> =
            edges.iter().copied().filter(|(u, v)| edges.binary_search(&(*v, *u)).is_err()).collect();
        let (copy, faces) = (self.vertices.len() as u32, self.triangles.len());
        self.vertices.extend_from_within(..);
        self.vertices[copy as usize..].iter_mut().for_each(|v| *v += offset);
        for t in 0..faces {
            let [a, b, c] = self.triangles[t].map(|v| v + copy);
            self.triangles.push([a, c, b]);
        }
        for (u, v) in open {
            self.push_quad([v, u, u + copy, v + copy]);
        }
        self.compacted()
    }
}

fn check_heights(heights: &[f64], columns: usize) -> Result<(), MeshError> {
    let wrong = |what: String| Err(MeshError::HeightField { what });
    let count = heights.len();
    if columns < 2 || count / columns < 2 || !count.is_multiple_of(columns) {
        return wrong(format!(
            "has {count} heights in rows of {columns}, but needs at least 2 full rows of at least 2"
        ));
    }
    if count > MAX_HEIGHTS {
        return wrong(format!("has {count} heights, but at most {MAX_HEIGHTS} are allowed"));
    }
    match heights.iter().position(|h| !h.is_finite() || h.abs() > FARTHEST) {
        Some(n) => wrong(format!(
            "has a height of {} m in row {}, column {}, but heights must be finite and within 1e9 m",
            heights[n],
            n / columns + 1,
            n % columns + 1
        )),
        None => Ok(()),
    }
}

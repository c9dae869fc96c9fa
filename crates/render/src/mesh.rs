//! Triangle meshes for the renderer: one normal per vertex, with vertices split at hard edges.

use crate::RenderError;
use nalgebra::Vector3;
use std::f32::consts::{PI, TAU};

/// Largest number of vertices, and of indices, of a single mesh.
pub const MAX_MESH_VERTICES: usize = 1 << 24;

/// Triangles with a normal per vertex, in the mesh's own frame, m. They are counter-clockwise seen
/// from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeshData {
    /// One point per vertex.
    pub positions: Vec<[f32; 3]>,
    /// One unit vector per vertex.
    pub normals: Vec<[f32; 3]>,
    /// Three vertex indices per triangle.
    pub indices: Vec<u32>,
    /// Texture coordinates per vertex (0 to 1 from the left and lower edge, repeated beyond), and
    /// how often the texture repeats per meter; empty if textures are projected by position.
    pub unwrapped: Vec<[f32; 3]>,
}

impl MeshData {
    /// Builds a mesh from triangles. Normals are smoothed over edges flatter than `crease_rad`;
    /// vertices are split at sharper ones.
    ///
    /// The normal of a corner is the sum of the normals of the faces around its vertex, weighted by
    /// their angle there, over the faces that lie within `crease_rad` of the corner's own face. `0`
    /// gives flat shading; `0.6` (34 degrees) suits most. Triangles without area are dropped.
    ///
    /// # Errors
    /// [`RenderError::BadMesh`] for an index out of range, a number that is not finite, or too many
    /// vertices.
    pub fn from_triangles(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        crease_rad: f32,
    ) -> Result<Self, RenderError> {
        check_counts(positions.len(), triangles.len() * 3)?;
        check_finite(positions, "position")?;
        check_indices(triangles.iter().flatten().copied(), positions.len())?;
        Ok(Self::smoothed(positions, triangles, &[], crease_rad))
    }

    /// Builds a mesh with texture coordinates: those of the three corners of each triangle.
    /// Vertices are split if these differ.
    ///
    /// # Errors
    /// As [`MeshData::from_triangles`]; also for a different number of triangles, or coordinates
    /// that are not finite.
    pub fn from_unwrapped(
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        places: &[[[f32; 2]; 3]],
        crease_rad: f32,
    ) -> Result<Self, RenderError> {
        check_counts(positions.len(), triangles.len() * 3)?;
        check_finite(positions, "position")?;
        check_indices(triangles.iter().flatten().copied(), positions.len())?;
        if places.len() != triangles.len() || places.iter().flatten().flatten().any(|x| !x.is_finite()) {
            return Err(RenderError::BadMesh(format!(
                "texture coordinates of {} triangles, expected finite ones of {}",
                places.len(),
                triangles.len()
            )));
        }
        Ok(Self::smoothed(positions, triangles, places, crease_rad))
    }

    /// Splits vertices at creases, and if their texture coordinates differ.
    fn smoothed(positions: &[[f32; 3]], triangles: &[[u32; 3]], places: &[[[f32; 2]; 3]], crease_rad: f32) -> Self {
        let point = |i: u32| Vector3::from(positions[i as usize]);
        let faces: Vec<Face> =
            triangles.iter().enumerate().filter_map(|(i, &t)| Face::new(t, t.map(point), places.get(i))).collect();
        let around = corners_around(&faces, positions.len());
        let mut mesh = MeshData::default();
        let cos_crease = crease_rad.clamp(0.0, PI).cos() - 1e-6;
        let mut made: Vec<Vec<u32>> = vec![Vec::new(); positions.len()]; // vertices already split off each point
        for face in &faces {
            for (k, &v) in face.vertices.iter().enumerate() {
                let sum: Vector3<f32> = around[v as usize]
                    .iter()
                    .filter(|&&(f, _)| faces[f as usize].normal.dot(&face.normal) >= cos_crease)
                    .map(|&(f, angle)| faces[f as usize].normal * angle)
                    .sum();
                let normal: [f32; 3] = sum.try_normalize(1e-12).unwrap_or(face.normal).into();
                let place = face.places.map(|places| [places[k][0], places[k][1], face.per_meter]);
                let same = |&i: &u32| {
                    let i = i as usize;
                    (Vector3::from(mesh.normals[i]) - Vector3::from(normal)).norm() < 1e-4
                        && place.is_none_or(|p| mesh.unwrapped[i][..2] == p[..2])
                };
                let index = match made[v as usize].iter().copied().find(same) {
                    Some(index) => index,
                    None => {
                        let index = mesh.push(positions[v as usize], normal);
                        mesh.unwrapped.extend(place);
                        made[v as usize].push(index);
                        index
                    }
                };
                mesh.indices.push(index);
            }
        }
        mesh
    }

    /// A box with the given edges and flat faces.
    pub fn cuboid(size: [f32; 3]) -> Self {
        let half = size.map(|edge| 0.5 * edge);
        let mut mesh = MeshData::default();
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut normal = [0.0; 3];
                normal[axis] = sign;
                let corner = |a: f32, b: f32| {
                    let mut p = [0.0; 3];
                    (p[axis], p[u], p[v]) = (sign * half[axis], a * half[u], b * half[v]);
                    p
                };
                let ring = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                let first = ring.map(|p| mesh.push(p, normal))[0];
                let order: [u32; 6] = if sign > 0.0 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
                mesh.indices.extend(order.map(|i| first + i));
            }
        }
        mesh
    }

    /// A box from −½ to ½ on every axis.
    pub fn unit_box() -> Self {
        Self::cuboid([1.0; 3])
    }

    /// A box of the given size whose edges are rounded with `radius`, at most half of the shortest
    /// edge. Highlights on the edges make its form visible.
    pub fn rounded_cuboid(size: [f32; 3], radius: f32, segments: usize) -> Self {
        let half = size.map(|edge| 0.5 * edge);
        let radius = radius.clamp(0.0, half[0].min(half[1]).min(half[2]));
        let n = segments.clamp(1, 32) as i32;
        let mut mesh = MeshData::default();
        for axis in 0..3 {
            for sign in [-1.0f32, 1.0] {
                let first = mesh.positions.len() as u32;
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                // the two edges of each strip are fillets of 45 degrees, the middle is flat
                let fillet = |i: i32, side: f32| (i as f32 / n as f32 * PI / 4.0, side);
                let stations: Vec<(f32, f32)> =
                    (-n..=0).map(|i| fillet(i, -1.0)).chain((0..=n).map(|i| fillet(i, 1.0))).collect();
                for &(a, side_u) in &stations {
                    for &(b, side_v) in &stations {
                        let mut dir = Vector3::zeros();
                        (dir[axis], dir[u], dir[v]) = (sign, a.tan(), b.tan());
                        let normal = dir.normalize();
                        let mut core = Vector3::zeros();
                        (core[axis], core[u], core[v]) =
                            (sign * (half[axis] - radius), side_u * (half[u] - radius), side_v * (half[v] - radius));
                        mesh.push((core + normal * radius).into(), normal.into());
                    }
                }
                mesh.grid_indices(first, stations.len() as u32, stations.len() as u32, sign > 0.0);
            }
        }
        mesh
    }

    /// A sphere of the given radius by latitude and longitude: `2 * rings` meridians, poles on ±z.
    pub fn uv_sphere(radius: f32, rings: usize) -> Self {
        let rings = rings.clamp(3, 2048);
        let profile = (0..=rings).map(|i| {
            let a = PI * i as f32 / rings as f32 - PI / 2.0;
            ([a.cos() * radius, a.sin() * radius], [a.cos(), a.sin()])
        });
        Self::revolve(&profile.collect::<Vec<_>>(), 2 * rings)
    }

    /// A closed cylinder around z, centered at the origin.
    pub fn cylinder(radius: f32, length: f32, segments: usize) -> Self {
        let (r, h) = (radius, 0.5 * length);
        Self::lathe(&[[0.0, -h], [r, -h], [r, h], [0.0, h]], segments, 0.5)
    }

    /// A capsule around z, centered at the origin: a cylinder of this length closed by hemispheres.
    pub fn capsule(radius: f32, length: f32, segments: usize) -> Self {
        let half_length = 0.5 * length;
        let quarter = (segments / 4).clamp(2, 512);
        let arc = |i: usize, from: f32, shift: f32| {
            let a = from + PI / 2.0 * i as f32 / quarter as f32;
            ([a.cos() * radius, a.sin() * radius + shift], [a.cos(), a.sin()])
        };
        let below = (0..=quarter).map(|i| arc(i, -PI / 2.0, -half_length));
        let above = (0..=quarter).map(|i| arc(i, 0.0, half_length));
        Self::revolve(&below.chain(above).collect::<Vec<_>>(), segments)
    }

    /// A solid of revolution around z from a profile of `[radius, z]`, listed from bottom to top
    /// (pins, bowls, bottles). Corners of the profile sharper than `crease_rad` stay hard.
    pub fn lathe(profile: &[[f32; 2]], segments: usize, crease_rad: f32) -> Self {
        let edge_normal = |i: usize| {
            let (a, b) = (profile[i], profile[i + 1]);
            nalgebra::Vector2::new(b[1] - a[1], a[0] - b[0]).try_normalize(1e-12)
        };
        let mut points = Vec::new();
        for i in 0..profile.len() {
            let before = if i > 0 { edge_normal(i - 1) } else { None };
            let after = if i + 1 < profile.len() { edge_normal(i) } else { None };
            match (before, after) {
                (Some(a), Some(b)) if a.dot(&b) < crease_rad.cos() => {
                    points.extend([(profile[i], a.into()), (profile[i], b.into())])
                }
                (a, b) => {
                    let sum = a.unwrap_or_default() + b.unwrap_or_default();
                    points.push((profile[i], sum.try_normalize(1e-12).map_or([0.0, 1.0], Into::into)));
                }
            }
        }
        Self::revolve(&points, segments)
    }

    /// A square of this side in the plane `z = 0`, centered at the origin, normal up.
    pub fn ground_quad(size: f32) -> Self {
        let h = 0.5 * size;
        MeshData {
            positions: vec![[-h, -h, 0.0], [h, -h, 0.0], [h, h, 0.0], [-h, h, 0.0]],
            normals: vec![[0.0, 0.0, 1.0]; 4],
            indices: vec![0, 1, 2, 0, 2, 3],
            unwrapped: Vec::new(),
        }
    }

    /// The corners `(min, max)` of the bounding box; `None` for an empty mesh.
    pub fn bounds(&self) -> Option<([f32; 3], [f32; 3])> {
        let mut points = self.positions.iter();
        let first = *points.next()?;
        Some(points.fold((first, first), |(lo, hi), p| {
            (std::array::from_fn(|k| lo[k].min(p[k])), std::array::from_fn(|k| hi[k].max(p[k])))
        }))
    }

    /// Checks that the arrays fit each other and hold finite numbers.
    ///
    /// # Errors
    /// [`RenderError::BadMesh`] names the fault.
    pub fn validate(&self) -> Result<(), RenderError> {
        check_counts(self.positions.len(), self.indices.len())?;
        if self.normals.len() != self.positions.len() {
            return Err(RenderError::BadMesh(format!(
                "{} normals for {} positions, expected as many",
                self.normals.len(),
                self.positions.len()
            )));
        }
        if !self.unwrapped.is_empty() && self.unwrapped.len() != self.positions.len() {
            return Err(RenderError::BadMesh(format!(
                "{} texture coordinates for {} positions, expected as many",
                self.unwrapped.len(),
                self.positions.len()
            )));
        }
        check_finite(&self.unwrapped, "texture coordinate")?;
        if !self.indices.len().is_multiple_of(3) {
            return Err(RenderError::BadMesh(format!("{} indices, expected a multiple of 3", self.indices.len())));
        }
        check_finite(&self.positions, "position")?;
        check_finite(&self.normals, "normal")?;
        check_indices(self.indices.iter().copied(), self.positions.len())
    }

    fn push(&mut self, position: [f32; 3], normal: [f32; 3]) -> u32 {
        self.positions.push(position);
        self.normals.push(normal);
        (self.positions.len() - 1) as u32
    }

    /// Sweeps `([radius, z], [normal_radius, normal_z])` around z.
    fn revolve(profile: &[([f32; 2], [f32; 2])], segments: usize) -> Self {
        let segments = segments.clamp(3, 4096);
        let mut mesh = MeshData::default();
        let widest = profile.iter().fold(0f32, |w, ([r, _], _)| w.max(r.abs()));
        for s in 0..=segments {
            let (sin, cos) = (TAU * (s % segments) as f32 / segments as f32).sin_cos();
            for ([r, z], [nr, nz]) in profile {
                let r = if r.abs() < 1e-6 * widest { 0.0 } else { *r }; // poles meet exactly
                mesh.push([r * cos, r * sin, *z], [nr * cos, nr * sin, *nz]);
            }
        }
        mesh.grid_indices(0, segments as u32 + 1, profile.len() as u32, true);
        mesh
    }

    /// Adds two triangles per cell of a `rows` x `columns` grid of vertices that starts at `first`.
    fn grid_indices(&mut self, first: u32, rows: u32, columns: u32, outward: bool) {
        for i in 0..rows.saturating_sub(1) {
            for j in 0..columns.saturating_sub(1) {
                let a = first + i * columns + j;
                let (b, c, d) = (a + columns, a + columns + 1, a + 1);
                for t in [[a, b, c], [a, c, d]] {
                    self.push_unless_flat(if outward { t } else { [t[0], t[2], t[1]] });
                }
            }
        }
    }

    fn push_unless_flat(&mut self, t: [u32; 3]) {
        let [a, b, c] = t.map(|i| self.positions[i as usize]);
        if a != b && b != c && c != a {
            self.indices.extend(t);
        }
    }
}

struct Face {
    vertices: [u32; 3],
    normal: Vector3<f32>,
    angles: [f32; 3],
    places: Option<[[f32; 2]; 3]>,
    /// Repetitions of the texture per meter: the root of the ratio of the areas.
    per_meter: f32,
}

impl Face {
    fn new(vertices: [u32; 3], [a, b, c]: [Vector3<f32>; 3], places: Option<&[[f32; 2]; 3]>) -> Option<Face> {
        let area = (b - a).cross(&(c - a));
        let flat =
            places.map_or(0.0, |[p, q, r]| ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])).abs());
        let per_meter = (flat / area.norm()).sqrt().min(1e6);
        let normal = area.try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()))?;
        let angles = [(b - a).angle(&(c - a)), (a - b).angle(&(c - b)), (a - c).angle(&(b - c))];
        Some(Face { vertices, normal, angles, places: places.copied(), per_meter })
    }
}

/// Returns, for every point, the faces that meet there and their angle at it.
fn corners_around(faces: &[Face], points: usize) -> Vec<Vec<(u32, f32)>> {
    let mut around = vec![Vec::new(); points];
    for (f, face) in faces.iter().enumerate() {
        for k in 0..3 {
            around[face.vertices[k] as usize].push((f as u32, face.angles[k]));
        }
    }
    around
}

fn check_counts(vertices: usize, indices: usize) -> Result<(), RenderError> {
    for (what, count) in [("mesh vertices", vertices), ("mesh indices", indices)] {
        if count > MAX_MESH_VERTICES {
            return Err(RenderError::TooMany { what, count, cap: MAX_MESH_VERTICES });
        }
    }
    Ok(())
}

fn check_finite(rows: &[[f32; 3]], what: &str) -> Result<(), RenderError> {
    match rows.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(i) => Err(RenderError::BadMesh(format!("{what} {i} is {:?}, expected finite numbers", rows[i]))),
        None => Ok(()),
    }
}

fn check_indices(mut indices: impl Iterator<Item = u32>, vertices: usize) -> Result<(), RenderError> {
    match indices.find(|&i| i as usize >= vertices) {
        Some(i) => Err(RenderError::BadMesh(format!("index {i} in a mesh of {vertices} vertices, expected less"))),
        None => Ok(()),
    }
}

//! Generators of closed, outward-wound meshes. Angles use `libm`, so every platform gets the same
//! bits.

use super::TriMesh;
use crate::{MeshError, Vec3};
use nalgebra::ComplexField;
use std::f64::consts::PI;

/// Maximum number of segments around an axis.
const MAX_SEGMENTS: usize = 4096;

impl TriMesh {
    /// Returns a box about the origin with edges of `size` meters, above 0: 8 vertices, 12
    /// triangles.
    pub fn cuboid(size: Vec3) -> TriMesh {
        let half_extents = 0.5 * size;
        let vertices = (0..8_u32).map(|n| half_extents.zip_map(&signs(n), |h, s| h * s)).collect();
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        TriMesh { vertices, triangles: quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect() }
    }

    /// Returns a sphere of meridians and parallels, poles on z. At least 3 segments and 2 rings.
    pub fn uv_sphere(radius: f64, segments: usize, rings: usize) -> TriMesh {
        let rings = rings.clamp(2, MAX_SEGMENTS);
        let profile: Vec<_> = (0..=rings).map(|n| on_arc(radius, 0.0, PI * n as f64 / rings as f64)).collect();
        revolve(&profile, segments)
    }

    /// Returns a sphere from an icosahedron whose faces are split 1:4 `subdivisions` times (at most
    /// 7).
    pub fn icosphere(radius: f64, subdivisions: u32) -> TriMesh {
        let mut mesh = icosahedron();
        for _ in 0..subdivisions.min(7) {
            mesh = mesh.split_on_sphere();
        }
        mesh.scaled(radius)
    }

    /// Returns a cylinder along z about the origin; meters.
    pub fn cylinder(radius: f64, length: f64, segments: usize) -> TriMesh {
        let half_length = 0.5 * length;
        revolve(&[(0.0, -half_length), (radius, -half_length), (radius, half_length), (0.0, half_length)], segments)
    }

    /// Returns a capsule along z about the origin; meters, `length` without the caps, `rings` per
    /// cap.
    pub fn capsule(radius: f64, length: f64, segments: usize, rings: usize) -> TriMesh {
        let half_length = 0.5 * length;
        let rings = rings.clamp(1, MAX_SEGMENTS);
        let angle = |n: usize| 0.5 * PI * n as f64 / rings as f64;
        let lower = (0..=rings).map(|n| on_arc(radius, -half_length, angle(n)));
        let upper = (0..=rings).map(|n| on_arc(radius, half_length, angle(n) + 0.5 * PI));
        revolve(&lower.chain(upper).collect::<Vec<_>>(), segments)
    }

    /// Returns a torus around z: `major` is the radius of the tube's center line, `minor` the
    /// tube's radius (below `major`), meters.
    pub fn torus(major: f64, minor: f64, segments: usize, sides: usize) -> TriMesh {
        let (segments, sides) = (segments.clamp(3, MAX_SEGMENTS), sides.clamp(3, MAX_SEGMENTS));
        let mut mesh = TriMesh::default();
        for n in 0..segments {
            let (sin, cos) = ComplexField::sin_cos(2.0 * PI * n as f64 / segments as f64);
            for m in 0..sides {
                let (up, out) = ComplexField::sin_cos(2.0 * PI * m as f64 / sides as f64);
                let r = major + minor * out;
                mesh.vertices.push(Vec3::new(r * cos, r * sin, minor * up));
            }
        }
        let at = |n: usize, m: usize| ((n % segments) * sides + m % sides) as u32;
        for n in 0..segments {
            for m in 0..sides {
                mesh.push_quad([at(n, m), at(n + 1, m), at(n + 1, m + 1), at(n, m + 1)]);
            }
        }
        mesh
    }

    /// Returns a closed solid of revolution about z. `profile` lists `(r, z)` in meters, in either
    /// direction: first and last point on the axis (`r = 0`), all others off it, no two neighbors
    /// equal. The profile must not cross itself (not checked here).
    ///
    /// # Errors
    /// [`MeshError::Profile`] if the profile is not as described.
    pub fn lathe(profile: &[(f64, f64)], segments: usize) -> Result<TriMesh, MeshError> {
        let bad = |what: &str| Err(MeshError::Profile { what: what.into() });
        let [first, middle @ .., last] = profile else { return bad("has fewer than 3 points") };
        if middle.is_empty() {
            return bad("has fewer than 3 points");
        }
        if first.0 != 0.0 || last.0 != 0.0 {
            return bad("must start and end on the axis (r = 0)");
        }
        if profile.iter().any(|(r, z)| !r.is_finite() || !z.is_finite()) {
            return bad("has a number that is not finite");
        }
        if middle.iter().any(|(r, _)| *r <= 0.0) {
            return bad("must stay off the axis (r > 0) between its ends");
        }
        if profile.windows(2).any(|w| w[0] == w[1]) {
            return bad("has two equal neighbors");
        }
        let mut mesh = revolve(profile, segments);
        if mesh.signed_volume() < 0.0 {
            mesh.flip_winding();
        }
        Ok(mesh)
    }

    /// Returns a cone along z about its center of mass, tip up; meters.
    pub fn cone(radius: f64, height: f64, segments: usize) -> TriMesh {
        let base = -0.25 * height;
        revolve(&[(0.0, base), (radius, base), (0.0, 0.75 * height)], segments)
    }

    pub(super) fn push_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.triangles.extend([[a, b, c], [a, c, d]]);
    }

    /// Reverses every triangle.
    pub(crate) fn flip_winding(&mut self) {
        self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }

    /// Splits each face into four and projects new vertices to the unit sphere.
    fn split_on_sphere(&self) -> TriMesh {
        let mut vertices = self.vertices.clone();
        let mut edges: Vec<(u32, u32)> =
            self.triangles.iter().flat_map(|t| [0, 1, 2].map(|k| edge(t[k], t[(k + 1) % 3]))).collect();
        edges.sort_unstable();
        edges.dedup();
        let base = vertices.len() as u32;
        vertices
            .extend(edges.iter().map(|(u, v)| (self.vertices[*u as usize] + self.vertices[*v as usize]).normalize()));
        // the list contains every edge of every face
        let middle = |u, v| base + edges.partition_point(|e| *e < edge(u, v)) as u32;
        let triangles = self.triangles.iter().flat_map(|&[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
        });
        TriMesh { triangles: triangles.collect(), vertices }
    }
}

fn edge(u: u32, v: u32) -> (u32, u32) {
    (u.min(v), u.max(v))
}

fn signs(n: u32) -> Vec3 {
    Vec3::from_fn(|k, _| if n >> k & 1 == 1 { 1.0 } else { -1.0 })
}

/// Returns the point of a half circle of `radius` about `(0, z)`, `angle` from its lowest point.
/// Exactly on the axis at both ends.
fn on_arc(radius: f64, z: f64, angle: f64) -> (f64, f64) {
    let (sin, cos) = ComplexField::sin_cos(angle);
    (if sin.abs() < 1e-12 { 0.0 } else { radius * sin }, z - radius * cos)
}

/// Revolves an ascending profile from axis to axis around z: a pole at each end, a ring per point
/// between.
pub(crate) fn revolve(profile: &[(f64, f64)], segments: usize) -> TriMesh {
    let segments = segments.clamp(3, MAX_SEGMENTS);
    let rings = profile.len() - 2;
    let mut mesh =
        TriMesh { vertices: vec![Vec3::z() * profile[0].1, Vec3::z() * profile[rings + 1].1], triangles: Vec::new() };
    for &(r, z) in &profile[1..=rings] {
        for n in 0..segments {
            let (sin, cos) = ComplexField::sin_cos(2.0 * PI * n as f64 / segments as f64);
            mesh.vertices.push(Vec3::new(r * cos, r * sin, z));
        }
    }
    let at = |ring: usize, n: usize| (2 + ring * segments + n % segments) as u32;
    for n in 0..segments {
        mesh.triangles.push([0, at(0, n + 1), at(0, n)]);
        for ring in 0..rings - 1 {
            mesh.push_quad([at(ring, n), at(ring, n + 1), at(ring + 1, n + 1), at(ring + 1, n)]);
        }
        mesh.triangles.push([1, at(rings - 1, n), at(rings - 1, n + 1)]);
    }
    mesh
}

fn icosahedron() -> TriMesh {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut vertices = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        vertices.extend(
            [Vec3::new(0.0, s, t * g), Vec3::new(s, t * g, 0.0), Vec3::new(t * g, 0.0, s)].map(|v| v.normalize()),
        );
    }
    // faces are the triples with the smallest mutual distance, wound outwards
    let side = (0..12)
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .map(|(i, j)| (vertices[i] - vertices[j]).norm())
        .fold(9.0, f64::min);
    let near = |i: usize, j: usize| (vertices[i] - vertices[j]).norm() < 1.1 * side;
    let mut triangles = Vec::new();
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(i, k) {
                    let outward = vertices[i].dot(&vertices[j].cross(&vertices[k])) > 0.0;
                    triangles.push(if outward {
                        [i as u32, j as u32, k as u32]
                    } else {
                        [i as u32, k as u32, j as u32]
                    });
                }
            }
        }
    }
    TriMesh { vertices, triangles }
}

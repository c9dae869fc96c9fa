//! Sampling of the surface points that the spheres must cover: vertices, and points inside
//! triangles by area.
//!
//! In the order of the triangles, each `A/n` of area gets a point (`A` the whole area, `n` the
//! requested number). Within a triangle the point is the next member of the R₂ sequence, which is
//! evenly distributed (Roberts, *The unreasonable effectiveness of quasirandom sequences*, 2018).

use super::types::CoverPoints;
use crate::{TriMesh, Vec3};

/// Steps of the R₂ sequence: `1/g` and `1/g²`, `g` the real root of `g³ = g + 1`.
const R2: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];

impl CoverPoints {
    /// Samples about `count` points by area, and all vertices of triangles (at most `count`, evenly
    /// spaced).
    pub fn on(mesh: &TriMesh, count: usize) -> CoverPoints {
        let mut cover = CoverPoints::default();
        let triangle_of = vertex_triangles(mesh);
        let used: Vec<usize> = (0..mesh.vertices.len()).filter(|&v| triangle_of[v].is_some()).collect();
        let stride = used.len().div_ceil(count.max(1)).max(1);
        for &v in used.iter().step_by(stride) {
            let triangle = triangle_of[v].unwrap_or(0);
            cover.push(mesh.vertices[v], triangle, mesh);
        }
        let areas: Vec<f64> = (0..mesh.triangles.len()).map(|t| 0.5 * area_vector(mesh, t).norm()).collect();
        let each = areas.iter().sum::<f64>() / count.max(1) as f64;
        let mut owed = 0.5;
        for (t, area) in areas.iter().enumerate() {
            owed += if each > 0.0 { area / each } else { 0.0 };
            while owed >= 1.0 {
                owed -= 1.0;
                let n = cover.points.len() as f64;
                let point = on_triangle(mesh.corners(t), (n * R2[0]).fract(), (n * R2[1]).fract());
                cover.push(point, t as u32, mesh);
            }
        }
        cover
    }

    /// Adds a point of triangle `t`.
    pub fn push(&mut self, point: Vec3, t: u32, mesh: &TriMesh) {
        self.points.push(point);
        self.normals.push(area_vector(mesh, t as usize).try_normalize(0.0).unwrap_or_default());
        self.triangles.push(t);
    }
}

/// Returns for each vertex the first triangle that contains it.
fn vertex_triangles(mesh: &TriMesh) -> Vec<Option<u32>> {
    let mut of = vec![None; mesh.vertices.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        for &v in triangle {
            of[v as usize].get_or_insert(t as u32);
        }
    }
    of
}

fn area_vector(mesh: &TriMesh, t: usize) -> Vec3 {
    let [a, b, c] = mesh.corners(t);
    (b - a).cross(&(c - a))
}

/// Maps the unit square to the triangle by folding.
fn on_triangle([a, b, c]: [Vec3; 3], u: f64, v: f64) -> Vec3 {
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    a + (b - a) * u + (c - a) * v
}

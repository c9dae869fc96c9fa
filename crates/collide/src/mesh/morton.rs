//! Morton order: a space-filling curve along which points that are close in space are close in
//! memory.
//!
//! Source: Morton, *A computer oriented geodetic data base* (1966): interleaves the bits of the
//! coordinates.

use super::TriMesh;
use crate::{Aabb, Vec3};

/// Bits of the curve per axis.
const BITS: u32 = 20;

/// Returns the Morton code of each point in the box around all points.
pub(crate) fn morton_codes(points: &[Vec3]) -> Vec<u64> {
    let bounds = Aabb::around(points.iter().copied());
    let side = (bounds.max - bounds.min).max();
    let scale = if side > 0.0 { f64::from((1u32 << BITS) - 1) / side } else { 0.0 };
    points.iter().map(|p| morton_code((p - bounds.min) * scale)).collect()
}

fn morton_code(p: Vec3) -> u64 {
    let [x, y, z] = [p.x as u64, p.y as u64, p.z as u64];
    (0..BITS).rev().fold(0, |morton_code, b| morton_code << 3 | (x >> b & 1) << 2 | (y >> b & 1) << 1 | (z >> b & 1))
}

impl TriMesh {
    /// Returns the mesh with vertices and triangles in Morton order.
    pub(crate) fn in_morton_order(&self) -> TriMesh {
        let by_place = |points: &[Vec3]| {
            let keys = morton_codes(points);
            let mut order: Vec<u32> = (0..points.len() as u32).collect();
            order.sort_by_key(|&n| keys[n as usize]);
            order
        };
        let order = by_place(&self.vertices);
        let mut renamed = vec![0; order.len()];
        order.iter().zip(0..).for_each(|(&old, new)| renamed[old as usize] = new);
        let middles: Vec<Vec3> =
            (0..self.triangles.len()).map(|t| self.corners(t).iter().sum::<Vec3>() / 3.0).collect();
        TriMesh {
            vertices: order.iter().map(|&n| self.vertices[n as usize]).collect(),
            triangles: by_place(&middles)
                .iter()
                .map(|&t| self.triangles[t as usize].map(|v| renamed[v as usize]))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_triangles_in_another_order() {
        let torus = TriMesh::torus(1.0, 0.35, 24, 12);
        let count = torus.triangles.len();
        let mesh = TriMesh { triangles: (0..count).map(|n| torus.triangles[n * 101 % count]).collect(), ..torus };
        let in_morton_order = mesh.in_morton_order();
        let sorted = |mesh: &TriMesh| {
            let mut all: Vec<String> = (0..mesh.triangles.len()).map(|t| format!("{:?}", mesh.corners(t))).collect();
            all.sort();
            all
        };
        assert_eq!(sorted(&mesh), sorted(&in_morton_order));
        // neighbors in memory are close to each other
        let way = |mesh: &TriMesh| {
            (1..count).map(|t| (mesh.corners(t)[0] - mesh.corners(t - 1)[0]).norm()).sum::<f64>() / count as f64
        };
        assert!(way(&in_morton_order) < 0.3 * way(&mesh), "{} {}", way(&in_morton_order), way(&mesh));
    }
}

//! Triangles with normals, as a page draws them: three corners each of position and normal.

use nalgebra::Vector3;
use tumble_collide::{Shape, TriMesh, Vec3};

/// Sides of round shapes.
const SIDES: usize = 40;
/// Half the side of the square that represents a half-space, m.
const PLANE_M: f64 = 60.0;
/// Cosine of the angle above which edges stay sharp, 0.7 rad.
const COS_CREASE: f32 = 0.765;
/// Numbers of a corner.
pub(crate) const CORNER: usize = 6;

/// Returns the surface of a shape.
pub(crate) fn of_shape(shape: &Shape) -> TriMesh {
    match shape {
        Shape::HalfSpace => {
            let corner = |x: f64, y: f64| Vec3::new(x * PLANE_M, y * PLANE_M, 0.0);
            let vertices = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            TriMesh { vertices, triangles: vec![[0, 1, 2], [0, 2, 3]] }
        }
        Shape::Sphere { radius } => TriMesh::uv_sphere(*radius, SIDES, SIDES / 2),
        Shape::Box { half_extents } => TriMesh::cuboid(2.0 * half_extents),
        Shape::Capsule { radius, half_length } => TriMesh::capsule(*radius, 2.0 * half_length, SIDES, SIDES / 4),
        Shape::Cylinder(cylinder) => TriMesh::cylinder(cylinder.radius(), 2.0 * cylinder.half_length(), SIDES),
        Shape::Mesh(mesh) => mesh.mesh().clone(),
        Shape::Compound(compound) => compound.mesh(),
        other => other.surface_mesh(SIDES),
    }
}

/// Appends the corners of all triangles. The normal of a corner is the mean of those of the faces around
/// its vertex that are within the crease angle of its own face, weighted by area.
pub(crate) fn append(vertices: &[Vector3<f32>], triangles: &[[u32; 3]], out: &mut Vec<f32>) {
    let point = |i: u32| vertices.get(i as usize).copied().unwrap_or_default();
    let crosses: Vec<Vector3<f32>> =
        triangles.iter().map(|t| (point(t[1]) - point(t[0])).cross(&(point(t[2]) - point(t[0])))).collect();
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); vertices.len()];
    for (face, triangle) in triangles.iter().enumerate() {
        for corner in triangle {
            if let Some(faces) = around.get_mut(*corner as usize) {
                faces.push(face as u32);
            }
        }
    }
    for (triangle, own) in triangles.iter().zip(&crosses) {
        for corner in triangle {
            let faces = around.get(*corner as usize).map_or(&[][..], Vec::as_slice);
            let near = faces.iter().map(|face| crosses[*face as usize]);
            let near = near.filter(|other| other.dot(own) >= COS_CREASE * other.norm() * own.norm());
            let normal: Vector3<f32> = near.sum();
            let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::z);
            out.extend(point(*corner).iter().chain(normal.iter()));
        }
    }
}

/// Returns points in single precision.
pub(crate) fn small(points: &[Vec3]) -> Vec<Vector3<f32>> {
    points.iter().map(|point| point.cast()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube keeps its edges: each normal is an axis. A sphere is smooth: each normal points along its vertex.
    #[test]
    fn normals_are_those_of_the_solids() {
        let corners = |mesh: TriMesh| {
            let mut out = Vec::new();
            append(&small(&mesh.vertices), &mesh.triangles, &mut out);
            assert_eq!(out.len(), 3 * CORNER * mesh.triangles.len());
            out
        };
        for corner in corners(of_shape(&Shape::cuboid(Vec3::new(1.0, 2.0, 3.0)).unwrap())).chunks_exact(CORNER) {
            let normal = Vector3::from_column_slice(&corner[3..]);
            let along = normal.iamax();
            assert!((normal.amax() - 1.0).abs() < 1e-6, "{normal}");
            assert!(
                (corner[along].abs() - 0.5 * (along + 1) as f32).abs() < 1e-6 && normal[along] * corner[along] > 0.0
            );
        }
        for corner in corners(of_shape(&Shape::sphere(2.0).unwrap())).chunks_exact(CORNER) {
            let [place, normal] = [0, 3].map(|k| Vector3::from_column_slice(&corner[k..k + 3]));
            assert!(place.normalize().dot(&normal) > 0.99, "{place} {normal}");
        }
    }
}

//! Areas of silhouettes: of the shadow that a shape throws along a direction.
//!
//! ```text
//! sphere    π·r²                                 box       Σ 4·a_j·a_k·|d_i|
//! capsule   π·r² + 4·r·l·sin θ                   cylinder  π·r²·|cos θ| + 4·r·l·sin θ
//! mesh      ½·Σ |A_t·d|                          compound  the sum over its parts
//! ```
//!
//! `d` is the direction, `θ` its angle to the z axis, `a` half the size of a box, `l` half the length of
//! the core of a capsule or of a cylinder, `A_t` the area vector of a triangle. The area of a mesh
//! is exact if it is convex; else, as for a compound, hidden surfaces count too.

use std::f64::consts::PI;
use tumble_collide::{Shape, Vec3};

/// Returns the area of a shape's silhouette along a direction of any length in the frame of the
/// shape, m²; 0 for a half-space and for a direction of length 0.
pub fn silhouette(shape: &Shape, direction: &Vec3) -> f64 {
    let Some(d) = direction.try_normalize(0.0) else { return 0.0 };
    let (along, across) = (d.z.abs(), (d.x * d.x + d.y * d.y).sqrt());
    match shape {
        Shape::HalfSpace => 0.0,
        Shape::Sphere { radius } => PI * radius * radius,
        Shape::Box { half_extents: a } => 4.0 * Vec3::new(a.y * a.z, a.z * a.x, a.x * a.y).dot(&d.abs()),
        Shape::Capsule { radius, half_length } => radius * (PI * radius + 4.0 * half_length * across),
        Shape::Cylinder(c) => c.radius() * (PI * c.radius() * along + 4.0 * c.half_length() * across),
        Shape::Mesh(mesh) => {
            let mesh = mesh.mesh();
            let shadow = |t: usize| {
                let [a, b, c] = mesh.corners(t);
                (b - a).cross(&(c - a)).dot(&d).abs()
            };
            0.25 * (0..mesh.triangles.len()).map(shadow).sum::<f64>()
        }
        Shape::Compound(compound) => {
            compound.placed().map(|(part, pose)| silhouette(part, &pose.rotation.inverse_transform_vector(&d))).sum()
        }
    }
}

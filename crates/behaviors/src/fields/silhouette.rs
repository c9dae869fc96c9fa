//! Areas of silhouettes: of the shadow that a shape throws along a direction.
//!
//! ```text
//! sphere    π·r²                                 box       Σ 4·a_j·a_k·|d_i|
//! capsule   π·r² + 4·r·l·sin θ                   cylinder  π·r²·|cos θ| + 4·r·l·sin θ
//! mesh      ½·Σ |A_t·d|                          compound  the sum over its parts
//! ellipsoid π·|(e_y·e_z·d_x, e_z·e_x·d_y, e_x·e_y·d_z)|
//! cone      r·√(h²·sin²θ − r²·cos²θ) + r²·|cos θ|·(π − acos(r·|cos θ|/(h·sin θ))), or the base alone
//! rounded   A + p·ρ + π·ρ²                       A, p area and outline of the core's silhouette (Steiner)
//! ```
//!
//! `d` is the direction, `θ` its angle to the z axis, `a` half the size of a box, `l` half the length of
//! the core of a capsule or of a cylinder, `e` half the axes of an ellipsoid, `h` the height of a cone, `ρ` a rounding, `A_t` the area vector of a triangle. The area of a mesh
//! is exact if it is convex; else, as for a compound, hidden surfaces count too.

use nalgebra::ComplexField;
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
        Shape::Ellipsoid { half_axes: e } => PI * Vec3::new(e.y * e.z * d.x, e.z * e.x * d.y, e.x * e.y * d.z).norm(),
        Shape::Cone { radius, height } => {
            // the ellipse of the base, and its tangents from the tip
            let (low, tip) = (radius * along, height * across);
            if tip <= low {
                return PI * radius * low;
            }
            radius * (tip * tip - low * low).sqrt() + radius * low * (PI - ComplexField::acos(low / tip))
        }
        Shape::RoundedBox { half_extents, rounding: r } => {
            let a = half_extents.add_scalar(-r);
            let outline = 4.0 * a.dot(&d.map(|x| (1.0 - x * x).max(0.0).sqrt()));
            silhouette(&shape.core().0, &d) + r * outline + PI * r * r
        }
        Shape::RoundedCylinder { core, rounding: r } => {
            let outline = ellipse_outline(core.radius(), core.radius() * along) + 4.0 * core.half_length() * across;
            silhouette(&shape.core().0, &d) + r * outline + PI * r * r
        }
        Shape::Compound(compound) => {
            compound.placed().map(|(part, pose)| silhouette(part, &pose.rotation.inverse_transform_vector(&d))).sum()
        }
    }
}

/// Returns the outline of an ellipse of half axes `a ≥ b`, meters, by the arithmetic-geometric mean:
/// `2π/agm(a, b)·(a² − Σ 2^(n−1)·c_n²)`, `c_0² = a² − b²`.
fn ellipse_outline(a: f64, b: f64) -> f64 {
    if b <= 1e-9 * a {
        return 4.0 * a;
    }
    let (mut high, mut low, mut factor, mut sum) = (a, b, 0.5, a * a - 0.5 * (a * a - b * b));
    while high - low > 1e-15 * a {
        let half_difference = 0.5 * (high - low);
        (high, low) = (0.5 * (high + low), (high * low).sqrt());
        factor *= 2.0;
        sum -= factor * half_difference * half_difference;
        if factor > 64.0 {
            break;
        }
    }
    2.0 * PI * sum / high
}

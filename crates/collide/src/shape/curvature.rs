//! How the touching point of a convex surface moves over its material as the normal turns.
//!
//! ```text
//! p(n) = point of the surface with the outward normal n,      ṗ = P·ṅ,      P = ∂p/∂n, symmetric, P·n = 0
//! ellipsoid   P = (D² − p·pᵀ)/s,   s = |D·n|                rim   P = a/|d|·t·tᵀ
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `D` | half axes, m, on the diagonal |
//! | `a`, `d`, `t` | radius of the rim, m; part of `n` across its axis; unit tangent |

use super::{Cone, CylinderShape, Shape, ellipsoid};
use crate::{Mat3, Vec3};

/// A point farther from that of the normal than this fraction of the size is another one: a corner of an overlap, or one of
/// the fixed points on which a flat end stands.
const SAME_POINT: f64 = 1e-3;
/// A flat end that is tilted by less, rad, touches with the whole end: the farthest point of its rim means nothing.
const LEAST_TILT: f64 = 1e-3;

impl Shape {
    /// Returns the matrix `P` of a point of the surface (m, local) with an outward normal (unit, local), m, without the part of a
    /// sphere about a core.
    ///
    /// `None` where a sphere about the core feature of a contact says all: on spheres, capsules, flat faces, straight edges,
    /// corners, and the side of a cylinder.
    pub fn curvature(&self, point: &Vec3, outward: &Vec3) -> Option<Mat3> {
        let of_cylinder = |cylinder: &CylinderShape, point: &Vec3| {
            rim((cylinder.radius(), cylinder.half_length().copysign(point.z)), point, outward)
        };
        match self {
            Shape::Ellipsoid { half_axes } => {
                let off = (ellipsoid::support_point(half_axes, outward) - point).norm();
                (off <= SAME_POINT * half_axes.max()).then(|| ellipsoid::curvature_radii(half_axes, outward))
            }
            Shape::Cylinder(cylinder) => of_cylinder(cylinder, point),
            Shape::RoundedCylinder { core, rounding } => of_cylinder(core, &(point - *rounding * outward)),
            Shape::Cone { radius, height } => {
                let cone = Cone { radius: *radius, height: *height };
                rim((cone.radius, cone.base()), point, outward)
            }
            _ => None,
        }
    }
}

/// The matrix of a rim of a `radius` at a `height` on the z axis, m; `None` if `point` is not its farthest one along the normal.
fn rim((radius, height): (f64, f64), point: &Vec3, outward: &Vec3) -> Option<Mat3> {
    let across = Vec3::new(outward.x, outward.y, 0.0);
    let length = across.norm();
    let farthest = radius / length * across + height * Vec3::z();
    if length < LEAST_TILT || (point - farthest).norm() > SAME_POINT * radius {
        return None;
    }
    let tangent = Vec3::z().cross(&across) / length;
    Some(radius / length * tangent * tangent.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The matrix is the derivative of the farthest point of the shape by the normal.
    #[test]
    fn the_matrix_is_the_derivative_of_the_farthest_point() {
        let half = Vec3::new(0.5, 0.3, 0.25);
        let at = |n: &Vec3| ellipsoid::support_point(&half, n);
        let n = Vec3::new(0.3, -0.5, 0.8).normalize();
        let shape = Shape::ellipsoid(2.0 * half).unwrap();
        check(&shape, &n, &at);
        let circle = |n: &Vec3, z: f64| Vec3::new(n.x, n.y, 0.0) * (0.2 / n.xy().norm()) + Vec3::z() * z;
        check(&Shape::cylinder(0.2, 0.6).unwrap(), &n, &|n| circle(n, 0.3));
        check(&Shape::cylinder(0.2, 0.6).unwrap(), &-n, &|n| circle(n, -0.3));
        check(&Shape::cone(0.2, 0.6).unwrap(), &-n, &|n| circle(n, -0.15));
        let rounded = Shape::rounded_cylinder(0.25, 0.7, 0.05).unwrap();
        let matrix = rounded.curvature(&(circle(&n, 0.3) + 0.05 * n), &n).unwrap();
        let plain = Shape::cylinder(0.2, 0.6).unwrap().curvature(&circle(&n, 0.3), &n).unwrap();
        assert!((matrix - plain).norm() < 1e-12);
        // a point on which a flat end stands, the tip of a cone, and a sphere
        assert!(Shape::cylinder(0.2, 0.6).unwrap().curvature(&Vec3::new(0.2, 0.0, 0.3), &n).is_none());
        assert!(Shape::cone(0.2, 0.6).unwrap().curvature(&Vec3::new(0.0, 0.0, 0.45), &n).is_none());
        assert!(Shape::sphere(0.2).unwrap().curvature(&(0.2 * n), &n).is_none());
    }

    fn check(shape: &Shape, n: &Vec3, at: &dyn Fn(&Vec3) -> Vec3) {
        let matrix = shape.curvature(&at(n), n).unwrap();
        for k in 0..3 {
            let mut turn = Vec3::zeros();
            turn[k] = 1e-5;
            let difference = (at(&(n + turn)) - at(&(n - turn))) / 2e-5;
            assert!((matrix.column(k) - difference).norm() < 1e-8, "{shape:?}: {matrix} {difference}");
        }
        assert!((matrix * n).norm() < 1e-12);
    }
}

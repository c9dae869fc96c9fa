//! The point of a shape's surface that is closest to a given point.

use super::SurfacePoint;
use crate::shape::{Cone, ellipsoid};
use crate::{CompoundShape, Pose, Shape, Vec3};

impl Shape {
    /// Returns the point of the shape's surface at `pose` that is closest to the world point `point`.
    /// Of several equally close ones it is any. Inside overlapping parts of a compound it is the point
    /// of the part in which the given point is deepest. The first call builds the tree of a mesh.
    pub fn closest_point(&self, pose: &Pose, point: &Vec3) -> SurfacePoint {
        let p = pose.inverse_transform_point(&(*point).into()).coords;
        let ((q, distance, normal), shape) = match self {
            Shape::Compound(compound) => closest_of_compound(compound, &p),
            _ => (self.closest_local(&p), 0),
        };
        let (point, normal) = (pose.transform_point(&q.into()).coords, pose.rotation * normal);
        SurfacePoint { point, distance, normal, shape }
    }

    /// Returns the closest point of the surface, the signed distance and the normal, in the shape's
    /// frame.
    fn closest_local(&self, p: &Vec3) -> (Vec3, f64, Vec3) {
        match self {
            Shape::HalfSpace => (Vec3::new(p.x, p.y, 0.0), p.z, Vec3::z()),
            Shape::Sphere { radius } => round(p, &Vec3::zeros(), *radius),
            Shape::Capsule { radius, half_length } => {
                let core = Vec3::z() * p.z.clamp(-half_length, *half_length);
                let (q, distance, normal) = round(p, &core, *radius);
                // on the axis every direction across it is as close, and along it none is
                if p.xy().norm() == 0.0 && p.z.abs() <= *half_length {
                    return (core + Vec3::x() * *radius, -radius, Vec3::x());
                }
                (q, distance, normal)
            }
            Shape::Box { half_extents } => {
                let inside = p.zip_map(half_extents, |x, h| x.clamp(-h, h));
                let offset = p - inside;
                let distance = offset.norm();
                if distance > 0.0 {
                    return (inside, distance, offset / distance);
                }
                let depth = half_extents - p.abs();
                let k = depth.imin();
                let normal = Vec3::ith(k, if p[k] < 0.0 { -1.0 } else { 1.0 });
                (p + normal * depth[k], -depth[k], normal)
            }
            Shape::Cylinder(c) => {
                let (radius, half) = (c.radius(), c.half_length());
                let length = p.xy().norm();
                let outward = if length > 0.0 { Vec3::new(p.x, p.y, 0.0) / length } else { Vec3::x() };
                let up = Vec3::z() * if p.z < 0.0 { -1.0 } else { 1.0 };
                let (r, z) = (length - radius, p.z.abs() - half);
                if r <= 0.0 && z <= 0.0 {
                    return if r > z { (p - outward * r, r, outward) } else { (p - up * z, z, up) };
                }
                let q = outward * length.min(radius) + Vec3::z() * p.z.clamp(-half, half);
                let distance = (p - q).norm();
                (q, distance, (p - q) / distance)
            }
            Shape::Mesh(mesh) => {
                let closest = mesh.distance().closest(p);
                let [a, b, c] = mesh.mesh().corners(closest.triangle);
                let flat = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vec3::z);
                let offset = (p - closest.point) * closest.signed_distance.signum();
                (closest.point, closest.signed_distance, offset.try_normalize(0.0).unwrap_or(flat))
            }
            Shape::Compound(compound) => closest_of_compound(compound, p).0,
            Shape::Ellipsoid { half_axes } => {
                let found = ellipsoid::closest(half_axes, p);
                (found.point, found.distance, found.normal)
            }
            Shape::Cone { radius, height } => {
                let (_, distance, normal) = Cone { radius: *radius, height: *height }.closest(p);
                (p - normal * distance, distance, normal)
            }
            Shape::RoundedBox { .. } | Shape::RoundedCylinder { .. } => {
                let (core, rounding) = self.core();
                let (q, distance, normal) = core.closest_local(p);
                // inside the core the direction of the nearest face, across which the rounding adds
                (q + normal * rounding, distance - rounding, normal)
            }
        }
    }
}

/// Returns the closest point of the surface of a compound, and the index of its part.
fn closest_of_compound(compound: &CompoundShape, p: &Vec3) -> ((Vec3, f64, Vec3), u32) {
    let mut least = ((*p, f64::INFINITY, Vec3::z()), 0);
    for (n, part, own) in compound.active_parts().map(|(n, part, own)| (n as u32, part, own)) {
        let found = part.closest_point(own, p);
        if found.distance < least.0.1 {
            least = ((found.point, found.distance, found.normal), n);
        }
    }
    least
}

/// The surface at `radius` around a core point.
fn round(p: &Vec3, core: &Vec3, radius: f64) -> (Vec3, f64, Vec3) {
    let offset = p - core;
    let length = offset.norm();
    let normal = if length > 0.0 { offset / length } else { Vec3::z() };
    (core + normal * radius, length - radius, normal)
}

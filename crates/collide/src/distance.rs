//! Distances: from a point to a shape, and between two shapes.

use crate::shape::{Cone, ellipsoid};
use crate::{CompoundShape, Contact, Pose, Shape, Vec3, contacts};

/// Maximum number of alternating projections.
const PROJECTIONS: usize = 16;
/// Relative margin of a bound.
const ROUNDING: f64 = 1e-9;
/// Distance, as a fraction of the smaller radius, below which surfaces with an overlapping contact cross.
const CROSSING: f64 = 1e-5;
/// Depth of a contact that can be that of a corner beside a face, in sizes of the smaller body.
const BESIDE: f64 = 0.02;

/// The point of a shape's surface that is closest to a given point, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point of the surface, meters.
    pub point: Vec3,
    /// Signed distance of the given point from the surface, meters; negative inside.
    pub distance: f64,
    /// Outward unit normal: from the surface to a point outside, from a point inside to the surface.
    pub normal: Vec3,
    /// The shape: the index of a compound's part; 0 for all other shapes.
    pub shape: u32,
}

/// The closest points of two shapes, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPair {
    /// Distance, meters; minus the depth of the deepest contact if they overlap.
    pub distance: f64,
    /// A point of the surface of A, and one of B, meters.
    pub points: [Vec3; 2],
    /// Unit normal from B towards A.
    pub normal: Vec3,
    /// The shapes that the points are of, of A and of B: the index of a compound's part; 0 for all others.
    pub shapes: [u32; 2],
}

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

/// Returns the closest points of two shapes; `None` for two half-spaces, and for a pose that is not
/// finite.
///
/// The distance is exact for pairs with exact contacts ([`contacts`]). For others it is the least
/// gap of their contacts, improved by alternating projections between the two surfaces.
pub fn closest_points(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> Option<ClosestPair> {
    if matches!((a, b), (Shape::HalfSpace, Shape::HalfSpace)) {
        return None;
    }
    let between = |from: Vec3| projected(a, pose_a, b, pose_b, from);
    let start = between(pose_a.translation.vector);
    let margin = start.distance.max(0.0);
    let mut found = Vec::new();
    contacts(a, pose_a, b, pose_b, margin * (1.0 + ROUNDING) + f64::MIN_POSITIVE, &mut found);
    // a corner that is slightly beside a face has a contact with that face, but is not below it
    let size = a.bounding_radius().min(b.bounding_radius());
    let inside = |p: &Vec3| {
        [(a, pose_a), (b, pose_b)].iter().all(|(shape, pose)| shape.closest_point(pose, p).distance <= ROUNDING * size)
    };
    let overlaps =
        |c: &&Contact| c.gap < -BESIDE * size || c.gap <= 0.0 && ClosestPair::of(c).points.iter().any(inside);
    let deepest = found.iter().filter(overlaps).min_by(|x, y| x.gap.total_cmp(&y.gap));
    if let Some(deepest) = deepest {
        return Some(ClosestPair::of(deepest));
    }
    let least = found.iter().min_by(|x, y| x.gap.abs().total_cmp(&y.gap.abs()));
    let Some(least) = least else { return start.distance.is_finite().then_some(start) };
    let polished = between(least.point + least.normal * (0.5 * least.gap));
    let nearest = if polished.distance <= start.distance { polished } else { start };
    // projections between surfaces that cross end at the crossing
    let deepest = found.iter().filter(|c| c.gap < 0.0).min_by(|x, y| x.gap.total_cmp(&y.gap));
    Some(deepest.filter(|_| nearest.distance <= CROSSING * size).map_or(nearest, ClosestPair::of))
}

/// Returns a pair of points of the two surfaces, by alternating projections from a point of A. Its
/// distance never increases. It is exact for convex bodies in the limit, and 0 if they overlap.
fn projected(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, mut from: Vec3) -> ClosestPair {
    let mut best = ClosestPair { distance: f64::INFINITY, points: [from; 2], normal: Vec3::z(), shapes: [0; 2] };
    for _ in 0..PROJECTIONS {
        let SurfacePoint { point: to, shape, .. } = b.closest_point(pose_b, &from);
        let back = a.closest_point(pose_a, &to);
        let offset = back.point - to;
        let distance = offset.norm();
        if distance.is_nan() || distance >= best.distance * (1.0 - 1e-15) {
            break;
        }
        let normal = offset.try_normalize(0.0).unwrap_or(-back.normal);
        best = ClosestPair { distance, points: [back.point, to], normal, shapes: [back.shape, shape] };
        from = back.point;
    }
    best
}

impl ClosestPair {
    fn of(contact: &Contact) -> ClosestPair {
        let half = contact.normal * (0.5 * contact.gap);
        ClosestPair {
            distance: contact.gap,
            points: [contact.point + half, contact.point - half],
            normal: contact.normal,
            shapes: contact.shapes,
        }
    }
}

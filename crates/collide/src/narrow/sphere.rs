//! Sphere (always A) against sphere, capsule and box.

use super::segment::closest_on_segment;
use crate::shape::axis;
use crate::{Contact, NormalFrom, Pose, Vec3};

pub(super) fn sphere_sphere(
    radius_a: f64,
    pose_a: &Pose,
    radius_b: f64,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let (a, b) = (pose_a.translation.vector, pose_b.translation.vector);
    let reach = radius_a + radius_b + margin;
    if (a - b).norm_squared() <= reach * reach {
        out.push(Contact::between_cores((a, radius_a), (b, radius_b), 0));
    }
}

pub(super) fn sphere_capsule(
    radius: f64,
    pose_a: &Pose,
    (radius_b, half_length): (f64, f64),
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let (center, direction) = (pose_b.translation.vector, axis(pose_b));
    let a = pose_a.translation.vector;
    let along = closest_on_segment(&(a - center), &(direction * half_length));
    let core = center + direction * half_length * along;
    let mut contact = Contact::between_cores((a, radius), (core, radius_b), 0);
    if along.abs() < 1.0 {
        contact.normal_from = NormalFrom::LineOfB(direction);
    }
    if (a - core).norm_squared() < 1e-24 * radius_b * radius_b {
        // on the axis all perpendicular directions are equivalent
        contact = Contact { normal: pose_b.rotation * Vec3::x(), ..contact };
        contact.point = core + contact.normal * (radius_b + 0.5 * contact.gap);
    }
    if contact.gap <= margin {
        out.push(contact);
    }
}

/// Exact: the closest point of the box by clamping; from inside, the nearest face.
pub(super) fn sphere_box(radius: f64, pose_a: &Pose, half: &Vec3, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let p = pose_b.inverse_transform_point(&pose_a.translation.vector.into()).coords;
    let Some(found) = point_box(&p, half) else { return };
    let gap = found.distance - radius;
    if gap <= margin {
        let normal = pose_b.rotation * found.normal;
        out.push(Contact {
            point: pose_a.translation.vector - normal * (radius + 0.5 * gap),
            normal,
            gap,
            feature: found.region,
            core_a: radius,
            core_b: 0.0,
            normal_from: match (found.face, edge(found.region)) {
                (true, _) => NormalFrom::FaceOfB,
                (false, Some(k)) => NormalFrom::LineOfB(pose_b.rotation * Vec3::ith(k, 1.0)),
                (false, None) => NormalFrom::CorePoints,
            },
            shapes: [0; 2],
        });
    }
}

/// Returns the axis of the edge of an edge region: the one digit that is 1.
fn edge(region: u64) -> Option<usize> {
    let inside = |k: usize| region / 3u64.pow(k as u32) % 3 == 1;
    let mut free = (0..3).filter(|k| inside(*k));
    free.next().filter(|_| free.next().is_none())
}

/// The relation of a point to a box, in the box's frame.
pub(super) struct PointBox {
    /// Signed distance from the surface, meters.
    pub distance: f64,
    /// Outward unit normal at the closest surface point.
    pub normal: Vec3,
    /// One of 27 regions (faces have 1 clamped axis, edges 2, vertices 3): base 3, digit k is 0, 1,
    /// 2 for −, inside, +.
    pub region: u64,
    /// Whether the closest feature is a face.
    pub face: bool,
}

/// Returns signed distance and normal of a box at `p`; `None` only if the point is not finite.
pub(super) fn point_box(p: &Vec3, half: &Vec3) -> Option<PointBox> {
    let outside = p - clamp(p, half);
    let distance = outside.norm();
    if distance > 1e-12 * half.max() {
        let region = region(p, half);
        let clamped = outside.iter().filter(|d| **d != 0.0).count();
        return Some(PointBox { distance, normal: outside / distance, region, face: clamped == 1 });
    }
    if !distance.is_finite() {
        return None;
    }
    let depth = half - p.abs();
    let k = (0..3).fold(0, |best, k| if depth[k] < depth[best] { k } else { best });
    let sign = if p[k] < 0.0 { -1.0 } else { 1.0 };
    let normal = Vec3::ith(k, sign);
    Some(PointBox {
        distance: -depth[k],
        normal,
        region: region(&normal.component_mul(&(half * 2.0)), half),
        face: true,
    })
}

pub(super) fn clamp(p: &Vec3, half: &Vec3) -> Vec3 {
    p.zip_map(half, |x, h| x.clamp(-h, h))
}

/// Returns the code of the region around the box that contains `p`.
pub(super) fn region(p: &Vec3, half: &Vec3) -> u64 {
    (0..3).rev().fold(0, |code, k| {
        3 * code
            + if p[k] < -half[k] {
                0
            } else if p[k] > half[k] {
                2
            } else {
                1
            }
    })
}

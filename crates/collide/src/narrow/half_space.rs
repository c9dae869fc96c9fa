//! Sphere, capsule and box against a half-space (always B; its outward normal is local +z).

use crate::shape::axis;
use crate::{Contact, NormalFrom, Pose, Vec3};

/// Appends the contact of a sphere about `core` (radius 0: a vertex) with the plane, if within
/// `margin`.
#[inline]
fn push(core: Vec3, radius: f64, normal: &Vec3, origin: &Vec3, feature: u64, margin: f64, out: &mut Vec<Contact>) {
    let gap = normal.dot(&(core - origin)) - radius;
    if gap <= margin {
        out.push(Contact {
            point: core - normal * (radius + 0.5 * gap),
            normal: *normal,
            gap,
            feature,
            core_a: radius,
            core_b: 0.0,
            normal_from: NormalFrom::FaceOfB,
            shapes: [0; 2],
        });
    }
}

pub(super) fn sphere(radius: f64, pose_a: &Pose, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    push(pose_a.translation.vector, radius, &axis(pose_b), &pose_b.translation.vector, 0, margin, out);
}

pub(super) fn capsule(
    (radius, half_length): (f64, f64),
    pose_a: &Pose,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let (normal, origin) = (axis(pose_b), pose_b.translation.vector);
    let half = axis(pose_a) * half_length;
    push(pose_a.translation.vector - half, radius, &normal, &origin, 0, margin, out);
    push(pose_a.translation.vector + half, radius, &normal, &origin, 1, margin, out);
}

/// Appends one contact per corner within `margin`. The feature is the corner's signs (bit k set:
/// `+` on axis k).
pub(super) fn cuboid(half: &Vec3, pose_a: &Pose, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let (normal, origin) = (axis(pose_b), pose_b.translation.vector);
    let rotation = pose_a.rotation.to_rotation_matrix();
    let center = pose_a.translation.vector;
    let reach = rotation.inverse_transform_vector(&normal).abs().dot(half);
    if normal.dot(&(center - origin)) - reach > margin {
        return;
    }
    for corner in 0..8_u64 {
        let local = Vec3::from_fn(|k, _| if corner >> k & 1 == 1 { half[k] } else { -half[k] });
        push(center + rotation * local, 0.0, &normal, &origin, corner, margin, out);
    }
}

/// Appends the contact of a point of a curved surface with the plane, if within `margin`: its core radius there and its
/// feature.
pub(super) fn push_point(
    at: Vec3,
    (core_a, feature): (f64, u64),
    (normal, origin): (Vec3, Vec3),
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let gap = normal.dot(&(at - origin));
    if gap <= margin {
        let point = at - normal * (0.5 * gap);
        let normal_from = NormalFrom::FaceOfB;
        out.push(Contact { point, normal, gap, feature, core_a, core_b: 0.0, normal_from, shapes: [0; 2] });
    }
}

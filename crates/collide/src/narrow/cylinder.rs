//! A cylinder (A) on a half-space (B), exactly.
//!
//! Each flat face has a contact at its lowest rim point. A face that is nearly level also has four
//! rim points fixed in the body, so that a standing cylinder keeps its contacts under small
//! rotations. A cylinder on its side rests on the two lowest points, whose core is the axis.

use super::half_space::push_point;
use crate::shape::axis;
use crate::{Contact, Pose, Vec3};

/// Sine of the tilt below which the lowest rim point is not distinguished from the fixed ones (it
/// is lower by 0.3 of this, in radii).
const LEVEL_TILT: f64 = 1e-4;
/// Sine of the tilt above which a face stands on one point.
const STEEP_TILT: f64 = 0.2;
/// Sine of the tilt above which the cylinder lies on its side.
const SIDE_TILT: f64 = 0.99;

pub(super) fn half_space(
    (radius, half_length): (f64, f64),
    pose_a: &Pose,
    pose_b: &Pose,
    margin: f64,
    out: &mut Vec<Contact>,
) {
    let (normal, origin) = (axis(pose_b), pose_b.translation.vector);
    let up = axis(pose_a);
    // the downward direction in the flat faces
    let down = up * up.dot(&normal) - normal;
    let tilt = down.norm();
    let core_a = if tilt > SIDE_TILT { radius } else { 0.0 };
    for (face, side) in [-1.0, 1.0].into_iter().enumerate() {
        let middle = pose_a.translation.vector + up * (side * half_length);
        let mut push = |direction: Vec3, n: usize| {
            let rim = middle + direction * radius;
            push_point(rim, (core_a, (8 * face + n) as u64), (normal, origin), margin, out);
        };
        if tilt > LEVEL_TILT {
            push(down / tilt, 0);
        }
        if tilt < STEEP_TILT {
            let (x, y) = (pose_a.rotation * Vec3::x(), pose_a.rotation * Vec3::y());
            [x, y, -x, -y].into_iter().enumerate().for_each(|(n, direction)| push(direction, n + 1));
        }
    }
}

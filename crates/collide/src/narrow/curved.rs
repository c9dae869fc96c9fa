//! An ellipsoid and a cone (A) on a half-space (B), exactly.
//!
//! An ellipsoid touches at the point farthest along the negative normal. A cone touches with its tip
//! and the lowest point of its rim; if it stands, four fixed points of the rim carry it under small
//! rotations, as for a cylinder. On its side, tip and lowest point are the ends of a line, and the core
//! of the latter is on the axis.

use super::half_space::push_point;
use crate::shape::{Cone, axis, ellipsoid};
use crate::{Contact, Pose, Vec3};

/// Sine of the tilt below which the lowest rim point is not distinguished from the fixed ones.
const LEVEL_TILT: f64 = 1e-4;
/// Sine of the tilt above which the base stands on one point.
const STEEP_TILT: f64 = 0.2;
/// Cosine of the angle between the side's normal and the plane's below which the cone does not lie on
/// its side.
const ON_SIDE: f64 = 0.99;

pub(super) fn ellipsoid_half_space(half: &Vec3, pose_a: &Pose, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let (normal, origin) = (axis(pose_b), pose_b.translation.vector);
    let down = -pose_a.rotation.inverse_transform_vector(&normal);
    let core_a = ellipsoid::mean_radius(half, &down);
    let lowest = pose_a * nalgebra::Point3::from(ellipsoid::support_point(half, &down));
    push_point(lowest.coords, (core_a, 0), (normal, origin), margin, out);
}

pub(super) fn cone_half_space(cone: &Cone, pose_a: &Pose, pose_b: &Pose, margin: f64, out: &mut Vec<Contact>) {
    let (normal, origin) = (axis(pose_b), pose_b.translation.vector);
    let down = -pose_a.rotation.inverse_transform_vector(&normal);
    let mut push = |local: Vec3, core: f64, feature: u64| {
        let at = pose_a * nalgebra::Point3::from(local);
        push_point(at.coords, (core, feature), (normal, origin), margin, out);
    };
    let (across, along) = cone.side_normal();
    let tilt = down.xy().norm();
    let on_side = tilt * across + down.z * along > ON_SIDE;
    push(Vec3::z() * cone.tip(), 0.0, 0);
    let rim = |direction: Vec3| direction * cone.radius + Vec3::z() * cone.base();
    if tilt > LEVEL_TILT {
        let direction = Vec3::new(down.x, down.y, 0.0) / tilt;
        push(rim(direction), if on_side { cone.radius / across } else { 0.0 }, 1);
    }
    if tilt < STEEP_TILT && down.z < 0.0 {
        [Vec3::x(), Vec3::y(), -Vec3::x(), -Vec3::y()]
            .into_iter()
            .enumerate()
            .for_each(|(n, w)| push(rim(w), 0.0, n as u64 + 2));
    }
}

//! Orientations in files, converted to unit quaternions `[x, y, z, w]`.
//!
//! A rotation by θ about the unit axis **a** is `[a sin θ/2, cos θ/2]`; the product `p q` applies
//! `q` first.

use nalgebra::{Quaternion, Translation3, UnitQuaternion};
use tumble_core::collide::{Pose, Vec3};

use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, norm};

const ANGLE: Bound = Bound::new(-36_000.0, 36_000.0, "an angle from -36000 to 36000 degrees");
/// Largest deviation of a quaternion's length from 1.
const LENGTH_SLACK: f64 = 1e-3;

/// Reads the orientation of a body: at most one of `orientation_xyzw`, `rotation_deg` and
/// `rotation`.
pub(crate) fn read(f: &mut Fields<'_>) -> [f64; 4] {
    let ways = [read_quaternion(f), read_roll_pitch_yaw(f), read_axis_angle(f)];
    let given: Vec<[f64; 4]> = ways.into_iter().flatten().collect();
    if given.len() > 1 {
        let message = format!("{} has more than one orientation", f.what);
        f.log.report(f.span.clone(), message, "expected one of `orientation_xyzw`, `rotation_deg` and `rotation`");
    }
    given.first().copied().unwrap_or([0.0, 0.0, 0.0, 1.0])
}

/// Reads `position_m` and an orientation as one pose.
pub(crate) fn read_pose(f: &mut Fields<'_>) -> Pose {
    let position = f.vector_or("position_m", Bound::ANY, [0.0; 3]);
    pose(position, read(f))
}

/// Returns a pose from a position in meters and a unit quaternion `[x, y, z, w]`.
pub(crate) fn pose(position_m: [f64; 3], [x, y, z, w]: [f64; 4]) -> Pose {
    Pose::from_parts(
        Translation3::from(Vec3::from(position_m)),
        UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
    )
}

/// Returns roll, pitch and yaw about the fixed axes x, then y, then z, radians, as a unit
/// quaternion `[x, y, z, w]`.
pub(crate) fn roll_pitch_yaw([x, y, z]: [f64; 3]) -> [f64; 4] {
    let [about_x, about_y, about_z] = [about([1.0, 0.0, 0.0], x), about([0.0, 1.0, 0.0], y), about([0.0, 0.0, 1.0], z)];
    product(about_z, product(about_y, about_x))
}

fn read_quaternion(f: &mut Fields<'_>) -> Option<[f64; 4]> {
    let value = f.value("orientation_xyzw")?;
    let q: [f64; 4] = f.as_vector("orientation_xyzw", value, Bound::ANY);
    let length = norm(&q);
    if (length - 1.0).abs() > LENGTH_SLACK {
        f.wrong("orientation_xyzw", value, format!("a quaternion [x, y, z, w] of length 1; this one has {length:.6}"));
    }
    Some(q.map(|x| x / length))
}

fn read_roll_pitch_yaw(f: &mut Fields<'_>) -> Option<[f64; 4]> {
    let angles: [f64; 3] = f.optional_vector("rotation_deg", ANGLE)?;
    Some(roll_pitch_yaw(angles.map(f64::to_radians)))
}

fn read_axis_angle(f: &mut Fields<'_>) -> Option<[f64; 4]> {
    axis_angle(f, "rotation")
}

/// Reads `key = { axis = …, angle_deg = … }`, if present.
pub(crate) fn axis_angle(f: &mut Fields<'_>, key: &'static str) -> Option<[f64; 4]> {
    let value = f.value(key)?;
    let example = "{ axis = [0, 1, 0], angle_deg = 20 }";
    let mut turn = Fields::of(f.log, value, format!("the {key} of {}", f.what), example)?;
    let axis = turn.direction("axis");
    let angle = turn.number("angle_deg", ANGLE).to_radians();
    turn.finish();
    Some(about(axis, angle))
}

/// Returns the rotation by `angle` radians about a unit `axis`, right-handed.
fn about(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let (sin, cos) = libm::sincos(0.5 * angle);
    [axis[0] * sin, axis[1] * sin, axis[2] * sin, cos]
}

/// Returns the Hamilton product: rotation by `q`, then by `p`.
fn product(p: [f64; 4], q: [f64; 4]) -> [f64; 4] {
    let ([px, py, pz, pw], [qx, qy, qz, qw]) = (p, q);
    [
        pw * qx + px * qw + py * qz - pz * qy,
        pw * qy - px * qz + py * qw + pz * qx,
        pw * qz + px * qy - py * qx + pz * qw,
        pw * qw - px * qx - py * qy - pz * qz,
    ]
}

//! Access to the numbers of a rigid body's state.

use nalgebra::{Quaternion, Unit};
use tumble_collide::{Quat, Vec3};

/// Returns the first three numbers.
pub(crate) fn vec3(x: &[f64]) -> Vec3 {
    Vec3::new(x[0], x[1], x[2])
}

/// Returns the orientation in a rigid body's range of the state. Every writer keeps it at unit
/// length.
pub(crate) fn orientation(x: &[f64]) -> Quat {
    Unit::new_unchecked(Quaternion::new(x[6], x[3], x[4], x[5]))
}

/// Writes the orientation to a rigid body's range of the state.
pub(super) fn write_orientation(x: &mut [f64], q: &Quat) {
    x[3..7].copy_from_slice(q.coords.as_slice());
}

/// `x += h·v`.
pub(super) fn add(x: &mut [f64], v: &Vec3, h: f64) {
    x.iter_mut().zip(v.iter()).for_each(|(x, v)| *x += h * v);
}

/// Writes `[angular; linear]`.
pub(super) fn write6(out: &mut [f64], angular: &Vec3, linear: &Vec3) {
    out[..3].copy_from_slice(angular.as_slice());
    out[3..6].copy_from_slice(linear.as_slice());
}

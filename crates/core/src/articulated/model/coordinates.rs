//! Arithmetic on positions: integration along a velocity, and the velocity between two positions.
//!
//! Rotations follow the circle of a constant angular velocity, so `integrate` is exact for it and
//! `difference` is its inverse:
//!
//! ```text
//! spherical   R' = R·exp(h·ω)                      ω in the link's axes
//! floating    R' = exp(h·ω)·R,   p' = p + h·v      ω, v in world axes
//! others      q' = q + h·q̇
//! ```

use crate::articulated::model::Model;
use crate::articulated::model::joint::Joint;
use crate::rigid::rotation::turn;
use nalgebra::{Quaternion, Unit};
use tumble_collide::{Quat, Vec3};

/// Integrates the positions `q` along the velocities `v` for `h` seconds. Exact on rotations;
/// normalizes quaternions. Lengths: [`Model::positions`] and [`Model::dof`].
pub fn integrate(model: &Model, q: &mut [f64], v: &[f64], h: f64) {
    for link in model.links() {
        let (q, v) = (&mut q[link.q..], &v[link.v..]);
        match link.joint {
            Joint::Fixed => {}
            Joint::Revolute { .. } | Joint::Prismatic { .. } => q[0] += h * v[0],
            Joint::Spherical => write_rotation(&(read_rotation(q) * turn(&Quat::identity(), &read_vector(v), h)), q),
            Joint::Floating => {
                for k in 0..3 {
                    q[k] += h * v[3 + k];
                }
                write_rotation(&turn(&read_rotation(&q[3..]), &read_vector(v), h), &mut q[3..]);
            }
        }
    }
}

/// Writes the velocity `v` that takes `from` to `to` in one second: `integrate(from, v, 1) = to`.
/// Rotations take the shorter way.
pub fn difference(model: &Model, from: &[f64], to: &[f64], v: &mut [f64]) {
    for link in model.links() {
        let (a, b, v) = (&from[link.q..], &to[link.q..], &mut v[link.v..]);
        match link.joint {
            Joint::Fixed => {}
            Joint::Revolute { .. } | Joint::Prismatic { .. } => v[0] = b[0] - a[0],
            Joint::Spherical => write_vector(&(read_rotation(a).inverse() * read_rotation(b)).scaled_axis(), v),
            Joint::Floating => {
                write_vector(&(read_rotation(&b[3..]) * read_rotation(&a[3..]).inverse()).scaled_axis(), v);
                write_vector(&(read_vector(b) - read_vector(a)), &mut v[3..]);
            }
        }
    }
}

/// Normalizes the quaternions in `q`; one of length 0 becomes the identity.
pub fn normalize(model: &Model, q: &mut [f64]) {
    for link in model.links() {
        if let Some(k) = link.joint.quaternion() {
            let turn = &mut q[link.q + k..link.q + k + 4];
            let unit =
                Unit::try_new(Quaternion::new(turn[3], turn[0], turn[1], turn[2]), 0.0).unwrap_or_else(Quat::identity);
            write_rotation(&unit, turn);
        }
    }
}

/// Returns a vector from the first three numbers.
pub(in crate::articulated) fn read_vector(x: &[f64]) -> Vec3 {
    Vec3::new(x[0], x[1], x[2])
}

/// Returns a rotation from the first four numbers, `x, y, z, w`, normalized.
pub(in crate::articulated) fn read_rotation(x: &[f64]) -> Quat {
    Unit::new_normalize(Quaternion::new(x[3], x[0], x[1], x[2]))
}

fn write_vector(a: &Vec3, x: &mut [f64]) {
    x[..3].copy_from_slice(a.as_slice());
}

fn write_rotation(rotation: &Quat, x: &mut [f64]) {
    let unit = rotation.into_inner().normalize();
    x[..4].copy_from_slice(unit.coords.as_slice());
}

//! The point at which the rim of a cylinder touches a plane: it runs along the rim when the cylinder
//! rolls on its edge.
//!
//! ```text
//! p = c − a·d̂,   d = n − u·(u·n),   ṗ = ċ − a·d̂˙,   d̂˙ = (1 − d̂·d̂ᵀ)·ḋ/|d|
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `c`, `u`, `a` | center and axis of the end, radius of the rim |
//! | `n` | normal of the plane, into the cylinder |

use crate::object::part_state::PartState;
use tumble_collide::{Shape, Vec3};

/// A contact point farther from the lowest point of the rim than this fraction of the radius is another one: a
/// corner of the end's overlap with a face.
const SAME_POINT: f64 = 1e-3;

/// A cylinder on its end that is tilted by less, rad, touches with the whole end: the lowest point of
/// the rim means nothing.
const LEAST_TILT: f64 = 1e-3;

/// Returns the velocity of the rim's contact point over the material there, m/s; `None` if `point`
/// (m) is not the rim's point farthest along `−normal`. `normal` (unit, into the cylinder) changes at
/// `normal_rate` (1/s).
pub(crate) fn rim_rate(
    shape: &Shape,
    state: &PartState,
    point: &Vec3,
    normal: &Vec3,
    normal_rate: &Vec3,
) -> Option<Vec3> {
    let Shape::Cylinder(cylinder) = shape else { return None };
    let (radius, half_length) = (cylinder.radius(), cylinder.half_length());
    let u = state.pose.rotation * Vec3::z();
    let across = normal - u * u.dot(normal);
    let length = across.norm();
    if length < LEAST_TILT {
        return None;
    }
    let d = across / length;
    let end = state.position() + u * u.dot(&(point - state.position())).signum() * half_length;
    let rim = end - radius * d;
    if (point - rim).norm() > SAME_POINT * radius {
        return None;
    }
    let u_rate = state.angular_velocity.cross(&u);
    let rate = normal_rate - u * (u.dot(normal_rate) + u_rate.dot(normal)) - u_rate * u.dot(normal);
    let turning = (rate - d * d.dot(&rate)) / length;
    Some(state.angular_velocity.cross(&(radius * d)) - radius * turning)
}

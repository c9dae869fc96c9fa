//! Cones and twists of spherical joints of articulated bodies: the angle between an axis of the link and the same axis of the
//! joint, and the turn about that axis.
//!
//! ```text
//! swing      θ = ∠(w, u),   u = R·w         rate  θ̇ = n·R·ω,   n = w × u/|w × u|        bias  ṅ·R·ω
//! row        gap = cone − θ,   velocity −θ̇,   one-sided
//! twist      ψ = 2·atan2(q_w, q_0)          rate  ψ̇ = m·R·ω,   m = (w + u)/(1 + w·u)    bias  ṁ·R·ω
//! rows       gaps ψ − ψ_lo and ψ_hi − ψ,   velocities ±ψ̇,   one-sided
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `w` | axis x, y or z of the joint's frame: that of the degree of freedom with the limit |
//! | `R` | rotation of the link in the joint's frame: the position of the joint |
//! | `ω` | velocity of the joint, in the link's axes |
//! | `n` | axis of the swing, in the joint's frame |
//! | `q_w, q_0` | component of the quaternion of `R` along `w`, and its scalar part |

use crate::articulated::model::coordinates::{read_rotation, read_vector};
use crate::constraint::loop_joint::near;
use nalgebra::RealField;
use tumble_collide::{Quat, Vec3};

/// `|w × u|` below which the axis of the swing is that of the motion.
const PARALLEL: f64 = 1e-9;

/// The swing of one axis of a spherical joint, or the twist about it.
pub(super) struct Swing {
    /// `θ`, rad, in [0, π]; or `ψ` in (−π, π].
    pub angle: f64,
    /// `∂θ̇/∂ω`: the axis of the swing in the link's axes.
    pub jacobian: Vec3,
    /// `θ̈` at constant `ω`.
    pub bias: f64,
}

/// Returns the rotation vector of a spherical joint with the position numbers `q`, link axes, from the orientation whose
/// rotation vector is `from`.
pub(super) fn turn_from(q: &[f64], from: &Vec3) -> Vec3 {
    let turn = read_rotation(q);
    if *from == Vec3::zeros() { turn.scaled_axis() } else { (Quat::from_scaled_axis(-from) * turn).scaled_axis() }
}

impl Swing {
    /// Returns the swing of axis `k` for the position and velocity numbers of the joint.
    pub fn of(k: usize, q: &[f64], v: &[f64]) -> Swing {
        let (rotation, w) = (read_rotation(q), Vec3::ith(k, 1.0));
        let (u, omega) = (rotation * w, rotation * read_vector(v));
        let c = w.cross(&u);
        let angle = RealField::atan2(c.norm(), w.dot(&u));
        let (n, bias) = match c.try_normalize(PARALLEL) {
            Some(n) => {
                let rate = w.cross(&omega.cross(&u));
                (n, ((rate - n * n.dot(&rate)) / c.norm()).dot(&omega))
            }
            None => {
                let across = (omega - w * w.dot(&omega)).try_normalize(0.0);
                (across.unwrap_or_else(|| Vec3::ith((k + 1) % 3, 1.0)), 0.0)
            }
        };
        Swing { angle, jacobian: rotation.inverse() * n, bias }
    }

    /// Returns the twist about axis `k`: the turn of the link about that axis after the shortest turn of the joint's axis to it.
    /// It has no value where the axes are opposite.
    pub fn twist(k: usize, q: &[f64], v: &[f64]) -> Swing {
        let (rotation, w) = (read_rotation(q), Vec3::ith(k, 1.0));
        let (u, omega) = (rotation * w, rotation * read_vector(v));
        let angle = near(2.0 * RealField::atan2(rotation.coords[k], rotation.coords.w), 0.0);
        let (u_rate, left) = (omega.cross(&u), (1.0 + w.dot(&u)).max(1e-9));
        let turning = u_rate / left - (w + u) * (w.dot(&u_rate) / (left * left));
        Swing { angle, jacobian: rotation.inverse() * ((w + u) / left), bias: turning.dot(&omega) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rate and the bias are the derivatives of the angle along the motion at constant `ω`.
    #[test]
    fn rates_are_derivatives() {
        let start = Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 0.3));
        let v = [0.8, -0.3, 1.1];
        let at = |t: f64| {
            let q = start * Quat::from_scaled_axis(Vec3::from(v) * t);
            let q = q.coords.as_slice();
            let all: [Swing; 6] =
                std::array::from_fn(|k| if k < 3 { Swing::of(k, q, &v) } else { Swing::twist(k - 3, q, &v) });
            all
        };
        let h = 1e-5;
        for (k, (before, after)) in at(-h).iter().zip(at(h)).enumerate() {
            let now = &at(0.0)[k];
            let rate = now.jacobian.dot(&Vec3::from(v));
            assert!(((after.angle - before.angle) / (2.0 * h) - rate).abs() < 1e-8, "row {k}");
            let rates = [before, &after].map(|swing| swing.jacobian.dot(&Vec3::from(v)));
            assert!(((rates[1] - rates[0]) / (2.0 * h) - now.bias).abs() < 1e-8, "row {k}");
        }
    }
}

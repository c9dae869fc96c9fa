//! Cones of spherical joints of articulated bodies: the largest angle between an axis of the link and the same axis of the
//! joint.
//!
//! ```text
//! swing      θ = ∠(w, u),   u = R·w         rate  θ̇ = n·R·ω,   n = w × u/|w × u|        bias  ṅ·R·ω
//! row        gap = cone − θ,   velocity −θ̇,   one-sided
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `w` | axis x, y or z of the joint's frame: that of the degree of freedom with the limit |
//! | `R` | rotation of the link in the joint's frame: the position of the joint |
//! | `ω` | velocity of the joint, in the link's axes |
//! | `n` | axis of the swing, in the joint's frame |

use crate::articulated::model::coordinates::{read_rotation, read_vector};
use nalgebra::RealField;
use tumble_collide::Vec3;

/// `|w × u|` below which the axis of the swing is that of the motion.
const PARALLEL: f64 = 1e-9;

/// The swing of one axis of a spherical joint.
pub(super) struct Swing {
    /// `θ`, rad, in [0, π].
    pub angle: f64,
    /// `∂θ̇/∂ω`: the axis of the swing in the link's axes.
    pub jacobian: Vec3,
    /// `θ̈` at constant `ω`.
    pub bias: f64,
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble_collide::Quat;

    /// The rate and the bias are the derivatives of the angle along the motion at constant `ω`.
    #[test]
    fn rates_are_derivatives() {
        let start = Quat::from_scaled_axis(Vec3::new(0.4, -0.7, 0.3));
        let v = [0.8, -0.3, 1.1];
        let at = |t: f64| {
            let q = start * Quat::from_scaled_axis(Vec3::from(v) * t);
            std::array::from_fn::<Swing, 3, _>(|k| Swing::of(k, q.coords.as_slice(), &v))
        };
        let h = 1e-5;
        for (k, (before, after)) in at(-h).iter().zip(at(h)).enumerate() {
            let now = &at(0.0)[k];
            let rate = now.jacobian.dot(&Vec3::from(v));
            assert!(((after.angle - before.angle) / (2.0 * h) - rate).abs() < 1e-8, "axis {k}");
            let rates = [before, &after].map(|swing| swing.jacobian.dot(&Vec3::from(v)));
            assert!(((rates[1] - rates[0]) / (2.0 * h) - now.bias).abs() < 1e-8, "axis {k}");
        }
    }
}

//! Torque-free rotation of a rigid body by symmetric splitting.
//!
//! In principal axes the kinetic energy is `Σ m_i²/2I_i`, and the flow of each term alone is a rotation about axis `i` by the angle
//! `m_i·h/I_i`, which leaves `m_i` unchanged. Composed symmetrically, `1(h/2) 2(h/2) 3(h) 2(h/2) 1(h/2)`, they keep the angular
//! momentum to rounding, are time-reversible and of second order, and the energy error stays bounded.
//! Source: Dullweber, Leimkuhler, McLachlan, *Symplectic splitting methods for rigid body molecular dynamics*, 1997.
//!
//! | symbol | meaning |
//! |---|---|
//! | `q` | orientation of the principal axes in the world |
//! | `m` | angular momentum in principal axes, kg·m²/s |
//! | `I` | principal moments, kg·m² |

use nalgebra::{ComplexField, Quaternion, Unit};
use tumble_collide::{Quat, Vec3};

/// Rotates `q` for `h` seconds with world angular momentum `l` held; `moments` are the principal moments.
pub fn coast(q: &Quat, l: &Vec3, moments: &Vec3, h: f64) -> Quat {
    let spread = moments.max() - moments.min();
    if spread <= 1e-12 * moments.max() {
        return turn(q, &(l / moments.x), h);
    }
    let mut m = q.inverse_transform_vector(l);
    let mut q = q.into_inner();
    for (axis, part) in [(0, 0.5), (1, 0.5), (2, 1.0), (1, 0.5), (0, 0.5)] {
        let (s, c) = ComplexField::sin_cos(0.5 * part * h * m[axis] / moments[axis]);
        q *= about(axis, s, c);
        // The momentum turns the other way in the turning axes: by −angle, with cos = c² − s², sin = 2sc.
        let (cos, sin) = (c * c - s * s, 2.0 * s * c);
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        (m[i], m[j]) = (cos * m[i] + sin * m[j], cos * m[j] - sin * m[i]);
    }
    Unit::new_normalize(q)
}

/// Rotates `q` by the world rotation vector `h·omega`: the exponential map.
pub fn turn(q: &Quat, omega: &Vec3, h: f64) -> Quat {
    let half = 0.5 * h * omega;
    let angle = half.norm();
    let (s, c) = ComplexField::sin_cos(angle);
    let axis = if angle > 1e-8 { half * (s / angle) } else { half };
    Unit::new_normalize(Quaternion::from_parts(c, axis) * q.into_inner())
}

/// The rate of the rotation vector `theta` of a rotation `exp(θ)·q₀` that turns with the world angular velocity `omega`: `dexp⁻¹_θ(ω)`, the inverse
/// of the differential of [`turn`].
///
/// ```text
/// θ̇ = ω − ½·θ×ω + c·θ×(θ×ω)           c = (1 − ½|θ|·cot ½|θ|)/|θ|² = 1/12 + |θ|²/720 + |θ|⁴/30240 + …
/// ```
///
/// Singular at a full turn, `|θ| = 2π`.
pub fn pull_back(theta: &Vec3, omega: &Vec3) -> Vec3 {
    let square = theta.norm_squared();
    let c = if square < 1e-2 {
        1.0 / 12.0 + square * (1.0 / 720.0 + square * (1.0 / 30240.0 + square / 1209600.0))
    } else {
        let half = 0.5 * square.sqrt();
        let (sin, cos) = ComplexField::sin_cos(half);
        (1.0 - half * cos / sin) / square
    };
    let across = theta.cross(omega);
    omega - 0.5 * across + c * theta.cross(&across)
}

fn about(axis: usize, s: f64, c: f64) -> Quaternion<f64> {
    let mut v = Vec3::zeros();
    v[axis] = s;
    Quaternion::from_parts(c, v)
}

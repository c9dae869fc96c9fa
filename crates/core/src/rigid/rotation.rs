//! Torque-free rotation of a rigid body by symmetric splitting with energy conservation.
//!
//! ```text
//! T = |l|²/2I_b + ½a_i·m_i² + ½a_j·m_j²        a = 1/I − 1/I_b,  I_b the middle moment
//! ```
//!
//! The flow of the first term turns the body about `l` by `|l|·h/I_b` and commutes with the others.
//! The flow of each other term is a rotation about its axis by `a·m·h`, which leaves that `m`
//! unchanged. The symmetric composition `b(h) i(h/2) j(h) i(h/2)` conserves angular momentum to
//! rounding and is of second order; it is exact for a body with two equal moments.
//!
//! For three different moments the energy has an error of second order in `h`, and a different one
//! after every impact. The body is therefore turned back to its former energy: `m` moves along `m ×
//! ω`, the direction of steepest ascent of the energy on the sphere `|m| = |l|`. The remaining
//! error is in the phase of the motion. Source of the splitting: Dullweber, Leimkuhler, McLachlan,
//! *Symplectic splitting methods for rigid body molecular dynamics*, 1997.
//!
//! | symbol | meaning |
//! |---|---|
//! | `q` | orientation of the principal axes in the world |
//! | `l` | angular momentum in the world, kg·m²/s; `m` the same in principal axes |
//! | `I` | principal moments, kg·m² |
//! | `ω` | angular velocity in principal axes, `m/I` |

use nalgebra::{ComplexField, Quaternion, Unit};
use tumble_collide::{Quat, Vec3};

/// Maximum number of energy corrections.
const CORRECTIONS: usize = 4;
/// Maximum angle of a correction, rad.
const FARTHEST: f64 = 0.3;

/// Rotates `q` for `h` seconds at constant world angular momentum `l`; `moments` are the principal
/// moments. Conserves angular momentum and energy to rounding.
pub fn free_motion(q: &Quat, l: &Vec3, moments: &Vec3, h: f64) -> Quat {
    let inverse = moments.map(|i| 1.0 / i);
    let (low, high) = (moments.imin(), moments.imax());
    if moments[high] - moments[low] <= 1e-12 * moments[high] {
        return turn(q, &(l * inverse.x), h);
    }
    let base = 3 - low - high;
    let a = inverse.add_scalar(-inverse[base]);
    let (outer, inner) = if a[low].abs() >= a[high].abs() { (low, high) } else { (high, low) };
    let (mut m, mut turned) = (q.inverse_transform_vector(l), q.into_inner());
    for (axis, part) in [(outer, 0.5), (inner, 1.0), (outer, 0.5)] {
        let (s, c) = ComplexField::sin_cos(0.5 * part * h * a[axis] * m[axis]);
        turned *= about(axis, s, c);
        // The momentum turns by −angle in the turning axes, with cos = c² − s², sin = 2sc.
        let (cos, sin) = (c * c - s * s, 2.0 * s * c);
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        (m[i], m[j]) = (cos * m[i] + sin * m[j], cos * m[j] - sin * m[i]);
    }
    let free = turn(&Unit::new_unchecked(turned), &(l * inverse[base]), h);
    onto_energy(free, q, l, &inverse)
}

/// Turns `q` by the smallest angle that restores the energy at `before`.
fn onto_energy(mut q: Quat, before: &Quat, l: &Vec3, inverse: &Vec3) -> Quat {
    let twice = |m: &Vec3| m.component_mul(m).dot(inverse);
    let wanted = twice(&before.inverse_transform_vector(l));
    for _ in 0..CORRECTIONS {
        let m = q.inverse_transform_vector(l);
        let omega = m.component_mul(inverse);
        let (off, up) = (0.5 * (twice(&m) - wanted), m.cross(&omega));
        let steepness = up.norm_squared();
        if off.abs() <= 1e-15 * wanted || steepness <= 1e-20 * m.norm_squared() * omega.norm_squared() {
            break;
        }
        // dE = θ·(m × ω) if m turns by θ, which is q turned by −θ in its own axes
        let theta = up * (off / steepness);
        let angle = theta.norm();
        q *= turn(&Quat::identity(), &theta, if angle > FARTHEST { FARTHEST / angle } else { 1.0 });
    }
    q
}

/// Rotates `q` by the world rotation vector `h·omega`: the exponential map.
pub fn turn(q: &Quat, omega: &Vec3, h: f64) -> Quat {
    let half = 0.5 * h * omega;
    let angle = half.norm();
    let (s, c) = ComplexField::sin_cos(angle);
    let axis = if angle > 1e-8 { half * (s / angle) } else { half };
    Unit::new_normalize(Quaternion::from_parts(c, axis) * q.into_inner())
}

/// Returns the rate of the rotation vector `theta` of a rotation `exp(θ)·q₀` with the world angular
/// velocity `omega`: `dexp⁻¹_θ(ω)`, the inverse of the differential of [`turn`].
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

//! Rates of rotation vectors.
//!
//! ```text
//! R = exp(r),   Ṙ = [ω]·R      ṙ = J⁻¹(r)·ω,     J⁻¹(r) = 1 − ½[r] + c·[r]²
//! Ṙ = R·[ω]                    ṙ = J⁻ᵀ(r)·ω
//! c = 1/θ² − cot(½θ)/(2θ),     θ = |r|
//! ```
//!
//! A spring along each component pulls along the gradients of the components, so it has a potential.

use nalgebra::ComplexField;
use tumble_collide::Vec3;

/// A rotation vector that changes.
pub(crate) struct RotationVector {
    /// rad.
    pub r: Vec3,
    /// `ṙ`, rad/s.
    pub rate: Vec3,
    /// 1 if the angular velocity has the axes in which the rotation is measured, −1 if it has the axes that are rotated.
    side: f64,
    c: f64,
    c_rate: f64,
}

impl RotationVector {
    /// Returns the vector `r` at an angular velocity in the axes in which the rotation is measured.
    pub fn outside(r: Vec3, omega: &Vec3) -> RotationVector {
        RotationVector::of(r, omega, 1.0)
    }

    /// Returns the vector `r` at an angular velocity in the axes that are rotated.
    pub fn inside(r: Vec3, omega: &Vec3) -> RotationVector {
        RotationVector::of(r, omega, -1.0)
    }

    fn of(r: Vec3, omega: &Vec3, side: f64) -> RotationVector {
        let (c, slope) = factor(r.norm());
        let rate = omega - 0.5 * side * r.cross(omega) + c * r.cross(&r.cross(omega));
        RotationVector { r, rate, side, c, c_rate: slope * r.dot(&rate) }
    }

    /// Returns `w` with `ṙ_k = w·ω`, and its rate.
    pub fn gradient(&self, k: usize) -> [Vec3; 2] {
        let (r, rate, e) = (&self.r, &self.rate, Vec3::ith(k, 1.0));
        let twice = r.cross(&r.cross(&e));
        let w = e + 0.5 * self.side * r.cross(&e) + self.c * twice;
        let turning = 0.5 * self.side * rate.cross(&e)
            + self.c_rate * twice
            + self.c * (rate.cross(&r.cross(&e)) + r.cross(&rate.cross(&e)));
        [w, turning]
    }
}

/// Returns `c`, and its rate by `θ`, divided by `θ`.
fn factor(angle: f64) -> (f64, f64) {
    if angle < 1e-2 {
        let square = angle * angle;
        return (1.0 / 12.0 + square / 720.0, 1.0 / 360.0 + square / 7560.0);
    }
    let (sin, cos) = ComplexField::sin_cos(0.5 * angle);
    let (cot, square) = (cos / sin, angle * angle);
    let slope = -2.0 / (square * angle) + cot / (2.0 * square) + 1.0 / (4.0 * angle * sin * sin);
    (1.0 / square - cot / (2.0 * angle), slope / angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use tumble_collide::Quat;

    /// Rates and gradients are the derivatives of the vector along the motion.
    #[test]
    fn rates_are_those_of_the_rotation() {
        let (omega, h) = (Vec3::new(0.7, -1.1, 0.4), 1e-4);
        for size in [0.0, 1e-5, 9e-3, 0.02, 1.0, 2.9] {
            let r = size * Vec3::new(0.36, -0.48, 0.8);
            let turned = |t: f64, inside: bool| {
                let (start, turn) = (Quat::from_scaled_axis(r), Quat::from_scaled_axis(t * omega));
                if inside { (start * turn).scaled_axis() } else { (turn * start).scaled_axis() }
            };
            for inside in [false, true] {
                let make = if inside { RotationVector::inside } else { RotationVector::outside };
                let at = make(r, &omega);
                let rate = (turned(h, inside) - turned(-h, inside)) / (2.0 * h);
                let second = (turned(h, inside) - 2.0 * r + turned(-h, inside)) / (h * h);
                assert!((at.rate - rate).norm() < 1e-7, "{size} {inside}: {} instead of {rate}", at.rate);
                for k in 0..3 {
                    let [w, turning] = at.gradient(k);
                    assert!((w.dot(&omega) - rate[k]).abs() < 1e-7, "{size} {inside} {k}");
                    assert!((turning.dot(&omega) - second[k]).abs() < 1e-5, "{size} {inside} {k}");
                }
            }
        }
    }
}

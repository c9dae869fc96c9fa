//! Forces of several points as one force and torque, and the least forces at other points that equal
//! them.
//!
//! Forces `f_i` at points `r_i` have the force `F` and the torque `τ` about the origin. The smallest
//! forces (least `Σ|f_i|²`) with that sum and torque at `n` points of centroid `c`, `d_i = r_i − c`:
//!
//! ```text
//! f_i = F/n + b × d_i,        (Σ |d_i|²·1 − d_i·d_iᵀ)·b = τ − c × F
//! ```
//!
//! Points that are close together would need large forces against the torque, and points at one place, apart by rounding,
//! forces without bound. So `b` is shortened until `|b × d_i|` is at most [`LARGEST`] times the sum of the given `|f_i|`.

use tumble_collide::{Mat3, Vec3};

/// A force, N, its torque about the origin, N·m, and the sum of the magnitudes of the forces that it consists of, N.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrench {
    pub force: Vec3,
    pub torque: Vec3,
    magnitude: f64,
}

/// Moments of the points below this fraction of their trace resist little: nearly on a line, they
/// would need large forces against a torque about it.
const FLAT: f64 = 0.02;
/// Largest force against the torque at a point, in the sum of the magnitudes of the forces.
const LARGEST: f64 = 2.0;

impl Wrench {
    /// Adds a force at a point.
    pub fn add(&mut self, point: &Vec3, force: &Vec3) {
        self.force += force;
        self.torque += point.cross(force);
        self.magnitude += force.norm();
    }

    /// Adds to `forces` the smallest forces at the points that `which` selects whose sum and torque
    /// are this wrench, as far as those points can exert it: points on a line have no torque about
    /// it, and points at one place none.
    pub fn spread(&self, point: impl Fn(usize) -> Vec3, which: impl Fn(usize) -> bool, forces: &mut [Vec3]) {
        let members = || (0..forces.len()).filter(|&i| which(i));
        let n = members().count() as f64;
        if n == 0.0 {
            return;
        }
        let center = members().map(&point).sum::<Vec3>() / n;
        let mut moments = Mat3::zeros();
        for d in members().map(|i| point(i) - center) {
            moments += Mat3::from_diagonal_element(d.norm_squared()) - d * d.transpose();
        }
        let size = moments.trace();
        let torque = self.torque - center.cross(&self.force);
        let turn = (moments * moments + Mat3::from_diagonal_element((FLAT * size).powi(2)))
            .try_inverse()
            .map_or(Vec3::zeros(), |inverse| inverse * (moments * torque));
        let arm = |i: usize| point(i) - center;
        let largest = members().map(|i| turn.cross(&arm(i)).norm()).fold(0.0, f64::max);
        let most = LARGEST * self.magnitude;
        let (turn, rest) = if largest > most {
            (turn * (most / largest), members().map(arm).sum::<Vec3>() / n) // arms of rounding have a sum
        } else {
            (turn, Vec3::zeros())
        };
        let members: Vec<usize> = members().collect();
        members.iter().for_each(|&i| forces[i] += self.force / n + turn.cross(&(arm(i) - rest)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(-1.0..1.0_f64).prop_map(Vec3::from)
    }

    proptest! {
        /// Three points that are not near a line exert the force and, to 3 %, the torque.
        #[test]
        fn forces_of_points_that_are_gone_pass_to_others(force in vector(), at in vector(), normal in vector()) {
            let mut gone = Wrench::default();
            gone.add(&at, &force);
            gone.add(&-at, &(2.0 * force + normal));
            let points = [Vec3::x(), Vec3::y(), -Vec3::x() - Vec3::y(), 5.0 * Vec3::z()];
            let mut forces = [Vec3::zeros(); 4];
            gone.spread(|i| points[i], |i| i < 3, &mut forces);
            let mut spread = Wrench::default();
            points.iter().zip(&forces).for_each(|(p, f)| spread.add(p, f));
            prop_assert_eq!(forces[3], Vec3::zeros());
            prop_assert!((spread.force - gone.force).norm() < 1e-12);
            prop_assert!((spread.torque - gone.torque).norm() < 0.03 * gone.torque.norm() + 1e-12);
        }

        /// Points on a line keep the force, and their forces do not grow without bound.
        #[test]
        fn points_on_a_line_resist_no_torque_about_it(force in vector(), at in vector(), off in 0.0..1e-3_f64) {
            let mut gone = Wrench::default();
            gone.add(&at, &force);
            let points = [Vec3::x(), -Vec3::x(), Vec3::new(0.0, off, 0.0)];
            let mut forces = [Vec3::zeros(); 3];
            gone.spread(|i| points[i], |_| true, &mut forces);
            prop_assert!((forces.iter().sum::<Vec3>() - force).norm() < 1e-12);
            prop_assert!(forces.iter().all(|f| f.norm() < 10.0), "{forces:?}");
        }

        /// Points at one place, apart by rounding, keep the force, and their forces are not larger than what they replace.
        #[test]
        fn points_at_one_place_resist_no_torque(force in vector(), other in vector(), at in vector(), power in -18.0..-3.0_f64) {
            let mut gone = Wrench::default();
            gone.add(&at, &force);
            gone.add(&Vec3::zeros(), &other);
            let points = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| Vec3::repeat(0.05) + 10f64.powf(power) * axis);
            let mut forces = [Vec3::zeros(); 3];
            gone.spread(|i| points[i], |_| true, &mut forces);
            let given = force.norm() + other.norm();
            prop_assert!((forces.iter().sum::<Vec3>() - force - other).norm() < 1e-12);
            prop_assert!(forces.iter().all(|f| f.norm() <= 3.0 * given), "{forces:?}");
        }
    }
}

//! Inertia of a rigid body [RBDA §2.13]: ten numbers.
//!
//! ```text
//! I = [ J    h× ]      momentum   I [ω; v] = [J ω + h × v;  m v − h × ω]
//!     [ −h×  m  ]      h = m c, first moment of mass;  J about the frame's origin
//! ```

use super::matrix::Symmetric;
use super::motion::{Force, Motion};
use super::scalar::Scalar;
use super::transform::Transform;
use super::vector::Vector;
use tumble_collide::{Mat3, Vec3};

/// Inertia of a rigid body about its frame's origin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertia<T = f64> {
    /// `J`, about the frame's origin, kg·m².
    pub rotational: Symmetric<T>,
    /// `h = m·c`, mass times center of mass, kg·m.
    pub moment: Vector<T>,
    /// `m`, kg.
    pub mass: T,
}

impl<T: Scalar> Inertia<T> {
    /// Returns the momentum of a body with velocity `velocity`, or the force for that acceleration
    /// from rest.
    #[inline(always)]
    pub fn times(&self, velocity: Motion<T>) -> Force<T> {
        Force {
            torque: self.rotational * velocity.angular + self.moment.cross(velocity.linear),
            force: velocity.linear * self.mass - self.moment.cross(velocity.angular),
        }
    }

    /// Returns twice the kinetic energy, `vᵀ I v`, J.
    #[inline(always)]
    pub fn doubled_energy(&self, velocity: Motion<T>) -> T {
        velocity.power(self.times(velocity))
    }
}

impl Inertia<f64> {
    /// Makes the inertia of a body from mass, kg, center of mass, m, and the inertia about it,
    /// kg·m², all in the frame's axes: `J = I + m(|c|²·1 − c cᵀ)`.
    pub fn new(mass: f64, center: &Vec3, about_center: &Mat3) -> Inertia<f64> {
        let rotational = about_center + mass * (center.norm_squared() * Mat3::identity() - center * center.transpose());
        Inertia { rotational: rotational.into(), moment: (mass * center).into(), mass }
    }

    /// Returns the inertia in coordinates of A, from coordinates of B: `J' = R J Rᵀ + m(|p|² − p
    /// pᵀ) + 2 (p·Rh) − p Rhᵀ − Rh pᵀ`, `h' = R h + m p`.
    pub fn seen_from(&self, frame: &Transform<f64>) -> Inertia<f64> {
        let (r, p, h): (Mat3, Vec3, Vec3) =
            (frame.rotation.into(), frame.position.into(), (frame.rotation * self.moment).into());
        let moved = |a: &Vec3, b: &Vec3| a.dot(b) * Mat3::identity() - a * b.transpose();
        let rotational =
            r * Mat3::from(self.rotational) * r.transpose() + self.mass * moved(&p, &p) + moved(&p, &h) + moved(&h, &p);
        Inertia { rotational: rotational.into(), moment: (h + self.mass * p).into(), mass: self.mass }
    }
}

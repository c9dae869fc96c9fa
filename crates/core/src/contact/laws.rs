//! Laws of a pair of surfaces beside those of Coulomb and of restitution.
//!
//! Friction that depends on the direction: with the factors `s_k` of `μ` along two orthogonal tangents
//! `t_k`, rows along `s_k·t_k` turn the ellipse of admissible friction forces into the circle of the
//! solver, and the force of greatest dissipation into that opposite to the row velocities. The factors
//! are the eigenvalues of `T = P·R·diag(s)·Rᵀ·P`, with `R` the rotation of the part and `P = 1 − n·nᵀ`.

use crate::object::Material;
use crate::object::collidable::ContactFrame;
use crate::object::part_state::PartState;
use tumble_collide::{Mat3, Vec3};

/// Constants of a pair of surfaces; see [`Material`].
#[derive(Clone, Debug)]
pub(crate) struct ContactLaws {
    /// m.
    pub rolling: f64,
    /// m.
    pub torsional: f64,
    pub static_friction: f64,
    /// m/s.
    pub stribeck_speed: f64,
    pub tangential_restitution: f64,
    /// N.
    pub adhesion: f64,
    /// The share of this contact in the adhesion, N.
    pub pull: f64,
    /// Factors of friction in world axes, if any is not 1.
    pub friction_scale: Option<Mat3>,
}

/// Least factor of friction in a direction: a row without response would be none.
const LEAST_SCALE: f64 = 1e-3;

impl ContactLaws {
    /// Returns the laws of two parts with their materials; `None` if Coulomb's and restitution are all.
    pub fn of_pair(pair: &Material, sides: [(&PartState, &Material); 2]) -> Option<Box<ContactLaws>> {
        let own = [pair.rolling_friction, pair.torsional_friction, pair.tangential_restitution, pair.adhesion];
        let [a, b] = sides.map(|(_, material)| material.friction_scale != Vec3::repeat(1.0));
        if own == [0.0; 4] && pair.static_friction <= pair.friction && !a && !b {
            return None;
        }
        let scale = |(state, material): (&PartState, &Material)| {
            let axes = state.pose.rotation.to_rotation_matrix().into_inner();
            axes * Mat3::from_diagonal(&material.friction_scale) * axes.transpose()
        };
        let friction_scale = match (a, b) {
            (false, false) => None,
            (true, false) => Some(scale(sides[0])),
            (false, true) => Some(scale(sides[1])),
            (true, true) => {
                let product = scale(sides[0]) * scale(sides[1]);
                Some(0.5 * (product + product.transpose()))
            }
        };
        Some(Box::new(ContactLaws {
            rolling: pair.rolling_friction,
            torsional: pair.torsional_friction,
            static_friction: pair.static_friction,
            stribeck_speed: pair.stribeck_speed,
            tangential_restitution: pair.tangential_restitution,
            adhesion: pair.adhesion,
            pull: 0.0,
            friction_scale,
        }))
    }

    /// Returns the frame of a contact: tangents are scaled by the factors of friction.
    pub fn frame(laws: Option<&ContactLaws>, point: Vec3, normal: Vec3) -> ContactFrame {
        let mut frame = ContactFrame::new(point, normal);
        let Some(scale) = laws.and_then(|laws| laws.friction_scale) else { return frame };
        let [_, t, b] = frame.axes;
        let (tt, tb, bb) = (t.dot(&(scale * t)), t.dot(&(scale * b)), b.dot(&(scale * b)));
        let angle = 0.5 * nalgebra::RealField::atan2(2.0 * tb, tt - bb);
        let (sin, cos) = nalgebra::ComplexField::sin_cos(angle);
        let mean = 0.5 * (tt + bb);
        let half = nalgebra::ComplexField::hypot(0.5 * (tt - bb), tb);
        let factor = |s: f64| s.max(LEAST_SCALE);
        frame.axes[1] = factor(mean + half) * (cos * t + sin * b);
        frame.axes[2] = factor(mean - half) * (cos * b - sin * t);
        frame
    }

    /// Returns the coefficient of friction at a sliding speed, m/s, for that of fast sliding.
    pub fn friction_at(&self, speed: f64, sliding: f64) -> f64 {
        sliding
            + (self.static_friction - sliding).max(0.0)
                * nalgebra::ComplexField::exp(-(speed / self.stribeck_speed).powi(2))
    }

    /// Returns whether two contacts have the same laws.
    pub fn are_same(a: &Option<Box<ContactLaws>>, b: &Option<Box<ContactLaws>>) -> bool {
        let numbers = |laws: &ContactLaws| {
            let ContactLaws {
                rolling,
                torsional,
                static_friction,
                stribeck_speed,
                tangential_restitution,
                adhesion,
                ..
            } = *laws;
            (
                [rolling, torsional, static_friction, stribeck_speed, tangential_restitution, adhesion],
                laws.friction_scale,
            )
        };
        match (a, b) {
            (Some(a), Some(b)) => numbers(a) == numbers(b),
            (a, b) => a.is_none() && b.is_none(),
        }
    }

    /// Returns the adhesion at a contact, N.
    pub fn pull(laws: &Option<Box<ContactLaws>>) -> f64 {
        laws.as_ref().map_or(0.0, |laws| laws.pull)
    }

    /// Returns whether rows of the contact depend on the solution.
    pub fn depends_on_solution(&self, friction: f64) -> bool {
        self.rolling > 0.0 || self.torsional > 0.0 || self.static_friction > friction
    }
}

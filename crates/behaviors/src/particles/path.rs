//! The path of a free particle: gravity and drag in air that moves evenly.
//!
//! ```text
//! v̇ = g + γ·(w − v)          γ = d₁ + d₂·|w − v|
//!
//! v(t) = v₀ + a₀·t·φ₁(γt)     x(t) = x₀ + v₀·t + a₀·t²·φ₂(γt)     a₀ = g + γ·(w − v₀)
//! φ₁(z) = (1 − e^{−z})/z      φ₂(z) = (z − 1 + e^{−z})/z²
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `v` | position, velocity |
//! | `g`, `w` | gravity; velocity of the air |
//! | `d₁`, `d₂` | linear and quadratic drag, per mass |
//! | `γ` | drag per mass and speed, constant over a step: that in its middle |
//!
//! Exact with linear drag at any step, of second order with quadratic drag, and stable at any step. A terminal velocity
//! is a fixed point.

use nalgebra::ComplexField;
use tumble_collide::Vec3;

/// Gravity, air and drag of a particle system.
#[derive(Clone, Copy, Debug)]
pub(super) struct Air {
    pub gravity: Vec3,
    pub wind: Vec3,
    /// Linear drag per mass, 1/s.
    pub linear: f64,
    /// Quadratic drag per mass, 1/m.
    pub quadratic: f64,
    /// Length of a frame, s, and `φ₁` and `φ₂` there with linear drag alone: most paths are of a whole frame.
    frame: f64,
    phi: (f64, f64),
}

/// A path from a point in time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    pub x: Vec3,
    pub v: Vec3,
    /// Acceleration at its start, m/s².
    pub pull: Vec3,
    gamma: f64,
    /// Length that the path is made for, s, and `φ₁` and `φ₂` there.
    length: f64,
    phi: (f64, f64),
}

impl Air {
    /// Makes the air of frames of `frame` seconds, with linear and quadratic drag.
    pub fn new(gravity: Vec3, wind: Vec3, [linear, quadratic]: [f64; 2], frame: f64) -> Air {
        Air { gravity, wind, linear, quadratic, frame, phi: phi(linear * frame) }
    }

    /// Returns the path of a particle for a step of `h` seconds.
    pub fn path(&self, x: Vec3, v: Vec3, h: f64) -> Path {
        let rate = |v: &Vec3| match self.quadratic {
            0.0 => self.linear,
            quadratic => self.linear + quadratic * (self.wind - v).norm(),
        };
        let path = |gamma: f64, length: f64, phi: (f64, f64)| Path {
            x,
            v,
            pull: self.gravity + gamma * (self.wind - v),
            gamma,
            length,
            phi,
        };
        if self.quadratic == 0.0 {
            return path(self.linear, h, if h == self.frame { self.phi } else { phi(self.linear * h) });
        }
        let (first, middle) = (rate(&v), 0.5 * h);
        let gamma = rate(&path(first, middle, phi(first * middle)).end().1);
        path(gamma, h, phi(gamma * h))
    }
}

impl Path {
    /// Returns a straight path at a velocity.
    pub fn straight(x: Vec3, v: Vec3) -> Path {
        Path { x, v, pull: Vec3::zeros(), gamma: 0.0, length: 0.0, phi: (1.0, 0.5) }
    }

    /// Returns position and velocity after `t` seconds.
    pub fn at(&self, t: f64) -> (Vec3, Vec3) {
        self.with(t, phi(self.gamma * t))
    }

    /// Returns position and velocity at its end.
    pub fn end(&self) -> (Vec3, Vec3) {
        self.with(self.length, self.phi)
    }

    fn with(&self, t: f64, (one, two): (f64, f64)) -> (Vec3, Vec3) {
        (self.x + t * (self.v + t * two * self.pull), self.v + t * one * self.pull)
    }

    /// Returns the acceleration where the velocity is `v`, m/s²: it decays along the path and does not turn.
    pub fn acceleration(&self, v: &Vec3) -> Vec3 {
        self.pull - self.gamma * (v - self.v)
    }

    /// Returns a bound on the speed up to `t` seconds, m/s.
    pub fn top_speed(&self, t: f64) -> f64 {
        self.v.norm() + t * self.pull.norm()
    }
}

/// Below this, the terms of the series of `φ₂` are exact to rounding.
const SMALL: f64 = 0.03;
/// `1/k!`, from `k = 2` on.
const TERMS: [f64; 8] =
    [1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0, 1.0 / 5040.0, 1.0 / 40320.0, 1.0 / 362_880.0];

/// Returns `φ₁` and `φ₂`.
fn phi(z: f64) -> (f64, f64) {
    if z == 0.0 {
        (1.0, 0.5)
    } else if z < SMALL {
        // φ₂ = Σ (−z)^k/(k + 2)!, φ₁ = 1 − z·φ₂
        let two = TERMS.iter().rev().fold(0.0, |sum, term| term - z * sum);
        (1.0 - z * two, two)
    } else {
        let decay = -ComplexField::exp_m1(-z);
        (decay / z, (z - decay) / (z * z))
    }
}

#[cfg(test)]
mod tests {
    use super::phi;

    #[test]
    fn the_series_meets_the_closed_form() {
        for z in [1e-9, 1e-4, 0.01, 0.0299, 0.0301, 1.0, 40.0f64] {
            let (one, two) = phi(z);
            assert!((one + (-z).exp_m1() / z).abs() < 1e-15, "{z}");
            // φ₂ loses digits in its closed form where z is small
            assert!((two - (z + (-z).exp_m1()) / (z * z)).abs() < 3e-16 / z, "{z}");
            assert!((one - (1.0 - z * two)).abs() < 1e-15, "{z}");
        }
    }
}

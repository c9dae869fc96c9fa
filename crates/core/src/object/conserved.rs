//! Energy and momentum of an object or of a world.

use tumble_collide::Vec3;

/// Mechanical energy, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Energy of motion.
    pub kinetic: f64,
    /// Energy in uniform gravity, 0 at the world's origin, and in springs.
    pub potential: f64,
}

impl Energy {
    /// Returns the sum of kinetic and potential energy.
    pub fn total(&self) -> f64 {
        self.kinetic + self.potential
    }
}

/// Momentum, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Momentum {
    /// Linear momentum, N·s.
    pub linear: Vec3,
    /// Angular momentum about the world's origin, N·m·s.
    pub angular: Vec3,
}

impl Default for Momentum {
    fn default() -> Momentum {
        Momentum { linear: Vec3::zeros(), angular: Vec3::zeros() }
    }
}

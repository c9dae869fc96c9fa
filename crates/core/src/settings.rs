//! The constants of a world.

use crate::object::collidable::Combine;
use crate::solver::SolverSettings;
use crate::world::sleep::Sleep;
use tumble_collide::Vec3;

/// How smooth motion is integrated between contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Integrator {
    /// Drift, kick, drift: symplectic, of second order, one evaluation of the forces per step.
    #[default]
    Verlet,
    /// Kick, then drift with the new velocity: symplectic, of first order.
    SymplecticEuler,
    /// The thesis's integrator (§IV.B.2): drift and kick with what was there before. First order; gains energy.
    ExplicitEuler,
    /// Fourth order: classical Runge–Kutta on momenta, commutator-free on rotations.
    Rk4,
    /// Fifth order with error control (Dormand and Prince): inner steps as [`Settings::integrator_tolerance`] asks, with dense output.
    DormandPrince,
}

/// A world's constants; they may be changed between steps.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Settings {
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Length of a step, s; 1/240 by default, as in scenes and Python.
    pub dt: f64,
    /// Equal sub-steps that `time_stepping` divides a frame into, at least 1.
    pub substeps: u32,
    /// How the backtracking stepper integrates. `time_stepping` is the midpoint rule whatever is chosen here.
    pub integrator: Integrator,
    /// `dormand_prince`: error that an inner step may make in any coordinate, as displacement (m, rad) and as velocity (m/s, rad/s), relative where
    /// the coordinate's displacement or velocity is above 1; 1e-14 to 0.1.
    pub integrator_tolerance: f64,
    /// Effort of the iterative solvers.
    pub solver_settings: SolverSettings,
    /// Sweeps at most of the position projection; of groups with joints as many as [`Settings::solver_settings`] grants a solve, if that is more.
    pub projection_sweeps: u32,
    /// Whether the equality rows of constraints (joints) are held in place too, and not in velocity alone: off, they drift.
    pub stabilize_positions: bool,
    /// `backtracking`: surfaces closer than this touch, metres; deeper than this, a new contact makes the step go back. A rebound
    /// lower than this rests.
    pub contact_tolerance: f64,
    /// Depth that contacts which last may drift to within a sub-step before they are projected out, metres.
    pub drift_tolerance: f64,
    /// Greatest speed at which existing penetration is pushed out, m/s.
    pub recovery_speed: f64,
    /// When what lies still is left out of the steps; `None`: never.
    pub sleep: Option<Sleep>,
    /// How the friction of two bodies combines: by default the geometric mean, so that ice is slippery under everything.
    pub combine_friction: Combine,
    /// How the restitution of two bodies combines: by default the larger, so that a ball bounces off a floor of which nothing is said.
    pub combine_restitution: Combine,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            gravity: Vec3::new(0.0, 0.0, -9.81),
            dt: 1.0 / 240.0,
            substeps: 1,
            integrator: Integrator::default(),
            integrator_tolerance: 1e-6,
            solver_settings: SolverSettings { max_sweeps: 200, max_relaxations: 20_000, tolerance: 1e-9 },
            projection_sweeps: 15,
            stabilize_positions: true,
            contact_tolerance: 1e-7,
            drift_tolerance: 1e-4,
            recovery_speed: 3.0,
            sleep: None,
            combine_friction: Combine::GeometricMean,
            combine_restitution: Combine::Max,
        }
    }
}

/// A setting out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} is {value}; it must be {wanted}")]
pub struct SettingsError {
    /// Which setting.
    pub what: &'static str,
    /// Value given.
    pub value: f64,
    /// What would be right.
    pub wanted: &'static str,
}

impl Settings {
    /// Checks every range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let check = |what, value: f64, right: bool, wanted| {
            if right && value.is_finite() { Ok(()) } else { Err(SettingsError { what, value, wanted }) }
        };
        self.gravity.iter().try_for_each(|&g| check("gravity", g, true, "finite"))?;
        check("dt", self.dt, self.dt > 0.0 && self.dt <= 1.0, "above 0 and at most 1 s")?;
        check("substeps", self.substeps as f64, (1..=1000).contains(&self.substeps), "1 to 1000")?;
        let tolerance = self.integrator_tolerance;
        check("integrator tolerance", tolerance, (1e-14..=0.1).contains(&tolerance), "1e-14 to 0.1")?;
        check(
            "sweeps",
            self.solver_settings.max_sweeps as f64,
            (1..=1_000_000).contains(&self.solver_settings.max_sweeps),
            "1 to 1000000",
        )?;
        check("solver tolerance", self.solver_settings.tolerance, self.solver_settings.tolerance >= 0.0, "at least 0")?;
        check("contact tolerance", self.contact_tolerance, self.contact_tolerance > 0.0, "above 0 m")?;
        check(
            "drift tolerance",
            self.drift_tolerance,
            self.drift_tolerance >= self.contact_tolerance,
            "at least the contact tolerance",
        )?;
        if let Some(sleep) = &self.sleep {
            check("sleep: seconds", sleep.after, sleep.after > 0.0, "above 0 s")?;
            check("sleep: distance", sleep.within, sleep.within > 0.0, "above 0 m")?;
        }
        check("recovery speed", self.recovery_speed, self.recovery_speed >= 0.0, "at least 0 m/s")
    }
}

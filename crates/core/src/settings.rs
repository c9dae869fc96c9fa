//! The constants of a world.

use crate::object::Combine;
use crate::solver::SolverSettings;
use crate::threads::MAX_THREADS;
use crate::world::sleep::Sleep;
use tumble_collide::Vec3;

/// Integration of smooth motion between contacts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Integrator {
    /// Free motion for half a step, all forces, free motion for half a step: symplectic, second
    /// order, one evaluation of the forces per step.
    #[default]
    Verlet,
    /// Velocities first, then positions with the new velocities: symplectic, first order.
    SymplecticEuler,
    /// The thesis's integrator (§IV.B.2): positions and velocities with the rates at the start.
    /// First order; gains energy.
    ExplicitEuler,
    /// Fourth order: classical Runge–Kutta on momenta, commutator-free on rotations.
    Rk4,
    /// Fifth order with error control (Dormand and Prince): inner steps that satisfy
    /// [`Settings::integrator_tolerance`], with dense output.
    DormandPrince,
}

/// The constants of a world. They may change between steps
/// ([`World::set_settings`](crate::World::set_settings)).
///
/// Later versions can have more settings, so a program starts from the defaults, or from the
/// settings of a world, and changes some:
///
/// ```
/// use tumble_core::prelude::*;
/// let settings = Settings::default().with_dt(1.0 / 60.0).with_gravity(Vec3::new(0.0, 0.0, -1.62));
/// let mut world = World::new(settings)?;
/// world.set_settings(world.settings().with_substeps(4))?;
/// # Ok::<(), WorldError>(())
/// ```
#[non_exhaustive]
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Settings {
    /// Gravity, m/s².
    pub gravity: Vec3,
    /// Length of a step, s; 1/240 by default, as in scenes and Python.
    pub dt: f64,
    /// Number of equal sub-steps of `time_stepping` in a frame, 1 to 1000.
    pub substeps: u32,
    /// Integrator of the backtracking stepper. `time_stepping` always uses the midpoint rule.
    pub integrator: Integrator,
    /// `dormand_prince`: admissible error of an inner step in any coordinate, as a displacement (m,
    /// rad) and as a velocity (m/s, rad/s); relative if the coordinate's displacement or velocity
    /// exceeds 1. 1e-14 to 0.1.
    pub integrator_tolerance: f64,
    /// Limits of the iterative solvers.
    pub solver_settings: SolverSettings,
    /// Maximum number of sweeps of the projection, the round of a position correction that removes
    /// overlap. Islands with joints or limits get at least as many as in a solve
    /// ([`Settings::solver_settings`]).
    pub projection_sweeps: u32,
    /// Whether positions of equality rows (joints) are corrected. If not, only velocities are
    /// constrained and positions drift.
    pub stabilize_positions: bool,
    /// `backtracking`: surfaces closer than this are in contact, m. A new contact deeper than this
    /// makes the step go back, and a rebound lower than this comes to rest.
    pub contact_tolerance: f64,
    /// Depth that a lasting contact may reach within a sub-step; the projection removes the rest,
    /// m.
    pub drift_tolerance: f64,
    /// Maximum speed at which existing penetration is corrected, m/s.
    pub recovery_speed: f64,
    /// Largest angle by which the forces of joints may turn a part back and forth in a sub-step, rad, 0.01
    /// to 1e6; 1 by default. A frame in which a part turns further is taken again in sub-steps that
    /// are short enough: chains of light links with a heavy end need it (`step/turning.rs`). Of free rigid bodies those under steady
    /// forces resist instead, beyond four sub-steps in `time_stepping` (`step/resistance.rs`).
    pub max_turn: f64,
    /// When islands fall asleep; `None`: never.
    pub sleep: Option<Sleep>,
    /// Combination of the friction coefficients of two bodies. The default is the geometric mean,
    /// so that ice is slippery under any body.
    pub combine_friction: Combine,
    /// Combination of the restitution coefficients of two bodies. The default is the larger, so
    /// that a ball bounces off a floor without settings of its own.
    pub combine_restitution: Combine,
    /// Smallest impulse of a pair of parts in a frame with which they count as in contact, N·s, at
    /// least 0: weaker contacts make no [`Event`](crate::Event)s. 0 by default: every touch counts.
    pub event_impulse: f64,
    /// Number of threads of a step, 0 to 256: 1 by default, 0 for as many as cores. The results are
    /// the same bits for every number, so it is no part of a saved world: a world that is read has
    /// 1.
    ///
    /// All worlds of a process share the threads. A world that is stepped on a thread of rayon, or
    /// while another world uses the threads, uses the calling thread alone; so does small work.
    #[serde(skip, default = "one_thread")]
    pub threads: u32,
}

/// Returns the default number of threads.
fn one_thread() -> u32 {
    1
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            gravity: Vec3::new(0.0, 0.0, -9.81),
            dt: 1.0 / 240.0,
            substeps: 1,
            integrator: Integrator::default(),
            integrator_tolerance: 1e-10,
            solver_settings: SolverSettings { max_sweeps: 200, max_relaxations: 20_000, tolerance: 1e-9, budget: None },
            projection_sweeps: 15,
            stabilize_positions: true,
            contact_tolerance: 1e-7,
            drift_tolerance: 1e-4,
            recovery_speed: 3.0,
            max_turn: 1.0,
            sleep: None,
            combine_friction: Combine::GeometricMean,
            combine_restitution: Combine::Max,
            event_impulse: 0.0,
            threads: one_thread(),
        }
    }
}

/// A setting out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what} is {value}; it must be {expected}")]
pub struct SettingsError {
    /// Which setting.
    pub what: &'static str,
    /// Value given.
    pub value: f64,
    /// Admissible range.
    pub expected: &'static str,
}

/// Methods that change one setting: name, field, type.
macro_rules! setters {
    ($($with:ident $field:ident: $type:ty),* $(,)?) => {
        impl Settings {
            $(
                #[doc = concat!("Returns the settings with another [`", stringify!($field), "`](Self::", stringify!($field), ").")]
                #[must_use]
                pub fn $with(mut self, $field: $type) -> Settings {
                    self.$field = $field;
                    self
                }
            )*
        }
    };
}

setters! {
    with_gravity gravity: Vec3,
    with_dt dt: f64,
    with_substeps substeps: u32,
    with_integrator integrator: Integrator,
    with_integrator_tolerance integrator_tolerance: f64,
    with_solver_settings solver_settings: SolverSettings,
    with_projection_sweeps projection_sweeps: u32,
    with_stabilize_positions stabilize_positions: bool,
    with_contact_tolerance contact_tolerance: f64,
    with_drift_tolerance drift_tolerance: f64,
    with_recovery_speed recovery_speed: f64,
    with_max_turn max_turn: f64,
    with_sleep sleep: Option<Sleep>,
    with_combine_friction combine_friction: Combine,
    with_combine_restitution combine_restitution: Combine,
    with_event_impulse event_impulse: f64,
    with_threads threads: u32,
}

impl Settings {
    /// Returns the settings with another [`SolverSettings::budget`].
    #[must_use]
    pub fn with_budget(mut self, budget: Option<u32>) -> Settings {
        self.solver_settings.budget = budget;
        self
    }

    /// Checks the range of every setting.
    ///
    /// # Errors
    /// The first setting that is out of its range.
    pub fn validate(&self) -> Result<(), SettingsError> {
        let check = |what, value: f64, right: bool, expected| {
            if right && value.is_finite() { Ok(()) } else { Err(SettingsError { what, value, expected }) }
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
        if let Some(budget) = self.solver_settings.budget {
            check("budget", budget.into(), budget > 0, "above 0 relaxations")?;
        }
        check("solver tolerance", self.solver_settings.tolerance, self.solver_settings.tolerance >= 0.0, "at least 0")?;
        check("max turn", self.max_turn, (0.01..=1e6).contains(&self.max_turn), "0.01 to 1e6 rad")?;
        check("contact tolerance", self.contact_tolerance, self.contact_tolerance > 0.0, "above 0 m")?;
        check(
            "drift tolerance",
            self.drift_tolerance,
            self.drift_tolerance >= self.contact_tolerance,
            "at least the contact tolerance",
        )?;
        check("threads", self.threads as f64, self.threads <= MAX_THREADS, "0 to 256")?;
        check("event impulse", self.event_impulse, self.event_impulse >= 0.0, "at least 0 N·s")?;
        if let Some(sleep) = &self.sleep {
            check("sleep: seconds", sleep.after, sleep.after > 0.0, "above 0 s")?;
            check("sleep: distance", sleep.within, sleep.within > 0.0, "above 0 m")?;
        }
        check("recovery speed", self.recovery_speed, self.recovery_speed >= 0.0, "at least 0 m/s")
    }
}

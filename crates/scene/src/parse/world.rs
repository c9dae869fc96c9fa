//! `[world]`: gravity, time, and which algorithms step the scene.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;
use tumble_core::collide::ContactMode;
use tumble_core::solver::{GaussSeidel, LcpPyramid, LcpSliding, RowSolver};
use tumble_core::{Backtracking, Combine, Sleep, TimeStepping};

use crate::parse::bound::Bound;
use crate::parse::fields::{Fields, Names};
use crate::parse::suggest::{listed, nearest};

/// The stepper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stepper {
    /// One detection and one solve per step, at a fixed cost.
    TimeStepping,
    /// Goes back to the time of each collision (thesis, Algorithm 4).
    Backtracking,
}

/// The integrator of free motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Velocity Verlet: second order, one force evaluation per step.
    Verlet,
    /// Velocities first, then positions with the new velocities.
    SymplecticEuler,
    /// Positions and velocities from the state at the start of the step (the thesis's integrator).
    ExplicitEuler,
    /// The classical Runge–Kutta method of fourth order.
    Rk4,
    /// Dormand and Prince's pair of fifth and fourth order, with error control.
    DormandPrince,
}

/// The solver of contact forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Gauss–Seidel sweeps over the friction cones.
    GaussSeidel,
    /// Pivoting on the four-sided friction pyramid (6m unknowns).
    LcpPyramid,
    /// Pivoting with one tangent, along the sliding direction (3m unknowns; the thesis's `K^F`).
    LcpSliding,
}

impl Stepper {
    /// All steppers with their names in scene files, Python and on the command line: those of
    /// [`tumble_core::STEPPERS`], in the same order.
    pub const NAMES: &[(&str, Self)] =
        &[("time_stepping", Stepper::TimeStepping), ("backtracking", Stepper::Backtracking)];

    /// Makes the stepper.
    pub(crate) fn new_stepper(self) -> Box<dyn tumble_core::Stepper> {
        match self {
            Stepper::TimeStepping => Box::<TimeStepping>::default(),
            Stepper::Backtracking => Box::<Backtracking>::default(),
        }
    }
}

impl Integrator {
    /// All integrators with their names in scene files, Python and on the command line: one for
    /// each of [`tumble_core::Integrator`].
    pub const NAMES: &[(&str, Self)] = &[
        ("verlet", Integrator::Verlet),
        ("symplectic_euler", Integrator::SymplecticEuler),
        ("explicit_euler", Integrator::ExplicitEuler),
        ("rk4", Integrator::Rk4),
        ("dormand_prince", Integrator::DormandPrince),
    ];
}

impl Solver {
    /// All solvers with their names in scene files, Python and on the command line: those of
    /// [`tumble_core::solver::NAMES`], in the same order.
    pub const NAMES: &[(&str, Self)] = &[
        ("gauss_seidel", Solver::GaussSeidel),
        ("lcp_pyramid", Solver::LcpPyramid),
        ("lcp_sliding", Solver::LcpSliding),
    ];

    /// Makes the solver.
    pub(crate) fn new_solver(self) -> Box<dyn RowSolver> {
        match self {
            Solver::GaussSeidel => Box::new(GaussSeidel),
            Solver::LcpPyramid => Box::new(LcpPyramid),
            Solver::LcpSliding => Box::new(LcpSliding),
        }
    }
}

/// Values of the key `contacts`: how meshes and cylinders collide.
pub(crate) const CONTACTS: Names<ContactMode> = ContactMode::NAMES;

impl From<Integrator> for tumble_core::Integrator {
    fn from(integrator: Integrator) -> Self {
        match integrator {
            Integrator::Verlet => Self::Verlet,
            Integrator::SymplecticEuler => Self::SymplecticEuler,
            Integrator::ExplicitEuler => Self::ExplicitEuler,
            Integrator::Rk4 => Self::Rk4,
            Integrator::DormandPrince => Self::DormandPrince,
        }
    }
}

/// A name that a choice does not have.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{typed}` is not known; {expected}")]
pub struct UnknownName {
    /// The given name.
    pub typed: String,
    /// The nearest name, or all names.
    pub expected: String,
}

/// Looks up a name outside of a scene file, as on a command line.
fn by_name<T: Copy>(typed: &str, names: Names<T>) -> Result<T, UnknownName> {
    let words = || names.iter().map(|(name, _)| *name);
    let found = names.iter().find(|(name, _)| *name == typed).map(|(_, meaning)| *meaning);
    found.ok_or_else(|| UnknownName {
        typed: typed.to_owned(),
        expected: match nearest(typed, words()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("expected {}", listed(words(), "or")),
        },
    })
}

/// Conversion between choices and their names, in both directions.
macro_rules! written_by_name {
    ($($choice:ident),*) => {
        $(
            impl FromStr for $choice {
                type Err = UnknownName;

                fn from_str(typed: &str) -> Result<Self, UnknownName> {
                    by_name(typed, Self::NAMES)
                }
            }

            impl fmt::Display for $choice {
                fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                    let word = Self::NAMES.iter().find(|(_, meaning)| meaning == self).map_or("", |(name, _)| *name);
                    f.write_str(word)
                }
            }
        )*
    };
}

written_by_name!(Stepper, Integrator, Solver);

/// Returns the combination rule of that name in scene files.
///
/// # Errors
/// [`UnknownName`].
pub fn combine_by_name(typed: &str) -> Result<Combine, UnknownName> {
    by_name(typed, Combine::NAMES)
}

/// `[world]`. All keys have defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSettings {
    /// Gravitational acceleration, world axes, m/s². Default `[0, 0, -9.81]`.
    pub gravity_m_per_s2: [f64; 3],
    /// Length of a step, seconds, 1e-6 to 1. Default 1/240.
    pub dt_s: f64,
    /// Sub-steps of each step, 1 to 1000. Default 1.
    pub substeps: u32,
    /// How long the command runs the scene by default, seconds. Default 5.
    pub duration_s: f64,
    /// Default `time_stepping`.
    pub stepper: Stepper,
    /// Default `verlet`.
    pub integrator: Integrator,
    /// `dormand_prince`: error per inner step (m, rad, m/s, rad/s), 1e-14 to 0.1. Default 1e-6.
    pub integrator_tolerance: f64,
    /// Default `gauss_seidel`.
    pub solver: Solver,
    /// Largest number of sweeps of the iterative solver per solve, 1 to 1 000 000. Default 200.
    pub iterations: u32,
    /// Largest work of a step in block relaxations, 1 to 4e9. Default: no bound.
    pub budget: Option<u32>,
    /// `backtracking`: surfaces closer than this are in contact, and lower rebounds end, meters.
    /// Default 1e-7.
    pub contact_tolerance_m: f64,
    /// Islands at rest for this long sleep: they are left out of the steps, seconds. Default:
    /// never.
    pub sleep_after_s: Option<f64>,
    /// Largest displacement of any point of an island at rest during that time, meters. Default
    /// 1e-5.
    pub sleep_within_m: f64,
    /// Rule for the restitution of a pair. Default `max`.
    pub combine_restitution: Combine,
    /// Rule for the friction of a pair. Default `geometric_mean`.
    pub combine_friction: Combine,
    /// Smallest impulse in a step with which a pair counts as in contact, N·s. Default 0.
    pub event_impulse_n_s: f64,
    /// Largest angle by which forces of joints may turn a part back and forth in a sub-step, rad. Default 1.
    pub max_turn_rad: f64,
    /// Depth that a lasting contact may reach within a sub-step, meters. Default: 1e-4, or the contact tolerance if that is
    /// larger.
    pub drift_tolerance_m: Option<f64>,
    /// Largest speed at which existing penetration is corrected, m/s. Default 3.
    pub recovery_speed_m_per_s: f64,
    /// Largest number of sweeps of the correction of overlap. Default 15.
    pub projection_sweeps: u32,
    /// Whether positions of joints are corrected. Default true.
    pub stabilize_positions: bool,
    /// A sweep that changes no velocity by more than this ends a solve, m/s. Default 1e-9.
    pub solver_tolerance_m_per_s: f64,
    /// Largest number of block relaxations of a step in sweeps beyond the first 25. Default 20 000.
    pub max_relaxations: u32,
    /// Contact mode of meshes and cylinders without their own. Default `surface`.
    pub contacts: ContactMode,
    /// Threads of a step, 0 for as many as cores; no number changes the result. Default 1.
    pub threads: u32,
}

impl Default for WorldSettings {
    fn default() -> Self {
        WorldSettings {
            gravity_m_per_s2: [0.0, 0.0, -9.81],
            dt_s: 1.0 / 240.0,
            substeps: 1,
            duration_s: 5.0,
            stepper: Stepper::TimeStepping,
            integrator: Integrator::Verlet,
            integrator_tolerance: 1e-10,
            solver: Solver::GaussSeidel,
            iterations: 200,
            budget: None,
            contact_tolerance_m: 1e-7,
            sleep_after_s: None,
            sleep_within_m: Sleep::default().within,
            combine_restitution: Combine::Max,
            combine_friction: Combine::GeometricMean,
            event_impulse_n_s: 0.0,
            max_turn_rad: 1.0,
            drift_tolerance_m: None,
            recovery_speed_m_per_s: 3.0,
            projection_sweeps: 15,
            stabilize_positions: true,
            solver_tolerance_m_per_s: 1e-9,
            max_relaxations: 20_000,
            contacts: ContactMode::Surface,
            threads: 1,
        }
    }
}

const DT: Bound = Bound::new(1e-6, 1.0, "a time from 1e-6 to 1 s");
const TOLERANCE: Bound = Bound::new(1e-9, 1.0, "a length from 1e-9 to 1 m");
const ACCURACY: Bound = Bound::new(1e-14, 0.1, "a tolerance from 1e-14 to 0.1");
const AFTER: Bound = Bound::new(1e-3, 1e6, "a time from 0.001 to 1e6 s");
const TURN: Bound = Bound::new(0.01, 1e6, "an angle from 0.01 to 1e6 rad");
const SECONDS: Bound = Bound::new(0.0, 1e6, "a time from 0 to 1e6 s");

impl WorldSettings {
    pub(crate) fn read(mut f: Fields<'_>) -> Self {
        let default = WorldSettings::default();
        let world = WorldSettings {
            gravity_m_per_s2: f.vector_or("gravity_m_per_s2", Bound::ANY, default.gravity_m_per_s2),
            dt_s: f.number_or("dt_s", DT, default.dt_s),
            substeps: f.integer_or("substeps", 1..=1000, default.substeps),
            duration_s: f.number_or("duration_s", SECONDS, default.duration_s),
            stepper: f.choice_or("stepper", Stepper::NAMES, default.stepper),
            integrator: f.choice_or("integrator", Integrator::NAMES, default.integrator),
            integrator_tolerance: f.number_or("integrator_tolerance", ACCURACY, default.integrator_tolerance),
            solver: f.choice_or("solver", Solver::NAMES, default.solver),
            iterations: f.integer_or("iterations", 1..=1_000_000, default.iterations),
            budget: f.optional_integer("budget", 1..=4_000_000_000),
            contact_tolerance_m: f.number_or("contact_tolerance_m", TOLERANCE, default.contact_tolerance_m),
            sleep_after_s: f.optional_number("sleep_after_s", AFTER),
            sleep_within_m: f.number_or("sleep_within_m", TOLERANCE, default.sleep_within_m),
            combine_restitution: f.choice_or("combine_restitution", Combine::NAMES, default.combine_restitution),
            combine_friction: f.choice_or("combine_friction", Combine::NAMES, default.combine_friction),
            event_impulse_n_s: f.number_or("event_impulse_n_s", Bound::NOT_NEGATIVE, default.event_impulse_n_s),
            max_turn_rad: f.number_or("max_turn_rad", TURN, default.max_turn_rad),
            drift_tolerance_m: f.optional_number("drift_tolerance_m", TOLERANCE),
            recovery_speed_m_per_s: f.number_or(
                "recovery_speed_m_per_s",
                Bound::NOT_NEGATIVE,
                default.recovery_speed_m_per_s,
            ),
            projection_sweeps: f.integer_or("projection_sweeps", 0..=u32::MAX, default.projection_sweeps),
            stabilize_positions: f.flag_or("stabilize_positions", default.stabilize_positions),
            solver_tolerance_m_per_s: f.number_or(
                "solver_tolerance_m_per_s",
                Bound::NOT_NEGATIVE,
                default.solver_tolerance_m_per_s,
            ),
            max_relaxations: f.integer_or("max_relaxations", 0..=u32::MAX, default.max_relaxations),
            contacts: f.choice_or("contacts", CONTACTS, default.contacts),
            threads: f.integer_or("threads", 0..=256, default.threads),
        };
        if let Some(value) = f.value("drift_tolerance_m")
            && world.drift_tolerance_m.is_some_and(|drift| drift < world.contact_tolerance_m)
        {
            let least = world.contact_tolerance_m;
            f.wrong("drift_tolerance_m", value, format!("at least the contact tolerance, {least} m"));
        }
        f.finish();
        world
    }
}

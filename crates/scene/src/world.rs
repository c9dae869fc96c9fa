//! `[world]`: gravity, time, and which algorithms step the scene.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;
use tumble_core::collide::ContactMode;
use tumble_core::{Combine, Sleep};

use crate::bound::Bound;
use crate::fields::{Fields, Names};
use crate::suggest::{listed, nearest};

/// How the world is stepped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stepper {
    /// One detection and one solve per step: a fixed cost.
    TimeStepping,
    /// Goes back to the instant of each collision (thesis, Algorithm 4).
    Backtracking,
}

/// How free motion is integrated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Integrator {
    /// Velocity Verlet: second order, one force evaluation per step.
    Verlet,
    /// Velocities first, then positions with the new velocities.
    SymplecticEuler,
    /// All from the state at the start of the step (the thesis's).
    ExplicitEuler,
    /// The classical Runge–Kutta method of fourth order.
    Rk4,
    /// Dormand and Prince's pair of fifth and fourth order, with error control.
    DormandPrince,
}

/// How contact forces are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Solver {
    /// Sweeps over the friction cones.
    GaussSeidel,
    /// Pivoting on the four-sided friction pyramid (6m unknowns).
    LcpPyramid,
    /// Pivoting with one tangent, along the sliding direction (3m unknowns; the thesis's `K^F`).
    LcpSliding,
}

impl Stepper {
    /// All of them with their names, as scene files and Python write them.
    pub const NAMES: &[(&str, Self)] =
        &[("time_stepping", Stepper::TimeStepping), ("backtracking", Stepper::Backtracking)];
}

impl Integrator {
    /// All of them with their names, as scene files and Python write them.
    pub const NAMES: &[(&str, Self)] = &[
        ("verlet", Integrator::Verlet),
        ("symplectic_euler", Integrator::SymplecticEuler),
        ("explicit_euler", Integrator::ExplicitEuler),
        ("rk4", Integrator::Rk4),
        ("dormand_prince", Integrator::DormandPrince),
    ];
}

impl Solver {
    /// All of them with their names, as scene files and Python write them.
    pub const NAMES: &[(&str, Self)] = &[
        ("gauss_seidel", Solver::GaussSeidel),
        ("lcp_pyramid", Solver::LcpPyramid),
        ("lcp_sliding", Solver::LcpSliding),
    ];
}

/// How meshes and cylinders collide: the words of `contacts`.
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

/// A word that is not among those a choice has.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{typed}` is not known; {wanted}")]
pub struct UnknownName {
    /// The word.
    pub typed: String,
    /// What would be right.
    pub wanted: String,
}

/// The meaning of a word that stands outside of a scene file, as on a command line.
fn by_name<T: Copy>(typed: &str, names: Names<T>) -> Result<T, UnknownName> {
    let words = || names.iter().map(|(name, _)| *name);
    let found = names.iter().find(|(name, _)| *name == typed).map(|(_, meaning)| *meaning);
    found.ok_or_else(|| UnknownName {
        typed: typed.to_owned(),
        wanted: match nearest(typed, words()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("wanted {}", listed(words(), "or")),
        },
    })
}

/// The words of files for each choice, in both directions.
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

/// The rule of that name, as scene files write it.
///
/// # Errors
/// [`UnknownName`].
pub fn combine_by_name(typed: &str) -> Result<Combine, UnknownName> {
    by_name(typed, Combine::NAMES)
}

/// `[world]`. All keys have defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldSettings {
    /// Acceleration of free fall, world axes, m/s². Default `[0, 0, -9.81]`.
    pub gravity_m_per_s2: [f64; 3],
    /// Length of a step, seconds, from 1e-6 to 1. Default 1/240.
    pub dt_s: f64,
    /// Parts each step is cut into, 1 to 1000. Default 1.
    pub substeps: u32,
    /// How long the scene runs when nothing else is said, seconds. Default 5.
    pub seconds: f64,
    /// Default `time_stepping`.
    pub stepper: Stepper,
    /// Default `verlet`.
    pub integrator: Integrator,
    /// `dormand_prince`: error of an inner step (m, rad, m/s, rad/s), from 1e-14 to 0.1. Default 1e-6.
    pub integrator_tolerance: f64,
    /// Default `gauss_seidel`.
    pub solver: Solver,
    /// Most sweeps of an iterating solver per solve, 1 to 100 000. Default 200.
    pub iterations: u32,
    /// `backtracking`: surfaces closer than this touch, and a rebound lower than this rests, metres. Default 1e-7.
    pub contact_tolerance_m: f64,
    /// Islands that have been still for so long are left out of the steps, seconds. Default: never.
    pub sleep_after_s: Option<f64>,
    /// How far the furthest point of what is still may have moved in that time, metres. Default 1e-5.
    pub sleep_within_m: f64,
    /// Restitution of a pair from those of its bodies. Default `max`.
    pub combine_restitution: Combine,
    /// Friction of a pair from those of its bodies. Default `geometric_mean`.
    pub combine_friction: Combine,
    /// How meshes and cylinders collide that say nothing of their own. Default `surface`.
    pub contacts: ContactMode,
}

impl Default for WorldSettings {
    fn default() -> Self {
        WorldSettings {
            gravity_m_per_s2: [0.0, 0.0, -9.81],
            dt_s: 1.0 / 240.0,
            substeps: 1,
            seconds: 5.0,
            stepper: Stepper::TimeStepping,
            integrator: Integrator::Verlet,
            integrator_tolerance: 1e-6,
            solver: Solver::GaussSeidel,
            iterations: 200,
            contact_tolerance_m: 1e-7,
            sleep_after_s: None,
            sleep_within_m: Sleep::default().within,
            combine_restitution: Combine::Max,
            combine_friction: Combine::GeometricMean,
            contacts: ContactMode::Surface,
        }
    }
}

const DT: Bound = Bound::new(1e-6, 1.0, "a time from 1e-6 to 1 s");
const TOLERANCE: Bound = Bound::new(1e-9, 1.0, "a length from 1e-9 to 1 m");
const ACCURACY: Bound = Bound::new(1e-14, 0.1, "a tolerance from 1e-14 to 0.1");
const AFTER: Bound = Bound::new(1e-3, 1e6, "a time from 0.001 to 1e6 s");
const SECONDS: Bound = Bound::new(0.0, 1e6, "a time from 0 to 1e6 s");

impl WorldSettings {
    pub(crate) fn read(mut f: Fields<'_>) -> Self {
        let usual = WorldSettings::default();
        let world = WorldSettings {
            gravity_m_per_s2: f.vector_or("gravity_m_per_s2", Bound::ANY, usual.gravity_m_per_s2),
            dt_s: f.number_or("dt_s", DT, usual.dt_s),
            substeps: f.integer_or("substeps", 1..=1000, usual.substeps),
            seconds: f.number_or("seconds", SECONDS, usual.seconds),
            stepper: f.choice_or("stepper", Stepper::NAMES, usual.stepper),
            integrator: f.choice_or("integrator", Integrator::NAMES, usual.integrator),
            integrator_tolerance: f.number_or("integrator_tolerance", ACCURACY, usual.integrator_tolerance),
            solver: f.choice_or("solver", Solver::NAMES, usual.solver),
            iterations: f.integer_or("iterations", 1..=100_000, usual.iterations),
            contact_tolerance_m: f.number_or("contact_tolerance_m", TOLERANCE, usual.contact_tolerance_m),
            sleep_after_s: f.optional_number("sleep_after_s", AFTER),
            sleep_within_m: f.number_or("sleep_within_m", TOLERANCE, usual.sleep_within_m),
            combine_restitution: f.choice_or("combine_restitution", Combine::NAMES, usual.combine_restitution),
            combine_friction: f.choice_or("combine_friction", Combine::NAMES, usual.combine_friction),
            contacts: f.choice_or("contacts", CONTACTS, usual.contacts),
        };
        f.finish();
        world
    }
}

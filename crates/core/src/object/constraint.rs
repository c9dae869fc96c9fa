//! The trait of objects that constrain themselves or others (thesis §IV.A.4).

use super::part_state::StateRange;
use crate::constraint::builder::RowBuilder;
use crate::constraint::rows::RowSet;
use crate::world::view::{ObjectId, WorldView};

/// The level of rows: velocity or acceleration (the thesis's two `Evaluate…Constraints`, §IV.A.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Level {
    /// Multipliers are impulses that correct velocities over a step of `h` seconds.
    Velocity {
        /// Length of the step, s.
        h: f64,
    },
    /// Multipliers are forces that correct accelerations.
    Acceleration {
        /// Length of the sub-step, s.
        h: f64,
        /// Time after its start, s, at which soft forces (damping, position drives, springs of
        /// joints) act, if they are rows; `None` if they are forces.
        soft: Option<f64>,
    },
}

impl Default for Level {
    fn default() -> Level {
        Level::Acceleration { h: 0.0, soft: None }
    }
}

impl Level {
    /// Returns the length of the step, s.
    pub fn h(self) -> f64 {
        match self {
            Level::Velocity { h } | Level::Acceleration { h, .. } => h,
        }
    }

    /// Returns [`RowTarget::share`] of rows whose `h` is [`soft_step`](Self::soft_step).
    pub(crate) fn share(self) -> f64 {
        self.soft_step().map_or(1.0, |soft| soft / self.h())
    }

    /// Returns the time after the start of the step at which the forces of soft rows act, s: its end, or its
    /// middle if the step resolves them. `None` if soft forces are no rows.
    pub fn soft_step(self) -> Option<f64> {
        match self {
            Level::Velocity { h } => Some(h),
            Level::Acceleration { soft, .. } => soft,
        }
    }
}

/// Constrains itself or others: joint limits, loop joints, rods. Its rows are solved together with
/// all contacts.
pub trait Constraint {
    /// Adds its rows; see [`RowBuilder`]. The view shows the state in the middle of the next step
    /// under free motion, where directions are right to second order. Errors are those of the same
    /// state; the stepper converts them to the present. A stepper with rigid equality rows calls
    /// this several times in a step, at its start, middle and end, so rows must depend on the view
    /// alone.
    fn rows(&self, me: &StateRange, view: &WorldView, level: Level, out: &mut RowBuilder);
    /// Appends the gap of every one-sided row ([`RowSet::HalfLine`]) at the view's state, in the
    /// order of the rows. `backtracking` uses gaps for event detection, as it does for contacts: it
    /// ends the sub-step when a limit is reached and enforces the limit from there. A limit without
    /// a reported gap is active over the whole sub-step in which it would be reached.
    fn gaps(&self, me: &StateRange, view: &WorldView, out: &mut Vec<f64>) {
        let _ = (me, view, out);
    }
    /// Appends all objects that its rows can act on and returns true. Returns false if it does not
    /// know them; then nothing in the world falls asleep.
    fn partners(&self, out: &mut Vec<ObjectId>) -> bool {
        let _ = out;
        false
    }
    /// Returns two parts that it holds together. They do not collide, unless a
    /// [`PairMaterial`](crate::PairMaterial) says so.
    fn joined_parts(&self) -> Option<[(ObjectId, usize); 2]> {
        None
    }
    /// Returns whether its rows act on the object itself alone. Such rows are left out while
    /// impulses do not move the object: a kinematic object may pass its own limits.
    fn on_itself(&self) -> bool {
        false
    }
    /// Returns whether its rows or gaps depend on the part states of the view, as those of loop joints do. If
    /// those of no constraint of the world do, part states are not computed for it, and the view has those of
    /// another time of the step.
    fn reads_part_states(&self) -> bool {
        true
    }
}

/// Admissible multipliers, error and targets of one row of a [`Constraint`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTarget {
    /// Set of admissible multipliers.
    pub set: RowSet,
    /// Position error of the row, m or rad: the drift of an equality, or the gap of a one-sided row
    /// (negative if violated).
    pub error: f64,
    /// Target velocity of the row, m/s or rad/s; 0 except for motors.
    pub velocity: f64,
    /// Acceleration of the row without any force or change of velocity (`J̇·v`), m/s² or rad/s²; 0
    /// if the row's direction is constant.
    pub bias_acceleration: f64,
    /// Compliance `R` of the row, at least 0, in `w = c + (K + R)·λ`. In (m/s)/(N·s); at the
    /// acceleration level (m/s²)/N. 0 is rigid. A soft row is a spring: it takes part in no impact,
    /// and has no error to correct.
    ///
    /// An implicit PD drive `F = kp·(q* − q⁺) + kd·(v* − v⁺)` with `q⁺ = q + h·v⁺` is
    /// `compliance = 1/(h·(kd + h·kp))` with the target velocity
    /// `(kp·(q* − q) + kd·v*)/(kd + h·kp)`; the same at the acceleration level, for a sub-step of
    /// `h` ([`Level::h`]).
    pub compliance: f64,
    /// Share of the step after which a soft row at the acceleration level has its target velocity:
    /// 1, or ½ for the implicit midpoint rule.
    pub share: f64,
    /// Whether the row is an inertia `1/R` that resists changes of its velocity: its target is the velocity before, and it
    /// takes part in impacts.
    pub inertial: bool,
    /// The spring whose row it is, if the rate of its extension is the row's velocity.
    pub spring: Option<SpringRow>,
}

/// A spring with a row by the implicit midpoint rule.
///
/// Where bodies turn, the extension at the end of a step is not the one by the rule, and is corrected as far as the spring is
/// stiff for the step. A stiff spring that is damped becomes implicit up to the backward Euler method (`step/springs.rs`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringRow {
    /// Extension, m or rad; its rest is at 0.
    pub extension: f64,
    /// Stiffness, N/m or N·m/rad, above 0.
    pub stiffness: f64,
    /// Damping beside it, whose row is another one, N·s/m or N·m·s/rad.
    pub damping: f64,
}

impl RowTarget {
    /// Makes a rigid row with target velocity 0 and the given set and position error.
    pub fn new(set: RowSet, error: f64) -> RowTarget {
        RowTarget {
            set,
            error,
            velocity: 0.0,
            bias_acceleration: 0.0,
            compliance: 0.0,
            share: 1.0,
            inertial: false,
            spring: None,
        }
    }

    /// Makes a row that adds an inertia to the bodies along its velocity, such as that of a rotor, kg or kg·m², above 0.
    pub fn inertia(inertia: f64) -> RowTarget {
        RowTarget { compliance: 1.0 / inertia, inertial: true, ..RowTarget::new(RowSet::Equality, 0.0) }
    }
}

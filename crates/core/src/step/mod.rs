//! One frame of simulated time, by either of two steppers.

mod adhesion;
mod backtracking;
mod budget;
mod contact_rows;
mod contacts;
mod context;
mod correction;
mod event_location;
mod extrapolation;
mod held_forces;
mod impact;
mod islands;
mod moment;
mod patch;
mod resistance;
mod slide_end;
mod solves;
mod springs;
mod time_stepping;
mod turning;
mod unreachable_joints;
mod warm_start;

pub use backtracking::Backtracking;
pub(crate) use budget::WorkMeter;
pub(crate) use contacts::Workspace;
pub(crate) use moment::Moment;
pub(crate) use patch::PatchMoment;
pub(crate) use resistance::ResistingBodies;
pub use time_stepping::TimeStepping;
pub(crate) use turning::{Attempt, HeldDivision, LargestTurn, add_stiffness, rate_squared};

use crate::settings::Settings;
use crate::world::{Core, StepError};

/// A method that advances a world by one frame.
pub trait Stepper: Send + Sync {
    /// Returns the stepper's name in reports and archives: one of [`STEPPERS`] for the steppers of
    /// this crate, any other for those of other crates.
    fn name(&self) -> &'static str;
    /// Advances by one frame: [`Settings::dt`](crate::Settings::dt) seconds. After an error the world restores state and time.
    fn step(&mut self, frame: StepContext) -> Result<(), StepError>;
    /// Returns the length of its longest sub-step, s, if it divides it by [`StepContext::division`]. By default it
    /// does not, and [`Settings::max_turn`](crate::Settings::max_turn) is only reported.
    fn undivided_step(&self, settings: &Settings) -> Option<f64> {
        let _ = settings;
        None
    }
    /// Returns whether rigid bodies may resist turning in its sub-steps, with an inertia that joint forces raise. False by
    /// default.
    fn resists_turning(&self) -> bool {
        false
    }
    /// Returns an independent copy.
    fn fork(&self) -> Box<dyn Stepper>;
}

/// Names of all steppers of this crate, as scene files, archives, Python and the command line use them.
pub const STEPPERS: [&str; 2] = ["time_stepping", "backtracking"];

/// Returns the stepper of that name; `None` for a name that is not in [`STEPPERS`].
pub fn stepper_by_name(name: &str) -> Option<Box<dyn Stepper>> {
    match name {
        "time_stepping" => Some(Box::<TimeStepping>::default()),
        "backtracking" => Some(Box::<Backtracking>::default()),
        _ => None,
    }
}

/// A world during one frame of a [`Stepper`].
pub struct StepContext<'a> {
    pub(crate) core: &'a mut Core,
}

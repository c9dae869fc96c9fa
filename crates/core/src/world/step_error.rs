//! Errors that stop a step.

/// An error that stopped a step. [`World::step`](crate::World::step) restores state and time to
/// those before the frame.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StepError {
    /// A force, a momentum or a position is not finite.
    #[error("'{object}' at t = {time} s: {what} is not finite; look at the forces and impulses given to it")]
    NotFinite {
        /// Object.
        object: String,
        /// The quantity: a force or the state.
        what: &'static str,
        /// Simulated time, s.
        time: f64,
    },
    /// A part flies away, which is an instability: of an explicit force, or of the step.
    #[error(
        "'{object}' at t = {time} s: part {part} flies away: {what}, is {value:e}, at most {most:e} is admissible; shorten dt, or look at the forces given to it: one that a program computes from the velocity is stable for |dF/dv| below 2·mass/dt"
    )]
    Runaway {
        /// Object.
        object: String,
        /// Part of the object: a link of an articulated body, 0 of a rigid body.
        part: usize,
        /// The quantity, with its unit: the speed of the part's surface or its distance from the origin.
        what: &'static str,
        /// Its value, m/s or m.
        value: f64,
        /// Largest admissible value, m/s or m.
        most: f64,
        /// Simulated time, s.
        time: f64,
    },
    /// An object's mass matrix is singular.
    #[error("'{object}' at t = {time} s: {why}")]
    Singular {
        /// Object.
        object: String,
        /// The singular joint, and a remedy.
        why: String,
        /// Simulated time, s.
        time: f64,
    },
    /// The adaptive integrator cannot hold its tolerance.
    #[error(
        "'{object}' at t = {time} s: its motion needs more than the {steps} inner steps of this frame (the last of {step} s) at the integrator's tolerance {tolerance}; soften what acts on it, or loosen the tolerance"
    )]
    Tolerance {
        /// The object with the largest error.
        object: String,
        /// Simulated time, s.
        time: f64,
        /// Length of the last inner step tried, s.
        step: f64,
        /// Inner steps of this frame, rejected ones included.
        steps: u32,
        /// `Settings::integrator_tolerance`.
        tolerance: f64,
    },
    /// An object is made for steps of a length that no stepper can take.
    #[error(
        "'{object}' is made for steps of {step} s (Integratable::made_for_step); expected at least {least} s, a ten-thousandth of the frame, and finite"
    )]
    MadeForStep {
        /// Object.
        object: String,
        /// Length that it returned, s.
        step: f64,
        /// Least length, s.
        least: f64,
    },
    /// The stepper did not advance the world by the length of a frame.
    #[error("stepper '{stepper}' advanced the world by {advanced} s; a frame has {dt} s")]
    Duration {
        /// Name of the stepper.
        stepper: &'static str,
        /// Time that it advanced, s.
        advanced: f64,
        /// `Settings::dt`.
        dt: f64,
    },
    /// The forces of joints turn a part too far even in the shortest sub-steps.
    #[error(
        "'{object}' at t = {time} s: the forces of its joints turn part {part} by {turn} rad in a sub-step, though it is divided as far as admissible; at most {most} is: shorten dt, give its lightest parts more inertia, or raise max_turn"
    )]
    Turn {
        /// Object.
        object: String,
        /// Part of the object: a link of an articulated body, 0 of a rigid body.
        part: usize,
        /// Turn, rad.
        turn: f64,
        /// `Settings::max_turn`.
        most: f64,
        /// Simulated time, s.
        time: f64,
    },
    /// An action of a scripted event failed.
    #[error("event '{event}': {why}")]
    Event {
        /// Name of the event.
        event: String,
        /// The fault.
        why: super::WorldError,
    },
    /// A callback of a scripted event returned an error.
    #[error("the callback of event '{event}': {why}")]
    Callback {
        /// Name of the event.
        event: String,
        /// Its text.
        why: String,
    },
    /// A constraint made an invalid row.
    #[error("constraint '{object}': {why}")]
    Row {
        /// Object.
        object: String,
        /// The fault of the row.
        why: String,
    },
}

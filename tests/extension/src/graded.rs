//! A stepper that takes as many sub-steps as the fastest part needs.
//!
//! ```text
//! n = ⌈dt·max|v|/travel⌉         sub-steps of a frame, between 1 and MAX_SUBSTEPS
//! ```

use tumble_core::{StepContext, StepError, Stepper, TimeStepping};

/// Maximum number of sub-steps of a frame.
const MAX_SUBSTEPS: f64 = 64.0;

/// `time_stepping` with sub-steps in which no part travels further than a distance, at its velocity
/// when the frame begins.
pub struct Graded {
    /// Distance per sub-step, m, above 0.
    pub travel: f64,
    method: TimeStepping,
}

impl Graded {
    /// Makes a stepper for a distance per sub-step, m.
    pub fn new(travel: f64) -> Graded {
        Graded { travel, method: TimeStepping::default() }
    }
}

impl Stepper for Graded {
    fn name(&self) -> &'static str {
        "graded"
    }

    fn step(&mut self, mut frame: StepContext) -> Result<(), StepError> {
        let dt = frame.settings().dt;
        let fastest = frame.view().part_states.iter().map(|part| part.velocity.norm()).fold(0.0, f64::max);
        let substeps = (dt * fastest / self.travel).ceil().clamp(1.0, MAX_SUBSTEPS);
        (0..substeps as u32).try_for_each(|_| frame.substep(&mut self.method, dt / substeps))
    }

    fn fork(&self) -> Box<dyn Stepper> {
        Box::new(Graded::new(self.travel))
    }
}

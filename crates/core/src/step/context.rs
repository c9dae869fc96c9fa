//! The part of a world that a stepper uses.

use super::{StepContext, TimeStepping};
use crate::report::StepReport;
use crate::settings::Settings;
use crate::world::view::WorldView;
use crate::world::{StepError, WorldState};

/// Steppers of other crates are made of sub-steps of `time_stepping`, of any lengths.
///
/// ```
/// use tumble_core::{StepContext, StepError, Stepper, TimeStepping, prelude::*};
///
/// /// Two sub-steps per frame, the second one three times as long.
/// #[derive(Default)]
/// struct Uneven(TimeStepping);
///
/// impl Stepper for Uneven {
///     fn name(&self) -> &'static str {
///         "uneven"
///     }
///     fn step(&mut self, mut frame: StepContext) -> Result<(), StepError> {
///         let dt = frame.settings().dt;
///         frame.substep(&mut self.0, 0.25 * dt)?;
///         frame.substep(&mut self.0, 0.75 * dt)
///     }
///     fn fork(&self) -> Box<dyn Stepper> {
///         Box::<Uneven>::default()
///     }
/// }
///
/// let mut world = World::default();
/// world.set_stepper(Box::<Uneven>::default());
/// assert_eq!(world.step()?.substeps, 2);
/// # Ok::<(), StepError>(())
/// ```
impl StepContext<'_> {
    /// Returns the number of equal parts of each sub-step that [`Settings::max_turn`](crate::Settings::max_turn)
    /// asks for in this frame.
    pub fn division(&self) -> u32 {
        self.core.division
    }

    /// Returns the settings. A stepper advances the world by [`Settings::dt`].
    pub fn settings(&self) -> &Settings {
        &self.core.settings
    }

    /// Returns the view of the present state.
    pub fn view(&self) -> WorldView<'_> {
        self.core.view(self.core.state.time)
    }

    /// Returns the report of the frame so far.
    pub fn report(&self) -> &StepReport {
        &self.core.report
    }

    /// Advances the world by one sub-step of `h` seconds. `method` has its buffers and no memory of earlier sub-steps.
    ///
    /// # Errors
    /// [`StepError`], after which the frame cannot go on: the stepper returns the error.
    pub fn substep(&mut self, method: &mut TimeStepping, h: f64) -> Result<(), StepError> {
        method.substep(self.core, h)
    }

    /// Writes the present state to `at`, whose memory is used again.
    pub fn checkpoint(&self, at: &mut WorldState) {
        at.clone_from(&self.core.state);
    }

    /// Returns to the state of a [`checkpoint`](Self::checkpoint) of this frame, to try other sub-steps. The report goes on. Returns false, and changes
    /// nothing, if the state is one of other objects.
    pub fn roll_back(&mut self, to: &WorldState) -> bool {
        let fits = self.core.state.fits(to);
        if fits {
            self.core.set_state(to);
        }
        fits
    }
}

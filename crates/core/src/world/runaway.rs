//! Motion that no step can mean: a world that flies apart ends in an error, long before its numbers overflow.
//!
//! ```text
//! |v| + |ω|·r ≤ c          r: bounding radius of the part, 0 without a shape
//! |x| ≤ 2⁵³ m              beyond it neighboring numbers are more than a meter apart
//! ```
//!
//! The equations are Newton's, so a surface faster than light is the result of an instability: of an explicit force that
//! overshoots, or of a fault of the engine.

use super::core::Core;
use super::step_error::StepError;
use super::view::Entry;
use crate::each_object::first_object;
use crate::object::part_state::PartState;

/// Speed of light, m/s.
const LIGHT: f64 = 299_792_458.0;
/// Largest distance from the origin, m.
const FARTHEST: f64 = 9_007_199_254_740_992.0;

/// Returns the limit that a part passes, with its speed (m/s) or distance (m).
fn passed(state: &PartState, radius: f64) -> Option<(&'static str, f64, f64)> {
    let (speed, distance) = (state.velocity.norm() + state.angular_velocity.norm() * radius, state.position().norm());
    if speed > LIGHT {
        Some(("its speed, m/s", speed, LIGHT))
    } else {
        (distance > FARTHEST).then_some(("its distance from the origin, m", distance, FARTHEST))
    }
}

impl Core {
    /// Checks that no part of a moving object is faster or farther away than admissible.
    ///
    /// # Errors
    /// [`StepError::Runaway`] for the first one.
    pub(super) fn check_runaway(&self) -> Result<(), StepError> {
        if self.branches.are_recorded() {
            return Ok(()); // with its choices held, an undetermined problem has solutions of any size: the linearization says so
        }
        let part_states = &self.derived.part_states;
        let found = |e: &Entry| {
            let shape = |part: usize| e.object.collidable().and_then(|body| body.shape(part));
            let radius = |part: usize| shape(part).map_or(0.0, |s| s.bounding_radius());
            let states = &part_states[e.state_range.parts.clone()];
            let of = |(part, state): (usize, &PartState)| {
                let radius = Some(radius(part)).filter(|r| r.is_finite()).unwrap_or(0.0);
                passed(state, radius).map(|passed| (part, passed))
            };
            states.iter().enumerate().filter(|_| e.moves()).find_map(of)
        };
        let first = first_object(&self.threads, self.objects(), |e| found(e).is_some());
        let Some((entry, (part, (what, value, most)))) = first.and_then(|e| found(&e).map(|found| (e, found))) else {
            return Ok(());
        };
        Err(StepError::Runaway { object: entry.name.to_string(), part, what, value, most, time: self.state.time })
    }
}

//! Rates and durations of pictures and steps.

use std::time::{Duration, Instant};

/// Figures are means over this time, so that they are readable.
const AVERAGING_TIME: Duration = Duration::from_millis(500);

/// Counts an activity and its duration.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meter {
    count: u32,
    seconds: f64,
}

impl Meter {
    /// Counts one occurrence.
    pub fn add(&mut self, took: Duration) {
        self.count += 1;
        self.seconds += took.as_secs_f64();
    }

    /// Returns occurrences per second over `over_s` seconds and their mean duration in ms; counts
    /// from zero again.
    fn take(&mut self, over_s: f64) -> (f64, f64) {
        let Meter { count, seconds } = std::mem::take(self);
        (f64::from(count) / over_s, 1e3 * seconds / f64::from(count.max(1)))
    }
}

/// Means of pictures and steps.
pub struct Statistics {
    since: Instant,
    /// Drawing and presenting pictures.
    pub pictures: Meter,
    /// The figures of the last period.
    pub shown: Figures,
}

/// Mean values over one period.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Figures {
    pub pictures_per_s: f64,
    pub steps_per_s: f64,
    /// Per picture.
    pub drawing_ms: f64,
    /// Per step.
    pub step_ms: f64,
}

impl Statistics {
    /// Starts the first period.
    pub fn new(now: Instant) -> Statistics {
        Statistics { since: now, pictures: Meter::default(), shown: Figures::default() }
    }

    /// Ends the period if it has lasted long enough, and returns whether it did. `steps` are the
    /// durations of its steps.
    pub fn count(&mut self, now: Instant, steps: &mut Meter) -> bool {
        let over = now - self.since;
        if over < AVERAGING_TIME {
            return false;
        }
        let (pictures_per_s, drawing_ms) = self.pictures.take(over.as_secs_f64());
        let (steps_per_s, step_ms) = steps.take(over.as_secs_f64());
        self.shown = Figures { pictures_per_s, steps_per_s, drawing_ms, step_ms };
        self.since = now;
        true
    }
}

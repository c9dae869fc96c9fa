//! How fast pictures come, and the lines that say so.

use std::time::{Duration, Instant};

/// Figures are means over this time, so that they can be read.
const AVERAGING_TIME: Duration = Duration::from_millis(500);

/// How often something was done, and how long it took.
#[derive(Clone, Copy, Debug, Default)]
pub struct Meter {
    count: u32,
    seconds: f64,
}

impl Meter {
    /// Once more.
    pub fn add(&mut self, took: Duration) {
        self.count += 1;
        self.seconds += took.as_secs_f64();
    }

    /// Times per second over so many seconds, and the mean in ms; counts from zero again.
    fn take(&mut self, over_s: f64) -> (f64, f64) {
        let Meter { count, seconds } = std::mem::take(self);
        (f64::from(count) / over_s, 1e3 * seconds / f64::from(count.max(1)))
    }
}

/// What pictures and steps took.
pub struct Statistics {
    since: Instant,
    /// Drawing pictures and handing them over.
    pub pictures: Meter,
    /// Of the last time that was counted.
    pub shown: Figures,
}

/// Means.
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
    /// From now on.
    pub fn new(now: Instant) -> Statistics {
        Statistics { since: now, pictures: Meter::default(), shown: Figures::default() }
    }

    /// Whether it is time for new figures; they are then made, with those of the steps.
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

//! How fast pictures come, and the lines that say so.

use std::time::{Duration, Instant};

/// Figures are means over this time, so that they can be read.
const OVER: Duration = Duration::from_millis(500);

/// What pictures and steps took.
pub struct Statistics {
    since: Instant,
    pictures: u32,
    steps: u32,
    drawing_s: f64,
    stepping_s: f64,
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
        Statistics { since: now, pictures: 0, steps: 0, drawing_s: 0.0, stepping_s: 0.0, shown: Figures::default() }
    }

    /// A picture that took so long to draw and hand over.
    pub fn picture(&mut self, took: Duration) {
        self.pictures += 1;
        self.drawing_s += took.as_secs_f64();
    }

    /// A step.
    pub fn step(&mut self, took: Duration) {
        self.steps += 1;
        self.stepping_s += took.as_secs_f64();
    }

    /// Whether there are new figures.
    pub fn count(&mut self, now: Instant) -> bool {
        let over = now - self.since;
        if over < OVER {
            return false;
        }
        let (pictures, steps) = (f64::from(self.pictures), f64::from(self.steps));
        self.shown = Figures {
            pictures_per_s: pictures / over.as_secs_f64(),
            steps_per_s: steps / over.as_secs_f64(),
            drawing_ms: 1e3 * self.drawing_s / pictures.max(1.0),
            step_ms: 1e3 * self.stepping_s / steps.max(1.0),
        };
        *self = Statistics { shown: self.shown, ..Statistics::new(now) };
        true
    }
}

//! Time by which heads are predicted: to the picture that is drawn for them.
//!
//! ```text
//! pose received ──age──► taken for a frame ──display──► frame presented ──stated──► light
//!
//! lead = age + median of display over the last frames + stated
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `age` | known for each pose, by the clock of the server's machine |
//! | `display` | until halfway between the first and the last facet that presents the frame, by the server's clock |
//! | `stated` | everything that the run cannot see: the tracker before it sends, the wait for the next refresh, scan-out and projector |

use std::collections::VecDeque;
use std::time::Duration;
use tumble::net::sync::FrameTimes;

/// Largest lead, s.
pub const MAX_LEAD_S: f64 = 0.2;
/// Number of frames in the median: 2 s at 60 Hz.
const MEDIAN_FRAMES: usize = 120;
/// Largest number of frames that are waited for.
const MAX_OPEN_FRAMES: usize = 8;

/// The lead that was asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lead {
    /// From the receipt of a pose, s.
    Stated(f64),
    /// To the presentation of the frame, which the run measures, and this much longer, s.
    Measured(f64),
}

impl std::str::FromStr for Lead {
    type Err = String;

    fn from_str(text: &str) -> Result<Lead, String> {
        let seconds = |text: &str| {
            let ms = text.parse::<f64>().ok().filter(|ms| (0.0..=1e3 * MAX_LEAD_S).contains(ms));
            ms.map(|ms| 1e-3 * ms)
                .ok_or(format!("expected auto, auto+MS or MS, with MS from 0 to {}", 1e3 * MAX_LEAD_S))
        };
        match text.strip_prefix("auto") {
            None => seconds(text).map(Lead::Stated),
            Some("") => Ok(Lead::Measured(0.0)),
            Some(more) => seconds(more.strip_prefix('+').unwrap_or("no number")).map(Lead::Measured),
        }
    }
}

/// Measures how long frames take from their begin to their presentation.
#[derive(Debug, Default)]
pub struct DisplayTimes {
    /// Frames that are not presented yet, and their begin by the server's clock.
    open: VecDeque<(u64, Duration)>,
    /// The last frames, s.
    last: VecDeque<f64>,
    /// Median of the last frames, s; `None` before the first.
    median_s: Option<f64>,
}

impl DisplayTimes {
    /// Notes a frame and the time at which its inputs were taken.
    pub fn begun(&mut self, frame: u64, taken: Duration) {
        self.open.push_back((frame, taken));
        if self.open.len() > MAX_OPEN_FRAMES {
            self.open.pop_front();
        }
    }

    /// Adds a frame that was presented. Returns the time that it took, s, if its begin is known.
    pub fn shown(&mut self, times: &FrameTimes) -> Option<f64> {
        let at = self.open.iter().position(|(frame, _)| *frame == times.frame)?;
        let (_, taken) = self.open.drain(..=at).next_back()?;
        let took_s = (times.shown.saturating_sub(times.skew / 2)).saturating_sub(taken).as_secs_f64();
        self.last.push_back(took_s);
        if self.last.len() > MEDIAN_FRAMES {
            self.last.pop_front();
        }
        let mut sorted: Vec<f64> = self.last.iter().copied().collect();
        sorted.sort_by(f64::total_cmp);
        self.median_s = Some(sorted[sorted.len() / 2]);
        Some(took_s)
    }

    /// Returns the lead of a pose of this age that is taken now, s. Before the first presentation a measured lead has
    /// age and stated part alone.
    pub fn lead_s(&self, lead: Lead, age: Duration) -> f64 {
        match lead {
            Lead::Stated(lead_s) => lead_s,
            Lead::Measured(more_s) => age.as_secs_f64() + self.median_s.unwrap_or(0.0) + more_s,
        }
        .min(MAX_LEAD_S)
    }
}

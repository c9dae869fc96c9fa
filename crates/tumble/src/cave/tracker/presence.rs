//! Whether a device answers: an alarm while it does not, and lines when it is lost, again from time to time, and when it
//! is back.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which an absent device is reported again.
const REPEAT_INTERVAL: Duration = Duration::from_secs(10);
/// Largest number of lines that wait to be read.
const MAX_LINES: usize = 64;

/// Presence of a device, shared by its thread and that of the run.
pub struct Presence {
    name: String,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Why the device does not answer, and when that was last reported.
    absent: Option<(String, Instant)>,
    lines: Vec<String>,
}

impl Presence {
    /// Begins before the device was connected and before it was lost.
    pub fn new(name: String) -> Presence {
        Presence { name, state: Mutex::default() }
    }

    /// Reports that the device answers.
    pub fn found(&self, how: &str) {
        let mut state = self.state();
        state.absent = None;
        state.say(format!("{}: {how}", self.name));
    }

    /// Reports that the device does not answer: at once if the reason is new, otherwise every 10 s.
    pub fn lost(&self, now: Instant, why: &str) {
        let mut state = self.state();
        let since = match &state.absent {
            Some((known, said)) if known == why && now.saturating_duration_since(*said) < REPEAT_INTERVAL => return,
            Some(_) => "still absent: ",
            None => "",
        };
        state.absent = Some((why.to_owned(), now));
        state.say(format!("{}: {since}{why}; tries again", self.name));
    }

    /// Adds a line that changes nothing.
    pub fn note(&self, line: &str) {
        self.state().say(format!("{}: {line}", self.name));
    }

    /// Returns the alarm of a device that does not answer.
    pub fn alarm(&self) -> Option<String> {
        self.state().absent.as_ref().map(|(why, _)| format!("{}: {why}", self.name))
    }

    /// Returns the lines since the last call.
    pub fn lines(&self) -> Vec<String> {
        std::mem::take(&mut self.state().lines)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    fn say(&mut self, line: String) {
        if self.lines.len() < MAX_LINES {
            self.lines.push(line);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_absent_device_is_an_alarm_and_is_reported_again_until_it_is_back() {
        let (device, start) = (Presence::new("VRPN h:1".into()), Instant::now());
        let after = |s: f64| start + Duration::from_secs_f64(s);
        assert!(device.alarm().is_none());
        (0..=20).for_each(|s| device.lost(after(f64::from(s)), "is silent"));
        let again = "VRPN h:1: still absent: is silent; tries again";
        assert_eq!(device.lines(), ["VRPN h:1: is silent; tries again", again, again]);
        assert_eq!(device.alarm().unwrap(), "VRPN h:1: is silent");
        device.lost(after(20.5), "refuses");
        assert_eq!(device.lines(), ["VRPN h:1: still absent: refuses; tries again"]);
        device.found("is connected");
        assert!(device.alarm().is_none() && device.lines() == ["VRPN h:1: is connected"]);
        device.lost(after(21.0), "refuses");
        assert_eq!(device.lines(), ["VRPN h:1: refuses; tries again"]);
    }
}

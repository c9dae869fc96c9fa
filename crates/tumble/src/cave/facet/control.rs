//! Conditions that end a facet: a signal, the end of its parent, no server for too long.

use crate::cave::facet_report::Reporter;
use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::io::{BufRead, Read};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tumble::net::sync::{Task, WaitReason};
use tumble::render::CalibrationPattern;

/// Interval at which signals, parent and picture are polled.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Interval at which a facet that stands by looks for the launcher's line.
pub const STANDBY_INTERVAL: Duration = Duration::from_millis(20);
/// Time without a server after which the facet reports it.
const REPORT_DELAY: Duration = Duration::from_secs(1);

/// Maximum length of a line of the launcher, bytes; the rest of a longer one counts as another line.
const MAX_LINE_BYTES: u64 = 64;
/// Beginning of a line that asks for a calibration pattern.
pub const PATTERN_MARK: &str = "pattern ";
/// The line that ends the standby of a facet.
pub const JOIN_LINE: &str = "join";

/// Conditions that end a facet, and its timeout.
#[derive(Clone)]
pub struct FacetControl {
    pub name: String,
    pub signals: Signals,
    pub reporter: Reporter,
    pub parent: Option<Parent>,
    pub connect_timeout: Duration,
    /// Whether all facets of this process end: one has failed, or its window was closed.
    pub end_all: Arc<AtomicBool>,
    /// Whether packets are authenticated. A server with another key file then does not answer.
    pub sealed: bool,
}

impl FacetControl {
    pub fn title(&self) -> String {
        format!("facet {}", self.name)
    }

    pub fn say(&self, what: &str) {
        eprintln!("facet {}: {what}", self.name);
        self.reporter.line(what);
    }

    pub fn is_orphaned(&self) -> bool {
        self.parent.as_ref().is_some_and(|parent| parent.gone.load(Ordering::Relaxed))
    }

    /// Returns the calibration pattern to show instead of the scene.
    pub fn pattern(&self) -> Option<CalibrationPattern> {
        self.parent.as_ref().and_then(Parent::pattern)
    }

    /// Returns whether a facet that stands by may join: the launcher has said so.
    pub fn may_join(&self) -> bool {
        self.parent.as_ref().is_some_and(|parent| parent.join.load(Ordering::Relaxed))
    }

    /// Reports that the facet is prepared, and waits until it may join. Returns `false` if it must stop.
    pub fn stand_by(&self) -> bool {
        self.reporter.update(|report| report.preparing = false);
        while !self.may_join() {
            if self.should_stop() {
                return false;
            }
            std::thread::sleep(STANDBY_INTERVAL);
        }
        true
    }

    pub fn should_stop(&self) -> bool {
        self.signals.stop_requested() || self.is_orphaned() || self.end_all.load(Ordering::Relaxed)
    }
}

/// The launcher's pipe: it ends when the launcher ends in any way, and its lines are requests.
///
/// ```text
/// pattern grid
/// pattern off
/// join
/// ```
#[derive(Clone, Default)]
pub struct Parent {
    gone: Arc<AtomicBool>,
    join: Arc<AtomicBool>,
    pattern: Arc<Mutex<Option<CalibrationPattern>>>,
}

impl Parent {
    /// Starts to read stdin.
    pub fn watch() -> Result<Parent, Failure> {
        let parent = Parent::default();
        let ours = parent.clone();
        let wait = move || {
            ours.read(std::io::stdin().lock());
            ours.gone.store(true, Ordering::Relaxed);
        };
        std::thread::Builder::new().name("parent".into()).spawn(wait).map_err(|e| Failure::run("the facet", e))?;
        Ok(parent)
    }

    /// Reads requests until the end; other lines are ignored.
    fn read(&self, mut pipe: impl BufRead) {
        loop {
            let mut line = Vec::new();
            match pipe.by_ref().take(MAX_LINE_BYTES).read_until(b'\n', &mut line) {
                Ok(1..) => {
                    let text = String::from_utf8_lossy(&line);
                    match text.trim() {
                        JOIN_LINE => self.join.store(true, Ordering::Relaxed),
                        other => other.strip_prefix(PATTERN_MARK).into_iter().for_each(|name| {
                            *self.pattern.lock().unwrap_or_else(PoisonError::into_inner) = name.parse().ok();
                        }),
                    }
                }
                Ok(0) | Err(_) => return,
            }
        }
    }

    /// Returns the calibration pattern to show instead of the scene.
    pub fn pattern(&self) -> Option<CalibrationPattern> {
        *self.pattern.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Time without a server, and whether it was reported.
#[derive(Default)]
pub struct ServerWait {
    since: Option<(WaitReason, Instant)>,
    said: bool,
}

impl ServerWait {
    /// Returns the time without a server; zero while there is one.
    pub fn elapsed(&self) -> Duration {
        self.since.map_or(Duration::ZERO, |(_, since)| since.elapsed())
    }

    pub fn update(&mut self, task: &Task, control: &FacetControl) -> Result<(), Failure> {
        let Task::Wait(why @ (WaitReason::Server | WaitReason::Lost)) = *task else {
            if self.since.take().is_some() && std::mem::take(&mut self.said) {
                control.say("is connected");
            }
            return Ok(());
        };
        let (_, since) = *self.since.filter(|(before, _)| *before == why).get_or_insert((why, Instant::now()));
        self.since = Some((why, since));
        if since.elapsed() > control.connect_timeout {
            let what =
                if why == WaitReason::Lost { "the server is lost and did not return" } else { "no server answers" };
            let key = if control.sealed {
                "; a server with another key file looks the same: compare the key files"
            } else {
                ""
            };
            return Err(Failure::run(
                &control.title(),
                format!("{what} for {:.0} s{key}", control.connect_timeout.as_secs_f64()),
            ));
        }
        if !self.said && (why == WaitReason::Lost || since.elapsed() > REPORT_DELAY) {
            control.say(if why == WaitReason::Lost {
                "lost its server; keeps the last picture and reconnects"
            } else {
                "waits for the server"
            });
            self.said = true;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_pattern_counts_and_other_lines_do_not() {
        let parent = Parent::default();
        for (lines, pattern) in [
            ("pattern grid\n".to_owned(), Some(CalibrationPattern::Grid)),
            (format!("garbage\n{}\n", "x".repeat(1000)), Some(CalibrationPattern::Grid)),
            ("pattern grid\npattern name\n".into(), Some(CalibrationPattern::Name)),
            ("pattern off\n".into(), None),
        ] {
            parent.read(lines.as_bytes());
            assert_eq!(parent.pattern(), pattern, "{lines}");
        }
        assert!(!parent.join.load(Ordering::Relaxed));
        parent.read("joint\njoin\n".as_bytes());
        assert!(parent.join.load(Ordering::Relaxed));
    }
}

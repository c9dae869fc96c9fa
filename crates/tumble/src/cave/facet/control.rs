//! Conditions that end a facet: a signal, the end of its parent, no server for too long.

use crate::cave::facet_report::Reporter;
use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble::net::sync::{Task, WaitReason};

/// Interval at which signals, parent and picture are polled.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Time without a server after which the facet reports it.
const REPORT_DELAY: Duration = Duration::from_secs(1);

/// Conditions that end a facet, and its timeout.
pub struct FacetControl {
    pub name: String,
    pub signals: Signals,
    pub reporter: Reporter,
    pub parent_gone: Option<Arc<AtomicBool>>,
    pub connect_timeout: Duration,
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
        self.parent_gone.as_ref().is_some_and(|gone| gone.load(Ordering::Relaxed))
    }

    pub fn should_stop(&self) -> bool {
        self.signals.stop_requested() || self.is_orphaned()
    }
}

/// Returns a flag that is set when stdin ends, which happens when the launcher ends in any way.
pub fn watch_parent() -> Result<Arc<AtomicBool>, Failure> {
    let gone = Arc::new(AtomicBool::new(false));
    let raise = gone.clone();
    let wait = move || {
        let mut bytes = [0; 64];
        while matches!(std::io::stdin().read(&mut bytes), Ok(n) if n > 0) {}
        raise.store(true, Ordering::Relaxed);
    };
    std::thread::Builder::new().name("parent".into()).spawn(wait).map_err(|e| Failure::run("the facet", e))?;
    Ok(gone)
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

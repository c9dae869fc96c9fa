//! Conditions that end a facet: a signal, the end of its parent, no server for too long.

use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::io::Read;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble::net::sync::{Task, WaitReason};

/// Between two looks at signals, pipe and picture.
pub const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Waiting for a server that is no longer than this is not worth a word.
const REPORT_DELAY: Duration = Duration::from_secs(1);

/// Who may end a facet, and how long it waits.
pub struct FacetControl {
    pub name: String,
    pub signals: Signals,
    pub parent_gone: Option<Arc<AtomicBool>>,
    pub connect_timeout: Duration,
    /// The server answers nobody who has another key file.
    pub sealed: bool,
}

impl FacetControl {
    pub fn title(&self) -> String {
        format!("facet {}", self.name)
    }

    pub fn say(&self, what: &str) {
        eprintln!("facet {}: {what}", self.name);
    }

    pub fn is_orphaned(&self) -> bool {
        self.parent_gone.as_ref().is_some_and(|gone| gone.load(Ordering::Relaxed))
    }

    pub fn should_stop(&self) -> bool {
        self.signals.stop_requested() || self.is_orphaned()
    }
}

/// Raised when stdin ends: the launcher is gone, however that came.
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

/// How long there has been no server, and what was said about it.
#[derive(Default)]
pub struct ServerWait {
    since: Option<(WaitReason, Instant)>,
    said: bool,
}

impl ServerWait {
    /// How long there has been no server; zero while there is one.
    pub fn elapsed(&self) -> Duration {
        self.since.map_or(Duration::ZERO, |(_, since)| since.elapsed())
    }

    pub fn update(&mut self, task: &Task, control: &FacetControl) -> Result<(), Failure> {
        let Task::Wait(why @ (WaitReason::Server | WaitReason::Lost)) = *task else {
            if self.since.take().is_some() && std::mem::take(&mut self.said) {
                control.say("has its server");
            }
            return Ok(());
        };
        let (_, since) = *self.since.filter(|(before, _)| *before == why).get_or_insert((why, Instant::now()));
        self.since = Some((why, since));
        if since.elapsed() > control.connect_timeout {
            let what =
                if why == WaitReason::Lost { "the server is lost and did not come back" } else { "no server answers" };
            let key = if control.sealed {
                "; a server that has another key file looks like this, too: compare them"
            } else {
                ""
            };
            return Err(Failure::run(
                &control.title(),
                format!("{what}, {:.0} s long{key}", control.connect_timeout.as_secs_f64()),
            ));
        }
        if !self.said && (why == WaitReason::Lost || since.elapsed() > REPORT_DELAY) {
            control.say(if why == WaitReason::Lost {
                "has lost its server, keeps the last picture and looks for it"
            } else {
                "waits for the server"
            });
            self.said = true;
        }
        Ok(())
    }
}

//! Progress: a bar on a terminal, a line every few seconds elsewhere, nothing with `--quiet`.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between two lines.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// Progress of a run in frames.
pub enum Progress {
    Quiet,
    Bar(ProgressBar),
    Lines { total: u64, last: Instant },
}

impl Progress {
    /// Starts at 0 of `total` frames.
    pub fn new(total: u64, quiet: bool) -> Progress {
        if quiet {
            return Progress::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return Progress::Lines { total, last: Instant::now() };
        }
        let style = ProgressStyle::with_template("{bar:40} {pos}/{len} frames  {elapsed} (eta {eta})  {msg}");
        Progress::Bar(ProgressBar::new(total).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())))
    }

    /// Reports that frame `done` is finished, at the simulated time `time`, s.
    pub fn at(&mut self, done: u64, time: f64) {
        match self {
            Progress::Quiet => {}
            Progress::Bar(bar) => {
                bar.set_message(format!("t = {time:.2} s"));
                bar.set_position(done);
            }
            Progress::Lines { total, last } if last.elapsed() >= LINE_INTERVAL => {
                *last = Instant::now();
                eprintln!("frame {done} of {total}, t = {time:.2} s");
            }
            Progress::Lines { .. } => {}
        }
    }

    /// Removes the bar.
    pub fn done(self) {
        if let Progress::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Progress of a computation as a fraction; any thread may report it.
pub enum WorkProgress {
    Quiet,
    Bar(ProgressBar),
    Lines { what: String, last: Mutex<Instant> },
}

/// Resolution of a bar.
const BAR_STEPS: f64 = 1000.0;

impl WorkProgress {
    /// Starts at 0; `what` names the activity.
    pub fn new(what: &str, quiet: bool) -> WorkProgress {
        if quiet {
            return WorkProgress::Quiet;
        }
        if !std::io::stderr().is_terminal() {
            return WorkProgress::Lines { what: what.to_owned(), last: Mutex::new(Instant::now()) };
        }
        let style = ProgressStyle::with_template("{msg} {bar:40} {percent} %  {elapsed}")
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        let bar = ProgressBar::new(BAR_STEPS as u64).with_style(style).with_message(what.to_owned());
        bar.enable_steady_tick(Duration::from_millis(200));
        WorkProgress::Bar(bar)
    }

    /// Removes the bar.
    pub fn done(self) {
        if let WorkProgress::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl tumble::collide::Progress for WorkProgress {
    fn report(&self, share: f64) {
        match self {
            WorkProgress::Quiet => {}
            WorkProgress::Bar(bar) => bar.set_position((BAR_STEPS * share) as u64),
            WorkProgress::Lines { what, last } => {
                // another thread is about to print a line
                let Ok(mut last) = last.try_lock() else { return };
                if last.elapsed() >= LINE_INTERVAL {
                    *last = Instant::now();
                    eprintln!("{what}: {:.0} %", 100.0 * share);
                }
            }
        }
    }
}

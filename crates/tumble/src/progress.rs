//! Progress: a bar on a terminal, a line every few seconds elsewhere, nothing when quiet.

use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Between two plain lines.
const EVERY: Duration = Duration::from_secs(5);

/// Shows how far a run is.
pub enum Progress {
    Quiet,
    Bar(ProgressBar),
    Lines { total: u64, last: Instant },
}

impl Progress {
    /// For `total` frames.
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

    /// After frame `done`, at simulated time `time`.
    pub fn at(&mut self, done: u64, time: f64) {
        match self {
            Progress::Quiet => {}
            Progress::Bar(bar) => {
                bar.set_message(format!("t = {time:.2} s"));
                bar.set_position(done);
            }
            Progress::Lines { total, last } if last.elapsed() >= EVERY => {
                *last = Instant::now();
                eprintln!("frame {done} of {total}, t = {time:.2} s");
            }
            Progress::Lines { .. } => {}
        }
    }

    /// Takes the bar away.
    pub fn done(self) {
        if let Progress::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

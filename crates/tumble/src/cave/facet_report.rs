//! Reports of a facet to its launcher: lines on the facet's stdout, which is a pipe to the launcher
//! and which launch commands such as `ssh` pass on.
//!
//! ```text
//! tumble-facet {"number":7,"preparing":false,"written":41,"waiting":2,"progress":5210}
//! ```
//!
//! So the launcher waits for a facet that works and does not wait for one that hangs. Other lines
//! are ignored.

use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Beginning of a report's line.
const MARK: &str = "tumble-facet ";
/// Maximum length of a line, bytes; longer lines are ignored.
const MAX_LINE_BYTES: usize = 1024;
/// Interval at which changes are reported.
const INTERVAL: Duration = Duration::from_millis(100);
/// Number of intervals after which a facet that prepares reports even without a change.
const HEARTBEAT_INTERVALS: u32 = 5;

/// State of a facet's process.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FacetReport {
    /// Number of the report; later ones have larger numbers.
    number: u64,
    /// Whether it prepares to join: it reads the scene, compiles pipelines and draws one picture.
    pub preparing: bool,
    /// Number of shown frames that are written: the picture, if any, and the line.
    pub written: u64,
    /// Number of shown frames that are not written yet.
    pub waiting: u64,
    /// Work done on files, in arbitrary units; it grows as long as writing proceeds.
    pub progress: u64,
}

/// A facet's side.
#[derive(Clone, Default)]
pub struct Reporter {
    report: Arc<Mutex<FacetReport>>,
    /// Whether there is a launcher to report to.
    speaks: bool,
}

impl Reporter {
    /// Starts to report to a launcher, if there is one.
    pub fn start(to_launcher: bool) -> Result<Reporter, Failure> {
        let report = FacetReport { preparing: true, ..FacetReport::default() };
        let reporter = Reporter { report: Arc::new(Mutex::new(report)), speaks: to_launcher };
        if to_launcher {
            let ours = reporter.clone();
            std::thread::Builder::new()
                .name("reports".into())
                .spawn(move || ours.report_changes())
                .map_err(|e| Failure::run("the facet", e))?;
        }
        Ok(reporter)
    }

    /// Changes the state.
    pub fn update(&self, change: impl FnOnce(&mut FacetReport)) {
        change(&mut lock(&self.report));
    }

    /// Reports the present state at once.
    pub fn flush(&self) {
        if self.speaks {
            let report = self.next();
            // a launcher that is gone reads nothing
            let _ = write_line(&report);
        }
    }

    fn next(&self) -> FacetReport {
        let mut report = lock(&self.report);
        report.number += 1;
        report.clone()
    }

    fn report_changes(&self) {
        let (mut last, mut silent) = (FacetReport::default(), 0);
        loop {
            let now = lock(&self.report).clone();
            silent += 1;
            if now != last || now.preparing && silent >= HEARTBEAT_INTERVALS {
                // the lock is free while this waits for the pipe
                let next = self.next();
                if write_line(&next).is_err() {
                    return;
                }
                (last, silent) = (next, 0);
            }
            std::thread::sleep(INTERVAL);
        }
    }
}

fn write_line(report: &FacetReport) -> std::io::Result<()> {
    let line = format!("{MARK}{}\n", serde_json::to_string(report)?);
    let mut out = std::io::stdout().lock();
    out.write_all(line.as_bytes())?;
    out.flush()
}

/// The newest report of a facet, and when it came.
#[derive(Clone, Debug, Default)]
pub struct Received {
    pub report: FacetReport,
    /// Arrival of the newest report.
    pub heard: Option<Instant>,
    /// Arrival of the newest report that shows a progress of writing.
    pub proceeded: Option<Instant>,
}

impl Received {
    fn take(&mut self, report: FacetReport) {
        // two threads of a facet write reports
        if self.heard.is_some() && report.number <= self.report.number {
            return;
        }
        let now = Instant::now();
        let done = |r: &FacetReport| (r.written, r.progress);
        if self.proceeded.is_none() || done(&report) != done(&self.report) {
            self.proceeded = Some(now);
        }
        (self.report, self.heard) = (report, Some(now));
    }
}

/// The launcher's side: reads a pipe to its end.
pub struct ReportReader {
    received: Arc<Mutex<Received>>,
    thread: JoinHandle<()>,
}

impl ReportReader {
    /// Starts to read.
    pub fn start(pipe: impl Read + Send + 'static) -> std::io::Result<ReportReader> {
        let received = Arc::new(Mutex::new(Received::default()));
        let theirs = received.clone();
        let thread =
            std::thread::Builder::new().name("facet reports".into()).spawn(move || read_lines(pipe, &theirs))?;
        Ok(ReportReader { received, thread })
    }

    /// Returns the newest report.
    pub fn received(&self) -> Received {
        lock(&self.received).clone()
    }

    /// Waits at most `most` for the end of the pipe, so that a process that has ended is known by
    /// its last report.
    pub fn wait_for_end(&self, most: Duration) {
        let until = Instant::now() + most;
        while !self.thread.is_finished() && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
        }
    }
}

fn read_lines(mut pipe: impl Read, received: &Mutex<Received>) {
    let (mut line, mut too_long, mut bytes) = (Vec::new(), false, [0; 4096]);
    while let Ok(length @ 1..) = pipe.read(&mut bytes) {
        for &byte in &bytes[..length] {
            match byte {
                b'\n' => {
                    let text = std::str::from_utf8(&line).ok().filter(|_| !too_long);
                    if let Some(report) = text.and_then(parse) {
                        lock(received).take(report);
                    }
                    line.clear();
                    too_long = false;
                }
                _ if line.len() < MAX_LINE_BYTES => line.push(byte),
                _ => too_long = true,
            }
        }
    }
}

fn parse(line: &str) -> Option<FacetReport> {
    serde_json::from_str(line.strip_prefix(MARK)?).ok()
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_are_found_among_other_lines_and_the_newest_counts() {
        let report =
            |number, written| FacetReport { number, written, waiting: 1, progress: 9, ..FacetReport::default() };
        let line = |r: &FacetReport| format!("{MARK}{}\n", serde_json::to_string(r).unwrap());
        let text = [
            "Welcome to this machine\n".to_owned(),
            line(&report(1, 3)),
            format!("{MARK}{{\"number\":9}}\n"),
            format!("{MARK}{}\n", "x".repeat(100_000)),
            line(&report(3, 5)),
            line(&report(2, 4)),
            line(&report(4, 6)).trim_end().to_owned(),
        ]
        .concat();
        let received = Mutex::new(Received::default());
        read_lines(text.as_bytes(), &received);
        assert_eq!(lock(&received).report, report(3, 5));
    }
}

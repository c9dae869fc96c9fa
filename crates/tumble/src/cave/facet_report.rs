//! Reports of a facet to its launcher: lines on the facet's stdout, which is a pipe to the launcher
//! and which launch commands such as `ssh` pass on.
//!
//! ```text
//! tumble-facet 0 {"number":7,"preparing":false,"written":41,"waiting":2,"progress":5210,…}
//! tumble-facet-line 0 draws into memory, because …
//! tumble-facet-picture 0 89504e47…
//! ```
//!
//! The number counts the facets of the process.
//!
//! So the launcher waits for a facet that works and does not wait for one that hangs. Other lines
//! are ignored.

use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::io::{Read, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Beginning of a report's line.
const MARK: &str = "tumble-facet ";
/// Beginnings of lines with a message for the operator, and with a small picture (PNG, hexadecimal).
const LINE_MARK: &str = "tumble-facet-line ";
const PICTURE_MARK: &str = "tumble-facet-picture ";
/// Maximum length of a line, bytes; longer lines are ignored.
const MAX_LINE_BYTES: usize = 1 << 17;
/// Maximum number of messages that wait.
const MAX_MESSAGES: usize = 100;
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
    /// Number of pictures that were looked at, of black ones, and of black ones since the last other.
    #[serde(default)]
    pub pictures: u64,
    #[serde(default)]
    pub black: u64,
    #[serde(default)]
    pub black_now: u64,
    /// First 16 bytes of the BLAKE3 hash of the last picture, hexadecimal.
    #[serde(default)]
    pub image: String,
    /// Graphics adapter that draws: its name, kind and interface; empty for none in this process.
    #[serde(default)]
    pub adapter: String,
    /// Web browsers that show the facet.
    #[serde(default)]
    pub browsers: Option<BrowserReport>,
}

/// Web browsers that show a facet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct BrowserReport {
    /// Number of browsers now.
    pub browsers: u32,
    /// Number of browsers that are awaited at the swap barrier.
    pub awaited: u32,
    /// Number of times that an awaited browser was late.
    pub late: u64,
    /// Frames that browsers have shown.
    pub shown: u64,
    /// Largest number of frames by which an awaited browser was behind when it had shown one.
    pub behind_max: u64,
}

impl std::fmt::Display for BrowserReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let BrowserReport { browsers, awaited, late, shown, behind_max } = self;
        write!(
            f,
            "{browsers} browsers ({awaited} awaited), {shown} frames in them, {late} times late, at most {behind_max} behind"
        )
    }
}

/// Messages and a picture that wait for the launcher.
#[derive(Default)]
struct Outbox {
    lines: VecDeque<String>,
    picture: Option<Vec<u8>>,
}

impl Outbox {
    /// Returns what waits as lines of a facet.
    fn take(&mut self, member: usize) -> String {
        let one_line = |text: &String| text.replace(['\n', '\r'], " ");
        let mut text: String =
            self.lines.iter().map(|line| format!("{LINE_MARK}{member} {}\n", one_line(line))).collect();
        self.lines.clear();
        if let Some(png) = self.picture.take() {
            text += &format!("{PICTURE_MARK}{member} {}\n", png.iter().map(|b| format!("{b:02x}")).collect::<String>());
        }
        text
    }
}

/// A facet's side.
#[derive(Clone, Default)]
pub struct Reporter {
    report: Arc<Mutex<FacetReport>>,
    outbox: Arc<Mutex<Outbox>>,
    /// Whether there is a launcher to report to.
    speaks: bool,
    /// Number of the facet in its process.
    member: usize,
}

impl Reporter {
    /// Starts to report to a launcher, if there is one. `member` counts the facets of this process.
    pub fn start(to_launcher: bool, member: usize) -> Result<Reporter, Failure> {
        let report = FacetReport { preparing: true, ..FacetReport::default() };
        let (report, outbox) = (Arc::new(Mutex::new(report)), Arc::default());
        let reporter = Reporter { report, outbox, speaks: to_launcher, member };
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

    /// Sends a message to the operator's console.
    pub fn line(&self, text: &str) {
        let mut outbox = lock(&self.outbox);
        if outbox.lines.len() < MAX_MESSAGES {
            outbox.lines.push_back(text.chars().take(1000).collect());
        }
    }

    /// Sends a small picture (PNG) to the operator's console; a later one replaces it while it waits.
    pub fn picture(&self, png: Vec<u8>) {
        if png.len() < MAX_LINE_BYTES / 2 - PICTURE_MARK.len() {
            lock(&self.outbox).picture = Some(png);
        }
    }

    /// Reports the present state at once.
    pub fn flush(&self) {
        if self.speaks {
            let _ = write_text(&lock(&self.outbox).take(self.member));
            let report = self.next();
            // a launcher that is gone reads nothing
            let _ = write_line(self.member, &report);
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
            let text = lock(&self.outbox).take(self.member);
            // the lock is free while this waits for the pipe
            if !text.is_empty() && write_text(&text).is_err() {
                return;
            }
            silent += 1;
            if now != last || now.preparing && silent >= HEARTBEAT_INTERVALS {
                // the lock is free while this waits for the pipe
                let next = self.next();
                if write_line(self.member, &next).is_err() {
                    return;
                }
                (last, silent) = (next, 0);
            }
            std::thread::sleep(INTERVAL);
        }
    }
}

fn write_line(member: usize, report: &FacetReport) -> std::io::Result<()> {
    write_text(&format!("{MARK}{member} {}\n", serde_json::to_string(report)?))
}

fn write_text(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
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
    /// Messages and a picture since they were last taken.
    pub lines: VecDeque<String>,
    pub picture: Option<Vec<u8>>,
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
    /// By facet of the process.
    received: Arc<Vec<Mutex<Received>>>,
    thread: JoinHandle<()>,
}

impl ReportReader {
    /// Starts to read the reports of a process with this number of facets.
    pub fn start(pipe: impl Read + Send + 'static, members: usize) -> std::io::Result<ReportReader> {
        let received: Arc<Vec<_>> = Arc::new((0..members).map(|_| Mutex::default()).collect());
        let theirs = received.clone();
        let thread =
            std::thread::Builder::new().name("facet reports".into()).spawn(move || read_lines(pipe, &theirs))?;
        Ok(ReportReader { received, thread })
    }

    /// Returns the newest report of a facet.
    pub fn received(&self, member: usize) -> Received {
        self.received.get(member).map_or_else(Received::default, |received| lock(received).clone())
    }

    /// Takes the messages and the picture of a facet that have arrived.
    pub fn take_messages(&self, member: usize) -> (VecDeque<String>, Option<Vec<u8>>) {
        let Some(received) = self.received.get(member) else { return Default::default() };
        let mut received = lock(received);
        (std::mem::take(&mut received.lines), received.picture.take())
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

fn read_lines(mut pipe: impl Read, received: &[Mutex<Received>]) {
    let (mut line, mut too_long, mut bytes) = (Vec::new(), false, [0; 4096]);
    while let Ok(length @ 1..) = pipe.read(&mut bytes) {
        for &byte in &bytes[..length] {
            match byte {
                b'\n' => {
                    let text = std::str::from_utf8(&line).ok().filter(|_| !too_long);
                    text.into_iter().for_each(|line| take_line(line, received));
                    line.clear();
                    too_long = false;
                }
                _ if line.len() < MAX_LINE_BYTES => line.push(byte),
                _ => too_long = true,
            }
        }
    }
}

fn take_line(line: &str, received: &[Mutex<Received>]) {
    // the facet's part of the table, and the rest of the line
    let marked = |mark: &str| {
        let (member, text) = line.strip_prefix(mark)?.split_once(' ')?;
        Some((received.get(member.parse::<usize>().ok()?)?, text))
    };
    if let Some((of, json)) = marked(MARK) {
        serde_json::from_str(json).into_iter().for_each(|report| lock(of).take(report));
    } else if let Some((of, text)) = marked(LINE_MARK) {
        let lines = &mut lock(of).lines;
        if lines.len() < MAX_MESSAGES {
            lines.push_back(text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect());
        }
    } else if let Some((of, png)) = marked(PICTURE_MARK).and_then(|(of, hex)| Some((of, bytes_of(hex)?))) {
        lock(of).picture = Some(png);
    }
}

/// Reads hexadecimal digits.
fn bytes_of(hex: &str) -> Option<Vec<u8>> {
    let (pairs, rest) = hex.as_bytes().as_chunks::<2>();
    let digit = |b: u8| char::from(b).to_digit(16);
    let byte = |[a, b]: &[u8; 2]| Some((16 * digit(*a)? + digit(*b)?) as u8);
    rest.is_empty().then(|| pairs.iter().map(byte).collect()).flatten()
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
        let line = |r: &FacetReport| format!("{MARK}1 {}\n", serde_json::to_string(r).unwrap());
        let text = [
            "Welcome to this machine\n".to_owned(),
            line(&report(1, 3)),
            format!("{MARK}1 {{\"number\":9}}\n"),
            format!("{MARK}1 {}\n", "x".repeat(200_000)),
            line(&report(8, 9)).replace(" 1 ", " 2 "), // there is no such facet
            line(&report(8, 9)).replace(" 1 ", " 0 "),
            line(&report(3, 5)),
            line(&report(2, 4)),
            format!("{LINE_MARK}1 no\twindow\n{PICTURE_MARK}1 00ff1\n{PICTURE_MARK}1 00fF\n"),
            line(&report(4, 6)).trim_end().to_owned(),
        ]
        .concat();
        let received = [(); 2].map(|()| Mutex::new(Received::default()));
        read_lines(text.as_bytes(), &received);
        let [first, received] = received.map(|received| received.into_inner().unwrap());
        assert_eq!(first.report, report(8, 9));
        assert_eq!(received.report, report(3, 5));
        assert_eq!((received.lines, received.picture), (["no window".to_owned()].into(), Some(vec![0, 255])));
    }
}

//! A process of facets: its start, its reports, its end, and the process that stands by to take its place.

use super::facet_commands::FacetStart;
use crate::cave::facet::{JOIN_LINE, PATTERN_MARK};
use crate::cave::facet_report::{Received, ReportReader};
use crate::cave::signals::Signals;
use crate::cave::web::KEY_VARIABLE;
use crate::failure::Failure;
use rustix::io::ioctl_fionbio;
use std::collections::VecDeque;
use std::ffi::OsString;
use std::io::Write;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tumble::net::sync::transport::FacetNumber;

/// Time without progress after which a facet that writes frames is no longer waited for. Below the
/// shutdown timeout of signals.
const WRITE_TIMEOUT: Duration = Duration::from_secs(8);
/// Time for the last report of a process that has ended.
const LAST_REPORT_TIMEOUT: Duration = Duration::from_millis(50);
/// Time without a report after which a facet no longer counts as preparing.
const REPORT_TIMEOUT: Duration = Duration::from_secs(10);
/// Time after the end of a process that stood by in which no other one is started.
const STANDBY_PAUSE: Duration = Duration::from_secs(60);
/// Interval at which a process is looked at that may be ending.
const ENDING_INTERVAL: Duration = Duration::from_millis(50);
/// Time for killed processes to end. On a busy machine their threads wait for a core.
const KILL_TIMEOUT: Duration = Duration::from_secs(1);
/// Exit codes of a facet that failed by itself: the command's own, and that of a panic.
const OWN_FAILURES: [i32; 3] = [1, 2, 101];
/// Signals of a process that crashes, as in a graphics driver: SIGILL, SIGTRAP, SIGABRT, SIGBUS, SIGFPE, SIGSEGV and
/// SIGSYS. All others come from outside.
const CRASHES: [i32; 7] = [4, 5, 6, 7, 8, 11, 31];

/// A facet of a process.
pub struct Member {
    pub slot: FacetNumber,
    pub name: String,
    /// Frames written by earlier processes of this facet.
    written_before: u64,
}

/// How processes are started.
#[derive(Clone)]
pub struct Starter {
    pub signals: Signals,
    /// Key of the links of browsers, if there are any.
    pub web_key: Option<String>,
}

/// A process that has been started, with its reports.
struct Started {
    child: Child,
    began: Instant,
    reports: ReportReader,
}

/// Facets of one process, and its successors.
pub struct FacetProcess {
    starter: Starter,
    /// At least one.
    pub members: Vec<Member>,
    /// Program and arguments of the first start.
    command: Vec<OsString>,
    /// The same of further starts.
    command_again: Vec<OsString>,
    /// The same of a process that stands by; `None` for none.
    command_of_standby: Option<Vec<OsString>>,
    pub child: Option<Child>,
    /// Earlier processes that are ending.
    ending: Vec<Child>,
    /// When it was last asked whether the process is ending.
    looked: Option<Instant>,
    /// Start of the process.
    began: Option<Instant>,
    reports: Option<ReportReader>,
    /// The process that stands by to take the place of this one.
    standby: Option<Started>,
    /// Whether it has been said that it is ready.
    standby_announced: bool,
    /// End of the last process that stood by and was not needed.
    standby_ended: Option<Instant>,
    pub ended: Option<Instant>,
    /// Ended for good: closed by the user, or failed too often.
    pub over: bool,
    /// Whether its last end was a failure.
    pub failed: bool,
    /// Whether it failed too often to be started again.
    pub given_up: bool,
    /// Description of its last end if that was an exit code of its own failure. Codes by which
    /// shells and ssh report a killed process do not count.
    pub fault: Option<String>,
    pub restarts: VecDeque<Instant>,
}

impl Starter {
    fn start(&self, words: &[OsString], members: usize) -> std::io::Result<Started> {
        // never empty: the program is this one, or the first word of a launch command
        let mut command = Command::new(&words[0]);
        // a group of its own, because Ctrl-C is for the launcher, which ends the run in order
        command.args(&words[1..]).stdin(Stdio::piped()).stdout(Stdio::piped()).process_group(0);
        command.envs(self.web_key.iter().map(|key| (KEY_VARIABLE, key)));
        let mut child = command.spawn()?;
        self.signals.started(child.id());
        let mut prepared = || {
            // a facet that does not read must not stop the run
            child.stdin.iter().try_for_each(|pipe| ioctl_fionbio(pipe, true))?;
            let pipe = child.stdout.take().ok_or(std::io::ErrorKind::BrokenPipe)?;
            ReportReader::start(pipe, members)
        };
        match prepared() {
            Ok(reports) => Ok(Started { child, began: Instant::now(), reports }),
            Err(e) => {
                self.kill(child);
                Err(e)
            }
        }
    }

    /// Kills a process. One that takes long to end is left to the system.
    fn kill(&self, mut child: Child) {
        let _ = child.kill();
        let until = Instant::now() + KILL_TIMEOUT;
        while matches!(child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(Duration::from_millis(2));
        }
        self.signals.ended(child.id());
    }
}

impl FacetProcess {
    /// Creates the process of facets, given by slot and name, before its start. `command` returns the
    /// command of a start; with `standby` another process stands by.
    pub fn new<'a>(
        starter: &Starter,
        members: impl Iterator<Item = (usize, &'a str)>,
        command: impl Fn(FacetStart) -> Vec<OsString>,
        standby: bool,
    ) -> FacetProcess {
        let member = |(slot, name): (usize, &str)| Member {
            slot: slot as FacetNumber,
            name: name.to_owned(),
            written_before: 0,
        };
        FacetProcess {
            starter: starter.clone(),
            members: members.map(member).collect(),
            command: command(FacetStart::First),
            command_again: command(FacetStart::Again),
            command_of_standby: standby.then(|| command(FacetStart::StandBy)),
            child: None,
            ending: Vec::new(),
            looked: None,
            began: None,
            reports: None,
            standby: None,
            standby_announced: false,
            standby_ended: None,
            ended: None,
            over: false,
            failed: false,
            given_up: false,
            fault: None,
            restarts: VecDeque::new(),
        }
    }

    /// Has the process that stands by join, or starts another one. It shows a calibration pattern, if there
    /// is one.
    pub fn spawn(&mut self, pattern: Option<&str>) -> Result<(), Failure> {
        let count = self.members.len();
        let standby = self.standby.take().and_then(|standby| self.joined(standby));
        let words = if self.restarts.is_empty() { &self.command } else { &self.command_again };
        let started = standby
            .map_or_else(|| self.starter.start(words, count), Ok)
            .map_err(|e| Failure::run(&format!("starting {}", self.title()), e))?;
        let written: Vec<u64> = (0..count).map(|k| self.written(k)).collect();
        self.members.iter_mut().zip(written).for_each(|(member, written)| member.written_before = written);
        (self.child, self.began, self.reports) = (Some(started.child), Some(started.began), Some(started.reports));
        (self.ended, self.fault) = (None, None);
        pattern.into_iter().for_each(|name| self.tell_pattern(name));
        Ok(())
    }

    /// Has a process that stood by join. Returns `None` if it has ended.
    fn joined(&self, mut standby: Started) -> Option<Started> {
        let runs = matches!(standby.child.try_wait(), Ok(None));
        let line = format!("{JOIN_LINE}\n");
        if runs && standby.child.stdin.as_mut().is_some_and(|pipe| pipe.write_all(line.as_bytes()).is_ok()) {
            return Some(standby);
        }
        self.starter.kill(standby.child);
        None
    }

    /// Returns whether a process is to stand by for this one, and none does. One that has ended is not
    /// replaced at once.
    pub fn lacks_standby(&mut self) -> bool {
        if self.over {
            self.end_standby();
        }
        if self.standby.as_mut().is_some_and(|standby| !matches!(standby.child.try_wait(), Ok(None))) {
            self.end_standby();
            self.standby_ended = Some(Instant::now());
        }
        let paused = self.standby_ended.is_some_and(|at| at.elapsed() < STANDBY_PAUSE);
        self.command_of_standby.is_some() && self.child.is_some() && self.standby.is_none() && !paused
    }

    /// Starts the process that stands by.
    pub fn start_standby(&mut self) {
        let Some(words) = &self.command_of_standby else { return };
        match self.starter.start(words, self.members.len()) {
            Ok(started) => (self.standby, self.standby_announced) = (Some(started), false),
            Err(e) => {
                self.standby_ended = Some(Instant::now());
                eprint!("{}", Failure::run(&format!("starting {} to stand by", self.title()), e).report());
            }
        }
    }

    /// Kills the process that stands by, and does not wait for its end.
    pub fn kill_standby(&mut self) {
        self.standby.iter_mut().for_each(|standby| _ = standby.child.kill());
    }

    /// Ends the process that stands by, which shows and writes nothing.
    pub fn end_standby(&mut self) {
        self.standby.take().into_iter().for_each(|standby| self.starter.kill(standby.child));
    }

    /// Ends all its processes at once.
    pub fn kill(&mut self) {
        self.end_standby();
        self.child.take().into_iter().chain(self.ending.drain(..)).for_each(|child| self.starter.kill(child));
    }

    /// Writes a line into the pipe to the facet. A full pipe takes none.
    pub fn tell_pattern(&mut self, name: &str) {
        let pipe = self.child.as_mut().and_then(|child| child.stdin.as_mut());
        // a facet that has ended shows nothing
        pipe.into_iter().for_each(|pipe| _ = pipe.write_all(format!("{PATTERN_MARK}{name}\n").as_bytes()));
    }

    pub fn title(&self) -> String {
        title(&self.members.iter().map(|member| member.name.as_str()).collect::<Vec<_>>())
    }

    pub fn names(&self) -> String {
        self.members.iter().map(|member| member.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    /// Returns the reports of the process, if it has been started.
    pub fn reports(&self) -> Option<&ReportReader> {
        self.reports.as_ref()
    }

    pub fn received_of(&self, member: usize) -> Received {
        self.reports.as_ref().map_or_else(Received::default, |reports| reports.received(member))
    }

    pub fn received(&self) -> impl Iterator<Item = Received> {
        (0..self.members.len()).map(|k| self.received_of(k))
    }

    /// Returns the number of frames of a facet that its processes have written.
    pub fn written(&self, member: usize) -> u64 {
        self.members[member].written_before + self.received_of(member).report.written
    }

    /// Returns whether a facet prepares to join.
    pub fn is_preparing(&self) -> bool {
        self.child.is_some() && self.received().any(|received| prepares(&received, self.began))
    }

    /// Returns whether the process that stands by still prepares.
    pub fn standby_is_preparing(&self) -> bool {
        self.standby.as_ref().is_some_and(|standby| prepares(&standby.reports.received(0), Some(standby.began)))
    }

    /// Returns whether the process that stands by has become ready since the last call that said so.
    pub fn standby_is_newly_ready(&mut self) -> bool {
        let Some(standby) = self.standby.as_ref().filter(|_| !self.standby_announced) else { return false };
        let received = standby.reports.received(0);
        self.standby_announced = received.heard.is_some() && !received.report.preparing;
        self.standby_announced
    }

    /// Returns whether the process still writes frames and makes progress.
    pub fn is_writing(&self) -> bool {
        let writes = |Received { report, proceeded, .. }: Received| {
            report.waiting > 0 && proceeded.is_some_and(|at| at.elapsed() < WRITE_TIMEOUT)
        };
        self.child.is_some() && self.received().any(writes)
    }

    /// Returns how the process ended, if it did since the last poll. A process that the system is about to end
    /// counts: on a busy machine the threads of a killed one wait seconds for a core to end on.
    pub fn poll_exit(&mut self) -> Option<ExitStatus> {
        let signals = &self.starter.signals;
        self.ending.retain_mut(|child| {
            let ends = matches!(child.try_wait(), Ok(None));
            if !ends {
                signals.ended(child.id());
            }
            ends
        });
        let child = self.child.as_mut()?;
        let status = match child.try_wait().ok().flatten() {
            Some(status) => {
                self.starter.signals.ended(child.id());
                self.child = None;
                // only another holder of the pipe can make this wait
                self.reports.iter().for_each(|reports| reports.wait_for_end(LAST_REPORT_TIMEOUT));
                status
            }
            None => {
                if self.looked.is_some_and(|at| at.elapsed() < ENDING_INTERVAL) {
                    return None;
                }
                self.looked = Some(Instant::now());
                let status = ending_status(child.id())?;
                self.ending.extend(self.child.take());
                status
            }
        };
        self.failed = !status.success();
        self.fault = failed_by_itself(status).then(|| describe_exit(status));
        Some(status)
    }
}

/// Returns how a process ends that runs no code of its own any more, but cannot be waited for yet: SIGKILL is
/// pending for its first thread, or this thread has ended and others still do.
fn ending_status(pid: u32) -> Option<ExitStatus> {
    let about = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    status_of(&about)
}

/// Reads the content of `/proc/PID/stat` (proc(5)): fields 3, 31 and 52 are the state, the pending signals and the
/// status as `wait` returns it. The name in parentheses may contain anything.
fn status_of(about: &str) -> Option<ExitStatus> {
    const SIGKILL: i32 = 9;
    let fields: Vec<&str> = about.rsplit_once(')')?.1.split_whitespace().collect();
    let number = |field: usize| fields.get(field - 3)?.parse::<u64>().ok();
    if fields.first() == Some(&"Z") {
        return Some(ExitStatus::from_raw(number(52)? as i32));
    }
    (number(31)? & 1 << (SIGKILL - 1) != 0).then(|| ExitStatus::from_raw(SIGKILL))
}

/// Returns whether a facet that was started at a time prepares to join.
fn prepares(Received { report, heard, .. }: &Received, began: Option<Instant>) -> bool {
    let recent = heard.or(began).is_some_and(|at| at.elapsed() < REPORT_TIMEOUT);
    recent && (heard.is_none() || report.preparing)
}

/// Returns how the facets of a process are called.
pub fn title(names: &[&str]) -> String {
    format!("{} {}", if names.len() > 1 { "facets" } else { "facet" }, names.join(", "))
}

/// Returns whether a process failed by itself, and was not ended by others.
fn failed_by_itself(status: ExitStatus) -> bool {
    let is_in = |numbers: &[i32], number: Option<i32>| number.is_some_and(|number| numbers.contains(&number));
    is_in(&OWN_FAILURES, status.code()) || is_in(&CRASHES, status.signal())
}

pub fn describe_exit(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => format!("killed by signal {signal}"),
        _ => "of unknown cause".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_is_ending_has_a_status() {
        let about = |state: &str, pending: u64, status: i32| {
            let middle = ["0"; 27].join(" ");
            format!("42 (a name) with) {state} {middle} {pending} {} {status}\n", ["0"; 20].join(" "))
        };
        let of = |text: &str| status_of(text).map(|status| (status.code(), status.signal()));
        assert_eq!(of(&about("S", 0, 0)), None);
        assert_eq!(of(&about("R", 1 << 14, 0)), None, "SIGTERM is no end");
        assert_eq!(of(&about("R", 1 << 8, 0)), Some((None, Some(9))));
        assert_eq!(of(&about("Z", 0, 9)), Some((None, Some(9))));
        assert_eq!(of(&about("Z", 0, 2 << 8)), Some((Some(2), None)));
        assert_eq!((of("42 (cut) S 0 0"), of("")), (None, None));
        // the fields are where the system has them: a child that was not waited for
        let mut child = Command::new("sh").args(["-c", "exit 3"]).spawn().unwrap();
        let until = Instant::now() + Duration::from_secs(60);
        let mut found = None;
        while found.is_none() && Instant::now() < until {
            found = ending_status(child.id());
        }
        assert_eq!(found, Some(child.wait().unwrap()));
    }
}

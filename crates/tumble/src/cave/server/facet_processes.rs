//! The processes of a run's facets. Those of this machine, and of nodes with a launch command, are
//! started, monitored and ended. For all others the command line is printed.

use super::facet_commands::{
    address_for, facet_args, launch, processes, scene_args, shell_quoted, slots, web_addresses, web_facets,
};
use crate::cave::address::ServerAddress;
use crate::cave::args::{CaveOptions, ServeOptions};
use crate::cave::facet::PATTERN_MARK;
use crate::cave::facet_report::{FacetReport, Received, ReportReader};
use crate::cave::signals::Signals;
use crate::cave::web::KEY_VARIABLE;
use crate::failure::Failure;
use rustix::io::ioctl_fionbio;
use std::collections::{BTreeMap, VecDeque};
use std::ffi::OsString;
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tumble::net::sync::transport::FacetNumber;
use tumble::scene::cave::Cave;

/// Time for facets to end by themselves after END, to write their last pictures. Together with the
/// next it is well below the shutdown timeout of signals.
const EXIT_TIMEOUT: Duration = Duration::from_secs(3);
/// Time without progress after which a facet that writes frames is no longer waited for. Below the
/// shutdown timeout of signals.
const WRITE_TIMEOUT: Duration = Duration::from_secs(8);
/// Time for the last report of a process that has ended.
const LAST_REPORT_TIMEOUT: Duration = Duration::from_millis(50);
/// The same as the exit timeout after their pipe was closed, and for facets that were still
/// starting.
const FINAL_EXIT_TIMEOUT: Duration = Duration::from_secs(1);
/// Time without a report after which a facet no longer counts as preparing.
const REPORT_TIMEOUT: Duration = Duration::from_secs(10);
/// Exit codes of a facet that failed by itself: the command's own, and that of a panic.
const OWN_FAILURES: [i32; 3] = [1, 2, 101];
/// Maximum number of restarts of a facet within the window.
const MAX_RESTARTS: usize = 5;
const RESTART_WINDOW: Duration = Duration::from_secs(60);
/// A facet that ends sooner after its restart is restarted with a delay.
const MIN_UPTIME: Duration = Duration::from_secs(5);
const RESTART_DELAY: Duration = Duration::from_secs(1);

/// The facets started by this process.
pub struct FacetProcesses {
    processes: Vec<FacetProcess>,
    restart: bool,
    quiet: bool,
    signals: Signals,
    /// Key of the links of browsers, if there are any.
    web_key: Option<String>,
    /// The calibration pattern that the facets show.
    pattern: Option<String>,
}

/// A facet of a process.
struct Member {
    slot: FacetNumber,
    name: String,
    /// Frames written by earlier processes of this facet.
    written_before: u64,
}

struct FacetProcess {
    /// At least one.
    members: Vec<Member>,
    /// Program and arguments of the first start.
    command: Vec<OsString>,
    /// The same of further starts.
    command_again: Vec<OsString>,
    child: Option<Child>,
    /// Start of the process.
    began: Option<Instant>,
    reports: Option<ReportReader>,
    ended: Option<Instant>,
    /// Ended for good: closed by the user, or failed too often.
    over: bool,
    /// Whether its last end was a failure.
    failed: bool,
    /// Whether it failed too often to be started again.
    given_up: bool,
    /// Description of its last end if that was an exit code of its own failure. Codes by which
    /// shells and ssh report a killed process do not count.
    fault: Option<String>,
    restarts: VecDeque<Instant>,
}

/// Result of polling the processes.
pub struct ProcessReport {
    /// Status of all processes.
    pub processes: ProcessStatus,
    /// Facets whose processes have ended since the last poll.
    pub ended: Vec<FacetNumber>,
}

/// Status of all processes together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessStatus {
    /// At least one is running, or none was started.
    Running,
    /// All have ended on request of their users.
    AllLeft,
    /// All have ended, at least one by a failure.
    AllFailed,
}

impl FacetProcesses {
    /// Starts the facets of this machine if there is a launcher, and prints how to start the
    /// others.
    pub fn start(
        serve: &ServeOptions,
        cave: &Cave,
        launcher: Option<&CaveOptions>,
        address: &ServerAddress,
        signals: &Signals,
    ) -> Result<FacetProcesses, Failure> {
        let web = launcher.map_or(Ok(Vec::new()), |launcher| web_facets(launcher, cave))?;
        let groups = processes(cave, launcher, &web);
        let addresses = |launcher| web_addresses(launcher, cave, &groups, &web);
        let web = launcher.map_or(Ok(BTreeMap::new()), addresses)?;
        let mut processes = FacetProcesses {
            processes: Vec::new(),
            restart: launcher.is_some_and(|l| l.restart),
            quiet: serve.quiet,
            signals: signals.clone(),
            web_key: launcher.and_then(|launcher| launcher.web.drawn_key.clone()),
            pattern: None,
        };
        let slots = slots(cave, launcher.is_some_and(|l| l.preview));
        for group in groups {
            let names: Vec<&str> = group.iter().map(|&k| slots[k].name.as_str()).collect();
            let members = || group.iter().map(|&k| (k, slots[k].name.as_str()));
            let title = title(&names);
            let remote =
                cave.facets.get(group[0]).and_then(|f| f.node).map(|n| &cave.nodes[n]).filter(|n| !n.is_local());
            let server_address = remote.map_or_else(|| Some(address.clone()), |node| address_for(node, address));
            match (launcher, remote) {
                (Some(_), Some(node)) if server_address.is_none() && !node.launch.is_empty() => {
                    let why = format!(
                        "{} is unreachable, so this machine's address as its facets see it is unknown; give it with --listen ADDR:PORT",
                        node.address
                    );
                    return Err(Failure::input(format!("node {}: {why}", node.name)));
                }
                (Some(launcher), None) => {
                    let program = std::env::current_exe().map_err(|e| Failure::run("starting a facet", e))?;
                    let command = |again| {
                        let words = facet_args(launcher, &names, address, web.get(names[0]), again)
                            .into_iter()
                            .map(OsString::from);
                        std::iter::once(program.clone().into_os_string()).chain(words).collect()
                    };
                    processes.processes.push(FacetProcess::new(members(), command));
                }
                (Some(launcher), Some(node)) if !node.launch.is_empty() => {
                    let server = server_address.as_ref().unwrap_or(address);
                    let words =
                        |again| launch(node, &names.join(","), &facet_args(launcher, &names, server, None, again));
                    processes.report(&format!(
                        "{title}: starting it on {}: {}",
                        node.name,
                        words(false).iter().map(|w| shell_quoted(w)).collect::<Vec<_>>().join(" ")
                    ));
                    let command = |again| words(again).into_iter().map(OsString::from).collect();
                    processes.processes.push(FacetProcess::new(members(), command));
                }
                (_, node) => {
                    let server = match (&server_address, address) {
                        (Some(ServerAddress::Udp(at)), _) if node.is_some() => format!(" --server {at}"),
                        (None, ServerAddress::Udp(at)) => {
                            format!(" --server ADDR:{} with this machine's address as that one sees it", at.port())
                        }
                        _ => String::new(),
                    };
                    let place = node.map_or("here".to_owned(), |n| format!("on {} ({})", n.name, n.address));
                    let what = scene_args(serve).iter().map(|a| shell_quoted(a)).collect::<Vec<_>>().join(" ");
                    processes.report(&format!(
                        "{title}: start it {place}: tumble facet {what} --facet {}{server}",
                        shell_quoted(&names.join(","))
                    ));
                }
            }
        }
        for k in 0..processes.processes.len() {
            processes.spawn(k)?;
        }
        Ok(processes)
    }

    /// Polls the processes and restarts them if requested. While `joining`, before the first frame,
    /// an end is an error.
    pub fn watch(&mut self, joining: bool) -> Result<ProcessReport, Failure> {
        let mut ended = Vec::new();
        for k in 0..self.processes.len() {
            let process = &mut self.processes[k];
            if let Some(status) = process.poll_exit(&self.signals) {
                process.ended = Some(Instant::now());
                ended.extend(process.members.iter().map(|member| member.slot));
                process.over = status.success() || !self.restart;
                let title = process.title();
                if joining {
                    return Err(Failure::run(
                        &title,
                        format!("ended before the start ({}); its output is above", describe_exit(status)),
                    ));
                }
                self.report(&if status.success() {
                    format!("{title} has left")
                } else {
                    format!("{title} ended ({})", describe_exit(status))
                });
            }
            let process = &mut self.processes[k];
            process.restarts.retain(|at| at.elapsed() < RESTART_WINDOW);
            let ended_early =
                |ended: Instant| process.restarts.back().is_some_and(|began| ended.duration_since(*began) < MIN_UPTIME);
            let due = process.ended.is_some_and(|at| !ended_early(at) || at.elapsed() >= RESTART_DELAY)
                && process.child.is_none()
                && !process.over;
            if due {
                if process.restarts.len() >= MAX_RESTARTS {
                    (process.over, process.given_up) = (true, true);
                    let text = format!(
                        "{} ended {MAX_RESTARTS} times within a minute and is not started again",
                        process.title()
                    );
                    self.report(&text);
                    continue;
                }
                process.restarts.push_back(Instant::now());
                // the other facets continue, and this one is tried again
                if let Err(failure) = self.spawn(k) {
                    eprint!("{}", failure.report());
                    (self.processes[k].ended, self.processes[k].failed) = (Some(Instant::now()), true);
                }
            }
        }
        let all_over = !self.processes.is_empty() && self.processes.iter().all(|m| m.over && m.child.is_none());
        let processes = match all_over {
            false => ProcessStatus::Running,
            true if self.processes.iter().any(|m| m.failed) => ProcessStatus::AllFailed,
            true => ProcessStatus::AllLeft,
        };
        Ok(ProcessReport { processes, ended })
    }

    /// Returns the names of the facets that prepare to join: those that report it, and those that
    /// were started a moment ago and have not reported yet.
    pub fn preparing(&self) -> Vec<&str> {
        let members = self.processes.iter().filter(|process| process.is_preparing()).flat_map(|p| &p.members);
        members.map(|member| member.name.as_str()).collect()
    }

    /// Waits for the facets after END, and kills those that do not end. A facet that writes frames
    /// is waited for as long as it makes progress. `started`: they had joined and can have received
    /// END.
    ///
    /// # Errors
    /// A facet ended by a failure of its own and was not restarted, failed too often, or was killed
    /// before it had written all frames that it had shown.
    pub fn end(&mut self, started: bool) -> Result<(), Failure> {
        self.wait(if started { EXIT_TIMEOUT } else { FINAL_EXIT_TIMEOUT / 2 });
        let mut faults: Vec<String> =
            self.processes.iter().filter_map(|m| Some(format!("{} ({})", m.names(), m.fault()?))).collect();
        // a facet that missed END finds its pipe closed
        self.processes.iter_mut().filter_map(|m| m.child.as_mut()).for_each(|child| drop(child.stdin.take()));
        self.wait(FINAL_EXIT_TIMEOUT);
        // all are killed before any is waited for: graphics drivers take time to release a process
        for process in &mut self.processes {
            let waiting: u64 = process.received().map(|received| received.report.waiting).sum();
            let (title, names) = (process.title(), process.names());
            let Some(child) = &mut process.child else { continue };
            if let Ok(None) = child.try_wait() {
                eprintln!("{title}: does not end and was killed");
                if waiting > 0 {
                    faults.push(format!("{names} ({waiting} shown frames are not written)"));
                }
            }
            let _ = child.kill();
        }
        for mut child in self.processes.iter_mut().filter_map(|m| m.child.take()) {
            let _ = child.wait();
            self.signals.ended(child.id());
        }
        match faults.is_empty() {
            true => Ok(()),
            false => Err(Failure::run(
                "the facets",
                format!("{} ended by a failure; its output is above", faults.join(", ")),
            )),
        }
    }

    /// Waits at most `most` until all have ended, and longer for those that write.
    fn wait(&mut self, most: Duration) {
        let until = Instant::now() + most;
        loop {
            self.processes.iter_mut().for_each(|m| _ = m.poll_exit(&self.signals));
            let writing = self.processes.iter().any(FacetProcess::is_writing);
            if self.processes.iter().all(|m| m.child.is_none()) || Instant::now() >= until && !writing {
                return;
            }
            if writing {
                self.signals.postpone();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Returns the messages and the small pictures of the facets since the last call.
    pub fn messages(&self) -> Vec<(FacetNumber, VecDeque<String>, Option<Vec<u8>>)> {
        let of = |(process, k, member): (&FacetProcess, usize, &Member)| {
            let (lines, picture) = process.reports.as_ref()?.take_messages(k);
            (!lines.is_empty() || picture.is_some()).then_some((member.slot, lines, picture))
        };
        self.members().filter_map(of).collect()
    }

    /// Returns all facets, with their processes and their numbers in these.
    fn members(&self) -> impl Iterator<Item = (&FacetProcess, usize, &Member)> {
        self.processes.iter().flat_map(|process| process.members.iter().enumerate().map(move |(k, m)| (process, k, m)))
    }

    /// Has all facets show a calibration pattern, or `off` for the scene. A facet that is started again
    /// shows it too.
    pub fn show_pattern(&mut self, name: &str) {
        self.pattern = Some(name.to_owned()).filter(|name| name != "off");
        self.processes.iter_mut().for_each(|process| process.tell_pattern(name));
    }

    /// Returns the calibration pattern that the facets show.
    pub fn pattern(&self) -> Option<&str> {
        self.pattern.as_deref()
    }

    /// Returns whether this process has started a facet.
    pub fn any(&self) -> bool {
        !self.processes.is_empty()
    }

    /// Returns the last report of the facet in a slot; an empty one if this process did not start it.
    pub fn report_of(&self, slot: FacetNumber) -> FacetReport {
        let found = self.members().find(|(_, _, member)| member.slot == slot);
        found.map_or_else(FacetReport::default, |(process, k, _)| process.received_of(k).report)
    }

    /// Returns by slot how many frames have been written; `None` for a facet that this process did
    /// not start.
    pub fn written(&self, slots: usize) -> Vec<Option<u64>> {
        let mut written = vec![None; slots];
        for (process, k, member) in self.members() {
            if let Some(entry) = written.get_mut(member.slot as usize) {
                *entry = Some(process.written(k));
            }
        }
        written
    }

    fn spawn(&mut self, k: usize) -> Result<(), Failure> {
        let process = &mut self.processes[k];
        let words = if process.restarts.is_empty() { &process.command } else { &process.command_again };
        // never empty: the program is this one, or the first word of a launch command
        let mut command = Command::new(&words[0]);
        // a group of its own, because Ctrl-C is for the launcher, which ends the run in order
        command.args(&words[1..]).stdin(Stdio::piped()).stdout(Stdio::piped()).process_group(0);
        command.envs(self.web_key.iter().map(|key| (KEY_VARIABLE, key)));
        let title = process.title();
        let failed = |e: std::io::Error| Failure::run(&format!("starting {title}"), e);
        let mut child = command.spawn().map_err(failed)?;
        self.signals.started(child.id());
        // a facet that does not read must not stop the run
        child.stdin.iter().try_for_each(|pipe| ioctl_fionbio(pipe, true)).map_err(|e| failed(e.into()))?;
        let count = process.members.len();
        let reports = child.stdout.take().map(|pipe| ReportReader::start(pipe, count)).transpose();
        let written: Vec<u64> = (0..count).map(|k| process.written(k)).collect();
        process.members.iter_mut().zip(written).for_each(|(member, written)| member.written_before = written);
        (process.child, process.began, process.ended, process.fault) = (Some(child), Some(Instant::now()), None, None);
        process.reports = reports.map_err(failed)?;
        self.pattern.iter().for_each(|name| process.tell_pattern(name));
        Ok(())
    }

    fn report(&self, what: &str) {
        if !self.quiet {
            eprintln!("{what}");
        }
    }
}

impl Drop for FacetProcesses {
    fn drop(&mut self) {
        for child in self.processes.iter_mut().filter_map(|m| m.child.as_mut()) {
            let _ = child.kill();
            let _ = child.wait();
            self.signals.ended(child.id());
        }
    }
}

impl FacetProcess {
    /// Creates the process of facets, given by slot and name, before its start. `command` returns the
    /// command of the first start, or of further ones.
    fn new<'a>(
        members: impl Iterator<Item = (usize, &'a str)>,
        command: impl Fn(bool) -> Vec<OsString>,
    ) -> FacetProcess {
        let member = |(slot, name): (usize, &str)| Member {
            slot: slot as FacetNumber,
            name: name.to_owned(),
            written_before: 0,
        };
        FacetProcess {
            members: members.map(member).collect(),
            command: command(false),
            command_again: command(true),
            child: None,
            began: None,
            reports: None,
            ended: None,
            over: false,
            failed: false,
            given_up: false,
            fault: None,
            restarts: VecDeque::new(),
        }
    }

    /// Writes a line into the pipe to the facet. A full pipe takes none.
    fn tell_pattern(&mut self, name: &str) {
        let pipe = self.child.as_mut().and_then(|child| child.stdin.as_mut());
        // a facet that has ended shows nothing
        pipe.into_iter().for_each(|pipe| _ = pipe.write_all(format!("{PATTERN_MARK}{name}\n").as_bytes()));
    }

    fn title(&self) -> String {
        title(&self.members.iter().map(|member| member.name.as_str()).collect::<Vec<_>>())
    }

    fn names(&self) -> String {
        self.members.iter().map(|member| member.name.as_str()).collect::<Vec<_>>().join(", ")
    }

    fn received_of(&self, member: usize) -> Received {
        self.reports.as_ref().map_or_else(Received::default, |reports| reports.received(member))
    }

    fn received(&self) -> impl Iterator<Item = Received> {
        (0..self.members.len()).map(|k| self.received_of(k))
    }

    /// Returns the number of frames of a facet that its processes have written.
    fn written(&self, member: usize) -> u64 {
        self.members[member].written_before + self.received_of(member).report.written
    }

    /// Returns whether a facet prepares to join.
    fn is_preparing(&self) -> bool {
        let prepares = |Received { report, heard, .. }: Received| {
            let recent = heard.or(self.began).is_some_and(|at| at.elapsed() < REPORT_TIMEOUT);
            recent && (heard.is_none() || report.preparing)
        };
        self.child.is_some() && self.received().any(prepares)
    }

    /// Returns whether the process still writes frames and makes progress.
    fn is_writing(&self) -> bool {
        let writes = |Received { report, proceeded, .. }: Received| {
            report.waiting > 0 && proceeded.is_some_and(|at| at.elapsed() < WRITE_TIMEOUT)
        };
        self.child.is_some() && self.received().any(writes)
    }

    /// Returns why the run fails by this facet, if it does.
    fn fault(&self) -> Option<String> {
        let given_up = || self.given_up.then(|| format!("given up after {MAX_RESTARTS} restarts within a minute"));
        self.fault.clone().or_else(given_up)
    }

    /// Returns how the process ended, if it did since the last poll.
    fn poll_exit(&mut self, signals: &Signals) -> Option<ExitStatus> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        signals.ended(child.id());
        self.child = None;
        // only another holder of the pipe can make this wait
        self.reports.iter().for_each(|reports| reports.wait_for_end(LAST_REPORT_TIMEOUT));
        self.failed = !status.success();
        self.fault = status.code().filter(|code| OWN_FAILURES.contains(code)).map(|_| describe_exit(status));
        Some(status)
    }
}

/// Returns how the facets of a process are called.
fn title(names: &[&str]) -> String {
    format!("{} {}", if names.len() > 1 { "facets" } else { "facet" }, names.join(", "))
}

fn describe_exit(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => format!("killed by signal {signal}"),
        _ => "of unknown cause".into(),
    }
}

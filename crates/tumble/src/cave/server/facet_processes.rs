//! The processes of a run's facets. Those of this machine, and of nodes with a launch command, are
//! started, monitored and ended. For all others the command line is printed.

use super::facet_commands::{
    FacetStart, address_for, facet_args, launch, processes, scene_args, shell_quoted, slots, web_addresses, web_facets,
};
use super::facet_process::{FacetProcess, Member, Starter, describe_exit, title};
use crate::cave::address::ServerAddress;
use crate::cave::args::{CaveOptions, ServeOptions};
use crate::cave::facet_report::FacetReport;
use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::collections::{BTreeMap, VecDeque};
use std::ffi::OsString;
use std::time::{Duration, Instant};
use tumble::net::sync::transport::FacetNumber;
use tumble::scene::cave::Cave;

/// Time for facets to end by themselves after END, to write their last pictures. Together with the
/// next it is well below the shutdown timeout of signals.
const EXIT_TIMEOUT: Duration = Duration::from_secs(3);
/// The same as the exit timeout after their pipe was closed, and for facets that were still
/// starting.
const FINAL_EXIT_TIMEOUT: Duration = Duration::from_secs(1);
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
    /// The calibration pattern that the facets show.
    pattern: Option<String>,
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
            pattern: None,
        };
        let starter =
            Starter { signals: signals.clone(), web_key: launcher.and_then(|launcher| launcher.web.drawn_key.clone()) };
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
                    let browsers = web.get(names[0]);
                    let command = |start| {
                        let words =
                            facet_args(launcher, &names, address, browsers, start).into_iter().map(OsString::from);
                        std::iter::once(program.clone().into_os_string()).chain(words).collect()
                    };
                    // a second process cannot listen at the ports of the first
                    let standby = launcher.stand_by && browsers.is_none();
                    processes.processes.push(FacetProcess::new(&starter, members(), command, standby));
                }
                (Some(launcher), Some(node)) if !node.launch.is_empty() => {
                    let server = server_address.as_ref().unwrap_or(address);
                    let words =
                        |start| launch(node, &names.join(","), &facet_args(launcher, &names, server, None, start));
                    processes.report(&format!(
                        "{title}: starting it on {}: {}",
                        node.name,
                        words(FacetStart::First).iter().map(|w| shell_quoted(w)).collect::<Vec<_>>().join(" ")
                    ));
                    let command = |start| words(start).into_iter().map(OsString::from).collect();
                    processes.processes.push(FacetProcess::new(&starter, members(), command, launcher.stand_by));
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
            if let Some(status) = process.poll_exit() {
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
        if !joining {
            self.keep_standbys();
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
        self.processes.iter_mut().for_each(FacetProcess::kill_standby);
        self.wait(if started { EXIT_TIMEOUT } else { FINAL_EXIT_TIMEOUT / 2 });
        let mut faults: Vec<String> =
            self.processes.iter().filter_map(|m| Some(format!("{} ({})", m.names(), fault(m)?))).collect();
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
        self.processes.iter_mut().for_each(FacetProcess::kill);
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
            self.processes.iter_mut().for_each(|m| _ = m.poll_exit());
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
            let (lines, picture) = process.reports()?.take_messages(k);
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
        self.processes[k].spawn(self.pattern.as_deref())
    }

    /// Starts a process that stands by, if one is missing and nothing else prepares: they would take each
    /// other's time.
    fn keep_standbys(&mut self) {
        let ready =
            self.processes.iter_mut().filter_map(|process| process.standby_is_newly_ready().then(|| process.title()));
        ready.collect::<Vec<_>>().iter().for_each(|title| self.report(&format!("{title}: another process stands by")));
        let lacking: Vec<usize> = (0..self.processes.len()).filter(|&k| self.processes[k].lacks_standby()).collect();
        let busy = |process: &FacetProcess| process.is_preparing() || process.standby_is_preparing();
        if let Some(&k) = lacking.first()
            && !self.processes.iter().any(busy)
        {
            self.processes[k].start_standby();
        }
    }

    fn report(&self, what: &str) {
        if !self.quiet {
            eprintln!("{what}");
        }
    }
}

impl Drop for FacetProcesses {
    fn drop(&mut self) {
        self.processes.iter_mut().for_each(FacetProcess::kill);
    }
}

/// Returns why the run fails by a process, if it does.
fn fault(process: &FacetProcess) -> Option<String> {
    let given_up = || process.given_up.then(|| format!("given up after {MAX_RESTARTS} restarts within a minute"));
    process.fault.clone().or_else(given_up)
}

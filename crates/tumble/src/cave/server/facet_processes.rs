//! The processes of a run's facets. Those of this machine, and of nodes with a launch command, are
//! started, monitored and ended. For all others the command line is printed.

use crate::cave::address::{ServerAddress, address_towards};
use crate::cave::args::{CaveOptions, ServeOptions, TransportKind};
use crate::cave::run_setup::PREVIEW;
use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::collections::VecDeque;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tumble::net::sync::FacetSlot;
use tumble::net::sync::transport::FacetNumber;
use tumble::scene::cave::{Cave, Node};

/// Time for facets to end by themselves after END, to write their last pictures. Together with the
/// next it is well below the shutdown timeout of signals.
const EXIT_TIMEOUT: Duration = Duration::from_secs(3);
/// The same after their pipe was closed, and for facets that were still starting.
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
}

struct FacetProcess {
    slot: FacetNumber,
    name: String,
    /// Program and arguments.
    command: Vec<OsString>,
    child: Option<Child>,
    ended: Option<Instant>,
    /// Ended for good: closed by the user, or failed too often.
    over: bool,
    /// Whether its last end was a failure.
    failed: bool,
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

/// Returns the facet slots of a run: all facets, or the preview alone.
pub fn slots(cave: &Cave, preview: bool) -> Vec<FacetSlot> {
    if preview {
        return vec![FacetSlot { name: PREVIEW.into(), critical: true }];
    }
    cave.facets.iter().map(|f| FacetSlot { name: f.name.clone(), critical: f.critical }).collect()
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
        let mut processes = FacetProcesses {
            processes: Vec::new(),
            restart: launcher.is_some_and(|l| l.restart),
            quiet: serve.quiet,
            signals: signals.clone(),
        };
        for (k, slot) in slots(cave, launcher.is_some_and(|l| l.preview)).into_iter().enumerate() {
            let remote = cave.facets.get(k).and_then(|f| f.node).map(|n| &cave.nodes[n]).filter(|n| !n.is_local());
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
                    let words = parent_watch(launcher, &slot.name, address).into_iter().map(OsString::from);
                    processes.processes.push(FacetProcess::new(
                        k,
                        &slot.name,
                        std::iter::once(program.into_os_string()).chain(words).collect(),
                    ));
                }
                (Some(launcher), Some(node)) if !node.launch.is_empty() => {
                    let words = launch(
                        node,
                        &slot.name,
                        &parent_watch(launcher, &slot.name, server_address.as_ref().unwrap_or(address)),
                    );
                    processes.report(&format!(
                        "facet {}: starting it on {}: {}",
                        slot.name,
                        node.name,
                        words.iter().map(|w| shell_quoted(w)).collect::<Vec<_>>().join(" ")
                    ));
                    processes.processes.push(FacetProcess::new(
                        k,
                        &slot.name,
                        words.into_iter().map(OsString::from).collect(),
                    ));
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
                        "facet {}: start it {place}: tumble facet {what} --facet {}{server}",
                        slot.name,
                        shell_quoted(&slot.name)
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
                ended.push(process.slot);
                process.over = status.success() || !self.restart;
                let title = format!("facet {}", process.name);
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
                    process.over = true;
                    let text = format!(
                        "facet {} ended {MAX_RESTARTS} times within a minute and is not started again",
                        process.name
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

    /// Waits for the facets after END, and kills those that do not end. `started`: they had joined
    /// and can have received END.
    ///
    /// # Errors
    /// A facet ended by a failure of its own and was not restarted.
    pub fn end(&mut self, started: bool) -> Result<(), Failure> {
        self.wait(if started { EXIT_TIMEOUT } else { FINAL_EXIT_TIMEOUT / 2 });
        let faults: Vec<String> =
            self.processes.iter().filter_map(|m| Some(format!("{} ({})", m.name, m.fault.as_ref()?))).collect();
        // a facet that missed END finds its pipe closed
        self.processes.iter_mut().filter_map(|m| m.child.as_mut()).for_each(|child| drop(child.stdin.take()));
        self.wait(FINAL_EXIT_TIMEOUT);
        // all are killed before any is waited for: graphics drivers take time to release a process
        for process in &mut self.processes {
            let Some(child) = &mut process.child else { continue };
            if let Ok(None) = child.try_wait() {
                eprintln!("facet {}: does not end and was killed", process.name);
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

    /// Waits at most `max` until all have ended.
    fn wait(&mut self, most: Duration) {
        let until = Instant::now() + most;
        while Instant::now() < until {
            self.processes.iter_mut().for_each(|m| _ = m.poll_exit(&self.signals));
            if self.processes.iter().all(|m| m.child.is_none()) {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    fn spawn(&mut self, k: usize) -> Result<(), Failure> {
        let process = &mut self.processes[k];
        // never empty: the program is this one, or the first word of a launch command
        let mut command = Command::new(&process.command[0]);
        // a group of its own, because Ctrl-C is for the launcher, which ends the run in order
        command.args(&process.command[1..]).stdin(Stdio::piped()).stdout(Stdio::null()).process_group(0);
        let child = command.spawn().map_err(|e| Failure::run(&format!("starting facet {}", process.name), e))?;
        self.signals.started(child.id());
        (process.child, process.ended, process.fault) = (Some(child), None, None);
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
    fn new(slot: usize, name: &str, command: Vec<OsString>) -> FacetProcess {
        FacetProcess {
            slot: slot as FacetNumber,
            name: name.to_owned(),
            command,
            child: None,
            ended: None,
            over: false,
            failed: false,
            fault: None,
            restarts: VecDeque::new(),
        }
    }

    /// Returns how the process ended, if it did since the last poll.
    fn poll_exit(&mut self, signals: &Signals) -> Option<ExitStatus> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        signals.ended(child.id());
        self.child = None;
        self.failed = !status.success();
        self.fault = status.code().filter(|code| matches!(code, 1 | 2)).map(|_| describe_exit(status));
        Some(status)
    }
}

/// Returns the server's address as a node reaches it; `None` if there is no route to the node.
fn address_for(node: &Node, address: &ServerAddress) -> Option<ServerAddress> {
    match *address {
        ServerAddress::Udp(at) if at.ip().is_unspecified() => {
            address_towards(&node.address, at.port()).map(|ip| ServerAddress::Udp((ip, at.port()).into()))
        }
        _ => Some(address.clone()),
    }
}

/// Returns the launch command of a node with all placeholders filled in. Its stdin is a pipe that
/// ends with the launcher, and the facet ends with the pipe.
fn launch(node: &Node, facet: &str, arguments: &[String]) -> Vec<String> {
    let line = arguments.iter().map(|a| shell_quoted(a)).collect::<Vec<_>>().join(" ");
    let fill = |word: &String| match word.as_str() {
        "{arguments}" => arguments.to_vec(),
        _ => vec![
            word.replace("{address}", &node.address)
                .replace("{node}", &node.name)
                .replace("{facet}", facet)
                .replace("{line}", &line),
        ],
    };
    node.launch.iter().flat_map(fill).collect()
}

/// Returns the arguments of a facet's process.
fn parent_watch(launcher: &CaveOptions, name: &str, address: &ServerAddress) -> Vec<String> {
    let mut args = vec!["facet".to_owned()];
    args.extend(scene_args(&launcher.serve));
    if name == PREVIEW && launcher.preview {
        args.push("--preview".into())
    } else {
        args.extend(["--facet".into(), name.to_owned()])
    }
    args.extend(match address {
        ServerAddress::Memory(run) => ["--run".into(), run.clone()],
        ServerAddress::Udp(server) => ["--server".into(), local(*server).to_string()],
    });
    let draw = &launcher.draw;
    let folder = |option: &str, path: &Option<std::path::PathBuf>| {
        path.iter().flat_map(|p| [option.to_owned(), p.display().to_string()]).collect::<Vec<_>>()
    };
    args.extend(folder("--frames-dir", &draw.frames_dir));
    args.extend(folder("--log-dir", &draw.log_dir));
    args.extend(draw.quality.iter().flat_map(|q| ["--quality".to_owned(), q.to_string()]));
    args.extend(
        Some(draw.debug_draw.to_string())
            .filter(|w| !w.is_empty())
            .iter()
            .flat_map(|w| ["--debug-draw".to_owned(), w.clone()]),
    );
    let switches = [("--burn-in", draw.burn_in), ("--offscreen", draw.offscreen), ("--no-pictures", draw.no_pictures)];
    args.extend(switches.iter().filter(|(_, on)| *on).map(|(name, _)| (*name).to_owned()));
    // the launcher times out before its facets
    let wait = launcher.serve.connect_timeout.map_or("600".to_owned(), |s| (s + 10.0).to_string());
    args.extend(["--connect-timeout".into(), wait, "--parent-watch".into()]);
    args
}

fn scene_args(serve: &ServeOptions) -> Vec<String> {
    let surroundings = &serve.surroundings;
    let mut args = vec![serve.scene.name.clone()];
    args.extend(serve.scene.opening.to_args());
    args.extend(["--cave".into(), surroundings.cave.clone()]);
    args.extend(surroundings.environment.iter().flat_map(|e| ["--environment".into(), e.clone()]));
    args
}

/// Returns an address on which this machine listens, as this machine reaches it.
fn local(at: std::net::SocketAddr) -> std::net::SocketAddr {
    match at.ip().is_unspecified() {
        true if at.is_ipv4() => (std::net::Ipv4Addr::LOCALHOST, at.port()).into(),
        true => (std::net::Ipv6Addr::LOCALHOST, at.port()).into(),
        false => at,
    }
}

/// Quotes a word for a shell.
fn shell_quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./=:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn describe_exit(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => format!("killed by signal {signal}"),
        _ => "of unknown cause".into(),
    }
}

/// Returns the transport: from the command line, else from the cave.
pub fn transport_kind(serve: &ServeOptions, cave: &Cave) -> TransportKind {
    let of_cave = if cave.sync.transport == tumble::scene::cave::Transport::Udp {
        TransportKind::Udp
    } else {
        TransportKind::SharedMemory
    };
    serve.transport.unwrap_or(of_cave)
}

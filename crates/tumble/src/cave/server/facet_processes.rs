//! The facets of a run as processes: those of this machine, and those of nodes with a launch command, are started, watched and ended; of the others it is told
//! how to start them.

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

/// How long facets may take to end by themselves after they were told: to pack the last pictures. Together with the next well below the time that signals give.
const EXIT_TIMEOUT: Duration = Duration::from_secs(3);
/// The same after their pipe was closed, and for those that were still starting.
const FINAL_EXIT_TIMEOUT: Duration = Duration::from_secs(1);
/// Restarts of a facet within a minute, at most.
const MAX_RESTARTS: usize = 5;
const RESTART_WINDOW: Duration = Duration::from_secs(60);
/// A facet that ends sooner than this after its last restart is not started again at once, but after a pause.
const MIN_UPTIME: Duration = Duration::from_secs(5);
const RESTART_DELAY: Duration = Duration::from_secs(1);

/// The facets that are started here.
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
    /// Ended for good: closed by the user, or too often.
    over: bool,
    /// It ended last by a failure.
    failed: bool,
    /// How, where it ended last by the exit code of a failure of its own; what shells and ssh tell of one that was killed is none.
    fault: Option<String>,
    restarts: VecDeque<Instant>,
}

/// What a look at the crew brings.
pub struct ProcessReport {
    /// How it stands.
    pub processes: ProcessStatus,
    /// Whose processes have ended since the last look.
    pub ended: Vec<FacetNumber>,
}

/// How the crew stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProcessStatus {
    /// Somebody is there, or nobody had to be.
    Running,
    /// All have ended as their users wished.
    AllLeft,
    /// All have ended, at least one by a failure.
    AllFailed,
}

/// The seats of a run: all facets, or the preview alone.
pub fn slots(cave: &Cave, preview: bool) -> Vec<FacetSlot> {
    if preview {
        return vec![FacetSlot { name: PREVIEW.into(), critical: true }];
    }
    cave.facets.iter().map(|f| FacetSlot { name: f.name.clone(), critical: f.critical }).collect()
}

impl FacetProcesses {
    /// Starts the facets of this machine, if there is a launcher, and says how the others are started.
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
                        "{} cannot be reached from here, so the address at which its facets would find this machine is not known; name it with --listen ADDR:PORT",
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

    /// Looks whether somebody ended, and restarts if asked to. `joining`: before the first frame, where an end is a failure.
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
                        format!("ended before the start ({}); what it said stands above", describe_exit(status)),
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
                // the others go on without it, and it is tried again
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

    /// After the facets were told that the run is over: waits for them, and ends who does not. `started`: they were there, and can have heard it.
    ///
    /// Errors: a facet has ended by a failure of its own, and was not started again.
    pub fn end(&mut self, started: bool) -> Result<(), Failure> {
        self.wait(if started { EXIT_TIMEOUT } else { FINAL_EXIT_TIMEOUT / 2 });
        let faults: Vec<String> =
            self.processes.iter().filter_map(|m| Some(format!("{} ({})", m.name, m.fault.as_ref()?))).collect();
        // who has not heard it finds its pipe closed
        self.processes.iter_mut().filter_map(|m| m.child.as_mut()).for_each(|child| drop(child.stdin.take()));
        self.wait(FINAL_EXIT_TIMEOUT);
        // all before any is waited for: with a driver at work each takes its time to be gone
        for process in &mut self.processes {
            let Some(child) = &mut process.child else { continue };
            if let Ok(None) = child.try_wait() {
                eprintln!("facet {}: does not end and is killed", process.name);
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
                format!("{} ended by a failure; what it said stands above", faults.join(", ")),
            )),
        }
    }

    /// Until all have ended, at most so long.
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
        // a group of its own: Ctrl-C is for the launcher, who ends the run in order
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

    /// How it ended, if it did since the last look.
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

/// The server's address, as a node reaches it; `None` where there is no way to the node.
fn address_for(node: &Node, address: &ServerAddress) -> Option<ServerAddress> {
    match *address {
        ServerAddress::Udp(at) if at.ip().is_unspecified() => {
            address_towards(&node.address, at.port()).map(|ip| ServerAddress::Udp((ip, at.port()).into()))
        }
        _ => Some(address.clone()),
    }
}

/// The launch command of a node, with everything filled in. The pipe that it holds as stdin ends with the launcher, and a facet behind it ends with the pipe.
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

/// What a facet is started with.
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
    let switches = [("--burn-in", draw.burn_in), ("--offscreen", draw.offscreen), ("--no-pictures", draw.no_pictures)];
    args.extend(switches.iter().filter(|(_, on)| *on).map(|(name, _)| (*name).to_owned()));
    // the launcher gives up before its facets do
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

/// An address that this machine listens on, as it reaches itself.
fn local(at: std::net::SocketAddr) -> std::net::SocketAddr {
    match at.ip().is_unspecified() {
        true if at.is_ipv4() => (std::net::Ipv4Addr::LOCALHOST, at.port()).into(),
        true => (std::net::Ipv6Addr::LOCALHOST, at.port()).into(),
        false => at,
    }
}

/// As a shell takes it.
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

/// What carries the frames: as the command line says, else the cave.
pub fn transport_kind(serve: &ServeOptions, cave: &Cave) -> TransportKind {
    let of_cave = if cave.sync.transport == tumble::scene::cave::Transport::Udp {
        TransportKind::Udp
    } else {
        TransportKind::SharedMemory
    };
    serve.transport.unwrap_or(of_cave)
}

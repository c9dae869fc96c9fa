//! The facets of a run as processes: those of this machine, and those of nodes with a launch command, are started, watched and ended; of the others it is told
//! how to start them.

use super::args::{Carrier, CaveOptions, ServeOptions};
use super::ends::{Address, seen_from};
use super::signals::Signals;
use super::stage::PREVIEW;
use crate::failure::Failure;
use std::collections::VecDeque;
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};
use tumble::net::sync::Seat;
use tumble::net::sync::transport::FacetNumber;
use tumble::scene::cave::{Cave, Node};

/// How long facets may take to end by themselves after they were told: to pack the last pictures. Together with the next well below the time that signals give.
const GRACE: Duration = Duration::from_secs(3);
/// The same after their pipe was closed, and for those that were still starting.
const LAST_GRACE: Duration = Duration::from_secs(1);
/// Restarts of a facet within a minute, at most.
const MOST_RESTARTS: usize = 5;
const MINUTE: Duration = Duration::from_secs(60);
/// A facet that ends sooner than this after its last restart is not started again at once, but after a pause.
const HASTE: Duration = Duration::from_secs(5);
const PAUSE: Duration = Duration::from_secs(1);

/// The facets that are started here.
pub struct Crew {
    members: Vec<Member>,
    restart: bool,
    quiet: bool,
    signals: Signals,
}

struct Member {
    seat: FacetNumber,
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
pub struct Look {
    /// How it stands.
    pub crew: Crewed,
    /// Whose processes have ended since the last look.
    pub ended: Vec<FacetNumber>,
}

/// How the crew stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crewed {
    /// Somebody is there, or nobody had to be.
    Yes,
    /// All have ended as their users wished.
    Left,
    /// All have ended, at least one by a failure.
    Lost,
}

/// The seats of a run: all facets, or the preview alone.
pub fn seats(cave: &Cave, preview: bool) -> Vec<Seat> {
    if preview {
        return vec![Seat { name: PREVIEW.into(), critical: true }];
    }
    cave.facets.iter().map(|f| Seat { name: f.name.clone(), critical: f.critical }).collect()
}

impl Crew {
    /// Starts the facets of this machine, if there is a launcher, and says how the others are started.
    pub fn start(
        serve: &ServeOptions,
        cave: &Cave,
        launcher: Option<&CaveOptions>,
        address: &Address,
        signals: &Signals,
    ) -> Result<Crew, Failure> {
        let mut crew = Crew {
            members: Vec::new(),
            restart: launcher.is_some_and(|l| l.restart),
            quiet: serve.quiet,
            signals: signals.clone(),
        };
        for (k, seat) in seats(cave, launcher.is_some_and(|l| l.preview)).into_iter().enumerate() {
            let far = cave.facets.get(k).and_then(|f| f.node).map(|n| &cave.nodes[n]).filter(|n| !n.is_local());
            let seen = far.map_or_else(|| Some(address.clone()), |node| seen_by(node, address));
            match (launcher, far) {
                (Some(_), Some(node)) if seen.is_none() && !node.launch.is_empty() => {
                    let why = format!(
                        "{} cannot be reached from here, so the address at which its facets would find this machine is not known; name it with --listen ADDR:PORT",
                        node.address
                    );
                    return Err(Failure::input(format!("node {}: {why}", node.name)));
                }
                (Some(launcher), None) => {
                    let program = std::env::current_exe().map_err(|e| Failure::run("starting a facet", e))?;
                    let words = led(launcher, &seat.name, address).into_iter().map(OsString::from);
                    crew.members.push(Member::new(
                        k,
                        &seat.name,
                        std::iter::once(program.into_os_string()).chain(words).collect(),
                    ));
                }
                (Some(launcher), Some(node)) if !node.launch.is_empty() => {
                    let words = launch(node, &seat.name, &led(launcher, &seat.name, seen.as_ref().unwrap_or(address)));
                    crew.say(&format!(
                        "facet {}: starting it on {}: {}",
                        seat.name,
                        node.name,
                        words.iter().map(|w| quoted(w)).collect::<Vec<_>>().join(" ")
                    ));
                    crew.members.push(Member::new(k, &seat.name, words.into_iter().map(OsString::from).collect()));
                }
                (_, node) => {
                    let server = match (&seen, address) {
                        (Some(Address::Udp(at)), _) if node.is_some() => format!(" --server {at}"),
                        (None, Address::Udp(at)) => {
                            format!(" --server ADDR:{} with this machine's address as that one sees it", at.port())
                        }
                        _ => String::new(),
                    };
                    let place = node.map_or("here".to_owned(), |n| format!("on {} ({})", n.name, n.address));
                    let what = stage_args(serve).iter().map(|a| quoted(a)).collect::<Vec<_>>().join(" ");
                    crew.say(&format!(
                        "facet {}: start it {place}: tumble facet {what} --facet {}{server}",
                        seat.name,
                        quoted(&seat.name)
                    ));
                }
            }
        }
        for k in 0..crew.members.len() {
            crew.spawn(k)?;
        }
        Ok(crew)
    }

    /// Looks whether somebody ended, and restarts if asked to. `joining`: before the first frame, where an end is a failure.
    pub fn watch(&mut self, joining: bool) -> Result<Look, Failure> {
        let mut ended = Vec::new();
        for k in 0..self.members.len() {
            let member = &mut self.members[k];
            if let Some(status) = member.look(&self.signals) {
                member.ended = Some(Instant::now());
                ended.push(member.seat);
                member.over = status.success() || !self.restart;
                let title = format!("facet {}", member.name);
                if joining {
                    return Err(Failure::run(
                        &title,
                        format!("ended before the start ({}); what it said stands above", told(status)),
                    ));
                }
                self.say(&if status.success() {
                    format!("{title} has left")
                } else {
                    format!("{title} ended ({})", told(status))
                });
            }
            let member = &mut self.members[k];
            member.restarts.retain(|at| at.elapsed() < MINUTE);
            let hasty =
                |ended: Instant| member.restarts.back().is_some_and(|began| ended.duration_since(*began) < HASTE);
            let due = member.ended.is_some_and(|at| !hasty(at) || at.elapsed() >= PAUSE)
                && member.child.is_none()
                && !member.over;
            if due {
                if member.restarts.len() >= MOST_RESTARTS {
                    member.over = true;
                    let text = format!(
                        "facet {} ended {MOST_RESTARTS} times within a minute and is not started again",
                        member.name
                    );
                    self.say(&text);
                    continue;
                }
                member.restarts.push_back(Instant::now());
                // the others go on without it, and it is tried again
                if let Err(failure) = self.spawn(k) {
                    eprint!("{}", failure.report());
                    (self.members[k].ended, self.members[k].failed) = (Some(Instant::now()), true);
                }
            }
        }
        let all_over = !self.members.is_empty() && self.members.iter().all(|m| m.over && m.child.is_none());
        let crew = match all_over {
            false => Crewed::Yes,
            true if self.members.iter().any(|m| m.failed) => Crewed::Lost,
            true => Crewed::Left,
        };
        Ok(Look { crew, ended })
    }

    /// After the facets were told that the run is over: waits for them, and ends who does not. `begun`: they were there, and can have heard it.
    ///
    /// Errors: a facet has ended by a failure of its own, and was not started again.
    pub fn end(&mut self, begun: bool) -> Result<(), Failure> {
        self.wait(if begun { GRACE } else { LAST_GRACE / 2 });
        let faults: Vec<String> =
            self.members.iter().filter_map(|m| Some(format!("{} ({})", m.name, m.fault.as_ref()?))).collect();
        // who has not heard it finds its pipe closed
        self.members.iter_mut().filter_map(|m| m.child.as_mut()).for_each(|child| drop(child.stdin.take()));
        self.wait(LAST_GRACE);
        // all before any is waited for: with a driver at work each takes its time to be gone
        for member in &mut self.members {
            let Some(child) = &mut member.child else { continue };
            if let Ok(None) = child.try_wait() {
                eprintln!("facet {}: does not end and is killed", member.name);
            }
            let _ = child.kill();
        }
        for mut child in self.members.iter_mut().filter_map(|m| m.child.take()) {
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
            self.members.iter_mut().for_each(|m| _ = m.look(&self.signals));
            if self.members.iter().all(|m| m.child.is_none()) {
                return;
            }
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    fn spawn(&mut self, k: usize) -> Result<(), Failure> {
        let member = &mut self.members[k];
        // never empty: the program is this one, or the first word of a launch command
        let mut command = Command::new(&member.command[0]);
        // a group of its own: Ctrl-C is for the launcher, who ends the run in order
        command.args(&member.command[1..]).stdin(Stdio::piped()).stdout(Stdio::null()).process_group(0);
        let child = command.spawn().map_err(|e| Failure::run(&format!("starting facet {}", member.name), e))?;
        self.signals.started(child.id());
        (member.child, member.ended, member.fault) = (Some(child), None, None);
        Ok(())
    }

    fn say(&self, what: &str) {
        if !self.quiet {
            eprintln!("{what}");
        }
    }
}

impl Drop for Crew {
    fn drop(&mut self) {
        for child in self.members.iter_mut().filter_map(|m| m.child.as_mut()) {
            let _ = child.kill();
            let _ = child.wait();
            self.signals.ended(child.id());
        }
    }
}

impl Member {
    fn new(seat: usize, name: &str, command: Vec<OsString>) -> Member {
        Member {
            seat: seat as FacetNumber,
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
    fn look(&mut self, signals: &Signals) -> Option<ExitStatus> {
        let child = self.child.as_mut()?;
        let status = child.try_wait().ok().flatten()?;
        signals.ended(child.id());
        self.child = None;
        self.failed = !status.success();
        self.fault = status.code().filter(|code| matches!(code, 1 | 2)).map(|_| told(status));
        Some(status)
    }
}

/// The server's address, as a node reaches it; `None` where there is no way to the node.
fn seen_by(node: &Node, address: &Address) -> Option<Address> {
    match *address {
        Address::Udp(at) if at.ip().is_unspecified() => {
            seen_from(&node.address, at.port()).map(|ip| Address::Udp((ip, at.port()).into()))
        }
        _ => Some(address.clone()),
    }
}

/// The launch command of a node, with everything filled in. The pipe that it holds as stdin ends with the launcher, and a facet behind it ends with the pipe.
fn launch(node: &Node, facet: &str, arguments: &[String]) -> Vec<String> {
    let line = arguments.iter().map(|a| quoted(a)).collect::<Vec<_>>().join(" ");
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
fn led(launcher: &CaveOptions, name: &str, address: &Address) -> Vec<String> {
    let mut args = vec!["facet".to_owned()];
    args.extend(stage_args(&launcher.serve));
    if name == PREVIEW && launcher.preview {
        args.push("--preview".into())
    } else {
        args.extend(["--facet".into(), name.to_owned()])
    }
    args.extend(match address {
        Address::Memory(run) => ["--run".into(), run.clone()],
        Address::Udp(server) => ["--server".into(), local(*server).to_string()],
    });
    let draw = &launcher.draw;
    let folder = |option: &str, path: &Option<std::path::PathBuf>| {
        path.iter().flat_map(|p| [option.to_owned(), p.display().to_string()]).collect::<Vec<_>>()
    };
    args.extend(folder("--frames-dir", &draw.frames_dir));
    args.extend(folder("--log-dir", &draw.log_dir));
    args.extend(draw.quality.iter().flat_map(|q| ["--quality".to_owned(), q.to_string()]));
    let switches = [("--stamp", draw.stamp), ("--offscreen", draw.offscreen), ("--no-pictures", draw.no_pictures)];
    args.extend(switches.iter().filter(|(_, on)| *on).map(|(name, _)| (*name).to_owned()));
    // the launcher gives up before its facets do
    let wait = launcher.serve.wait.map_or("600".to_owned(), |s| (s + 10.0).to_string());
    args.extend(["--wait".into(), wait, "--led".into()]);
    args
}

fn stage_args(serve: &ServeOptions) -> Vec<String> {
    let stage = &serve.stage;
    let mut args = vec![stage.scene.clone(), "--cave".into(), stage.cave.clone()];
    args.extend(stage.environment.iter().flat_map(|e| ["--environment".into(), e.clone()]));
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
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./=:".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

fn told(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit code {code}"),
        (None, Some(signal)) => format!("killed by signal {signal}"),
        _ => "of unknown cause".into(),
    }
}

/// What carries the frames: as the command line says, else the cave.
pub fn carrier(serve: &ServeOptions, cave: &Cave) -> Carrier {
    let of_cave =
        if cave.sync.transport == tumble::scene::cave::Transport::Udp { Carrier::Udp } else { Carrier::SharedMemory };
    serve.transport.unwrap_or(of_cave)
}

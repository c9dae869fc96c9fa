//! The start of a run: scenes, lock, console, transport and facets.

use super::facet_commands::{slots, transport_kind};
use super::facet_processes::FacetProcesses;
use super::operator::Operator;
use super::outputs;
use super::serve::{Over, RunLoop};
use crate::args::SceneOptions;
use crate::cave::address::{RunKey, ServerAddress};
use crate::cave::args::{CaveOptions, ComputeKind, ServeOptions, TransportKind, WebOptions};
use crate::cave::console::{Console, read_token};
use crate::cave::endpoints::{ServerEndpoint, idle_timeout, key, timing};
use crate::cave::lock::{ConsoleLink, RunInfo, RunLock};
use crate::cave::replay::frames::Replay;
use crate::cave::run_setup::{Role, RunSetup};
use crate::cave::signals::Signals;
use crate::cave::simulation::CaveSimulation;
use crate::cave::web::{new_key, read_key};
use crate::failure::Failure;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::Path;
use std::time::Duration;
use tumble::net::sync::cpu_latency::CpuLatencyRequest;
use tumble::net::sync::shm::{ShmServer, clean_up};
use tumble::net::sync::udp::{Entropy, UdpServer};
use tumble::net::sync::{FacetSlot, MAX_CONTACTS, MAX_FRAME_EVENTS, Server, ServerOptions, SyncMode};
use tumble::scene::cave::{Cave, Mode};

/// Runs scenes in a cave one after the other, or replays a recording of one. With a launcher's options
/// it also runs the facets of this machine.
pub fn run(options: &ServeOptions, launcher: Option<&CaveOptions>, recording: Option<&Path>) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    outputs::check_scenes(options, launcher, recording.is_some())?;
    let launcher = launcher.map(with_key).transpose()?;
    let launcher = launcher.as_ref();
    let link = console_link(options)?;
    let console = link.clone().map(|link| Console::open(link.address, link.token)).transpose()?;
    let link = link.zip(console.as_ref()).map(|(link, console)| ConsoleLink { address: console.address(), ..link });
    if let (Some(link), false) = (&link, options.quiet) {
        let token = if options.console_token.is_some() { "TOKEN" } else { &link.token };
        eprintln!("console: http://{}/#{token}", link.address);
    }
    for k in 0..=options.then.len() {
        let name = k.checked_sub(1).map_or(&options.scene.name, |k| &options.then[k]).clone();
        let scene = SceneOptions { name, ..options.scene.clone() };
        let options = ServeOptions { scene, ..options.clone() };
        let show = |recording: Option<&Path>| {
            let operator = Operator::new(console.as_ref(), k < options.then.len());
            run_scene(&options, launcher, recording, &signals, operator, link.clone())
        };
        let mut over = show(recording)?;
        // the operator's replays; after each the scene begins again
        while let Over::Replay(file) = over {
            over = match show(Some(&file))? {
                Over::Scene => show(recording)?,
                other => other,
            };
        }
        if over == Over::Run {
            break;
        }
    }
    Ok(())
}

/// Draws the key of the links of browsers, if there are any. A key file is read by the facets, and checked here.
fn with_key(launcher: &CaveOptions) -> Result<CaveOptions, Failure> {
    launcher.web.web_key.as_deref().map(read_key).transpose()?;
    let drawn_key = launcher.web.web.map(|_| new_key()).transpose()?;
    Ok(CaveOptions { web: WebOptions { drawn_key, ..launcher.web.clone() }, ..launcher.clone() })
}

/// Returns address and token of the console, if the run has one.
fn console_link(options: &ServeOptions) -> Result<Option<ConsoleLink>, Failure> {
    let Some(address) = options.console else { return Ok(None) };
    let token = match &options.console_token {
        Some(file) => read_token(file)?,
        None if address.ip().is_loopback() => {
            let mut entropy = Entropy::system().map_err(|e| Failure::run("the console", e))?;
            entropy.next_bytes().iter().map(|byte| format!("{byte:02x}")).collect()
        }
        None => {
            let why = "other machines reach it, so it needs --console-token FILE";
            return Err(Failure::input(format!("--console {address}: {why}")));
        }
    };
    Ok(Some(ConsoleLink { address, token }))
}

fn run_scene(
    options: &ServeOptions,
    launcher: Option<&CaveOptions>,
    recording: Option<&Path>,
    signals: &Signals,
    operator: Operator<'_>,
    link: Option<ConsoleLink>,
) -> Result<Over, Failure> {
    let setup = RunSetup::load(options.scene.load()?, &options.surroundings, Role::Server)?;
    let compute = compute(options, &setup.cave, recording.is_some());
    let options = &ServeOptions { compute, ..options.clone() };
    let launcher = launcher.map(|launcher| CaveOptions { serve: options.clone(), ..launcher.clone() });
    let launcher = launcher.as_ref();
    let say = |what: &str| (!options.quiet).then(|| eprintln!("{what}"));
    setup.notes.iter().for_each(|note| _ = say(note));
    outputs::check(options, launcher, &setup, recording)?;
    let replay = recording.map(|path| Replay::open(path, setup.hash)).transpose()?;
    let key = key(&setup.cave)?;
    let mut entropy = Entropy::system().map_err(|e| Failure::run("the run", e))?;
    let number = entropy.next_u64();
    let name = format!("{number:016x}");
    if signals.stop_requested() {
        return Ok(Over::Run);
    }
    let mut run = RunInfo::here(&setup.scene.file, &setup.cave.file);
    let mut lock = RunLock::take(&setup, &run, options.replace)?;
    signals.remove_at_the_end(lock.path().to_owned());
    let slots = slots(&setup.cave, launcher.is_some_and(|l| l.preview));
    let count = slots.len() as u16;
    let failed = |e| Failure::run("the server", e);
    let (end, address) = match transport_kind(options, &setup.cave) {
        TransportKind::SharedMemory => {
            let server = ShmServer::new(&name, count).map_err(failed)?.with_idle_timeout(idle_timeout(&setup.cave));
            (ServerEndpoint::Shm(Box::new(server)), ServerAddress::Memory(name))
        }
        TransportKind::Udp => {
            let at = listen(options, &setup.cave);
            // without a key file the run has a key of its own, by which this user's processes join
            run.key = (key.is_none() && at.ip().is_loopback()).then(|| RunKey::new(entropy.next_bytes()));
            let by = if run.key.is_some() { "a key of this run, for this user alone" } else { "the key file" };
            let key = key.or(run.key.as_ref().map(RunKey::shared));
            let server = UdpServer::bind(at, count, key, timing(&setup.cave)).map_err(failed)?;
            let address = ServerAddress::Udp(server.address().map_err(failed)?);
            say(&format!("server: {} by {by}", server.describe()));
            (ServerEndpoint::Udp(Box::new(server)), address)
        }
    };
    // from here on facets can join
    (run.address, run.console) = (Some(address.clone()), link);
    lock.write(&run)?;
    let shared_memory = matches!(end, ServerEndpoint::Shm(_));
    let simulation = CaveSimulation::new(&setup, setup.world.fork(), options.user_colliders)?;
    let everywhere = compute == Some(ComputeKind::Everywhere);
    let hash = everywhere.then(|| simulation.hash(&setup)).transpose()?;
    let session_options = ServerOptions { compute: hash, ..session_options(options, &setup, number, &slots) };
    let server = Server::new(end, session_options, &setup.world);
    let mut processes = FacetProcesses::start(options, &setup.cave, launcher, &address, signals)?;
    let _awake = options
        .stay_awake
        .then(|| CpuLatencyRequest::ask().inspect_err(|why| _ = say(&format!("the cores may fall asleep: {why}"))));
    let begin = RunLoop::new(options, launcher, setup, simulation, server, slots, signals, replay, operator);
    let outcome = begin.and_then(|mut run_loop| {
        let outcome = run_loop.run_frames(&mut processes);
        let ended = run_loop.end(&mut processes);
        outcome.and_then(|over| ended.map(|()| over))
    });
    drop(processes);
    if shared_memory {
        // leftovers of killed facets
        clean_up().map_err(|e| Failure::run("cleaning up", e))?;
    }
    drop(lock);
    outcome
}

/// Returns where the world is stepped, if the facets need to know: a replay steps nothing.
fn compute(options: &ServeOptions, cave: &Cave, replaying: bool) -> Option<ComputeKind> {
    let of_cave = ComputeKind::from(cave.sync.compute);
    match options.compute.unwrap_or(of_cave) {
        ComputeKind::Everywhere if !replaying => Some(ComputeKind::Everywhere),
        _ => (of_cave == ComputeKind::Everywhere).then_some(ComputeKind::Server),
    }
}

fn listen(options: &ServeOptions, cave: &Cave) -> SocketAddr {
    let remote = cave.nodes.iter().any(|n| !n.is_local());
    let default = if remote { (Ipv4Addr::UNSPECIFIED, cave.sync.port) } else { (Ipv4Addr::LOCALHOST, 0) };
    options.listen.unwrap_or(default.into())
}

/// Returns the timeout for facets to join.
pub(super) fn connect_timeout(options: &ServeOptions, cave: &Cave) -> Duration {
    options.connect_timeout.map_or(Duration::from_millis(cave.sync.connect_timeout_ms.into()), Duration::from_secs_f64)
}

/// Returns the session's options from the cave file.
fn session_options(options: &ServeOptions, setup: &RunSetup, run: u64, slots: &[FacetSlot]) -> ServerOptions {
    let (sync, wait) = (&setup.cave.sync, connect_timeout(options, &setup.cave));
    let ms = |ms: u32| Duration::from_millis(ms.into());
    ServerOptions {
        mode: if sync.mode == Mode::Lockstep { SyncMode::Lockstep } else { SyncMode::Latest },
        ready_timeout: if options.no_realtime { wait } else { ms(sync.ready_timeout_ms) },
        first_frame_timeout: wait,
        drop_timeout: ms(sync.drop_timeout_ms),
        history: sync.history_frames as usize,
        contacts: if options.contacts { MAX_CONTACTS } else { 0 },
        events: if options.events { MAX_FRAME_EVENTS } else { 0 },
        ..ServerOptions::new(run, setup.join_hash, slots.to_vec())
    }
}

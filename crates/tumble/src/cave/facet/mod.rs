//! `tumble facet`: draws the server's frames, shows each when the server says so, and acknowledges
//! the hash of its image.

mod burn_in;
mod control;
mod desktop;
mod frame_log;
mod group;
mod painter;
mod picture_watch;
mod pictures;
mod priority;
mod render_thread;
mod runner;
mod user_input;
mod wall;
mod window;

use super::address::{RunServer, ServerAddress};
use super::args::{ComputeKind, FacetOptions};
use super::endpoints::FacetEndpoint;
use super::facet_report::Reporter;
use super::lock;
use super::run_setup::{PREVIEW, Role, RunSetup};
use super::server::title;
use super::signals::Signals;
use super::simulation::CaveSimulation;
use super::web::{FrameList, WebScreen, port_after};
use crate::failure::Failure;
use control::{FacetControl, POLL_INTERVAL, Parent};
pub use control::{JOIN_LINE, PATTERN_MARK};
use desktop::{Desktop, Probe, desktop};
use frame_log::{Earlier, FrameLog};
use group::{LeaderFrame, Membership};
use painter::Painter;
use picture_watch::PictureWatch;
pub use render_thread::ListMaker;
use render_thread::{RenderThread, slot_name};
use runner::FacetRunner;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tumble::net::sync::{Facet, FacetOptions as SessionOptions, SyncMode};
use tumble::net::sync::{transport::FacetNumber, udp::Entropy};
use tumble::scene::cave::{Facet as CaveFacet, Mode, Output, resolve_cave};
use wall::WallSetup;
use window::WindowSetup;

/// Runs a facet, or several in this process, until the end of the run.
pub fn run(options: &FacetOptions) -> Result<(), Failure> {
    let count = options.facet.len().max(1);
    let reporters: Vec<Reporter> =
        (0..count).map(|member| Reporter::start(options.parent_watch, member)).collect::<Result<_, _>>()?;
    let names: Vec<&str> = options.facet.iter().map(String::as_str).collect();
    let title = title(if names.is_empty() { &[PREVIEW] } else { &names });
    let outcome = show(options, &reporters).map_err(|failure| failure.of_facets(&title));
    if let Err(failure) = &outcome {
        reporters.iter().for_each(|reporter| reporter.line(failure.report()));
    }
    reporters.iter().for_each(Reporter::flush);
    outcome
}

fn show(options: &FacetOptions, reporters: &[Reporter]) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let parent = options.parent_watch.then(Parent::watch).transpose()?;
    let compute = compute(options)?;
    let role = if compute == ComputeKind::Everywhere { Role::Server } else { Role::Facet };
    let setup = RunSetup::load(options.scene.load()?, &options.surroundings, role)?;
    let facets = facets(options, &setup)?;
    let control = FacetControl {
        name: slot_name(facets.first()).to_owned(),
        signals,
        reporter: reporters[0].clone(), // there is one for each facet, and for the preview
        parent,
        connect_timeout: Duration::from_secs_f64(options.connect_timeout),
        end_all: Arc::default(),
        sealed: false,
    };
    let (painters, windows) = painters(options, &setup, &facets, &control, reporters)?;
    if let Windows::One(window, probe) = windows {
        let join = || {
            let mut runners = join(options, &setup, &facets, &control, reporters, (compute, vec![None]))?;
            Ok(runners.remove(0)) // one for each painter
        };
        return window.show(&control, options.stand_by, options.draw.burn_in, probe, join);
    }
    if options.stand_by && !control.stand_by() {
        return Ok(());
    }
    let mut runners = join(options, &setup, &facets, &control, reporters, (compute, painters))?;
    match (windows, &mut runners[..]) {
        (Windows::Several(wall), several) => wall.show(several, finish),
        (_, [runner]) => {
            let shown = runner.run();
            finish(runner, shown)
        }
        (_, several) => together(several, &control.end_all),
    }
}

/// Connects the facets of this process to the server. Each has a painter; `None` for one that draws nothing, or
/// in a window.
fn join(
    options: &FacetOptions,
    setup: &RunSetup,
    facets: &[CaveFacet],
    control: &FacetControl,
    reporters: &[Reporter],
    (compute, painters): (ComputeKind, Painters),
) -> Result<Vec<FacetRunner>, Failure> {
    let server = find_server(options, setup, control)?;
    let sealed = setup.cave.security.is_some() && matches!(server.address, ServerAddress::Udp(_));
    let applied = Arc::new(LeaderFrame::default());
    let mut runners = Vec::with_capacity(painters.len());
    for (k, painter) in painters.into_iter().enumerate() {
        let membership = match k {
            _ if facets.len() < 2 => Membership::Alone,
            0 => Membership::Leader(applied.clone()),
            _ => Membership::Follower(applied.clone()),
        };
        let name = slot_name(facets.get(k)).to_owned();
        let control = FacetControl { name, reporter: reporters[k].clone(), sealed, ..control.clone() };
        let session = session(options, setup, facets.get(k), &server, (compute, &membership))?;
        runners.push(runner(options, session, membership, painter, control)?);
    }
    Ok(runners)
}

/// Returns the facets of this process; none for the preview.
fn facets(options: &FacetOptions, setup: &RunSetup) -> Result<Vec<CaveFacet>, Failure> {
    let facets: Vec<CaveFacet> =
        options.facet.iter().map(|name| setup.cave.facet(name).cloned()).collect::<Result<_, _>>()?;
    let [first, others @ ..] = &facets[..] else { return Ok(facets) };
    for (k, facet) in others.iter().enumerate() {
        let wrong = |why: &str| {
            Failure::input(format!(
                "--facet {}: facets {} and {} {why}",
                options.facet.join(","),
                first.name,
                facet.name
            ))
        };
        if facets[..=k].iter().any(|other| other.name == facet.name) {
            return Err(Failure::input(format!("--facet {}: {} is named twice", options.facet.join(","), facet.name)));
        }
        if facet.display.gpu != first.display.gpu {
            return Err(wrong("have another `gpu`, so each needs a process of its own"));
        }
        let apart = (facet.output == Output::Offscreen) != (first.output == Output::Offscreen);
        if apart && options.web.web.is_none() && !options.draw.offscreen && !options.draw.no_pictures {
            return Err(wrong("draw into a window and into memory (output), so each needs a process of its own"));
        }
    }
    Ok(facets)
}

/// The painters of the facets of this process; `None` for one that draws nothing, or in a window.
type Painters = Vec<Option<Painter>>;

/// The windows of this process.
enum Windows {
    None,
    One(Box<WindowSetup>, Probe),
    Several(Box<WallSetup>),
}

/// Prepares what draws the facets, and their windows.
fn painters(
    options: &FacetOptions,
    setup: &RunSetup,
    facets: &[CaveFacet],
    control: &FacetControl,
    reporters: &[Reporter],
) -> Result<(Painters, Windows), Failure> {
    let draw = &options.draw;
    let (quality, overlays) = (draw.quality, draw.debug_draw.draw);
    if draw.no_pictures {
        return Ok((facets.iter().map(|_| None).chain(facets.is_empty().then_some(None)).collect(), Windows::None));
    }
    let first = facets.first();
    let in_memory = |facet: &CaveFacet| facet.output == Output::Offscreen;
    let in_memory = draw.offscreen || options.web.web.is_some() || !facets.is_empty() && facets.iter().all(in_memory);
    let window_required = facets.iter().any(|f| f.window_required);
    if let Some(probe) = if in_memory { None } else { reach_desktop(&control.name, window_required)? } {
        let lists = ListMaker::new(setup, quality, overlays);
        if facets.len() > 1 {
            let read = draw.frames_dir.is_some() || draw.log_dir.is_some();
            let looks = (read, draw.burn_in);
            let (wall, painters) = WallSetup::new(setup, facets, lists, looks, probe, control.end_all.clone())?;
            let painters = painters.into_iter().map(|painter| Some(Painter::Window(Box::new(painter))));
            return Ok((painters.collect(), Windows::Several(Box::new(wall))));
        }
        return Ok((vec![None], Windows::One(Box::new(WindowSetup::new(setup, first, lists)?), probe)));
    }
    if let (Some(at), false) = (options.web.web, facets.is_empty()) {
        let screens = web_screens(options, setup, facets, at, reporters)?;
        let painters = screens.into_iter().map(|screen| Some(Painter::Browsers(Box::new(screen))));
        return Ok((painters.collect(), Windows::None));
    }
    let thread = RenderThread::new(setup, facets, quality, overlays)?;
    let other = |pictures| Some(Painter::Other { pictures, adapter: thread.adapter().to_owned() });
    let others: Vec<_> = thread.others().iter().cloned().map(other).collect();
    Ok((std::iter::once(Some(Painter::Memory(Box::new(thread)))).chain(others).collect(), Windows::None))
}

/// Connects a facet to the server.
fn session(
    options: &FacetOptions,
    setup: &RunSetup,
    facet: Option<&CaveFacet>,
    server: &RunServer,
    (compute, membership): (ComputeKind, &Membership),
) -> Result<Facet<FacetEndpoint>, Failure> {
    let number = facet.and_then(|facet| setup.cave.facets.iter().position(|f| f.name == facet.name)).unwrap_or(0);
    let again = options.server.is_none() && options.run.is_none();
    let link = FacetEndpoint::open(server, number as FacetNumber, setup, again)?;
    let of_facet = session_options(setup, slot_name(facet))?;
    // only the leader of several facets has a world
    let world = || setup.world.fork();
    let follows = matches!(membership, Membership::Follower(_));
    let everywhere = compute == ComputeKind::Everywhere;
    if !everywhere {
        return match follows {
            false => Ok(Facet::new(link, of_facet, world())),
            true => Facet::following(link, of_facet, false).map_err(|e| Failure::run("the facet", e)),
        };
    }
    let simulation = CaveSimulation::new(setup, world(), options.user_colliders)?.disturbed(options.disturb_after);
    let of_facet = SessionOptions { scene: simulation.hash(setup)?, ..of_facet };
    match follows {
        false => Ok(Facet::computing(link, of_facet, Box::new(simulation))),
        true => Facet::following(link, of_facet, true).map_err(|e| Failure::run("the facet", e)),
    }
}

fn runner(
    options: &FacetOptions,
    session: Facet<FacetEndpoint>,
    membership: Membership,
    painter: Option<Painter>,
    control: FacetControl,
) -> Result<FacetRunner, Failure> {
    let log = frame_log(options, &control.name, &control.reporter)?;
    let watch = options.draw.watch_pictures.then(|| PictureWatch::new(control.reporter.clone()));
    Ok(FacetRunner::new(session, membership, painter, log, options.draw.burn_in, control, watch))
}

/// Runs several facets, each in a thread. If one fails, all end.
fn together(runners: &mut [FacetRunner], end_all: &AtomicBool) -> Result<(), Failure> {
    let run = |runner: &mut FacetRunner| {
        let shown = runner.run();
        if shown.is_err() {
            end_all.store(true, Ordering::Relaxed);
        }
        finish(runner, shown)
    };
    let outcomes: Vec<Result<(), Failure>> = std::thread::scope(|scope| {
        let threads: Vec<_> = runners.iter_mut().map(|runner| scope.spawn(|| run(runner))).collect();
        let joined = |thread: std::thread::ScopedJoinHandle<'_, _>| {
            thread.join().unwrap_or_else(|_| Err(Failure::run("the facets", "a thread has ended")))
        };
        threads.into_iter().map(joined).collect()
    });
    outcomes.into_iter().collect()
}

/// Leaves the run and completes the files of a facet.
fn finish(runner: &mut FacetRunner, shown: Result<(), Failure>) -> Result<(), Failure> {
    // in any case, the server need not wait for the timeout
    let _ = runner.facet.leave();
    // a write error is the cause of other errors
    let written = runner.log.as_mut().map_or(Ok(()), FrameLog::finish);
    written.and(shown)
}

/// Serves the facets to browsers, each at a port.
fn web_screens(
    options: &FacetOptions,
    setup: &RunSetup,
    facets: &[CaveFacet],
    first: SocketAddr,
    reporters: &[Reporter],
) -> Result<Vec<WebScreen>, Failure> {
    let (web, draw) = (&options.web, &options.draw);
    if draw.frames_dir.is_some() {
        let why = "browsers keep their pictures, so there is none to write; --log-dir writes frames.jsonl";
        return Err(Failure::input(format!("--web with --frames-dir: {why}")));
    }
    let lists = Arc::new(FrameList::default());
    let one = |(k, (facet, reporter)): (u16, (&CaveFacet, &Reporter))| {
        WebScreen::open(setup, facet, port_after(first, k, &facet.name)?, web, lists.clone(), reporter)
    };
    let mut screens: Vec<WebScreen> = (0..).zip(facets.iter().zip(reporters)).map(one).collect::<Result<_, _>>()?;
    let maker = ListMaker::new(setup, draw.quality, draw.debug_draw.draw);
    let all = screens.iter().map(WebScreen::shared).collect();
    if let Some(leader) = screens.first_mut() {
        leader.lead(maker, all);
    }
    Ok(screens)
}

/// Returns where the world is stepped: by the command line, else by the cave file.
fn compute(options: &FacetOptions) -> Result<ComputeKind, Failure> {
    let of_cave = || Ok(resolve_cave(&options.surroundings.cave)?.load()?.sync.compute.into());
    options.compute.map_or_else(of_cave, Ok)
}

/// Opens the facet's folder for frames, if there is one.
fn frame_log(options: &FacetOptions, name: &str, reporter: &Reporter) -> Result<Option<FrameLog>, Failure> {
    let draw = &options.draw;
    let earlier = match (options.continue_frames, draw.overwrite) {
        (true, _) => Earlier::Continue,
        (false, true) => Earlier::Remove,
        (false, false) => Earlier::Refuse,
    };
    let open = |folder| FrameLog::open(folder, name, draw.frames_dir.is_some(), earlier, reporter.clone());
    draw.frames_dir.as_deref().or(draw.log_dir.as_deref()).map(open).transpose()
}

/// Connects to the desktop. Returns `None` if there is none, so that the facet draws into memory,
/// and prints why if one is named and does not answer.
///
/// # Errors
/// There is none, and the cave file requires a window.
fn reach_desktop(name: &str, required: bool) -> Result<Option<Probe>, Failure> {
    let why = match desktop() {
        Desktop::Available(probe) => return Ok(Some(probe)),
        Desktop::Unreachable(why) => Some(format!("the desktop does not answer ({why})")),
        Desktop::None => None,
    };
    if required {
        let why = why.unwrap_or("there is no desktop (DISPLAY and WAYLAND_DISPLAY are not set)".into());
        let hint = "the cave file says output = \"window\"; --offscreen draws into memory";
        return Err(Failure::run(&format!("facet {name}"), format!("no window: {why}; {hint}")));
    }
    if let Some(why) = why {
        eprintln!("facet {name}: draws into memory, because {why}");
    }
    Ok(None)
}

/// Returns the session's options from the cave file.
fn session_options(setup: &RunSetup, name: &str) -> Result<SessionOptions, Failure> {
    let seed = Entropy::system().map_err(|e| Failure::run("the facet", e))?.next_u64();
    let sync = &setup.cave.sync;
    let mode = if sync.mode == Mode::Lockstep { SyncMode::Lockstep } else { SyncMode::Latest };
    Ok(SessionOptions {
        mode,
        drop_timeout: Duration::from_millis(sync.drop_timeout_ms.into()),
        ..SessionOptions::new(name, setup.join_hash, seed)
    })
}

/// Returns the server: from the command line, or from the run in progress on this machine, for
/// which it waits. It waits too for the key of a run on this machine if the cave has no key file.
fn find_server(options: &FacetOptions, setup: &RunSetup, control: &FacetControl) -> Result<RunServer, Failure> {
    let given = options.server.map(ServerAddress::Udp).or(options.run.clone().map(ServerAddress::Memory));
    let needs_key = setup.cave.security.is_none() && options.server.is_some_and(|at| at.ip().is_loopback());
    if let Some(address) = given.clone().filter(|_| !needs_key) {
        return Ok(RunServer { address, key: None });
    }
    let until = Instant::now() + control.connect_timeout;
    let mut said = false;
    loop {
        let found = lock::find_run(&setup.place)?;
        if let Some(server) = found.filter(|server| given.as_ref().is_none_or(|given| *given == server.address)) {
            return Ok(server);
        }
        if control.should_stop() {
            return Err(Failure::run(&control.title(), "ended while it waited for a run"));
        }
        if Instant::now() > until {
            let far = setup.cave.nodes.iter().any(|n| !n.is_local());
            let hint = if far { "; for a run on another machine use --server ADDR:PORT" } else { "" };
            let at = options.server.map_or(String::new(), |at| format!(" at {at} by this user"));
            return Err(Failure::run(
                &control.title(),
                format!(
                    "no run was in progress in {} on this machine{at} for {:.0} s{hint}",
                    setup.cave.file, options.connect_timeout
                ),
            ));
        }
        if !std::mem::replace(&mut said, true) {
            control.say(&format!("waits for a run in {}", setup.cave.file));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

//! `tumble facet`: draws the server's frames, shows each when the server says so, and acknowledges
//! the hash of its image.

mod burn_in;
mod control;
mod desktop;
mod frame_log;
mod painter;
mod picture_watch;
mod priority;
mod render_thread;
mod runner;
mod window;

use super::address::{RunServer, ServerAddress};
use super::args::{ComputeKind, FacetOptions};
use super::endpoints::FacetEndpoint;
use super::facet_report::Reporter;
use super::lock;
use super::run_setup::{Role, RunSetup};
use super::signals::Signals;
use super::simulation::CaveSimulation;
use super::web::WebScreen;
use crate::failure::Failure;
pub use control::PATTERN_MARK;
use control::{FacetControl, POLL_INTERVAL, Parent};
use desktop::{Desktop, Probe, desktop};
use frame_log::{Earlier, FrameLog};
use painter::Painter;
use picture_watch::PictureWatch;
pub use render_thread::draw_list;
use render_thread::{RenderThread, slot_name};
use runner::FacetRunner;
use std::time::{Duration, Instant};
use tumble::net::sync::{Facet, FacetOptions as SessionOptions, SyncMode};
use tumble::net::sync::{transport::FacetNumber, udp::Entropy};
use tumble::scene::cave::{Facet as CaveFacet, Mode, Output, resolve_cave};
use window::WindowSetup;

/// Runs a facet until the end of the run.
pub fn run(options: &FacetOptions) -> Result<(), Failure> {
    let reporter = Reporter::start(options.parent_watch)?;
    let outcome = show(options, &reporter);
    if let Err(failure) = &outcome {
        reporter.line(failure.report());
    }
    reporter.flush();
    outcome
}

fn show(options: &FacetOptions, reporter: &Reporter) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let parent = options.parent_watch.then(Parent::watch).transpose()?;
    let compute = compute(options)?;
    let role = if compute == ComputeKind::Everywhere { Role::Server } else { Role::Facet };
    let setup = RunSetup::load(options.scene.load()?, &options.surroundings, role)?;
    let description = options.facet.as_deref().map(|name| setup.cave.facet(name).cloned()).transpose()?;
    let number = description
        .as_ref()
        .map_or(0, |facet| setup.cave.facets.iter().position(|f| f.name == facet.name).unwrap_or(0))
        as FacetNumber;
    let name = slot_name(description.as_ref()).to_owned();
    let draw = &options.draw;
    let in_memory = draw.no_pictures
        || draw.offscreen
        || options.web.web.is_some()
        || description.as_ref().is_some_and(|f| f.output == Output::Offscreen);
    let window_required = description.as_ref().is_some_and(|f| f.window_required);
    let mut desktop = if in_memory { None } else { reach_desktop(&name, window_required)? };
    let offscreen = desktop.is_none();
    let (mut painter, mut window_setup) = (None, None);
    match (draw.no_pictures, offscreen) {
        (true, _) => {}
        (false, true) => {
            painter = Some(match web_screen(options, &setup, description.as_ref(), reporter)? {
                Some(screen) => Painter::Browsers(Box::new(screen)),
                None => {
                    let (facet, overlays) = (description.as_ref(), draw.debug_draw.draw);
                    Painter::Memory(Box::new(RenderThread::new(&setup, facet, draw.quality, overlays)?))
                }
            })
        }
        (false, false) => {
            window_setup = Some(WindowSetup::new(&setup, description.as_ref(), draw.quality, draw.debug_draw.draw)?)
        }
    }
    let mut control = FacetControl {
        name: name.clone(),
        signals,
        reporter: reporter.clone(),
        parent,
        connect_timeout: Duration::from_secs_f64(options.connect_timeout),
        sealed: false,
    };
    let server = find_server(options, &setup, &control)?;
    control.sealed = setup.cave.security.is_some() && matches!(server.address, ServerAddress::Udp(_));
    let again = options.server.is_none() && options.run.is_none();
    let link = FacetEndpoint::open(&server, number, &setup, again)?;
    let session_options = session_options(&setup, &name)?;
    let log = frame_log(options, &name, reporter)?;
    let facet = match compute {
        ComputeKind::Server => Facet::new(link, session_options, setup.world),
        ComputeKind::Everywhere => {
            let simulation = CaveSimulation::new(&setup, setup.world.fork(), options.user_colliders)?
                .disturbed(options.disturb_after);
            let hash = simulation.hash(&setup)?;
            Facet::computing(link, SessionOptions { scene: hash, ..session_options }, Box::new(simulation))
        }
    };
    let watch = draw.watch_pictures.then(|| PictureWatch::new(reporter.clone()));
    let mut runner = FacetRunner::new(facet, painter, log, draw.burn_in, control, reporter.clone(), watch);
    let outcome = match window_setup {
        Some(window_setup) => window_setup.show(&mut runner, draw.burn_in, desktop.take()),
        None => runner.run_offscreen(),
    };
    // in any case, the server need not wait for the timeout
    let _ = runner.facet.leave();
    // a write error is the cause of other errors
    let written = runner.log.as_mut().map_or(Ok(()), FrameLog::finish);
    written.and(outcome)
}

/// Serves the facet to browsers if the options say so.
fn web_screen(
    options: &FacetOptions,
    setup: &RunSetup,
    facet: Option<&CaveFacet>,
    reporter: &Reporter,
) -> Result<Option<WebScreen>, Failure> {
    let (web, draw) = (&options.web, &options.draw);
    let (Some(at), Some(facet)) = (web.web, facet) else { return Ok(None) };
    if draw.frames_dir.is_some() {
        let why = "browsers keep their pictures, so there is none to write; --log-dir writes frames.jsonl";
        return Err(Failure::input(format!("--web with --frames-dir: {why}")));
    }
    WebScreen::open(setup, facet, at, web, draw.quality, draw.debug_draw.draw, reporter).map(Some)
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

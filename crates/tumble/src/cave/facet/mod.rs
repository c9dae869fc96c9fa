//! `tumble facet`: draws the server's frames, shows each when the server says so, and acknowledges
//! the hash of its image.

mod burn_in;
mod control;
mod desktop;
mod frame_log;
mod render_thread;
mod runner;
mod window;

use super::address::ServerAddress;
use super::args::FacetOptions;
use super::endpoints::FacetEndpoint;
use super::lock;
use super::run_setup::{Role, RunSetup};
use super::signals::Signals;
use crate::failure::Failure;
use control::{FacetControl, POLL_INTERVAL, watch_parent};
use desktop::{Desktop, desktop};
use frame_log::FrameLog;
use render_thread::{RenderThread, slot_name};
use runner::FacetRunner;
use std::time::{Duration, Instant};
use tumble::net::sync::{Facet, FacetOptions as SessionOptions, SyncMode};
use tumble::net::sync::{transport::FacetNumber, udp::Entropy};
use tumble::scene::cave::{Mode, Output};
use window::WindowSetup;

/// Runs a facet until the end of the run.
pub fn run(options: &FacetOptions) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let parent_gone = options.parent_watch.then(watch_parent).transpose()?;
    let scene = options.opening.read(&options.scene)?;
    let setup = RunSetup::load(scene, &options.surroundings, Role::Facet)?;
    let description = options.facet.as_deref().map(|name| setup.cave.facet(name).cloned()).transpose()?;
    let number = description
        .as_ref()
        .map_or(0, |facet| setup.cave.facets.iter().position(|f| f.name == facet.name).unwrap_or(0))
        as FacetNumber;
    let name = slot_name(description.as_ref()).to_owned();
    let draw = &options.draw;
    let offscreen = draw.no_pictures
        || draw.offscreen
        || description.as_ref().is_some_and(|f| f.output == Output::Offscreen)
        || lacks_desktop(&name);
    let (mut render_thread, mut window_setup) = (None, None);
    match (draw.no_pictures, offscreen) {
        (true, _) => {}
        (false, true) => {
            render_thread = Some(RenderThread::new(&setup, description.as_ref(), draw.quality, draw.debug_draw.draw)?)
        }
        (false, false) => {
            window_setup = Some(WindowSetup::new(&setup, description.as_ref(), draw.quality, draw.debug_draw.draw)?)
        }
    }
    let mut control = FacetControl {
        name: name.clone(),
        signals,
        parent_gone,
        connect_timeout: Duration::from_secs_f64(options.connect_timeout),
        sealed: false,
    };
    let address = address(options, &setup, &control)?;
    control.sealed = matches!(address, ServerAddress::Udp(_));
    let again = options.server.is_none() && options.run.is_none();
    let link = FacetEndpoint::open(&address, number, &setup, again)?;
    let session_options = session_options(&setup, &name)?;
    let log = match (&draw.frames_dir, &draw.log_dir) {
        (Some(folder), _) => Some(FrameLog::open(folder, &name, true, !options.parent_watch)?),
        (None, Some(folder)) => Some(FrameLog::open(folder, &name, false, !options.parent_watch)?),
        (None, None) => None,
    };
    let facet = Facet::new(link, session_options, setup.world);
    let mut runner = FacetRunner::new(facet, render_thread, log, draw.burn_in, control);
    let outcome = match window_setup {
        Some(window_setup) => window_setup.show(&mut runner, draw.burn_in),
        None => runner.run_offscreen(),
    };
    // in any case, the server need not wait for the timeout
    let _ = runner.facet.leave();
    // a write error is the cause of other errors
    runner.log.as_mut().map_or(Ok(()), FrameLog::finish).and(outcome)
}

/// Returns whether there is no desktop for a window. Reports one that is named and does not answer.
fn lacks_desktop(name: &str) -> bool {
    match desktop() {
        Desktop::Available => return false,
        Desktop::Unreachable(why) => {
            eprintln!("facet {name}: draws into memory, because the desktop does not answer ({why})")
        }
        Desktop::None => {}
    }
    true
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

/// Returns the server's address: from the command line, or from the run in progress on this
/// machine, for which it waits.
fn address(options: &FacetOptions, setup: &RunSetup, control: &FacetControl) -> Result<ServerAddress, Failure> {
    if let Some(server) = options.server {
        return Ok(ServerAddress::Udp(server));
    }
    if let Some(run) = &options.run {
        return Ok(ServerAddress::Memory(run.clone()));
    }
    let until = Instant::now() + control.connect_timeout;
    let mut said = false;
    loop {
        if let Some(address) = lock::find_run(&setup.place)? {
            return Ok(address);
        }
        if control.should_stop() {
            return Err(Failure::run(&control.title(), "ended while it waited for a run"));
        }
        if Instant::now() > until {
            let far = setup.cave.nodes.iter().any(|n| !n.is_local());
            let hint = if far { "; for a run on another machine use --server ADDR:PORT" } else { "" };
            return Err(Failure::run(
                &control.title(),
                format!(
                    "no run was in progress in {} on this machine for {:.0} s{hint}",
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

//! `tumble cave`, `tumble serve`, `tumble facet`: a server that simulates, and a process per facet
//! that draws (thesis §III.C, §IV.C; `docs/netsync.md`).
//!
//! ```text
//! tumble cave ─┬─ simulates, publishes        tumble serve: the same without child processes
//!              ├─ tumble facet front ─ draws
//!              ├─ tumble facet left  ─ draws   each in a process group of its own, with a pipe from the launcher as stdin:
//!              └─ …                            a facet ends when its stdin ends
//! ```
//!
//! The launcher is the server, so a cave of four facets is five processes.

/// Like the standard macro, without a panic if stderr is closed: pictures and recordings continue.
macro_rules! eprintln {
    ($($text:tt)*) => {{
        // one write, because the processes of a run share stderr
        let text = format!($($text)*) + "\n";
        let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
    }};
}

/// The same without the newline.
macro_rules! eprint {
    ($($text:tt)*) => {{
        let _ = std::io::Write::write_all(&mut std::io::stderr(), format!($($text)*).as_bytes());
    }};
}

mod address;
pub mod args;
pub mod console;
mod endpoints;
mod facet;
mod facet_report;
mod gamepad;
mod listener;
mod lock;
mod replay;
mod request;
mod run_setup;
mod server;
mod signals;
mod simulation;
mod tracker;
mod web;

pub use endpoints::key;

use crate::failure::Failure;
use args::{CaveOptions, ConsoleOptions, FacetOptions, RecoverOptions, RelayOptions, ReplayOptions, ServeOptions};

/// Runs the server and the facets of this machine.
pub fn cave(options: &CaveOptions) -> Result<(), Failure> {
    let contacts = options.serve.contacts || options.draw.debug_draw.needs_contacts();
    server::run(&ServeOptions { contacts, ..options.serve.clone() }, Some(options), None)
}

/// Runs the server alone.
pub fn serve(options: &ServeOptions) -> Result<(), Failure> {
    server::run(options, None, None)
}

/// Runs one facet.
pub fn facet(options: &FacetOptions) -> Result<(), Failure> {
    facet::run(options)
}

/// Shows a recorded run on the facets of a cave.
pub fn replay(options: &ReplayOptions) -> Result<(), Failure> {
    let serve = &options.cave.serve;
    let devices = serve.tracker.is_some() || serve.vrpn.is_some() || serve.openxr.is_some() || serve.gamepad.is_some();
    let users = serve.user_colliders || devices || serve.replay_input.is_some();
    let scene = &serve.scene;
    let method = scene.stepper.is_some() || scene.solver.is_some() || scene.integrator.is_some();
    let stepping = scene.dt.is_some() || scene.threads.is_some() || scene.budget.is_some() || method;
    let sound = serve.sound.is_some() || serve.audio.is_some() || serve.play.play.is_some();
    let everywhere = serve.compute == Some(args::ComputeKind::Everywhere);
    if serve.record.is_some()
        || serve.record_cameras
        || users
        || stepping
        || serve.contacts
        || serve.events
        || everywhere
        || sound
    {
        return Err(Failure::input(
            "a replay shows what was recorded; --record, --record-cameras, --user-colliders, --tracker, --vrpn, --openxr, --gamepad, --sound, --audio, --play, --replay-input, --contacts, --events, --dt, --stepper, --solver, --integrator, --threads, --budget and --compute everywhere go with tumble cave",
        ));
    }
    server::run(serve, Some(&options.cave), Some(&options.file))
}

/// Asks the console of a run.
pub fn console(options: &ConsoleOptions) -> Result<(), Failure> {
    console::console(options)
}

/// Forwards the datagrams of a tracker to a server, sealed.
pub fn relay(options: &RelayOptions) -> Result<(), Failure> {
    tracker::relay::relay(options)
}

/// Copies everything readable of a recording to a new file.
pub fn recover(options: &RecoverOptions) -> Result<(), Failure> {
    let report = tumble::net::record::recover(&options.file, &options.output).map_err(Failure::input)?;
    println!(
        "{}: {} frames in {} messages and {} chunks kept",
        options.output.display(),
        report.frames,
        report.messages,
        report.chunks
    );
    let fault = report.fault.map_or("it was complete".to_owned(), |fault| format!("what was wrong: {fault}"));
    println!(
        "{}: {} bytes read, {} damaged chunks and {} other records left out; {fault}",
        options.file.display(),
        report.bytes_used,
        report.damaged_chunks,
        report.dropped_records
    );
    Ok(())
}

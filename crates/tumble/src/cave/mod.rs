//! `tumble cave`, `tumble serve`, `tumble facet`: a server that simulates and a process per facet that draws (thesis §III.C, §IV.C; design of NetSync).
//!
//! ```text
//! tumble cave ─┬─ simulates, publishes        tumble serve: the same without the processes below it
//!              ├─ tumble facet front ─ draws
//!              ├─ tumble facet left  ─ draws   each in a process group of its own, with a pipe from the launcher as stdin:
//!              └─ …                            when that ends, the facet ends
//! ```
//!
//! The launcher is the server: what it prints about the facets it knows at first hand, and a cave of four facets is five processes.

/// As the standard one, but a stderr that nobody reads any more ends no run: pictures and recordings go on without it.
macro_rules! eprintln {
    ($($told:tt)*) => {{
        // in one piece: processes of a run share a stderr
        let told = format!($($told)*) + "\n";
        let _ = std::io::Write::write_all(&mut std::io::stderr(), told.as_bytes());
    }};
}

/// The same without the line's end.
macro_rules! eprint {
    ($($told:tt)*) => {{
        let _ = std::io::Write::write_all(&mut std::io::stderr(), format!($($told)*).as_bytes());
    }};
}

pub mod args;
mod bodies;
mod crew;
mod devices;
mod ends;
mod facet;
mod lock;
mod log;
mod measure;
mod osc;
mod outputs;
mod painter;
mod played;
mod replay;
mod serve;
mod signals;
mod stage;
mod stamp;
mod summary;
mod tracker;
mod users;
mod viewers;
mod window;

use crate::failure::Failure;
use args::{CaveOptions, FacetOptions, RecoverOptions, ReplayOptions, ServeOptions};

/// Server and facets of this machine.
pub fn cave(options: &CaveOptions) -> Result<(), Failure> {
    serve::run(&options.serve, Some(options), None)
}

/// The server alone.
pub fn serve(options: &ServeOptions) -> Result<(), Failure> {
    serve::run(options, None, None)
}

/// One facet.
pub fn facet(options: &FacetOptions) -> Result<(), Failure> {
    facet::run(options)
}

/// The facets of a cave, driven from a recording.
pub fn replay(options: &ReplayOptions) -> Result<(), Failure> {
    let serve = &options.cave.serve;
    let users = serve.push || serve.tracker.is_some() || serve.input_from.is_some();
    if serve.record.is_some() || users || serve.dt.is_some() || serve.stepper.is_some() || serve.solver.is_some() {
        return Err(Failure::input(
            "a replay shows what was recorded; --record, --push, --tracker, --input-from, --dt, --stepper and --solver go with tumble cave",
        ));
    }
    serve::run(serve, Some(&options.cave), Some(&options.file))
}

/// A recording, mended.
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

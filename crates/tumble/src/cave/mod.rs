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

pub mod args;
mod crew;
mod ends;
mod facet;
mod lock;
mod log;
mod measure;
mod painter;
mod serve;
mod signals;
mod stage;
mod stamp;
mod summary;
mod users;
mod window;

use crate::failure::Failure;
use args::{CaveOptions, FacetOptions, ServeOptions};

/// Server and facets of this machine.
pub fn cave(options: &CaveOptions) -> Result<(), Failure> {
    serve::run(&options.serve, Some(options))
}

/// The server alone.
pub fn serve(options: &ServeOptions) -> Result<(), Failure> {
    serve::run(options, None)
}

/// One facet.
pub fn facet(options: &FacetOptions) -> Result<(), Failure> {
    facet::run(options)
}

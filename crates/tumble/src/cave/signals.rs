//! Ctrl-C and SIGTERM end a run in order; a second one ends it at once.

use crate::failure::Failure;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the end was asked for.
#[derive(Clone)]
pub struct Signals(Arc<AtomicBool>);

impl Signals {
    /// From now on.
    pub fn watch() -> Result<Signals, Failure> {
        let asked = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            // in this order: the first signal finds the flag down
            flag::register_conditional_shutdown(signal, 130, asked.clone()).map_err(|e| Failure::run("signals", e))?;
            flag::register(signal, asked.clone()).map_err(|e| Failure::run("signals", e))?;
        }
        Ok(Signals(asked))
    }

    /// Whether one came.
    pub fn end(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

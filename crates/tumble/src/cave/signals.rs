//! Ctrl-C, SIGTERM and SIGHUP end a run in order. What does not end then, because of a frame that nobody answers, ends anyway after a while, and at
//! once by a second signal. (Some senders send each signal twice, so one right behind the first is the same.)

use crate::failure::Failure;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often the watching thread looks.
const LOOK: Duration = Duration::from_millis(50);
/// Signals within this time are one.
const SAME: Duration = Duration::from_millis(500);
/// An end in order takes no longer.
const PATIENCE: Duration = Duration::from_secs(10);
/// As shells tell Ctrl-C.
const CODE: i32 = 130;

/// Whether the end was asked for.
#[derive(Clone)]
pub struct Signals(Arc<AtomicBool>);

impl Signals {
    /// From now on.
    pub fn watch() -> Result<Signals, Failure> {
        let (came, asked) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, came.clone()).map_err(|e| Failure::run("signals", e))?;
        }
        let raised = asked.clone();
        std::thread::Builder::new().name("signals".into()).spawn(move || watch(&came, &raised)).map_err(|e| Failure::run("signals", e))?;
        Ok(Signals(asked))
    }

    /// Whether one came.
    pub fn end(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

fn watch(came: &AtomicBool, asked: &AtomicBool) {
    let mut first: Option<Instant> = None;
    loop {
        std::thread::sleep(LOOK);
        let came = came.swap(false, Ordering::Relaxed);
        match first {
            None if came => {
                asked.store(true, Ordering::Relaxed);
                first = Some(Instant::now());
            }
            Some(since) if since.elapsed() > PATIENCE || came && since.elapsed() > SAME => std::process::exit(CODE),
            _ => {}
        }
    }
}

//! Ctrl-C during long work: a thread of its own does the work, while the calling thread lets the interpreter look at signals.

use crate::errors::{Error, Result, caught};
use pyo3::prelude::*;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, ScopedJoinHandle};
use std::time::Duration;
use tumble::collide::Progress;

/// How often the calling thread looks at signals.
const TURN: Duration = Duration::from_millis(50);

thread_local! {
    /// The stop of the work that this thread is part of.
    static AROUND: RefCell<Option<Stop>> = const { RefCell::new(None) };
}

/// Tells the threads of one piece of work that it shall end.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// An error once the work shall end.
    pub fn check(&self) -> Result<()> {
        if self.stopped() { Err(Error::Stopped) } else { Ok(()) }
    }

    /// Runs `work` as a part of this piece of work: what it starts ends with it.
    pub fn within<T>(&self, work: impl FnOnce() -> T) -> T {
        let before = AROUND.replace(Some(self.clone()));
        let outcome = work();
        AROUND.set(before);
        outcome
    }
}

impl Progress for Stop {
    fn at(&self, _share: f64) {}

    fn stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs `work` with the interpreter let go. Where the interpreter answers a signal with an exception, `work` is told to stop, and the exception
/// is the outcome once it has.
pub fn interruptible<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> Result<T> {
    // a thread of a pool must not wait for others of its pool; the thread that waits for it looks at signals
    if rayon::current_thread_index().is_some() {
        let stop = AROUND.with_borrow(|around| around.clone().unwrap_or_default());
        return py.detach(|| caught(|| work(&stop)));
    }
    let (stop, done, caller) = (Stop::default(), AtomicBool::new(false), thread::current());
    let body = || {
        let outcome = caught(|| work(&stop));
        done.store(true, Ordering::Release);
        caller.unpark();
        outcome
    };
    thread::scope(|scope| {
        let worker = thread::Builder::new()
            .name("tumble".into())
            .spawn_scoped(scope, body)
            .map_err(|e| Error::Internal(e.to_string()))?;
        let signal = watch(py, &done);
        if signal.is_err() {
            stop.0.store(true, Ordering::Relaxed);
        }
        let outcome = py.detach(|| joined(worker));
        signal.and(outcome)
    })
}

/// Waits for the work; an error is what the interpreter made of a signal.
fn watch(py: Python<'_>, done: &AtomicBool) -> Result<()> {
    while !done.load(Ordering::Acquire) {
        py.detach(|| thread::park_timeout(TURN));
        py.check_signals()?;
    }
    Ok(())
}

fn joined<T>(worker: ScopedJoinHandle<'_, Result<T>>) -> Result<T> {
    worker.join().unwrap_or_else(|_| Err(Error::Internal("a thread ended by a panic".into())))
}

//! Ctrl-C during long work: a thread of its own does the work, while the calling thread lets the interpreter look at signals.

use crate::errors::{Error, Result, caught};
use pyo3::prelude::*;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Thread};
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

    fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
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
    fn report(&self, _share: f64) {}

    fn stopped(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Runs `work` with the interpreter let go. Where the interpreter answers a signal with an exception, `work` is told to stop, and the exception
/// is the outcome once it has.
pub fn interruptible<T: Send>(py: Python<'_>, work: impl FnOnce(&Stop) -> Result<T> + Send) -> Result<T> {
    if let Some(stop) = around() {
        return py.detach(|| caught(|| work(&stop)));
    }
    let (stop, done, caller) = (Stop::default(), AtomicBool::new(false), thread::current());
    let body = || finish(caught(|| work(&stop)), &done, &caller);
    thread::scope(|scope| {
        let worker = named().spawn_scoped(scope, body).map_err(|e| Error::Internal(e.to_string()))?;
        let signal = watch(py, &done);
        if signal.is_err() {
            stop.stop();
        }
        let outcome = py.detach(|| joined(worker.join()));
        signal.and(outcome)
    })
}

/// As [`interruptible`], for work that owns what it works on: the exception is the outcome at once, and the work ends behind it at its next look at
/// the stop. For work that looks seldom.
pub fn abandonable<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> Result<T> + Send + 'static,
) -> Result<T> {
    if let Some(stop) = around() {
        return py.detach(|| caught(|| work(&stop)));
    }
    let (stop, done) = (Stop::default(), Arc::new(AtomicBool::new(false)));
    let shared = (stop.clone(), done.clone(), thread::current());
    let worker = named()
        .spawn(move || {
            let (stop, done, caller) = shared;
            finish(caught(|| work(&stop)), &done, &caller)
        })
        .map_err(|e| Error::Internal(e.to_string()))?;
    watch(py, &done).inspect_err(|_| stop.stop())?;
    py.detach(|| joined(worker.join()))
}

/// The stop of the work that this thread is part of, where it is of a pool: such a thread must not wait for others of its pool, and the thread that
/// waits for it looks at signals.
fn around() -> Option<Stop> {
    rayon::current_thread_index().map(|_| AROUND.with_borrow(|around| around.clone().unwrap_or_default()))
}

fn named() -> thread::Builder {
    thread::Builder::new().name("tumble".into())
}

/// Says that the work is done and wakes who waits for it.
fn finish<T>(outcome: T, done: &AtomicBool, caller: &Thread) -> T {
    done.store(true, Ordering::Release);
    caller.unpark();
    outcome
}

/// Waits for the work; an error is what the interpreter made of a signal.
fn watch(py: Python<'_>, done: &AtomicBool) -> Result<()> {
    while !done.load(Ordering::Acquire) {
        py.detach(|| thread::park_timeout(TURN));
        py.check_signals()?;
    }
    Ok(())
}

fn joined<T>(outcome: thread::Result<Result<T>>) -> Result<T> {
    outcome.unwrap_or_else(|_| Err(Error::Internal("a thread ended by a panic".into())))
}

//! Ctrl-C during long work: a separate thread does the work while the calling thread lets the
//! interpreter handle signals.

use crate::errors::{Error, Result, caught};
use pyo3::prelude::*;
use rayon::ThreadPool;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, Thread};
use std::time::Duration;
use tumble::collide::Progress;

/// Interval at which the calling thread checks signals.
const TURN: Duration = Duration::from_millis(50);

thread_local! {
    /// The stop flag of the work that this thread is part of.
    static AROUND: RefCell<Option<Stop>> = const { RefCell::new(None) };
}

/// Asks the threads of one piece of work to stop.
#[derive(Clone, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Returns an error once the work should stop.
    pub fn check(&self) -> Result<()> {
        if self.stopped() { Err(Error::Stopped) } else { Ok(()) }
    }

    fn stop(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Runs `work` as a part of this piece of work. Everything it starts stops with it.
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

/// Runs `work` with the interpreter released. If a signal raises an exception, `work` is asked to
/// stop, and the exception is returned once it has.
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

/// As [`interruptible`], on a thread of the pool: no thread is started.
pub fn pooled<T: Send>(py: Python<'_>, pool: &ThreadPool, work: impl FnOnce(&Stop) -> Result<T> + Send) -> Result<T> {
    if let Some(stop) = around() {
        return py.detach(|| caught(|| work(&stop)));
    }
    let (stop, done, caller) = (Stop::default(), AtomicBool::new(false), thread::current());
    let mut outcome = None;
    let signal = pool.in_place_scope(|scope| {
        let (stop, done, caller, outcome) = (&stop, &done, &caller, &mut outcome);
        scope.spawn(move |_| *outcome = Some(finish(caught(|| work(stop)), done, caller)));
        watch(py, done).inspect_err(|_| {
            stop.stop();
            py.detach(|| {
                while !done.load(Ordering::Acquire) {
                    thread::park_timeout(TURN)
                }
            });
        })
    });
    signal.and(outcome.unwrap_or_else(|| Err(Error::Internal("a thread ended by a panic".into()))))
}

/// As [`interruptible`], for work that owns its data. The exception is returned at once, and the
/// work ends later at its next check of the stop flag. For work that checks rarely.
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

/// Returns the stop flag of the work that this thread is part of, if it belongs to a pool. Such a
/// thread must not wait for others of its pool; the thread that waits for it checks signals.
fn around() -> Option<Stop> {
    rayon::current_thread_index().map(|_| AROUND.with_borrow(|around| around.clone().unwrap_or_default()))
}

fn named() -> thread::Builder {
    thread::Builder::new().name("tumble".into())
}

/// Marks the work as done and wakes the waiting thread.
fn finish<T>(outcome: T, done: &AtomicBool, caller: &Thread) -> T {
    done.store(true, Ordering::Release);
    caller.unpark();
    outcome
}

/// Waits for the work. An error is an exception raised by a signal.
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

//! A world that many Python objects share. Its lock is tried and never waited for, so nothing can
//! block or deadlock.

use crate::errors::{Error, Result, caught};
use crate::world::gc::Ground;
use crate::world::inner::Inner;
use pyo3::prelude::*;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::thread::ThreadId;
use std::time::Duration;

/// How long a call steps before it checks for Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(50);
/// The same with the interpreter held, in switch intervals of the interpreter. A thread that waits
/// for the interpreter asks for its turn only after one whole interval without a release, so turns
/// of one interval could starve it.
const INTERVALS: f64 = 2.0;

/// A world behind its lock, and the thread that works on it.
pub struct Shared {
    inner: Mutex<Inner>,
    stepping: Mutex<Option<ThreadId>>,
    /// The garbage collector's data.
    pub ground: Ground,
}

/// The locked world of one call.
pub struct Held<'a> {
    guard: MutexGuard<'a, Inner>,
    shared: &'a Shared,
}

impl Shared {
    /// Returns a world for handles to share.
    pub fn new(inner: Inner) -> Arc<Shared> {
        let ground = Ground::default();
        ground.list(inner.callables());
        Arc::new(Shared { inner: Mutex::new(inner), stepping: Mutex::new(None), ground })
    }

    /// Locks the world. An error if another call works on it.
    fn hold(&self) -> Result<Held<'_>> {
        match self.inner.try_lock() {
            Ok(guard) if guard.broken => Err(Error::Broken),
            Ok(guard) => {
                *self.stepper() = Some(std::thread::current().id());
                Ok(Held { guard, shared: self })
            }
            Err(TryLockError::Poisoned(_)) => Err(Error::Broken),
            Err(TryLockError::WouldBlock) if *self.stepper() == Some(std::thread::current().id()) => Err(Error::Within),
            Err(TryLockError::WouldBlock) => Err(Error::Busy),
        }
    }

    fn stepper(&self) -> MutexGuard<'_, Option<ThreadId>> {
        self.stepping.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Reads the world.
    pub fn read<T>(&self, call: impl FnOnce(&Inner) -> Result<T>) -> Result<T> {
        let held = self.hold()?;
        caught(|| call(&held))
    }

    /// Changes the world under the interpreter's lock, since Python may be reading the state.
    pub fn write<T>(&self, _py: Python<'_>, call: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
        let mut held = self.hold()?;
        guarded(&mut held, call)
    }

    /// As `write`, for long work: with the interpreter released if possible.
    pub fn work<T: Send>(&self, py: Python<'_>, call: impl FnOnce(&mut Inner) -> Result<T> + Send) -> Result<T> {
        let mut held = self.hold()?;
        apart(py, &mut held, |py, inner| leave(py, inner, call))
    }

    /// Changes the world on any thread, without the interpreter. Arrays over the world's memory show
    /// the state before until [`show`](Self::show).
    pub fn unseen<T>(&self, call: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
        let mut held = self.hold()?;
        held.world.state_memory().freeze();
        guarded(&mut held, call)
    }

    /// Lets arrays over the world's memory show its state again, if no other call works on it.
    pub fn show(&self, _py: Python<'_>) {
        if let Ok(mut held) = self.hold() {
            held.world.state_memory().thaw();
        }
    }

    /// As `work`, in parts of the given length until one returns true. The world stays locked
    /// throughout, and Ctrl-C is checked between two parts.
    pub fn work_in_parts(
        &self,
        py: Python<'_>,
        mut part: impl FnMut(&mut Inner, Duration) -> Result<bool> + Send,
    ) -> Result<()> {
        let mut held = self.hold()?;
        apart(py, &mut held, |py, inner| {
            loop {
                let turn = if inner.looked_into(py) { turn(py)? } else { PATIENCE };
                if leave(py, inner, |inner| part(inner, turn))? {
                    return Ok(());
                }
                py.check_signals()?;
                py.detach(|| ()); // others' turn
            }
        })
    }

    /// Adds or removes forces or behaviors, and updates the garbage collector's list.
    pub fn extend<T>(&self, py: Python<'_>, call: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
        let (out, callables) = self.write(py, |inner| Ok((call(inner)?, inner.callables())))?;
        self.ground.list(callables);
        Ok(out)
    }

    /// Drops forces and behaviors, when only they can still reach this world.
    pub fn drop_callbacks(&self) {
        self.ground.list(Vec::new());
        let gone = self.inner.try_lock().map(|mut inner| inner.take_extension());
        drop(gone); // not under the lock: it may run Python
    }
}

/// Runs a call. If it also runs Python code, arrays over the world's memory keep showing the state
/// before the call until it ends.
fn apart<T>(py: Python<'_>, inner: &mut Inner, call: impl FnOnce(Python<'_>, &mut Inner) -> Result<T>) -> Result<T> {
    if inner.extension.is_empty() || !inner.shown.alive(py) {
        return call(py, inner);
    }
    inner.world.state_memory().freeze();
    let outcome = call(py, inner);
    inner.world.state_memory().thaw();
    outcome
}

/// Returns how long a call may hold the interpreter while other threads wait for it.
fn turn(py: Python<'_>) -> Result<Duration> {
    let interval: f64 = py.import("sys")?.call_method0("getswitchinterval")?.extract()?;
    Ok(Duration::try_from_secs_f64(INTERVALS * interval).unwrap_or(PATIENCE))
}

/// Releases the interpreter for a call, unless an array refers to the memory that changes.
fn leave<T: Send>(py: Python<'_>, inner: &mut Inner, call: impl FnOnce(&mut Inner) -> Result<T> + Send) -> Result<T> {
    if inner.looked_into(py) { guarded(inner, call) } else { py.detach(|| guarded(inner, call)) }
}

/// Runs a call that changes the world. A panic may leave the world inconsistent, so later calls
/// fail.
fn guarded<T>(held: &mut Inner, call: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
    let outcome = caught(|| call(held));
    held.broken = matches!(outcome, Err(Error::Internal(_)));
    outcome
}

impl Deref for Held<'_> {
    type Target = Inner;
    fn deref(&self) -> &Inner {
        &self.guard
    }
}

impl DerefMut for Held<'_> {
    fn deref_mut(&mut self) -> &mut Inner {
        &mut self.guard
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        *self.shared.stepper() = None;
    }
}

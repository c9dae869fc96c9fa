//! One world that many Python objects hold: behind a lock that is tried and never waited for, so that nothing can block or deadlock.

use crate::collect::Ground;
use crate::errors::{Error, Result, caught};
use crate::inner::Inner;
use pyo3::prelude::*;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use std::thread::ThreadId;
use std::time::Duration;

/// How long a call steps before it looks whether the user pressed Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(50);
/// The same while the interpreter is held: as long as the interpreter lets one thread run while others wait.
const TURN: Duration = Duration::from_millis(5);

/// A world behind its lock, and who is stepping it.
pub struct Shared {
    inner: Mutex<Inner>,
    stepping: Mutex<Option<ThreadId>>,
    /// What Python's collector knows of it.
    pub ground: Ground,
}

/// The world while one call works on it.
pub struct Held<'a> {
    guard: MutexGuard<'a, Inner>,
    shared: &'a Shared,
}

impl Shared {
    /// A world to be held by handles.
    pub fn new(inner: Inner) -> Arc<Shared> {
        let ground = Ground::default();
        ground.list(inner.callables());
        Arc::new(Shared { inner: Mutex::new(inner), stepping: Mutex::new(None), ground })
    }

    /// The world, if nobody works on it.
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

    /// Changes the world, under the interpreter's lock: Python may be looking at the state.
    pub fn write<T>(&self, _py: Python<'_>, call: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
        let mut held = self.hold()?;
        guarded(&mut held, call)
    }

    /// The same for what takes long: with the interpreter let go, if it can be.
    pub fn work<T: Send>(&self, py: Python<'_>, call: impl FnOnce(&mut Inner) -> Result<T> + Send) -> Result<T> {
        let mut held = self.hold()?;
        apart(py, &mut held, |py, inner| leave(py, inner, call))
    }

    /// The same in parts of the given length, until one answers that it was the last: the world stays held over all of them, and Ctrl-C is heard between
    /// two.
    pub fn work_in_parts(
        &self,
        py: Python<'_>,
        mut part: impl FnMut(&mut Inner, Duration) -> Result<bool> + Send,
    ) -> Result<()> {
        let mut held = self.hold()?;
        apart(py, &mut held, |py, inner| {
            loop {
                let turn = if inner.looked_into(py) { TURN } else { PATIENCE };
                if leave(py, inner, |inner| part(inner, turn))? {
                    return Ok(());
                }
                py.check_signals()?;
                py.detach(|| ()); // others' turn
            }
        })
    }

    /// Adds or removes forces or behaviours, and tells the collector.
    pub fn extend<T>(&self, py: Python<'_>, call: impl FnOnce(&mut Inner) -> Result<T>) -> Result<T> {
        let (out, callables) = self.write(py, |inner| Ok((call(inner)?, inner.callables())))?;
        self.ground.list(callables);
        Ok(out)
    }

    /// Drops forces and behaviours: nothing can reach this world any more but they themselves.
    pub fn forsake(&self) {
        self.ground.list(Vec::new());
        let gone = self.inner.try_lock().map(|mut inner| inner.take_extension());
        drop(gone); // not under the lock: it may run Python
    }
}

/// Where Python runs within the call too, an array that looks into the world's memory shows the state as it was before, until the call is over.
fn apart<T>(py: Python<'_>, inner: &mut Inner, call: impl FnOnce(Python<'_>, &mut Inner) -> Result<T>) -> Result<T> {
    if inner.extension.is_empty() || !inner.shown.alive(py) {
        return call(py, inner);
    }
    inner.world.freeze_state_memory();
    let outcome = call(py, inner);
    inner.world.thaw_state_memory();
    outcome
}

/// Lets the interpreter go meanwhile, if nobody looks into the memory that changes.
fn leave<T: Send>(py: Python<'_>, inner: &mut Inner, call: impl FnOnce(&mut Inner) -> Result<T> + Send) -> Result<T> {
    if inner.looked_into(py) { guarded(inner, call) } else { py.detach(|| guarded(inner, call)) }
}

/// A panic in a call that changes the world may leave it half-way: later calls say so.
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

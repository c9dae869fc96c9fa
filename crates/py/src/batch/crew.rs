//! Work on many worlds, shared among the threads of a pool. Worlds are independent, so the number
//! of threads and the order of the work change no bit.

use crate::errors::{Error, Result, caught};
use crate::interrupt::{Stop, pooled};
use crate::pool;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long the calling thread works before it checks for Ctrl-C.
const TURN: Duration = Duration::from_millis(50);

/// Largest number of threads that a caller may ask for.
const MOST_THREADS: usize = 1024;

/// The threads of a batch.
pub struct Crew {
    /// Made on first use: it may be the wrong one in a forked process.
    threads: Option<usize>,
    own: Option<Arc<rayon::ThreadPool>>,
}

/// The reason for which work returns before its end.
pub enum Pause<'a> {
    /// When the whole is stopped.
    Stopped(&'a Stop),
    /// At the end of the turn of the calling thread.
    Turn(Instant),
}

impl Pause<'_> {
    /// Returns whether work should return now.
    pub fn now(&self) -> bool {
        match self {
            Pause::Stopped(stop) => stop.check().is_err(),
            Pause::Turn(begun) => begun.elapsed() > TURN,
        }
    }
}

/// Checks a number of threads; `None` is one for each core.
pub fn checked(threads: Option<usize>) -> Result<Option<usize>> {
    match threads {
        Some(n) if n == 0 || n > MOST_THREADS => {
            Err(Error::value(format!("threads is {n}; it must be 1 to {MOST_THREADS}")))
        }
        threads => Ok(threads),
    }
}

/// Calls `work` once for each item on the threads of a pool. Returns the outcomes in the order of
/// the items; a panic is one of them.
pub fn each<T: Send>(
    pool: &rayon::ThreadPool,
    stop: &Stop,
    items: &mut [T],
    work: impl Fn(usize, &mut T) -> Result<()> + Sync,
) -> Vec<Result<()>> {
    let one = |(k, item): (usize, &mut T)| {
        stop.check()?;
        stop.within(|| caught(|| work(k, item)))
    };
    pool.install(|| items.par_iter_mut().enumerate().map(one).collect())
}

impl Crew {
    /// Returns a crew of `threads` threads; `None` for that of all batches, one for each core.
    pub fn new(threads: Option<usize>) -> Result<Crew> {
        let own = threads.filter(|n| *n > 1).map(pool::of).transpose()?;
        Ok(Crew { threads, own })
    }

    /// Returns the number of threads that was asked for.
    pub fn asked(&self) -> Option<usize> {
        self.threads
    }

    /// Returns the number of threads.
    pub fn threads(&self) -> Result<usize> {
        Ok(self.threads.unwrap_or(pool::shared()?.current_num_threads()))
    }

    /// Calls `work` for each item with the interpreter released, again and again until it returns
    /// true for that item. A signal's exception ends all of it.
    ///
    /// One thread is the calling one; else those of the pool work, and the calling one checks
    /// signals.
    pub fn run<T: Send>(
        &self,
        py: Python<'_>,
        items: &mut [T],
        work: impl Fn(usize, &mut T, &Pause<'_>) -> Result<bool> + Sync,
    ) -> Result<()> {
        if self.threads == Some(1) || items.len() < 2 {
            return alone(py, items, work);
        }
        let pool = match &self.own {
            Some(pool) => pool.clone(),
            None => pool::shared()?,
        };
        pooled(py, &pool, |stop| {
            let whole = |k: usize, item: &mut T| {
                while !work(k, item, &Pause::Stopped(stop))? {
                    stop.check()?;
                }
                Ok(())
            };
            each(&pool, stop, items, whole).into_iter().collect()
        })
    }
}

/// Works through the items on the calling thread, in turns between which signals are checked.
fn alone<T: Send>(
    py: Python<'_>,
    items: &mut [T],
    work: impl Fn(usize, &mut T, &Pause<'_>) -> Result<bool> + Sync,
) -> Result<()> {
    let mut at = 0;
    while at < items.len() {
        let (items, work) = (&mut *items, &work);
        at = py.detach(|| {
            let pause = Pause::Turn(Instant::now());
            let mut at = at;
            while at < items.len() && caught(|| work(at, &mut items[at], &pause))? {
                at += 1;
            }
            Ok::<usize, Error>(at)
        })?;
        py.check_signals()?;
    }
    Ok(())
}

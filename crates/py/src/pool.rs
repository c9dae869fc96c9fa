//! The thread pool of batches, rollouts and sphere trees. It is made on first use, and again in a
//! forked process, which has none of its parent's threads.

use crate::errors::{Error, Result, caught};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// The pool, with the process that it belongs to.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Returns the pool with as many threads as cores.
pub fn shared() -> Result<Arc<ThreadPool>> {
    let process = std::process::id();
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, pool)) = &*kept
        && *of == process
    {
        return Ok(pool.clone());
    }
    // The parent's threads do not exist here. Dropping the pool would wait for them forever.
    std::mem::forget(kept.take());
    let pool = of(0)?;
    *kept = Some((process, pool.clone()));
    Ok(pool)
}

/// Runs work that may divide itself among the threads of the pool.
pub fn run<R: Send>(work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
    let pool = shared()?;
    caught(|| pool.install(work))
}

/// Returns a pool with `threads` threads; 0 for as many as cores.
pub fn of(threads: usize) -> Result<Arc<ThreadPool>> {
    ThreadPoolBuilder::new().num_threads(threads).build().map(Arc::new).map_err(|e| Error::Internal(e.to_string()))
}

//! The threads that batches, rollouts and sphere trees run on: made when first asked for, and made anew in a process that was forked, which has none of its parent's threads.

use crate::errors::{Error, Result, caught};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Mutex, PoisonError};

/// The pool of this process, and which process it is of.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// As many threads as there are cores.
pub fn shared() -> Result<Arc<ThreadPool>> {
    let process = std::process::id();
    let mut kept = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((of, pool)) = &*kept
        && *of == process
    {
        return Ok(pool.clone());
    }
    // the parent's threads are not here: to end them would be to wait for ever
    std::mem::forget(kept.take());
    let pool = of(0)?;
    *kept = Some((process, pool.clone()));
    Ok(pool)
}

/// Runs there what may split itself among threads.
pub fn run<R: Send>(work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
    let pool = shared()?;
    caught(|| pool.install(work))
}

/// So many threads; 0 for as many as there are cores.
pub fn of(threads: usize) -> Result<Arc<ThreadPool>> {
    ThreadPoolBuilder::new().num_threads(threads).build().map(Arc::new).map_err(|e| Error::Internal(e.to_string()))
}

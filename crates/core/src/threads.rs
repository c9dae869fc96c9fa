//! The threads of a step: independent pieces of work on several threads, with results that do not
//! depend on their number.
//!
//! A piece writes to memory of its own, or to a part of an array that no other piece reads. The
//! caller joins the results in the order of the pieces. Which thread takes a piece is left to
//! chance, and changes no bit.
//!
//! All worlds of a process share one pool per number of threads, so a fork starts none. The calling
//! thread works too. It works alone if
//!
//! - the setting is 1, or the work is small,
//! - another world is using the pool at the time,
//! - it belongs to a pool itself, such as that of a batch of worlds, which has work for every core,
//!   or
//! - the operating system starts no further threads.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError, TryLockError};

/// Maximum number of threads.
pub(crate) const MAX_THREADS: u32 = 256;
/// Number of pieces per thread: pieces of unequal cost still end at about the same time.
const PIECES_PER_THREAD: usize = 4;

/// Pools of the process, ascending by their number of threads.
static POOLS: Mutex<Vec<Arc<Pool>>> = Mutex::new(Vec::new());

/// Threads that wait for work.
struct Pool {
    /// The process that has them: a forked one has none of its parent's threads.
    process: u32,
    /// Their number, with the calling thread.
    threads: usize,
    workers: ThreadPool,
    /// Held by the world that uses them.
    used: Mutex<()>,
}

/// The threads that a world may use in a step.
#[derive(Clone)]
pub(crate) struct Threads {
    /// `None`: the calling thread alone.
    pool: Option<Arc<Pool>>,
}

impl Threads {
    /// The calling thread alone.
    pub const NONE: Threads = Threads { pool: None };

    /// Sets the number of threads for the step to come: 0 for as many as cores.
    pub fn set(&mut self, asked: u32) {
        let threads = match asked {
            1 => 1,
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            more => more as usize,
        };
        if threads <= 1 || rayon::current_thread_index().is_some() {
            self.pool = None;
            return;
        }
        let process = std::process::id();
        if self.pool.as_ref().is_none_or(|pool| pool.threads != threads || pool.process != process) {
            self.pool = pool(process, threads);
        }
    }

    /// Returns their number, with the calling thread.
    pub fn count(&self) -> usize {
        self.pool.as_ref().map_or(1, |pool| pool.threads)
    }

    /// Returns the ranges of the pieces of `0..len`, each of at least `least` but the last; one
    /// range if there is one thread.
    pub fn pieces(&self, len: usize, least: usize) -> Vec<Range<usize>> {
        let most = if self.count() > 1 { PIECES_PER_THREAD * self.count() } else { 1 };
        let pieces = (len / least.max(1)).clamp(1, most);
        (0..pieces).map(|i| i * len / pieces..(i + 1) * len / pieces).collect()
    }

    /// Cuts an array of records of `record` numbers each into pieces of at least `least` records, and calls `work`
    /// with the number of the first record and the records of each piece. Returns the results in the order of the
    /// pieces.
    pub fn each_piece<T: Send, R: Send>(
        &self,
        items: &mut [T],
        record: usize,
        least: usize,
        work: impl Fn(usize, &mut [T]) -> R + Sync,
    ) -> Vec<R> {
        let pieces = self.pieces(items.len() / record.max(1), least);
        let mut results: Vec<Option<R>> = pieces.iter().map(|_| None).collect();
        let (mut parts, mut rest) = (Vec::new(), items);
        for (piece, result) in pieces.into_iter().zip(&mut results) {
            let (own, behind) = std::mem::take(&mut rest).split_at_mut(piece.len() * record);
            parts.push((piece.start, own, result));
            rest = behind;
        }
        self.each(parts, |(first, own, result)| *result = Some(work(first, own)));
        results.into_iter().flatten().collect()
    }

    /// Does the work on every item, on several threads at once. Items are taken in order.
    pub fn each<T: Send>(
        &self,
        items: impl IntoIterator<Item = T, IntoIter: ExactSizeIterator + Send>,
        work: impl Fn(T) + Sync,
    ) {
        let items = items.into_iter();
        let helpers = items.len().min(self.count()).saturating_sub(1);
        let pool = self.pool.as_ref().filter(|_| helpers > 0);
        let Some((pool, _held)) = pool.and_then(|pool| Some((pool, pool.take()?))) else {
            return items.for_each(work);
        };
        let items = Mutex::new(items);
        let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
        let go = || {
            while let Some(item) = next() {
                work(item);
            }
        };
        pool.workers.in_place_scope(|scope| {
            (0..helpers).for_each(|_| scope.spawn(|_| go()));
            go();
        });
    }
}

impl Pool {
    /// Returns `None` while another world uses the pool.
    fn take(&self) -> Option<std::sync::MutexGuard<'_, ()>> {
        match self.used.try_lock() {
            Ok(held) => Some(held),
            Err(TryLockError::Poisoned(held)) => Some(held.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

/// Returns the pool of a number of threads, and makes it on first use.
fn pool(process: u32, threads: usize) -> Option<Arc<Pool>> {
    let mut pools = POOLS.lock().unwrap_or_else(PoisonError::into_inner);
    if pools.iter().any(|pool| pool.process != process) {
        // dropping a pool would wait forever for threads that are not in this process
        std::mem::forget(std::mem::take(&mut *pools));
    }
    if let Some(known) = pools.iter().find(|pool| pool.threads == threads) {
        return Some(known.clone());
    }
    let name = |i| format!("tumble {}", i + 1);
    let workers = ThreadPoolBuilder::new().num_threads(threads - 1).thread_name(name).build().ok()?;
    let made = Arc::new(Pool { process, threads, workers, used: Mutex::new(()) });
    pools.push(made.clone());
    Some(made)
}

//! Ctrl-C, SIGTERM and SIGHUP end a run in order. If the run does not end, for instance because a
//! frame is not answered, it is ended after a timeout, or at once by a second signal. Child
//! processes are then killed and the lock is removed. (Some programs send each signal twice, so a
//! signal right after the first one is ignored.)

use crate::failure::Failure;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Interval at which the watching thread polls.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Signals within this time count as one.
const DEBOUNCE: Duration = Duration::from_millis(500);
/// Timeout of an orderly end, well above that of the facets.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(10);
/// Exit code of shells for Ctrl-C.
const EXIT_CODE: i32 = 130;

/// Shared state of the signal watch: whether the end was requested.
#[derive(Clone)]
pub struct Signals {
    stop_requested: Arc<AtomicBool>,
    /// Whether the timeout of an orderly end begins again.
    postponed: Arc<AtomicBool>,
    cleanup: Arc<Mutex<Cleanup>>,
}

/// Processes and files that a forced end must remove.
#[derive(Default)]
struct Cleanup {
    /// Leaders of process groups.
    processes: Vec<u32>,
    files: Vec<PathBuf>,
}

impl Signals {
    /// Starts to watch the signals.
    pub fn watch() -> Result<Signals, Failure> {
        let (came, stop_requested) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, came.clone()).map_err(|e| Failure::run("signals", e))?;
        }
        let cleanup = Arc::new(Mutex::new(Cleanup::default()));
        let postponed = Arc::new(AtomicBool::new(false));
        let (raised, later, kept) = (stop_requested.clone(), postponed.clone(), cleanup.clone());
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(move || watch(&came, &raised, &later, &kept))
            .map_err(|e| Failure::run("signals", e))?;
        Ok(Signals { stop_requested, postponed, cleanup })
    }

    /// Returns whether a signal arrived.
    pub fn stop_requested(&self) -> bool {
        self.stop_requested.load(Ordering::Relaxed)
    }

    /// Begins the timeout of an orderly end again, because the end makes progress.
    pub fn postpone(&self) {
        self.postponed.store(true, Ordering::Relaxed);
    }

    /// Notes a started process that leads a process group.
    pub fn started(&self, process: u32) {
        lock(&self.cleanup).processes.push(process);
    }

    /// Notes the end of a process.
    pub fn ended(&self, process: u32) {
        lock(&self.cleanup).processes.retain(|other| *other != process);
    }

    /// Notes a file to remove at a forced end.
    pub fn remove_at_the_end(&self, file: PathBuf) {
        lock(&self.cleanup).files.push(file);
    }
}

fn lock(cleanup: &Mutex<Cleanup>) -> MutexGuard<'_, Cleanup> {
    cleanup.lock().unwrap_or_else(PoisonError::into_inner)
}

fn end(cleanup: &Mutex<Cleanup>) -> ! {
    let cleanup = lock(cleanup);
    for pid in cleanup.processes.iter().filter_map(|pid| rustix::process::Pid::from_raw(*pid as i32)) {
        let _ = rustix::process::kill_process_group(pid, rustix::process::Signal::KILL);
    }
    cleanup.files.iter().for_each(|file| _ = std::fs::remove_file(file));
    std::process::exit(EXIT_CODE)
}

fn watch(came: &AtomicBool, stop_requested: &AtomicBool, postponed: &AtomicBool, cleanup: &Mutex<Cleanup>) {
    let (mut first, mut timeout_begins) = (None::<Instant>, Instant::now());
    loop {
        std::thread::sleep(POLL_INTERVAL);
        let came = came.swap(false, Ordering::Relaxed);
        match first {
            None if came => {
                stop_requested.store(true, Ordering::Relaxed);
                timeout_begins = Instant::now();
                first = Some(timeout_begins);
            }
            Some(since) if came && since.elapsed() > DEBOUNCE => end(cleanup),
            Some(_) if postponed.swap(false, Ordering::Relaxed) => timeout_begins = Instant::now(),
            Some(_) if timeout_begins.elapsed() > SHUTDOWN_TIMEOUT => end(cleanup),
            _ => {}
        }
    }
}

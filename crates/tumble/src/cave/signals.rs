//! Ctrl-C, SIGTERM and SIGHUP end a run in order. What does not end then, because of a frame that nobody answers, ends anyway after a while, and at
//! once by a second signal: processes that were started are killed first, and the lock is removed. (Some senders send each signal twice, so one right behind the
//! first is the same.)

use crate::failure::Failure;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How often the watching thread looks.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// Signals within this time are one.
const DEBOUNCE: Duration = Duration::from_millis(500);
/// An end in order takes no longer: well above what facets are given to end.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(10);
/// As shells tell Ctrl-C.
const EXIT_CODE: i32 = 130;

/// Whether the end was asked for.
#[derive(Clone)]
pub struct Signals {
    stop_requested: Arc<AtomicBool>,
    cleanup: Arc<Mutex<Cleanup>>,
}

/// What an end out of order must not leave.
#[derive(Default)]
struct Cleanup {
    /// Leaders of process groups.
    processes: Vec<u32>,
    files: Vec<PathBuf>,
}

impl Signals {
    /// From now on.
    pub fn watch() -> Result<Signals, Failure> {
        let (came, stop_requested) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            signal_hook::flag::register(signal, came.clone()).map_err(|e| Failure::run("signals", e))?;
        }
        let cleanup = Arc::new(Mutex::new(Cleanup::default()));
        let (raised, kept) = (stop_requested.clone(), cleanup.clone());
        std::thread::Builder::new()
            .name("signals".into())
            .spawn(move || watch(&came, &raised, &kept))
            .map_err(|e| Failure::run("signals", e))?;
        Ok(Signals { stop_requested, cleanup })
    }

    /// Whether one came.
    pub fn stop_requested(&self) -> bool {
        self.stop_requested.load(Ordering::Relaxed)
    }

    /// A process that leads a group was started.
    pub fn started(&self, process: u32) {
        lock(&self.cleanup).processes.push(process);
    }

    /// It is gone.
    pub fn ended(&self, process: u32) {
        lock(&self.cleanup).processes.retain(|other| *other != process);
    }

    /// A file that goes with this process.
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

fn watch(came: &AtomicBool, stop_requested: &AtomicBool, cleanup: &Mutex<Cleanup>) {
    let mut first: Option<Instant> = None;
    loop {
        std::thread::sleep(POLL_INTERVAL);
        let came = came.swap(false, Ordering::Relaxed);
        match first {
            None if came => {
                stop_requested.store(true, Ordering::Relaxed);
                first = Some(Instant::now());
            }
            Some(since) if since.elapsed() > SHUTDOWN_TIMEOUT || came && since.elapsed() > DEBOUNCE => end(cleanup),
            _ => {}
        }
    }
}

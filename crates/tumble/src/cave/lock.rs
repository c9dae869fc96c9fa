//! One run per cave and user: a locked file that describes the run in progress (thesis §IV.C).
//!
//! The system releases the lock with the process, however that ends. Facets that are started by
//! hand read the address of the server from the file.

use super::address::{RunKey, RunServer, ServerAddress};
use super::run_setup::RunSetup;
use crate::failure::Failure;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::net::SocketAddr;
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};
use tumble::net::sync::shm::folder;

/// Time for a replaced run to end by itself, and then to be gone after it was killed.
const REPLACE_TIMEOUT: Duration = Duration::from_secs(5);
/// Maximum length of the text, bytes: a few paths of maximum length with every byte escaped.
const MAX_LOCK_BYTES: u64 = 1 << 16;

/// Content of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunInfo {
    pub pid: i32,
    pub scene: String,
    pub cave: String,
    /// Start of the run, s since 1970.
    pub since_unix_s: u64,
    /// Start of the process, ticks since boot. A process id alone may be reused.
    pub start_ticks: u64,
    /// Address of the server; `None` before facets can join.
    pub address: Option<ServerAddress>,
    /// Key of the run over UDP without a key file.
    #[serde(default)]
    pub key: Option<RunKey>,
    /// The operator's console.
    #[serde(default)]
    pub console: Option<ConsoleLink>,
}

/// Address and token of a console. The file can be read by its user alone.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
pub struct ConsoleLink {
    pub address: SocketAddr,
    pub token: String,
}

impl std::fmt::Debug for ConsoleLink {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "ConsoleLink({}, secret)", self.address)
    }
}

impl RunInfo {
    /// Describes the run of this process.
    pub fn here(scene: &str, cave: &str) -> RunInfo {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let pid = std::process::id() as i32;
        RunInfo {
            pid,
            scene: scene.into(),
            cave: cave.into(),
            since_unix_s: since.as_secs(),
            start_ticks: start_ticks(pid).unwrap_or(0),
            address: None,
            key: None,
            console: None,
        }
    }

    /// Returns whether the process is still the one that wrote the file.
    fn is_running(&self) -> bool {
        start_ticks(self.pid) == Some(self.start_ticks)
    }

    fn description(&self) -> String {
        format!("process {}, scene {}, since {}", self.pid, self.scene, utc(self.since_unix_s))
    }
}

/// The lock of a run. The file is removed with it.
pub struct RunLock {
    file: File,
    path: PathBuf,
}

impl RunLock {
    /// Locks the cave, or refuses with a description of the run in progress. With `replace` that
    /// run is asked to end, then killed.
    pub fn take(setup: &RunSetup, run: &RunInfo, replace: bool) -> Result<RunLock, Failure> {
        let (cave, path) = (&setup.cave, path(&setup.place)?);
        let until = Instant::now() + 2 * REPLACE_TIMEOUT;
        let (mut asked, mut killed) = (None, false);
        loop {
            if let Some(file) = try_take(&path)? {
                let mut lock = RunLock { file, path };
                lock.write(run)?;
                return Ok(lock);
            }
            // the text may be of an earlier run, and its process id reused
            let other = read(&path).filter(RunInfo::is_running);
            let name = other
                .as_ref()
                .map_or("another process, which has not written its description yet".to_owned(), RunInfo::description);
            if !replace {
                return Err(Failure::run(
                    "the cave",
                    format!("a run is already in progress in {}: {name}; end it first, or use --replace", cave.file),
                ));
            }
            let now = Instant::now();
            if now > until {
                return Err(Failure::run("the cave", format!("the run in {} does not end: {name}", cave.file)));
            }
            match (&other, asked) {
                (Some(other), None) => {
                    eprintln!("ending the run in {}: {name}", cave.file);
                    signal(other.pid, rustix::process::Signal::TERM);
                    asked = Some(now);
                }
                (Some(other), Some(since)) if !killed && now > since + REPLACE_TIMEOUT => {
                    signal(other.pid, rustix::process::Signal::KILL);
                    killed = true;
                }
                _ => std::thread::sleep(Duration::from_millis(20)),
            }
        }
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the description of the run.
    pub fn write(&mut self, run: &RunInfo) -> Result<(), Failure> {
        let failed = |e: std::io::Error| Failure::run("the cave's lock", e);
        let text = serde_json::to_string(run).map_err(|e| Failure::run("the cave's lock", e))?;
        self.file.set_len(0).and_then(|()| self.file.rewind()).map_err(failed)?;
        self.file.write_all(text.as_bytes()).and_then(|()| self.file.flush()).map_err(failed)
    }
}

impl Drop for RunLock {
    fn drop(&mut self) {
        // still locked: a process that waits for the lock then finds another file at the path
        let _ = std::fs::remove_file(&self.path);
    }
}

/// Returns the server of the run in progress in the cave at `place` ([`RunSetup::place`])
/// on this machine, if facets can join it. It takes no lock, which a starting run would mistake for
/// a run in progress.
pub fn find_run(place: &str) -> Result<Option<RunServer>, Failure> {
    let run = read(&path(place)?).filter(RunInfo::is_running);
    Ok(run.and_then(|run| Some(RunServer { address: run.address?, key: run.key })))
}

/// Returns the token of the console at this address, if a run of this user on this machine has it.
pub fn find_console(at: SocketAddr) -> Result<Option<String>, Failure> {
    let (folder, _) = folder().map_err(|e| Failure::run("the cave's lock", e))?;
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let locks = files.filter(|path| path.extension().is_some_and(|extension| extension == "lock"));
    let consoles = locks.filter_map(|path| read(&path)).filter(RunInfo::is_running).filter_map(|run| run.console);
    Ok(consoles.into_iter().find(|console| console.address == at).map(|console| console.token))
}

/// Returns when a process started, ticks since boot. Returns `None` if there is no such process, or
/// if it is a zombie.
fn start_ticks(pid: i32) -> Option<u64> {
    let about = std::fs::read(format!("/proc/{pid}/stat")).ok()?;
    // the name in parentheses may contain anything; the third field follows it, and the start time
    // is the 22nd
    let behind = String::from_utf8_lossy(&about).rsplit_once(')')?.1.to_owned();
    let fields: Vec<&str> = behind.split_whitespace().collect();
    if matches!(fields.first(), Some(&("Z" | "X"))) {
        return None;
    }
    fields.get(22 - 3)?.parse().ok()
}

fn path(place: &str) -> Result<PathBuf, Failure> {
    let (folder, _) = folder().map_err(|e| Failure::run("the cave's lock", e))?;
    let hash = blake3::hash(place.as_bytes()).to_hex();
    Ok(folder.join(format!("cave-{}.lock", &hash[..16])))
}

/// Opens and locks the file; `None` if another process has the lock.
fn try_take(path: &Path) -> Result<Option<File>, Failure> {
    let failed = |e: std::io::Error| Failure::run(&format!("the cave's lock {}", path.display()), e);
    for _ in 0..100 {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(path)
            .map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => return Ok(None),
            Err(TryLockError::Error(e)) => return Err(failed(e)),
        }
        // the previous run may have removed the file between opening and locking
        let (ours, there) = (file.metadata().map_err(failed)?.ino(), std::fs::metadata(path).map(|m| m.ino()).ok());
        if there == Some(ours) {
            return Ok(Some(file));
        }
    }
    Ok(None)
}

fn read(path: &Path) -> Option<RunInfo> {
    let mut text = String::new();
    File::open(path).ok()?.take(MAX_LOCK_BYTES).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

fn signal(pid: i32, signal: rustix::process::Signal) {
    if let Some(pid) = rustix::process::Pid::from_raw(pid).filter(|_| pid > 1) {
        let _ = rustix::process::kill_process(pid, signal); // it may be gone already
    }
}

/// Formats a time as `2026-11-21 13:05:22 UTC`. Converts days to a date of the proleptic Gregorian
/// calendar, with years that begin in March.
fn utc(unix_s: u64) -> String {
    let (days, s) = ((unix_s / 86_400) as i64 + 719_468, unix_s % 86_400);
    let (era, day_of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month_from_march = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month_from_march + 2) / 5 + 1;
    let month = if month_from_march < 10 { month_from_march + 3 } else { month_from_march - 9 };
    let year = 400 * era + year_of_era + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02}:{:02} UTC", s / 3600, s / 60 % 60, s % 60)
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_process_is_known_by_its_number_and_beginning() {
        let mut run = super::RunInfo::here("s", "c");
        assert!(run.is_running());
        run.start_ticks += 1;
        assert!(!run.is_running());
        // no process has this number
        assert_eq!(super::start_ticks(i32::MAX), None);
    }

    #[test]
    fn dates_are_those_of_the_calendar() {
        // by `date -u -d @N`
        assert_eq!(super::utc(0), "1970-01-01 00:00:00 UTC");
        assert_eq!(super::utc(951_782_399), "2000-02-28 23:59:59 UTC");
        assert_eq!(super::utc(951_782_400), "2000-02-29 00:00:00 UTC");
        assert_eq!(super::utc(4_102_444_800), "2100-01-01 00:00:00 UTC");
    }
}

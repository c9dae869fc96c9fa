//! Wakes the processes of a run by counters in shared memory on which the kernel can wait (futex).
//!
//! ```text
//! server, to all facets at once                        facet, to the server
//!   to_facets ← to_facets + 1                            to_server ← to_server + 1
//!   wake all that wait for to_facets to change           wake it if to_server has reached wanted
//!
//! facet waits                                          server waits
//!   while to_facets = value before it read               wanted ← to_server before it read + outstanding replies
//!                                                        while to_server = value before it read
//! ```
//!
//! A message to any number of facets costs one system call of the server and one of each facet, and
//! only the last reply wakes the server. No wakeup is lost between reading and waiting, because the
//! kernel compares the counter before it sleeps. The counters carry no data; a process that misses
//! a wakeup reads again after its timeout.
//!
//! The memory is one page per run, `tumble_USER_…_RUN.wakeup`. The server holds a lock on it and
//! removes it at its end. A page without a lock was left by a killed server, and [`clean_up`]
//! removes it. (A process id would not do: it may be reused, or belong to another container.)

use crate::sync::transport::LinkError;
use iceoryx2::prelude::{FileName, SemanticString};
use iceoryx2_bb_concurrency::atomic::AtomicU32;
use iceoryx2_bb_posix::access_mode::AccessMode;
use iceoryx2_cal::dynamic_storage::posix_shared_memory::{Builder, Configuration, Storage};
use iceoryx2_cal::dynamic_storage::{DynamicStorage, DynamicStorageBuilder};
use iceoryx2_cal::named_concept::{NamedConceptBuilder, NamedConceptConfiguration};
use rustix::io::Errno;
use rustix::thread::futex;
use std::ffi::OsStr;
use std::fmt::Debug;
use std::fs::{File, Metadata, OpenOptions};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering::SeqCst;
use std::time::Duration;

/// Notifications to the facets; notifications to the server; value at which the server wants to be
/// woken; number of servers so far.
type Counters = [AtomicU32; 4];
const TO_FACETS: usize = 0;
const TO_SERVER: usize = 1;
const WANTED: usize = 2;
const SERVERS: usize = 3;

const SUFFIX: &str = ".wakeup";
/// Maximum number of attempts to create the page.
const MAX_TRIES: usize = 100;
/// Folder of shared memory objects.
const SHM_DIR: &str = "/dev/shm";

/// Access to the counters of a run.
pub struct Wakeup {
    memory: Storage<Counters>,
    /// Number of this server of the run and its lock; `None` for a facet.
    server: Option<(u32, File)>,
}

impl Wakeup {
    /// Creates the counters, or takes over those of an earlier server of the run.
    ///
    /// # Errors
    /// The system refuses.
    pub fn serve(run: &str, user: u32) -> Result<Wakeup, LinkError> {
        let (name, configuration) = (file_name(run)?, configuration(user)?);
        let path = file(&name, &configuration);
        for _ in 0..MAX_TRIES {
            if path.symlink_metadata().is_ok() && open_private(&path).is_none() {
                break;
            }
            let mut fresh = |value: &mut std::mem::MaybeUninit<Counters>, _: &mut _| {
                value.write(Default::default());
                true
            };
            let builder = Builder::<Counters>::new(&name)
                .config(&configuration)
                .has_ownership(false)
                .timeout(Duration::from_secs(1));
            let storage = builder.initializer(&mut fresh).open_or_create().map_err(refused)?;
            // a clean-up may have come before the lock: create another page
            let Some(lock) = open_private(&path).filter(|lock| lock.try_lock_shared().is_ok()) else { continue };
            if open_private(&path).is_some_and(|there| same_inode(&there, &lock)) {
                let server = storage.get()[SERVERS].fetch_add(1, SeqCst).wrapping_add(1);
                storage.acquire_ownership();
                return Ok(Wakeup { memory: storage, server: Some((server, lock)) });
            }
        }
        Err(LinkError::Other(format!(
            "shared memory: {} must be a file of this user with mode 600; remove it",
            path.display()
        )))
    }

    /// Opens the counters as a facet; `None` while there is no server.
    ///
    /// # Errors
    /// The run's name is too long.
    pub fn join(run: &str, user: u32) -> Result<Option<Wakeup>, LinkError> {
        let (name, configuration) = (file_name(run)?, configuration(user)?);
        if open_private(&file(&name, &configuration)).is_none() {
            return Ok(None);
        }
        let memory =
            Builder::<Counters>::new(&name).config(&configuration).has_ownership(false).open(AccessMode::ReadWrite);
        Ok(memory.ok().map(|memory| Wakeup { memory, server: None }))
    }

    /// Wakes all facets.
    pub fn notify_facets(&self) {
        self.counter(TO_FACETS).fetch_add(1, SeqCst);
        self.wake(TO_FACETS, i32::MAX as u32);
    }

    /// Counts a reply to the server, and wakes it if it waits for no more; with `now` in any case.
    pub fn notify_server(&self, now: bool) {
        let server_notifications = self.counter(TO_SERVER).fetch_add(1, SeqCst).wrapping_add(1);
        let past = server_notifications.wrapping_sub(self.counter(WANTED).load(SeqCst));
        if now || past <= u32::MAX / 2 {
            self.wake(TO_SERVER, 1);
        }
    }

    /// Returns the notifications to facets so far. To be read before reading messages.
    pub fn facet_notifications(&self) -> u32 {
        self.counter(TO_FACETS).load(SeqCst)
    }

    /// Returns the notifications to the server so far. To be read before reading messages.
    pub fn server_notifications(&self) -> u32 {
        self.counter(TO_SERVER).load(SeqCst)
    }

    /// Waits for the next notification to facets, at most `timeout`.
    pub fn wait_for_facet_notification(&self, seen: u32, timeout: Duration) -> Result<(), LinkError> {
        self.wait(TO_FACETS, seen, timeout)
    }

    /// Waits for `owed` more notifications to the server (at least one), at most `timeout`.
    pub fn wait_for_server_notifications(&self, seen: u32, owed: u32, timeout: Duration) -> Result<(), LinkError> {
        self.counter(WANTED).store(seen.wrapping_add(owed.max(1)), SeqCst);
        self.wait(TO_SERVER, seen, timeout)
    }

    fn counter(&self, which: usize) -> &std::sync::atomic::AtomicU32 {
        &self.memory.get()[which]
    }

    fn wake(&self, which: usize, most: u32) {
        // it fails only for an invalid address
        let _ = futex::wake(self.counter(which), futex::Flags::empty(), most);
    }

    fn wait(&self, which: usize, seen: u32, timeout: Duration) -> Result<(), LinkError> {
        let timeout = timeout.try_into().ok();
        match futex::wait(self.counter(which), futex::Flags::empty(), seen, timeout.as_ref()) {
            // changed before the sleep, timed out, or interrupted by a signal: read again
            Ok(()) | Err(Errno::AGAIN | Errno::TIMEDOUT | Errno::INTR) => Ok(()),
            Err(why) => Err(LinkError::Io { what: "shared memory: wait".into(), why: why.into() }),
        }
    }
}

impl Drop for Wakeup {
    /// Removes the file, unless another server has taken over.
    fn drop(&mut self) {
        if self.server.as_ref().is_some_and(|(server, _)| self.counter(SERVERS).load(SeqCst) != *server) {
            self.memory.release_ownership();
        }
    }
}

/// Removes the pages of this user's servers that are gone.
pub fn clean_up(user: u32) {
    let (Ok(files), Ok(configuration)) = (std::fs::read_dir(SHM_DIR), configuration(user)) else { return };
    let is_bell = |name: &OsStr| {
        FileName::new(name.as_encoded_bytes()).is_ok_and(|name| configuration.extract_name_from_file(&name).is_some())
    };
    for file in files.flatten().filter(|file| is_bell(&file.file_name())) {
        // a server that is about to lock it finds it gone and creates another
        if let Some(left) = open_private(&file.path())
            && left.try_lock().is_ok()
            && open_private(&file.path()).is_some_and(|there| same_inode(&there, &left))
        {
            let _ = std::fs::remove_file(file.path());
        }
    }
}

/// Returns the file of the object with this name.
fn file(name: &FileName, configuration: &Configuration<Counters>) -> PathBuf {
    Path::new(SHM_DIR).join(String::from_utf8_lossy(configuration.path_for(name).file_name().as_bytes()).as_ref())
}

/// Opens a file of this user with mode 600. Another user could truncate any other file, which kills
/// each process that reads it.
fn open_private(path: &Path) -> Option<File> {
    let mine = |about: Metadata| {
        about.is_file() && about.uid() == rustix::process::geteuid().as_raw() && about.mode() & 0o077 == 0
    };
    std::fs::symlink_metadata(path).ok().filter(|about| mine(about.clone()))?;
    // for writing: a page that is being created cannot be read yet
    OpenOptions::new().write(true).open(path).ok().filter(|file| file.metadata().is_ok_and(mine))
}

fn same_inode(a: &File, b: &File) -> bool {
    matches!((a.metadata(), b.metadata()), (Ok(a), Ok(b)) if a.ino() == b.ino())
}

fn configuration(user: u32) -> Result<Configuration<Counters>, LinkError> {
    let name = |text: &str| FileName::new(text.as_bytes()).map_err(refused);
    Ok(Configuration::default().prefix(&name(&format!("tumble_{user}_"))?).suffix(&name(SUFFIX)?))
}

/// Returns the hash of a run's name, which is a valid file name.
fn file_name(run: &str) -> Result<FileName, LinkError> {
    FileName::new(&blake3::hash(run.as_bytes()).to_hex().as_bytes()[..32]).map_err(refused)
}

fn refused(why: impl Debug) -> LinkError {
    LinkError::Other(format!("shared memory: the bell: {why:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    // users that do not exist; a test that cleans up has one of its own
    const NOBODY: u32 = 4_000_000_000;
    const NOBODY_ELSE: u32 = 4_000_000_001;

    #[test]
    fn one_ring_wakes_all_and_only_the_last_answer_wakes_the_server() {
        let run = format!("bell-{}", std::process::id());
        let server = Wakeup::serve(&run, NOBODY).unwrap();
        let facets: Vec<Wakeup> = (0..3).map(|_| Wakeup::join(&run, NOBODY).unwrap().unwrap()).collect();
        let (long, moment) = (Duration::from_secs(30), Duration::from_millis(50));
        let woken = AtomicBool::new(false);
        std::thread::scope(|scope| {
            let waiting: Vec<_> = facets.iter().map(|facet| (facet.facet_notifications(), facet)).collect();
            let waiting: Vec<_> = waiting
                .into_iter()
                .map(|(seen, facet)| scope.spawn(move || facet.wait_for_facet_notification(seen, long)))
                .collect();
            server.notify_facets();
            waiting.into_iter().for_each(|facet| facet.join().unwrap().unwrap());
            let seen = server.server_notifications();
            let (server, woken) = (&server, &woken);
            let waits = scope.spawn(move || {
                server.wait_for_server_notifications(seen, 3, long).unwrap();
                woken.store(true, SeqCst);
            });
            while server.counter(WANTED).load(SeqCst) != seen + 3 {
                std::thread::sleep(Duration::from_millis(1));
            }
            std::thread::sleep(moment); // asleep by now
            facets[0].notify_server(false);
            facets[1].notify_server(false);
            std::thread::sleep(moment);
            assert!(!woken.load(SeqCst), "two of three answers woke it");
            facets[2].notify_server(false);
            waits.join().unwrap();
            // a notification between reading and waiting is not lost
            server.wait_for_server_notifications(seen, 6, long).unwrap();
        });
    }

    #[test]
    fn a_bell_goes_with_its_server_and_is_cleaned_up_after_a_killed_one() {
        let there = |run: &str| Wakeup::join(run, NOBODY).unwrap().is_some();
        let [alive, dead, young] = ["alive", "dead", "young"].map(|name| format!("bell-{}-{name}", std::process::id()));
        let server = Wakeup::serve(&alive, NOBODY).unwrap();
        // as after kill -9: the file stays, the system drops the lock
        let killed = Wakeup::serve(&dead, NOBODY).unwrap();
        killed.memory.release_ownership();
        drop(killed);
        // and one that was never locked
        let barely = file_name(&young).unwrap();
        let mut fresh = |value: &mut std::mem::MaybeUninit<Counters>, _: &mut _| {
            value.write(Default::default());
            true
        };
        let builder = Builder::<Counters>::new(&barely).config(&configuration(NOBODY).unwrap()).has_ownership(false);
        drop(builder.initializer(&mut fresh).create().unwrap());
        assert!(there(&alive) && there(&dead) && there(&young));
        clean_up(NOBODY);
        assert!(there(&alive) && !there(&dead) && !there(&young));
        // a server that took over keeps the page when the first one ends
        let second = Wakeup::serve(&alive, NOBODY).unwrap();
        drop(server);
        assert!(there(&alive));
        drop(second);
        assert!(!there(&alive));
    }

    /// Another user may create a file with that name first; its content is not read.
    #[test]
    fn a_bell_that_others_may_open_is_not_touched() {
        let run = format!("bell-{}-open", std::process::id());
        let path = file(&file_name(&run).unwrap(), &configuration(NOBODY_ELSE).unwrap());
        std::fs::write(&path, "not a bell").unwrap();
        std::fs::set_permissions(&path, std::os::unix::fs::PermissionsExt::from_mode(0o666)).unwrap();
        assert!(Wakeup::join(&run, NOBODY_ELSE).unwrap().is_none());
        assert!(Wakeup::serve(&run, NOBODY_ELSE).err().unwrap().to_string().contains("mode 600; remove it"));
        clean_up(NOBODY_ELSE);
        assert_eq!(std::fs::read(&path).unwrap(), b"not a bell");
        std::fs::remove_file(&path).unwrap();
    }
}

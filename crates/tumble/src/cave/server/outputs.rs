//! Files that a run writes. None of them is a file that it reads, and a run that does not start
//! destroys none.

use super::facet_processes::transport_kind;
use crate::cave::args::{ServeOptions, TransportKind};
use crate::failure::Failure;
use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use tumble::scene::cave::Cave;

/// Checks the outputs before anything is opened. Refuses a recording over the replayed one, a
/// summary that cannot be written, and --listen without UDP.
pub fn check(options: &ServeOptions, cave: &Cave) -> Result<(), Failure> {
    let written = options.record.as_ref().or(cave.recording.as_ref().map(|r| &r.file));
    if let (Some(read), Some(written)) = (&options.replay_input, written)
        && same(read, written)
    {
        let (read, written) = (read.display(), written.display());
        return Err(Failure::input(format!(
            "--replay-input {read}: the run would be recorded into the same file ({written}); choose another with --record"
        )));
    }
    if let (Some(listen), TransportKind::SharedMemory) = (options.listen, transport_kind(options, cave)) {
        return Err(Failure::input(format!(
            "--listen {listen}: frames go through shared memory; the option needs --transport udp"
        )));
    }
    options.summary.as_deref().map_or(Ok(()), writable)
}

/// Returns whether two paths name the same file.
fn same(a: &Path, b: &Path) -> bool {
    let number = |path: &Path| std::fs::metadata(path).map(|about| (about.dev(), about.ino())).ok();
    a == b || number(a).is_some_and(|ours| Some(ours) == number(b))
}

/// Returns whether an open file is the one at `path`.
fn same_file(file: &File, path: &Path) -> bool {
    matches!((file.metadata(), std::fs::metadata(path)), (Ok(ours), Ok(there)) if ours.ino() == there.ino())
}

/// Tries to open the file for writing and leaves the folder as it was.
fn writable(path: &Path) -> Result<(), Failure> {
    let there = std::fs::symlink_metadata(path).is_ok();
    if there && std::fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        return Ok(()); // a pipe is waited for when there is something to say
    }
    OpenOptions::new()
        .write(true)
        .create(true)
        .truncate(false)
        .open(path)
        .map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))?;
    if !there {
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

/// Prints to stdout. A closed pipe is no error.
pub fn say(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Failure::run("stdout", e)),
        _ => Ok(()),
    }
}

/// The recording of a run. It is written beside the target and replaces the target when the run
/// starts, so a start without facets destroys no earlier recording. The process holds a lock on the
/// temporary file. A temporary file without a lock was left by a killed start, and the next
/// recording removes it.
pub struct Recording {
    file: PathBuf,
    beside: Option<PathBuf>,
    _lock: Option<File>,
}

impl Recording {
    /// Creates the temporary file of a target; links are followed. Devices and pipes are written
    /// directly.
    pub fn new(file: PathBuf) -> Result<Recording, Failure> {
        let real = file.canonicalize().unwrap_or(file.clone());
        let about = std::fs::metadata(&real).ok();
        if about.as_ref().is_some_and(|about| about.is_dir()) {
            return Err(Failure::input(format!("{}: cannot record into it: it is a folder", file.display())));
        }
        if about.is_some_and(|about| !about.is_file()) {
            return Ok(Recording { file, beside: None, _lock: None });
        }
        let begin = format!(".{:.200}.", real.file_name().unwrap_or_default().to_string_lossy());
        remove_left(&real, &begin);
        let beside = real.with_file_name(format!("{begin}{}", std::process::id()));
        let failed = |e: std::io::Error| Failure::run(&format!("recording into {}", file.display()), e);
        // a clean-up may have come before the lock
        for _ in 0..10 {
            let lock = OpenOptions::new().write(true).create(true).truncate(true).open(&beside).map_err(failed)?;
            // on a file system without locks, leftovers stay
            let locked = lock.try_lock().is_ok();
            if same_file(&lock, &beside) {
                return Ok(Recording { file: real, beside: Some(beside), _lock: locked.then_some(lock) });
            }
        }
        Err(Failure::run(
            &format!("recording into {}", file.display()),
            format!("{} is removed again and again", beside.display()),
        ))
    }

    /// Returns the path to write to.
    pub fn begins_at(&self) -> &Path {
        self.beside.as_deref().unwrap_or(&self.file)
    }

    /// Moves the recording to its target.
    pub fn begin(&mut self) -> Result<(), Failure> {
        match self.beside.take() {
            Some(beside) => std::fs::rename(&beside, &self.file).map_err(|e| {
                let _ = std::fs::remove_file(&beside);
                Failure::run(&format!("recording into {}", self.file.display()), e)
            }),
            None => Ok(()),
        }
    }

    /// Returns whether the recording is at its target.
    pub fn has_begun(&self) -> bool {
        self.beside.is_none()
    }

    /// Returns the target.
    pub fn file(&self) -> &Path {
        &self.file
    }
}

/// Removes temporary files of killed starts beside `real`: names with this prefix and a process id,
/// without a lock.
fn remove_left(real: &Path, begin: &str) {
    let number =
        |name: &str| name.strip_prefix(begin).is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let folder = real.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in
        entries.filter(|e| e.file_name().to_str().is_some_and(number) && e.file_type().is_ok_and(|kind| kind.is_file()))
    {
        if OpenOptions::new().write(true).open(entry.path()).is_ok_and(|left| left.try_lock().is_ok()) {
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

impl Drop for Recording {
    fn drop(&mut self) {
        if let Some(beside) = &self.beside {
            let _ = std::fs::remove_file(beside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_recording_takes_its_place_when_it_begins_and_not_before() {
        let folder = std::env::temp_dir().join(format!("tumble-recording-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("run.mcap");
        std::fs::write(&file, "before").unwrap();
        let given_up = Recording::new(file.clone()).ok().unwrap();
        std::fs::write(given_up.begins_at(), "given up").unwrap();
        drop(given_up);
        assert_eq!(std::fs::read(&file).unwrap(), b"before");
        // through a link: the target of the link
        let link = folder.join("link.mcap");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let mut begun = Recording::new(link.clone()).ok().unwrap();
        std::fs::write(begun.begins_at(), "now").unwrap();
        assert!(begun.begin().is_ok());
        drop(begun);
        assert_eq!(std::fs::read(&file).unwrap(), b"now");
        // leftovers of killed starts are removed, and nothing else
        let [left, held, other] = [".run.mcap.1", ".run.mcap.2", ".run.mcap.notes"].map(|name| folder.join(name));
        [&left, &held, &other].into_iter().for_each(|path| std::fs::write(path, "begun").unwrap());
        let holder = File::open(&held).unwrap();
        holder.lock().unwrap();
        drop(Recording::new(file.clone()));
        assert_eq!([&left, &held, &other].map(|path| path.exists()), [false, true, true]);
        [&held, &other].into_iter().for_each(|path| std::fs::remove_file(path).unwrap());
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink() && same(&file, &link));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

//! The files that a run writes: none of them is one that it reads, and none is lost to a run that does not begin.

use super::args::{Carrier, ServeOptions};
use super::crew::carrier;
use crate::failure::Failure;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use tumble::scene::cave::Cave;

/// Refuses what cannot go well, before anything is opened: a recording over the one that is played, a summary that cannot be written, and an address that
/// nobody listens at.
pub fn check(options: &ServeOptions, cave: &Cave) -> Result<(), Failure> {
    let written = options.record.as_ref().or(cave.recording.as_ref().map(|r| &r.file));
    if let (Some(read), Some(written)) = (&options.input_from, written)
        && same(read, written)
    {
        let (read, written) = (read.display(), written.display());
        return Err(Failure::input(format!("--input-from {read}: the run would be recorded into the same file ({written}); say another with --record")));
    }
    if let (Some(listen), Carrier::SharedMemory) = (options.listen, carrier(options, cave)) {
        return Err(Failure::input(format!("--listen {listen}: frames go through shared memory and nobody listens there; it goes with --transport udp")));
    }
    options.summary.as_deref().map_or(Ok(()), writable)
}

/// Whether two names are one file's.
fn same(a: &Path, b: &Path) -> bool {
    let number = |path: &Path| std::fs::metadata(path).map(|about| (about.dev(), about.ino())).ok();
    a == b || number(a).is_some_and(|ours| Some(ours) == number(b))
}

/// Tries it and leaves the folder as it was.
fn writable(path: &Path) -> Result<(), Failure> {
    let there = std::fs::symlink_metadata(path).is_ok();
    if there && std::fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        return Ok(()); // a pipe is waited for when there is something to say
    }
    OpenOptions::new().write(true).create(true).truncate(false).open(path).map_err(|e| Failure::input(format!("{}: cannot be written: {e}", path.display())))?;
    if !there {
        let _ = std::fs::remove_file(path);
    }
    Ok(())
}

/// To stdout, where somebody reads it; what fails otherwise is a failure.
pub fn say(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Failure::run("stdout", e)),
        _ => Ok(()),
    }
}

/// Where a run is recorded: into a file beside the one that is wanted, which takes its place when the run begins. So a start at which nobody joins costs no
/// earlier recording.
pub struct Recording {
    file: PathBuf,
    beside: Option<PathBuf>,
}

impl Recording {
    /// Of that file; what a link leads to is meant. Devices and pipes are written at once.
    pub fn new(file: PathBuf) -> Result<Recording, Failure> {
        let real = file.canonicalize().unwrap_or(file.clone());
        let about = std::fs::metadata(&real).ok();
        if about.as_ref().is_some_and(|about| about.is_dir()) {
            return Err(Failure::input(format!("{}: cannot be recorded into: it is a folder", file.display())));
        }
        let beside = about.is_none_or(|about| about.is_file()).then(|| {
            let name = real.file_name().unwrap_or_default().to_string_lossy();
            real.with_file_name(format!(".{:.200}.{}", name, std::process::id()))
        });
        Ok(Recording { file: if beside.is_some() { real } else { file }, beside })
    }

    /// What is opened.
    pub fn begins_at(&self) -> &Path {
        self.beside.as_deref().unwrap_or(&self.file)
    }

    /// The run begins.
    pub fn begin(&mut self) -> Result<(), Failure> {
        match self.beside.take() {
            Some(beside) => std::fs::rename(&beside, &self.file).map_err(|e| {
                let _ = std::fs::remove_file(&beside);
                Failure::run(&format!("recording into {}", self.file.display()), e)
            }),
            None => Ok(()),
        }
    }

    /// Whether it has.
    pub fn has_begun(&self) -> bool {
        self.beside.is_none()
    }

    /// Where it lies.
    pub fn file(&self) -> &Path {
        &self.file
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
        // through a link: the file that it leads to
        let link = folder.join("link.mcap");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let mut begun = Recording::new(link.clone()).ok().unwrap();
        std::fs::write(begun.begins_at(), "now").unwrap();
        assert!(begun.begin().is_ok());
        drop(begun);
        assert_eq!(std::fs::read(&file).unwrap(), b"now");
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink() && same(&file, &link));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

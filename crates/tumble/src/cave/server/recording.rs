//! The recording of a run: its file, and its end when the disk is full.

use crate::cave::args::ServeOptions;
use crate::cave::signals::Signals;
use crate::failure::Failure;
use crate::recording_file::{self, NamedBy, replaceable};
use std::fs::{File, OpenOptions};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use tumble::dynamics::World;
use tumble::net::record::RecorderOptions;
use tumble::net::sync::{ServerEvent, ServerSession, SessionRecorder};
use tumble::scene::cave;

/// The recorder of a run, if there is one. A recording that cannot be continued, because the disk is
/// full for instance, ends, and the run goes on.
pub struct RunRecorder {
    current: Option<(SessionRecorder, Recording)>,
    /// Whether a frame was recorded.
    recorded: bool,
    /// The reason for which the recording ended.
    failure: Option<Failure>,
}

impl RunRecorder {
    /// Opens the recording for a scene with this name and hash, if there is one.
    pub fn open(
        target: Option<&Target>,
        scene: &str,
        hash: [u8; 32],
        world: &World,
        signals: &Signals,
    ) -> Result<RunRecorder, Failure> {
        let Some(target) = target else {
            return Ok(RunRecorder { current: None, recorded: false, failure: None });
        };
        let (recording, every) = (Recording::new(target)?, target.every_frames);
        if !recording.has_begun() {
            signals.remove_at_the_end(recording.begins_at().to_owned());
        }
        let options = RecorderOptions::default();
        let recorder = SessionRecorder::create(recording.begins_at(), scene, hash, world, every, options)
            .map_err(|e| Failure::run("recording", e))?
            .with_cameras(target.cameras);
        Ok(RunRecorder { current: Some((recorder, recording)), recorded: false, failure: None })
    }

    /// Starts a recording within a run.
    ///
    /// # Errors
    /// A recording is in progress, or the file cannot be opened.
    pub fn start(
        &mut self,
        target: &Target,
        scene: &str,
        hash: [u8; 32],
        world: &World,
        signals: &Signals,
    ) -> Result<(), Failure> {
        if let Some(file) = self.file() {
            return Err(Failure::run("recording", format!("{} is being recorded", file.display())));
        }
        let mut started = RunRecorder::open(Some(target), scene, hash, world, signals)?;
        started.begin()?;
        started.failure = self.failure.take();
        *self = started;
        Ok(())
    }

    /// Returns the file of the recording in progress.
    pub fn file(&self) -> Option<&Path> {
        self.current.as_ref().map(|(_, recording)| recording.file())
    }

    /// Moves the recording to its target: the run begins.
    pub fn begin(&mut self) -> Result<(), Failure> {
        self.current.as_mut().map_or(Ok(()), |(_, recording)| recording.begin())
    }

    /// Takes the events of a step into the next frame.
    pub fn step(&mut self, world: &World) {
        if let Some((recorder, _)) = &mut self.current {
            recorder.step(world);
        }
    }

    /// Records the last frame of a session. An error ends the recording and is printed.
    pub fn frame(&mut self, world: &World, session: &ServerSession) {
        let Some((recorder, _)) = &mut self.current else { return };
        let Some(recorded) = session.recorded(!self.recorded) else { return };
        self.recorded = true;
        if let Err(error) = recorder.frame(world, recorded) {
            eprintln!("recording: {error}; the recording ends here, and the run goes on");
            self.failure = Some(Failure::run("recording", error));
            self.current = None;
        }
    }

    /// Records the inputs and acknowledgements among the events.
    pub fn events(&mut self, events: &[ServerEvent]) {
        if let Some((recorder, _)) = &mut self.current {
            recorder.events(events);
        }
    }

    /// Ends the recording.
    ///
    /// # Errors
    /// It ended early, or cannot be completed.
    pub fn finish(&mut self, quiet: bool) -> Result<(), Failure> {
        if let Some((recorder, recording)) = self.current.take().filter(|(_, recording)| recording.has_begun()) {
            recorder.finish().map_err(|e| Failure::run("recording", e))?;
            if !quiet {
                super::outputs::say(&format!("recording: {}\n", recording.file().display()))?;
            }
        }
        self.failure.take().map_or(Ok(()), Err)
    }
}

/// File of a recording.
#[derive(Clone, Debug)]
pub struct Target {
    pub file: PathBuf,
    pub every_frames: u32,
    /// Whether images of cameras are recorded.
    pub cameras: bool,
    pub named_by: NamedBy,
}

impl Target {
    /// Returns the recording of the command line, or else that of the cave file. A replay is not
    /// recorded.
    pub fn of(options: &ServeOptions, cave_file: Option<&cave::Recording>, replaying: bool) -> Option<Target> {
        let cameras = options.record_cameras;
        let given =
            options.record.clone().map(|file| Target { file, every_frames: 1, cameras, named_by: NamedBy::User });
        let of_cave = |r: &cave::Recording| Target {
            file: r.file.clone(),
            every_frames: r.every_frames,
            cameras: cameras || r.cameras,
            named_by: NamedBy::CaveFile,
        };
        given.or_else(|| cave_file.map(of_cave)).filter(|_| !replaying)
    }

    /// Checks the target as [`recording_file::check`] does.
    pub fn check(&self) -> Result<bool, Failure> {
        recording_file::check(&self.file, self.named_by)
    }
}

/// Returns whether an open file is the one at `path`.
fn same_file(file: &File, path: &Path) -> bool {
    matches!((file.metadata(), std::fs::metadata(path)), (Ok(ours), Ok(there)) if ours.ino() == there.ino())
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
    /// Creates the temporary file of a target; links are followed.
    pub fn new(target: &Target) -> Result<Recording, Failure> {
        let file = &target.file;
        if target.check()? {
            return Ok(Recording { file: file.clone(), beside: None, _lock: None });
        }
        let real = file.canonicalize().unwrap_or(file.clone());
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
        let Some(beside) = &self.beside else { return Ok(()) };
        // another file may have appeared there since
        replaceable(&self.file)?;
        std::fs::rename(beside, &self.file)
            .map_err(|e| Failure::run(&format!("recording into {}", self.file.display()), e))?;
        self.beside = None;
        Ok(())
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
    use super::super::outputs::same;
    use super::*;
    use tumble::net::record::Recorder;

    fn target(file: &Path, named_by: NamedBy) -> Target {
        Target { file: file.to_owned(), every_frames: 1, cameras: false, named_by }
    }

    /// Writes a recording without frames, and returns its bytes.
    fn recording(path: &Path, world: &str) -> Vec<u8> {
        Recorder::create(path, world, &[], RecorderOptions::default()).unwrap().finish().unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn a_recording_takes_its_place_when_it_begins_and_not_before() {
        let folder = std::env::temp_dir().join(format!("tumble-recording-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = folder.join("run.mcap");
        let before = recording(&file, "before");
        let given_up = Recording::new(&target(&file, NamedBy::User)).ok().unwrap();
        std::fs::write(given_up.begins_at(), "given up").unwrap();
        drop(given_up);
        assert!(std::fs::read(&file).unwrap() == before);
        // through a link: the target of the link
        let link = folder.join("link.mcap");
        std::os::unix::fs::symlink(&file, &link).unwrap();
        let mut begun = Recording::new(&target(&link, NamedBy::User)).ok().unwrap();
        let now = recording(begun.begins_at(), "now");
        assert!(begun.begin().is_ok());
        drop(begun);
        assert!(std::fs::read(&file).unwrap() == now && now != before);
        // leftovers of killed starts are removed, and nothing else
        let [left, held, other] = [".run.mcap.1", ".run.mcap.2", ".run.mcap.notes"].map(|name| folder.join(name));
        [&left, &held, &other].into_iter().for_each(|path| std::fs::write(path, "begun").unwrap());
        let holder = File::open(&held).unwrap();
        holder.lock().unwrap();
        drop(Recording::new(&target(&file, NamedBy::User)));
        assert_eq!([&left, &held, &other].map(|path| path.exists()), [false, true, true]);
        [&held, &other].into_iter().for_each(|path| std::fs::remove_file(path).unwrap());
        assert!(std::fs::symlink_metadata(&link).unwrap().is_symlink() && same(&file, &link));
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 2);
        std::fs::remove_dir_all(&folder).unwrap();
    }
    #[test]
    fn a_file_that_is_no_recording_is_not_replaced() {
        let folder = std::env::temp_dir().join(format!("tumble-foreign-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let [thesis, other, empty] = ["thesis.tex", "other.mcap", "empty"].map(|name| folder.join(name));
        std::fs::write(&thesis, "mine").unwrap();
        std::fs::write(&other, b"\x89MCAP0\r\n\x01\x08\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0").unwrap();
        File::create(&empty).unwrap();
        for named_by in [NamedBy::User, NamedBy::CaveFile] {
            for file in [&thesis, &other] {
                let refused = Recording::new(&target(file, named_by)).err().unwrap();
                assert!(refused.code() == 2 && refused.report().contains("is not overwritten"), "{}", refused.report());
            }
            assert!(Recording::new(&target(&empty, named_by)).is_ok());
        }
        assert!(Recording::new(&target(Path::new("/dev/null"), NamedBy::User)).is_ok_and(|r| r.has_begun()));
        assert!(Recording::new(&target(Path::new("/dev/null"), NamedBy::CaveFile)).is_err());
        // a file that appears between the opening and the beginning
        let mut late = Recording::new(&target(&folder.join("late"), NamedBy::User)).ok().unwrap();
        std::fs::write(folder.join("late"), "mine").unwrap();
        assert!(late.begin().is_err());
        drop(late);
        assert_eq!(std::fs::read(folder.join("late")).unwrap(), b"mine");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 4);
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

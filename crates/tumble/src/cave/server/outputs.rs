//! Files that a run writes. None of them is a file that it reads, and a run that does not start
//! destroys none.

use super::facet_commands::transport_kind;
use super::recording::Target;
use crate::cave::args::{CaveOptions, ServeOptions, TransportKind};
use crate::cave::run_setup::RunSetup;
use crate::failure::Failure;
use crate::frames_folder::begin_all;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::Path;

/// Checks the outputs before anything is opened. Refuses a recording over the replayed one or over
/// a file that is none, a
/// summary that cannot be written or would replace a file of the run, --listen without UDP, and frames among those of
/// an earlier run. `replayed` is the recording that a replay shows.
pub fn check(
    options: &ServeOptions,
    launcher: Option<&CaveOptions>,
    setup: &RunSetup,
    replayed: Option<&Path>,
) -> Result<(), Failure> {
    let cave = &setup.cave;
    let recorded = Target::of(options, cave.recording.as_ref(), replayed.is_some());
    recorded.as_ref().map_or(Ok(false), Target::check)?;
    if let Some(recorded) = &recorded
        && std::fs::metadata(&recorded.file).is_ok_and(|about| about.file_type().is_fifo())
    {
        eprintln!("{}: is a pipe; the run waits until something reads it", recorded.file.display());
    }
    if let (Some(read), Some(written)) = (&options.replay_input, &recorded)
        && same(read, &written.file)
    {
        let (read, written) = (read.display(), written.file.display());
        return Err(Failure::input(format!(
            "--replay-input {read}: the run would be recorded into the same file ({written}); choose another with --record"
        )));
    }
    if let (Some(listen), TransportKind::SharedMemory) = (options.listen, transport_kind(options, cave)) {
        return Err(Failure::input(format!(
            "--listen {listen}: frames go through shared memory; the option needs --transport udp"
        )));
    }
    if let Some(summary) = options.summary.as_deref() {
        let recorded = recorded.as_ref().map(|recorded| recorded.file.as_path());
        let read = [Path::new(&setup.scene.file), Path::new(&cave.file)].into_iter();
        let others = read.chain(recorded).chain(options.replay_input.as_deref()).chain(replayed);
        if let Some(other) = others.into_iter().find(|other| same(summary, other)) {
            return Err(Failure::input(format!(
                "--summary {}: the run reads or records this file ({}); choose another",
                summary.display(),
                other.display()
            )));
        }
        writable(summary)?;
    }
    let draw = launcher.map(|launcher| &launcher.draw);
    let folder = draw.and_then(|draw| draw.frames_dir.as_deref().or(draw.log_dir.as_deref()));
    let Some(folder) = folder else { return Ok(()) };
    begin_all(folder, draw.is_some_and(|draw| draw.overwrite))?;
    // each facet would otherwise say so
    std::fs::create_dir_all(folder).map_err(|e| Failure::input(format!("{}: cannot be created: {e}", folder.display())))
}

/// Refuses outputs of which the next scene would replace those of the one before, and further scenes that cannot
/// be read: a show is not to end at its second scene.
pub fn check_scenes(options: &ServeOptions, launcher: Option<&CaveOptions>, replaying: bool) -> Result<(), Failure> {
    let frames = launcher.is_some_and(|l| l.draw.frames_dir.is_some() || l.draw.log_dir.is_some());
    let files = options.record.is_some() || options.summary.is_some() || options.replay_input.is_some();
    if !options.then.is_empty() && (frames || files || replaying) {
        return Err(Failure::input(
            "--then: further scenes go without --frames-dir, --log-dir, --record, --summary, --replay-input and replays",
        ));
    }
    options.then.iter().try_for_each(|name| options.scene.opening.read(name).map(drop))
}

/// Returns whether two paths name the same file.
pub fn same(a: &Path, b: &Path) -> bool {
    let number = |path: &Path| std::fs::metadata(path).map(|about| (about.dev(), about.ino())).ok();
    a == b || number(a).is_some_and(|ours| Some(ours) == number(b))
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

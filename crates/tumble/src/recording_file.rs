//! Files that recordings replace: recordings, empty files, and no others.

use crate::failure::Failure;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use tumble::net::record::is_recording;

/// Origin of a recording's path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NamedBy {
    /// The command line.
    User,
    /// The cave file.
    CaveFile,
}

/// Refuses a target that would be damaged: a file that is no recording, a folder, a disk. Returns
/// whether it is written directly: pipes and character devices that the user names. A cave file,
/// which may come from elsewhere, cannot name them.
///
/// # Errors
/// The reason, with exit code 2.
pub fn check(file: &Path, named_by: NamedBy) -> Result<bool, Failure> {
    let refuse = |why: &str| Err(Failure::input(format!("{}: cannot record into it: {why}", file.display())));
    match std::fs::metadata(file).ok().map(|about| about.file_type()) {
        None => Ok(false),
        Some(kind) if kind.is_dir() => refuse("it is a folder"),
        Some(kind) if kind.is_file() => replaceable(file).map(|()| false),
        Some(kind) if kind.is_block_device() => refuse("it is a disk"),
        Some(_) if named_by == NamedBy::CaveFile => {
            refuse("it is no regular file, and a cave file can name no other; use --record")
        }
        Some(_) => Ok(true),
    }
}

/// Refuses to replace a file that is no recording. An empty file may be replaced.
///
/// # Errors
/// The file has another content.
pub fn replaceable(file: &Path) -> Result<(), Failure> {
    match std::fs::metadata(file) {
        Ok(about) if about.len() > 0 && !is_recording(file) => Err(Failure::input(format!(
            "{}: is no recording of tumble and is not overwritten; choose another file",
            file.display()
        ))),
        _ => Ok(()),
    }
}

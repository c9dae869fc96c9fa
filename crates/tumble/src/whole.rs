//! Files that are written whole or not at all.

use std::io;
use std::path::{Path, PathBuf};

/// Writes a file under a name of its own beside `path` and renames it, so that what was there stays until the new one is complete, and stays where that fails, as on a
/// full disk. What is there and is no file, such as `/dev/stdout`, is written into.
///
/// # Errors
/// Those of `write`, which is given the path to write, and of the renaming.
pub fn write_whole<E: From<io::Error>>(path: &Path, write: impl FnOnce(&Path) -> Result<(), E>) -> Result<(), E> {
    // a link stays a link, to a file that is new
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    if target.metadata().is_ok_and(|about| !about.is_file()) {
        return write(path);
    }
    let own = beside(&target);
    let written = write(&own).and_then(|()| {
        if let Ok(about) = target.metadata() {
            std::fs::set_permissions(&own, about.permissions())?;
        }
        Ok(std::fs::rename(&own, &target)?)
    });
    if written.is_err() {
        let _ = std::fs::remove_file(&own);
    }
    written
}

/// A name in the same folder that no other process and no other file of this one has.
fn beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.unfinished", std::process::id()))
}

/// Says what will keep a file from being written, before the work for it is done: its folder is not there, or it is a folder itself.
///
/// # Errors
/// A sentence without the file's name.
pub fn check_writable(path: &Path) -> Result<(), String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match folder {
        _ if path.is_dir() => Err("it is a folder; wanted the name of a file".into()),
        folder if !folder.is_dir() => Err(format!("there is no folder {}", folder.display())),
        _ => Ok(()),
    }
}

//! Files that appear complete or not at all: the one writer of the command's results.

use crate::failure::Failure;
use std::io;
use std::path::{Path, PathBuf};

/// Writes `bytes` to `path` atomically; see [`write_atomically`].
///
/// # Errors
/// A failure at run time that names the path.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    write_atomically(path, |path| std::fs::write(path, bytes))
        .map_err(|e| Failure::run(&format!("writing {}", path.display()), e))
}

/// Writes a temporary file beside `path` and renames it to `path`. An earlier file keeps its bytes
/// until the new one is complete, and keeps them if writing fails, as on a full disk. A `path` that
/// exists and is no regular file, such as `/dev/stdout`, is written directly. A symbolic link stays
/// a link, and its target is replaced.
///
/// # Errors
/// The errors of `write`, which gets the path to write to, and of the renaming.
fn write_atomically(path: &Path, write: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    let target = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    if target.metadata().is_ok_and(|about| !about.is_file()) {
        return write(path);
    }
    let temporary = temporary_beside(&target);
    let written = write(&temporary).and_then(|()| {
        if let Ok(about) = target.metadata() {
            std::fs::set_permissions(&temporary, about.permissions())?;
        }
        std::fs::rename(&temporary, &target)
    });
    if written.is_err() {
        // it may not have been created
        let _ = std::fs::remove_file(&temporary);
    }
    written
}

/// A hidden name in the same folder; the process id keeps the names of two processes apart.
fn temporary_beside(path: &Path) -> PathBuf {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!(".{name}.{}.unfinished", std::process::id()))
}

/// Checks, before the work for a file is done, that its folder exists and that it is not a folder
/// itself.
///
/// # Errors
/// A sentence that names the path and says what keeps the file from being written.
pub fn check_writable(path: &Path) -> Result<(), String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let problem = match folder {
        _ if path.is_dir() => "it is a folder; expected the name of a file".into(),
        folder if !folder.is_dir() => format!("there is no folder {}", folder.display()),
        _ => return Ok(()),
    };
    Err(format!("{} cannot be written: {problem}", path.display()))
}

/// Refuses to replace a file without `--overwrite`. What is no regular file, such as `/dev/stdout`, is written directly
/// and replaced by nothing.
///
/// # Errors
/// Bad usage, with the path.
pub fn check_replaceable(path: &Path, overwrite: bool) -> Result<(), Failure> {
    match !overwrite && path.is_file() {
        true => Err(Failure::input(format!("{}: exists already; --overwrite replaces it", path.display()))),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("tumble-atomic-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_write_that_fails_keeps_the_earlier_file_and_leaves_no_other() {
        let folder = folder("fails");
        let path = folder.join("result.json");
        write_atomically(&path, |path| std::fs::write(path, "first")).unwrap();
        let failed = write_atomically(&path, |path| {
            std::fs::write(path, "half")?;
            Err(io::Error::other("the disk is full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "the disk is full");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "first");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_link_stays_a_link_to_the_new_file() {
        let folder = folder("link");
        let (path, link) = (folder.join("result.json"), folder.join("latest.json"));
        std::fs::write(&path, "first").unwrap();
        std::os::unix::fs::symlink(&path, &link).unwrap();
        write_atomically(&link, |path| std::fs::write(path, "second")).unwrap();
        assert!(link.symlink_metadata().unwrap().is_symlink());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "second");
        std::fs::remove_dir_all(folder).unwrap();
    }
}

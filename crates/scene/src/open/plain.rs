//! Opens files that are named by a user or another file.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Opens a file to read it. A named pipe is an error, because opening it would wait until another
/// process writes to it. Pipes that are open already, as `/dev/stdin` and `<(command)` are, have a
/// writer and are read.
///
/// # Errors
/// Those of the system, and [`io::ErrorKind::InvalidInput`] for a named pipe.
pub fn open_file(path: impl AsRef<Path>) -> io::Result<File> {
    let path = path.as_ref();
    if is_named_pipe(path) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is a named pipe; expected a file"));
    }
    File::open(path)
}

/// Reads a file opened by [`open_file`].
///
/// # Errors
/// Those of [`open_file`].
pub fn read_file(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open_file(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Returns the error for a path at which there is something other than a file or a folder.
pub(crate) fn no_regular_file() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file")
}

/// Maximum number of symbolic links that are followed.
#[cfg(unix)]
const MAX_LINKS: usize = 16;

#[cfg(unix)]
fn is_named_pipe(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let mut path = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        let Ok(about) = std::fs::symlink_metadata(&path) else { return false };
        let Ok(to) = std::fs::read_link(&path) else { return about.file_type().is_fifo() };
        path = path.parent().unwrap_or(Path::new("")).join(to);
        // links of /proc lead to open files
        if path.starts_with("/proc") {
            return false;
        }
    }
    false
}

#[cfg(not(unix))]
fn is_named_pipe(_: &Path) -> bool {
    false
}

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

/// Largest file that is read at once, bytes: 1 GiB.
pub(crate) const MAX_FILE_BYTES: u64 = 1 << 30;

/// Reads a file opened by [`open_file`], at most 1 GiB. A device is an error, also behind a symbolic link, because it
/// may have no end.
///
/// # Errors
/// Those of [`open_file`], and [`io::ErrorKind::InvalidInput`] for a folder, a device and a longer file.
pub fn read_file(path: impl AsRef<Path>) -> io::Result<Vec<u8>> {
    read_at_most(path.as_ref(), MAX_FILE_BYTES)
}

fn read_at_most(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let about = std::fs::metadata(path)?;
    if !about.is_file() && !is_pipe(&about) {
        return Err(no_regular_file());
    }
    let mut bytes = Vec::new();
    if about.len() <= limit {
        open_file(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    }
    match about.len().max(bytes.len() as u64) > limit {
        true => Err(io::Error::new(io::ErrorKind::InvalidInput, format!("it has more than {limit} bytes"))),
        false => Ok(bytes),
    }
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

#[cfg(unix)]
fn is_pipe(about: &std::fs::Metadata) -> bool {
    std::os::unix::fs::FileTypeExt::is_fifo(&about.file_type())
}

#[cfg(not(unix))]
fn is_pipe(_: &std::fs::Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn devices_folders_and_files_above_the_limit_are_refused() {
        let folder = std::env::temp_dir().join(format!("tumble-plain-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let (link, file) = (folder.join("link"), folder.join("file"));
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        std::fs::write(&file, [7; 10]).unwrap();
        let why = |path: &Path, limit: u64| read_at_most(path, limit).unwrap_err().to_string();
        assert_eq!(why(&link, 1000), "it is no regular file");
        assert_eq!(why(&folder, 1000), "it is no regular file");
        assert_eq!(why(&file, 9), "it has more than 9 bytes");
        assert_eq!(read_at_most(&file, 10).unwrap(), [7; 10]);
        // a length that the system does not know
        assert_eq!(why(Path::new("/proc/self/status"), 9), "it has more than 9 bytes");
        std::fs::remove_dir_all(&folder).unwrap();
    }
}

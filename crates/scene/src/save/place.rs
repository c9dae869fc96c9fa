//! Puts finished files in their places: the folder of files and the file that names them, both or neither.

use std::io;
use std::path::{Path, PathBuf};

use super::SaveError;

/// A folder in which the files of a scene or a model are finished. It is removed when it goes out of scope.
pub(crate) struct Unfinished {
    folder: PathBuf,
    stem: String,
    /// Name of the file.
    file: String,
}

/// A file or folder that could not be written, and why.
pub(crate) struct Fault {
    pub(crate) file: PathBuf,
    pub(crate) source: io::Error,
}

impl Fault {
    /// Returns what names a file in the error of an operation on it.
    fn at(file: &Path) -> impl FnOnce(io::Error) -> Fault {
        let file = file.to_path_buf();
        move |source| Fault { file, source }
    }
}

impl From<Fault> for SaveError {
    fn from(Fault { file, source }: Fault) -> Self {
        SaveError::Write { file, source }
    }
}

impl Unfinished {
    /// Writes a text and its files to a new folder beside `path`, the files in a folder `NAME_files`.
    pub(crate) fn write(path: &Path, text: &str, files: &[(String, Vec<u8>)]) -> Result<Unfinished, Fault> {
        let name = |part: Option<&std::ffi::OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let (stem, file) = (name(path.file_stem()), name(path.file_name()));
        let place = path.parent().filter(|place| !place.as_os_str().is_empty());
        if let Some(place) = place.filter(|place| !place.is_dir()) {
            let why = format!("there is no folder {}", place.display());
            return Err(Fault { file: path.to_path_buf(), source: io::Error::new(io::ErrorKind::NotFound, why) });
        }
        let folder = path.with_file_name(format!(".{stem}.{}.unfinished", std::process::id()));
        // of a process of this number that was killed
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir(&folder).map_err(Fault::at(path))?;
        let made = Unfinished { folder, stem, file };
        let beside = made.files();
        if !files.is_empty() {
            std::fs::create_dir(&beside).map_err(Fault::at(&beside))?;
        }
        let files = files.iter().map(|(name, bytes)| (beside.join(name), &bytes[..]));
        for (file, bytes) in files.chain([(made.file(), text.as_bytes())]) {
            std::fs::write(&file, bytes).map_err(Fault::at(&file))?;
        }
        Ok(made)
    }

    /// Returns the finished file.
    pub(crate) fn file(&self) -> PathBuf {
        self.folder.join(&self.file)
    }

    /// Returns the folder of its files.
    fn files(&self) -> PathBuf {
        self.folder.join(format!("{}_files", self.stem))
    }

    /// Moves the finished files to their places. If one cannot be moved, the earlier ones return.
    pub(crate) fn put_in_place(self, path: &Path) -> Result<(), Fault> {
        let (finished, place) = (self.files(), path.with_file_name(format!("{}_files", self.stem)));
        let earlier = self.folder.join("earlier");
        let new = finished.exists();
        let replaced = new && place.exists();
        if replaced {
            std::fs::rename(&place, &earlier).map_err(Fault::at(&place))?;
        }
        let mut moved = if new { std::fs::rename(&finished, &place).map_err(Fault::at(&place)) } else { Ok(()) };
        if moved.is_ok() {
            moved = std::fs::rename(self.file(), path).map_err(Fault::at(path));
            if moved.is_err() && new {
                let _ = std::fs::rename(&place, &finished);
            }
        }
        if moved.is_err() && replaced {
            let _ = std::fs::rename(&earlier, &place);
        }
        moved
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder); // nothing depends on it any more
    }
}

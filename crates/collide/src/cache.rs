//! The disk cache of sphere trees and mesh shapes, identified by the content from which they were
//! built.
//!
//! The name of a file is the BLAKE3 hash of the mesh's content, the settings and the sources of
//! this crate. Its first line is
//!
//! ```text
//! HEAD NAME CHECKSUM
//! ```
//!
//! `HEAD` names the kind of file and its version; `CHECKSUM` is the hash of the name and of the
//! rest. A file that is truncated, changed, renamed or of another version is rebuilt. Several
//! processes can use one folder at once: a file is written under a temporary name and then renamed,
//! which is atomic. The last writer wins, and all write the same content. Faults of the folder are
//! reported in a note and never fail a build. Above a size limit the oldest files are removed.

use crate::{MeshId, TreeSettings};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

/// Maximum size of a file that is read: 512 MiB.
pub(crate) const MAX_BYTES: usize = 512 << 20;
/// Name extension of unfinished files.
const UNFINISHED: &str = "tmp";
/// Default of the maximum size of a folder.
const MAX_FOLDER_BYTES: u64 = 1 << 30;
/// The version of this crate and of its sources (see `build.rs`).
const BUILDERS: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("TUMBLE_BUILDERS"));

/// A folder of trees and shapes, or none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeCache {
    folder: Option<PathBuf>,
    max_bytes: u64,
}

impl TreeCache {
    /// Returns a disabled cache: everything is built.
    pub fn off() -> TreeCache {
        TreeCache { folder: None, max_bytes: MAX_FOLDER_BYTES }
    }

    /// Returns a cache in a folder, which is created with the first file.
    pub fn at(folder: impl Into<PathBuf>) -> TreeCache {
        TreeCache { folder: Some(folder.into()), max_bytes: MAX_FOLDER_BYTES }
    }

    /// Returns the cache that the environment selects: the folder `$TUMBLE_CACHE`, or none if that
    /// is `off` (in any case). If it is empty or blank, the folder `tumble/trees` in
    /// `$XDG_CACHE_HOME` or `~/.cache`; none without a home folder.
    pub fn of_environment() -> TreeCache {
        let path = |name: &str| {
            std::env::var_os(name).filter(|value| !value.to_string_lossy().trim().is_empty()).map(PathBuf::from)
        };
        match path("TUMBLE_CACHE") {
            Some(word) if word.to_string_lossy().trim().eq_ignore_ascii_case("off") => TreeCache::off(),
            Some(folder) => TreeCache::at(folder),
            None => {
                // the XDG specification requires that relative paths are ignored
                let base = path("XDG_CACHE_HOME")
                    .filter(|p| p.is_absolute())
                    .or_else(|| path("HOME").map(|home| home.join(".cache")));
                TreeCache { folder: base.map(|base| base.join("tumble/trees")), ..TreeCache::off() }
            }
        }
    }

    /// Sets the maximum size of the folder; the oldest files are removed first. Default 1 GiB.
    #[must_use]
    pub fn with_max_bytes(self, max_bytes: u64) -> TreeCache {
        TreeCache { max_bytes, ..self }
    }

    /// Returns the folder; `None` if the cache is off.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }
}

/// A kind of file in the cache.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// A sphere tree: the text of a [`TreeFile`](crate::TreeFile).
    Tree,
    /// A mesh shape: see `stored.rs`.
    Shape,
}

impl Kind {
    const ALL: [Kind; 2] = [Kind::Tree, Kind::Shape];

    fn head(self) -> &'static str {
        match self {
            Kind::Tree => "tumble cached tree 1",
            Kind::Shape => "tumble cached shape 1",
        }
    }

    fn word(self) -> &'static str {
        match self {
            Kind::Tree => "tree",
            Kind::Shape => "shape",
        }
    }

    /// Name extension of the files.
    fn extension(self) -> &'static str {
        self.word()
    }
}

/// The file of one tree or shape.
pub(crate) struct Entry<'a> {
    folder: &'a Path,
    max_bytes: u64,
    kind: Kind,
    /// Name in hexadecimal.
    name: String,
}

impl<'a> Entry<'a> {
    /// Returns the entry for a mesh and settings; `None` if the cache is off.
    pub fn new(cache: &'a TreeCache, kind: Kind, mesh: &MeshId, settings: &TreeSettings) -> Option<Entry<'a>> {
        let folder = cache.folder.as_deref()?;
        // all fields of the settings, numbers in their shortest exact form
        let content = format!("{} {BUILDERS} {} {settings:?}", kind.head(), mesh.blake3);
        let name = blake3::hash(content.as_bytes()).to_hex().to_string();
        Some(Entry { folder, max_bytes: cache.max_bytes, kind, name })
    }

    fn path(&self) -> PathBuf {
        self.folder.join(&self.name).with_extension(self.kind.extension())
    }

    fn first_line(&self, body: &[u8]) -> String {
        let checksum = blake3::Hasher::new().update(self.name.as_bytes()).update(body).finalize().to_hex();
        format!("{} {} {checksum}", self.kind.head(), self.name)
    }

    /// Returns the note that the file is invalid, with the reason.
    pub fn refused(&self, why: impl std::fmt::Display) -> String {
        format!("the cached {} {} is rebuilt: {why}", self.kind.word(), self.path().display())
    }

    /// Returns the content of the file after its first line; `None` without a file; an error if it
    /// is invalid.
    pub fn read(&self) -> Result<Option<Vec<u8>>, String> {
        let file = match fs::File::open(self.path()) {
            Ok(file) => file,
            // a file instead of the folder has no entries; the fault is reported when an entry is
            // written
            Err(error) if matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => {
                return Ok(None);
            }
            Err(error) => return Err(self.refused(error)),
        };
        let mut bytes = Vec::with_capacity(file.metadata().map_or(0, |m| m.len().min(MAX_BYTES as u64) as usize));
        file.take(MAX_BYTES as u64).read_to_end(&mut bytes).map_err(|e| self.refused(e))?;
        let end = bytes.iter().position(|b| *b == b'\n').ok_or_else(|| self.refused("it has no header line"))?;
        let body = bytes.split_off(end + 1);
        if bytes[..end] != *self.first_line(&body).as_bytes() {
            return Err(self.refused("its content does not match its header line"));
        }
        Ok(Some(body))
    }

    /// Writes a file. The error is the reason why it could not be written.
    pub fn write(&self, body: &[u8]) -> Result<(), String> {
        // the counter separates names within a process, the id separates processes
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let reason = |error: std::io::Error| {
            format!("the {} is not kept in {}: {error}", self.kind.word(), self.folder.display())
        };
        fs::create_dir_all(self.folder).map_err(reason)?;
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let own = self.folder.join(format!("{}.{}.{number}.{UNFINISHED}", self.name, std::process::id()));
        let bytes = [self.first_line(body).as_bytes(), b"\n", body].concat();
        let written = fs::write(&own, bytes).and_then(|()| fs::rename(&own, self.path()));
        if let Err(error) = written {
            let _ = fs::remove_file(&own);
            return Err(reason(error));
        }
        remove_oldest(self.folder, self.max_bytes);
        Ok(())
    }
}

/// Returns whether a file has a name that only this cache uses: 64 hexadecimal digits and the
/// extension of a finished or unfinished file.
fn is_ours(path: &Path) -> bool {
    let Some((name, rest)) = path.file_name().and_then(|name| name.to_str()).and_then(|name| name.split_at_checked(64))
    else {
        return false;
    };
    let hexadecimal = name.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
    let mut parts = rest.split('.').skip(1);
    let number = |part: Option<&str>| part.is_some_and(|p| !p.is_empty() && p.bytes().all(|b| b.is_ascii_digit()));
    let unfinished =
        number(parts.next()) && number(parts.next()) && parts.next() == Some(UNFINISHED) && parts.next().is_none();
    let kept = Kind::ALL.iter().any(|kind| rest.strip_prefix('.') == Some(kind.extension()));
    hexadecimal && (kept || unfinished)
}

/// Removes files of the cache, oldest first, until the rest has at most `max_bytes`. Files that
/// another process removes meanwhile are ignored.
fn remove_oldest(folder: &Path, max_bytes: u64) {
    let entries =
        fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).filter(|path| is_ours(path));
    let mut files: Vec<(SystemTime, PathBuf, u64)> = entries
        .filter_map(|path| {
            fs::metadata(&path)
                .ok()
                .filter(fs::Metadata::is_file)
                .and_then(|m| Some((m.modified().ok()?, path, m.len())))
        })
        .collect();
    files.sort_unstable();
    let mut total: u64 = files.iter().map(|f| f.2).sum();
    for (_, path, size) in files {
        if total <= max_bytes {
            return;
        }
        let _ = fs::remove_file(path);
        total -= size;
    }
}

//! What takes long to build, on disk: sphere trees and the shapes of meshes, found again by what they were built of.
//!
//! A file's name is the BLAKE3 hash of the mesh's content, the settings and the sources of this crate; its first line is
//!
//! ```text
//! HEAD NAME CHECKSUM
//! ```
//!
//! `HEAD` names the kind of file and its version, and `CHECKSUM` is the hash of the name and of the rest. A file that is cut, changed, of another name or of
//! another version is built anew. Several processes may use one folder at once: a file is written under a name of its own and renamed, which takes
//! effect at once and as a whole; whoever comes last wins, and both wrote the same. What goes wrong with the folder is told in a note and
//! never fails a build. Above a size the oldest files are removed.

use crate::{MeshId, TreeSettings};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

/// Most bytes of a file that is read: 512 MiB.
pub(crate) const MOST_BYTES: usize = 512 << 20;
/// Of files that are being written.
const UNFINISHED: &str = "tmp";
/// Most bytes of a folder unless told otherwise.
const MOST_IN_ALL: u64 = 1 << 30;
/// The version of this crate and of its sources (see `build.rs`).
const BUILDERS: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("TUMBLE_BUILDERS"));

/// A folder of built trees and shapes, or none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeCache {
    folder: Option<PathBuf>,
    most_bytes: u64,
}

impl TreeCache {
    /// No cache: everything is built.
    pub fn off() -> TreeCache {
        TreeCache { folder: None, most_bytes: MOST_IN_ALL }
    }

    /// In a folder, which is made when the first file is kept.
    pub fn at(folder: impl Into<PathBuf>) -> TreeCache {
        TreeCache { folder: Some(folder.into()), most_bytes: MOST_IN_ALL }
    }

    /// As the environment says: in the folder `$TUMBLE_CACHE`, or none if that is `off` in any case; where it is empty or blank, in `tumble/trees` of `$XDG_CACHE_HOME` or
    /// `~/.cache`; none where there is no home.
    pub fn of_environment() -> TreeCache {
        let path = |name: &str| {
            std::env::var_os(name).filter(|value| !value.to_string_lossy().trim().is_empty()).map(PathBuf::from)
        };
        match path("TUMBLE_CACHE") {
            Some(word) if word.to_string_lossy().trim().eq_ignore_ascii_case("off") => TreeCache::off(),
            Some(folder) => TreeCache::at(folder),
            None => {
                // a relative path there is to be passed over, says the XDG specification
                let base = path("XDG_CACHE_HOME")
                    .filter(|p| p.is_absolute())
                    .or_else(|| path("HOME").map(|home| home.join(".cache")));
                TreeCache { folder: base.map(|base| base.join("tumble/trees")), ..TreeCache::off() }
            }
        }
    }

    /// The same with another limit; the oldest files go first. Default 1 GiB.
    #[must_use]
    pub fn with_most_bytes(self, most_bytes: u64) -> TreeCache {
        TreeCache { most_bytes, ..self }
    }

    /// Where it is; `None` if it is off.
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

    /// Of files in the folder.
    fn extension(self) -> &'static str {
        self.word()
    }
}

/// The place of one tree or shape.
pub(crate) struct Entry<'a> {
    folder: &'a Path,
    most_bytes: u64,
    kind: Kind,
    /// In hexadecimal.
    name: String,
}

impl<'a> Entry<'a> {
    /// Of what is built of a mesh by these settings; `None` where the cache is off.
    pub fn new(cache: &'a TreeCache, kind: Kind, mesh: &MeshId, settings: &TreeSettings) -> Option<Entry<'a>> {
        let folder = cache.folder.as_deref()?;
        // every field of the settings, numbers in their shortest exact form
        let content = format!("{} {BUILDERS} {} {settings:?}", kind.head(), mesh.blake3);
        let name = blake3::hash(content.as_bytes()).to_hex().to_string();
        Some(Entry { folder, most_bytes: cache.most_bytes, kind, name })
    }

    fn path(&self) -> PathBuf {
        self.folder.join(&self.name).with_extension(self.kind.extension())
    }

    fn first_line(&self, body: &[u8]) -> String {
        let checksum = blake3::Hasher::new().update(self.name.as_bytes()).update(body).finalize().to_hex();
        format!("{} {} {checksum}", self.kind.head(), self.name)
    }

    /// Why the file is not to be trusted, to be told.
    pub fn refused(&self, why: impl std::fmt::Display) -> String {
        format!("the cached {} {} is built anew: {why}", self.kind.word(), self.path().display())
    }

    /// What stands in the file behind its first line, `None` if there is no file, or why it is not to be trusted.
    pub fn read(&self) -> Result<Option<Vec<u8>>, String> {
        let file = match fs::File::open(self.path()) {
            Ok(file) => file,
            // a file where the folder should be holds nothing, and is told when something is to be kept
            Err(error) if matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => {
                return Ok(None);
            }
            Err(error) => return Err(self.refused(error)),
        };
        let mut bytes = Vec::with_capacity(file.metadata().map_or(0, |m| m.len().min(MOST_BYTES as u64) as usize));
        file.take(MOST_BYTES as u64).read_to_end(&mut bytes).map_err(|e| self.refused(e))?;
        let end = bytes.iter().position(|b| *b == b'\n').ok_or_else(|| self.refused("it has no first line"))?;
        let body = bytes.split_off(end + 1);
        if bytes[..end] != *self.first_line(&body).as_bytes() {
            return Err(self.refused("its content is not what its first line says"));
        }
        Ok(Some(body))
    }

    /// Keeps a file; an error says why it is not kept.
    pub fn write(&self, body: &[u8]) -> Result<(), String> {
        // names within a process are told apart by the counter, processes by their id
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let told = |error: std::io::Error| {
            format!("the {} is not kept in {}: {error}", self.kind.word(), self.folder.display())
        };
        fs::create_dir_all(self.folder).map_err(told)?;
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let own = self.folder.join(format!("{}.{}.{number}.{UNFINISHED}", self.name, std::process::id()));
        let bytes = [self.first_line(body).as_bytes(), b"\n", body].concat();
        let written = fs::write(&own, bytes).and_then(|()| fs::rename(&own, self.path()));
        if let Err(error) = written {
            let _ = fs::remove_file(&own);
            return Err(told(error));
        }
        remove_oldest(self.folder, self.most_bytes);
        Ok(())
    }
}

/// Whether a file has a name that only this cache gives: 64 hexadecimal digits and what a kept file or an unfinished one ends in.
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

/// Removes our files, oldest first, until the rest has at most `most_bytes`. What another process removes meanwhile is gone, and as well.
fn remove_oldest(folder: &Path, most_bytes: u64) {
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
        if total <= most_bytes {
            return;
        }
        let _ = fs::remove_file(path);
        total -= size;
    }
}

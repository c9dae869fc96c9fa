//! Built trees on disk, found again by what they were built of.
//!
//! A file's name is the BLAKE3 hash of the mesh's content, the settings and the builders' sources; its first line is
//!
//! ```text
//! tumble cached tree 1 NAME CHECKSUM
//! ```
//!
//! and the rest is a [`TreeFile`], whose hash together with the name is `CHECKSUM`. A file that is cut, changed, of another name or of another
//! version is built anew. Several processes may use one folder at once: a file is written under a name of its own and renamed, which takes
//! effect at once and as a whole; whoever comes last wins, and both wrote the same. What goes wrong with the folder is told in a note and
//! never fails a build. Above a size the oldest files are removed.

use super::file::MOST_BYTES;
use super::{MeshId, Progress, SphereTree, StageCount, TreeFile, TreeSettings};
use crate::{MeshError, TriMesh};
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

const HEAD: &str = "tumble cached tree 1";
/// Of files in the folder.
const EXTENSION: &str = "tree";
/// Of files that are being written.
const UNFINISHED: &str = "tmp";
/// Most bytes of a folder unless told otherwise.
const MOST_IN_ALL: u64 = 1 << 30;
/// The version of this crate and of the sources that a tree depends on (see `build.rs`).
const BUILDERS: &str = concat!(env!("CARGO_PKG_VERSION"), " ", env!("TUMBLE_BUILDERS"));

/// A folder of built trees, or none.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeCache {
    folder: Option<PathBuf>,
    most_bytes: u64,
}

/// A tree, and where it came from.
#[derive(Clone, Debug, PartialEq)]
pub struct CachedTree {
    /// The same bits, however it came.
    pub tree: SphereTree,
    /// What the builder's stages did when it was built.
    pub stages: Vec<StageCount>,
    /// Whether it was there.
    pub found: bool,
    /// What is to be said of the cache: a file that was not to be trusted, a folder that cannot be written.
    pub note: Option<String>,
}

impl TreeCache {
    /// No cache: everything is built.
    pub fn off() -> TreeCache {
        TreeCache { folder: None, most_bytes: MOST_IN_ALL }
    }

    /// In a folder, which is made when the first tree is kept.
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
    pub fn with_most_bytes(self, most_bytes: u64) -> TreeCache {
        TreeCache { most_bytes, ..self }
    }

    /// Where it is; `None` if it is off.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }
}

impl SphereTree {
    /// [`SphereTree::build`], or the tree that was built before of the same content and settings.
    ///
    /// # Errors
    /// Those of the build; none of the cache.
    pub fn build_cached(mesh: &TriMesh, settings: &TreeSettings, cache: &TreeCache) -> Result<CachedTree, MeshError> {
        SphereTree::build_cached_watched(mesh, settings, cache, &())
    }

    /// The same, told how far it is.
    ///
    /// # Errors
    /// As [`SphereTree::build_cached`].
    pub fn build_cached_watched(
        mesh: &TriMesh,
        settings: &TreeSettings,
        cache: &TreeCache,
        progress: &dyn Progress,
    ) -> Result<CachedTree, MeshError> {
        settings.check()?;
        let entry = cache.folder.as_ref().map(|folder| Entry::new(folder, mesh, settings));
        let mut note = None;
        match entry.as_ref().map(Entry::read) {
            Some(Ok(Some(file))) => {
                progress.at(1.0);
                return Ok(CachedTree { tree: file.tree, stages: file.stages, found: true, note });
            }
            Some(Err(why)) => note = Some(why),
            None | Some(Ok(None)) => {}
        }
        let (tree, stages) = SphereTree::build_watched(mesh, settings, progress)?;
        let mut built = CachedTree { tree, stages, found: false, note };
        if let Some(entry) = entry
            && let Err(why) = entry.write(&built, cache.most_bytes)
        {
            built.note.get_or_insert(why);
        }
        Ok(built)
    }
}

/// The place of one tree.
struct Entry<'a> {
    folder: &'a Path,
    /// In hexadecimal.
    name: String,
    mesh: MeshId,
    settings: TreeSettings,
}

impl<'a> Entry<'a> {
    fn new(folder: &'a Path, mesh: &TriMesh, settings: &TreeSettings) -> Entry<'a> {
        let mesh = MeshId::of(mesh);
        // every field of the settings, numbers in their shortest exact form
        let name =
            blake3::hash(format!("{HEAD} {BUILDERS} {} {settings:?}", mesh.blake3).as_bytes()).to_hex().to_string();
        Entry { folder, name, mesh, settings: *settings }
    }

    fn path(&self) -> PathBuf {
        self.folder.join(&self.name).with_extension(EXTENSION)
    }

    fn checksum(&self, body: &str) -> String {
        blake3::Hasher::new().update(self.name.as_bytes()).update(body.as_bytes()).finalize().to_hex().to_string()
    }

    /// The file, none if there is none, or why it is not to be trusted.
    fn read(&self) -> Result<Option<TreeFile>, String> {
        let path = self.path();
        let told = |why: String| format!("the cached tree {} is built anew: {why}", path.display());
        let file = match fs::File::open(&path) {
            Ok(file) => file,
            // a file where the folder should be holds no tree, and is told when one is to be kept
            Err(error) if matches!(error.kind(), std::io::ErrorKind::NotFound | std::io::ErrorKind::NotADirectory) => {
                return Ok(None);
            }
            Err(error) => return Err(told(error.to_string())),
        };
        let mut text = String::new();
        file.take(MOST_BYTES as u64).read_to_string(&mut text).map_err(|e| told(e.to_string()))?;
        let (head, body) = text.split_once('\n').ok_or_else(|| told("it has no first line".into()))?;
        if head != format!("{HEAD} {} {}", self.name, self.checksum(body)) {
            return Err(told("its content is not what its first line says".into()));
        }
        let found = TreeFile::from_json(body).map_err(|e| told(e.to_string()))?;
        if found.mesh != self.mesh || found.settings != self.settings {
            return Err(told("it is of another mesh or of other settings".into()));
        }
        Ok(Some(found))
    }

    fn write(&self, built: &CachedTree, most_bytes: u64) -> Result<(), String> {
        // names within a process are told apart by the counter, processes by their id
        static COUNTER: AtomicU64 = AtomicU64::new(0);
        let (name, mesh) = (String::new(), self.mesh.clone());
        let file = TreeFile {
            name,
            mesh,
            settings: self.settings,
            stages: built.stages.clone(),
            quality: Vec::new(),
            tree: built.tree.clone(),
        };
        let body = file.to_json();
        let told = |error: std::io::Error| format!("the tree is not kept in {}: {error}", self.folder.display());
        fs::create_dir_all(self.folder).map_err(told)?;
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let own = self.folder.join(format!("{}.{}.{number}.{UNFINISHED}", self.name, std::process::id()));
        let written = fs::write(&own, format!("{HEAD} {} {}\n{body}", self.name, self.checksum(&body)))
            .and_then(|()| fs::rename(&own, self.path()));
        if let Err(error) = written {
            let _ = fs::remove_file(&own);
            return Err(told(error));
        }
        remove_oldest(self.folder, most_bytes);
        Ok(())
    }
}

/// Whether a file has a name that only this cache gives: 64 hexadecimal digits and what a tree or an unfinished one ends in.
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
    hexadecimal && (rest.strip_prefix('.') == Some(EXTENSION) || unfinished)
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

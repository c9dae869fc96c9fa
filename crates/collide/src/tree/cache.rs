//! Sphere trees from the cache: the same bits as a build, without the work.

use super::{MeshId, Progress, SphereTree, StageCount, TreeFile, TreeSettings};
use crate::cache::{Entry, Kind, TreeCache};
use crate::{MeshError, TriMesh};

/// A tree from the cache or from a build.
#[derive(Clone, Debug, PartialEq)]
pub struct CachedTree {
    /// The tree. Its bits do not depend on its origin.
    pub tree: SphereTree,
    /// Counts of the builder's stages, from the original build.
    pub stages: Vec<StageCount>,
    /// Whether the tree was in the cache.
    pub found: bool,
    /// A warning about the cache: an invalid file, or a folder that cannot be written.
    pub note: Option<String>,
}

impl SphereTree {
    /// Returns the cached tree of the same mesh and settings, or else builds and stores it.
    ///
    /// # Errors
    /// Those of [`SphereTree::build`]. Faults of the cache are not errors; see
    /// [`CachedTree::note`].
    pub fn build_cached(mesh: &TriMesh, settings: &TreeSettings, cache: &TreeCache) -> Result<CachedTree, MeshError> {
        SphereTree::build_cached_with_progress(mesh, settings, cache, &())
    }

    /// Like [`SphereTree::build_cached`], with progress reports.
    ///
    /// # Errors
    /// As [`SphereTree::build_cached`]; [`MeshError::Stopped`] if `progress` requests it.
    pub fn build_cached_with_progress(
        mesh: &TriMesh,
        settings: &TreeSettings,
        cache: &TreeCache,
        progress: &dyn Progress,
    ) -> Result<CachedTree, MeshError> {
        settings.check()?;
        let id = MeshId::of(mesh);
        let entry = Entry::new(cache, Kind::Tree, &id, settings);
        let mut note = None;
        match entry.as_ref().map(|entry| read(entry, &id, settings)) {
            Some(Ok(Some(file))) => {
                progress.report(1.0);
                return Ok(CachedTree { tree: file.tree, stages: file.stages, found: true, note });
            }
            Some(Err(why)) => note = Some(why),
            None | Some(Ok(None)) => {}
        }
        let (tree, stages) = SphereTree::build_with_progress(mesh, settings, progress)?;
        let mut built = CachedTree { tree, stages, found: false, note };
        if let Some(entry) = entry
            && let Err(why) = entry.write(json_of(&built, id, settings).as_bytes())
        {
            built.note.get_or_insert(why);
        }
        Ok(built)
    }
}

fn read(entry: &Entry, mesh: &MeshId, settings: &TreeSettings) -> Result<Option<TreeFile>, String> {
    let Some(body) = entry.read()? else { return Ok(None) };
    let text = String::from_utf8(body).map_err(|e| entry.refused(e))?;
    let found = TreeFile::from_json(&text).map_err(|e| entry.refused(e))?;
    if found.mesh != *mesh || found.settings != *settings {
        return Err(entry.refused("it belongs to another mesh or other settings"));
    }
    Ok(Some(found))
}

fn json_of(built: &CachedTree, mesh: MeshId, settings: &TreeSettings) -> String {
    let (name, quality) = (String::new(), Vec::new());
    let (stages, tree) = (built.stages.clone(), built.tree.clone());
    TreeFile { name, mesh, settings: *settings, stages, quality, tree }.to_json()
}

//! Trees from the cache: the same bits as a build, without the work.

use super::{MeshId, Progress, SphereTree, StageCount, TreeFile, TreeSettings};
use crate::cache::{Entry, Kind, TreeCache};
use crate::{MeshError, TriMesh};

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

impl SphereTree {
    /// [`SphereTree::build`], or the tree that was built before of the same content and settings.
    ///
    /// # Errors
    /// Those of the build; none of the cache.
    pub fn build_cached(mesh: &TriMesh, settings: &TreeSettings, cache: &TreeCache) -> Result<CachedTree, MeshError> {
        SphereTree::build_cached_with_progress(mesh, settings, cache, &())
    }

    /// The same, told how far it is.
    ///
    /// # Errors
    /// As [`SphereTree::build_cached`].
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
        return Err(entry.refused("it is of another mesh or of other settings"));
    }
    Ok(Some(found))
}

fn json_of(built: &CachedTree, mesh: MeshId, settings: &TreeSettings) -> String {
    let (name, quality) = (String::new(), Vec::new());
    let (stages, tree) = (built.stages.clone(), built.tree.clone());
    TreeFile { name, mesh, settings: *settings, stages, quality, tree }.to_json()
}

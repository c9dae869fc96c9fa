//! The file with the exact state beside a scene that was saved.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tumble_core::archive::{ArchiveError, open, seal};
use tumble_core::{World, WorldError};

use super::SaveError;
use crate::notes::Notes;
use crate::parse::fields::Fields;
use crate::parse::file::SceneFile;

/// First bytes of the file; the last is the number of the format.
const HEAD: &[u8; 8] = b"tumbleSW";
/// Largest file, bytes: 2 GiB.
const MAX_SAVED_BYTES: u64 = 2 << 30;

/// Content of the file.
#[derive(Serialize, Deserialize)]
struct Content {
    /// BLAKE3 of the text of the scene.
    text: [u8; 32],
    /// The world.
    archive: Vec<u8>,
}

/// The exact state that belongs to the text of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedWorld {
    /// The file, prefixed with the folder of the scene.
    pub path: PathBuf,
    /// The archive; `None` if the text was edited after it was written, so that the text counts.
    archive: Option<Arc<[u8]>>,
    /// The scene as its text describes it.
    as_read: Option<Arc<SceneFile>>,
}

/// Returns the bytes of the file that goes with a text.
pub(super) fn file(text: &str, archive: Vec<u8>) -> Result<Vec<u8>, SaveError> {
    Ok(seal(HEAD, &Content { text: *blake3::hash(text.as_bytes()).as_bytes(), archive })?)
}

impl SavedWorld {
    /// Reads the key `saved_world`, and the file that it names.
    pub(crate) fn read(f: &mut Fields<'_>, folder: &Path) -> Option<SavedWorld> {
        let (name, value) = f.optional_text("saved_world")?;
        let path = folder.join(name);
        match content(&path) {
            Ok(content) => {
                let same = content.text == *blake3::hash(f.log.text().as_bytes()).as_bytes();
                Some(SavedWorld { path, archive: same.then(|| content.archive.into()), as_read: None })
            }
            Err(why) => {
                let message = format!("`saved_world` cannot be read from {}: {why}", path.display());
                let expected = "expected the file that was written with this scene; without the line, the text counts";
                f.log.report(value.span(), message, expected);
                None
            }
        }
    }

    /// Keeps the scene that the text describes.
    pub(crate) fn belonging_to(mut self, scene: &SceneFile) -> SavedWorld {
        self.as_read = self.archive.is_some().then(|| Arc::new(scene.clone()));
        self
    }
}

impl SceneFile {
    /// Returns the saved world if the scene is still the one that was saved. Its settings, stepper and
    /// solver are those of the scene, which may have been changed since. Otherwise a note says that the text
    /// counts.
    pub(crate) fn saved_world(&self, notes: &mut Notes) -> Result<Option<World>, String> {
        let Some(saved) = &self.saved else { return Ok(None) };
        let (Some(archive), Some(as_read)) = (&saved.archive, &saved.as_read) else {
            notes.push(format!("{}: it was edited after it was saved, so it starts from its text", self.file));
            return Ok(None);
        };
        if !self.has_objects_of(as_read) {
            notes.push(format!("{}: its objects were changed, so it starts from its text", self.file));
            return Ok(None);
        }
        let mut world = World::from_archive(archive, &mut tumble_behaviors::read_object)
            .map_err(|e: ArchiveError| e.to_string())?;
        let (ours, read) = (&self.world, &as_read.world);
        if *world.settings() != self.settings() {
            world.set_settings(self.settings()).map_err(|e: WorldError| e.to_string())?;
        }
        if ours.stepper != read.stepper {
            world.set_stepper(ours.stepper.new_stepper());
        }
        if ours.solver != read.solver {
            world.set_solver(ours.solver.new_solver());
        }
        Ok(Some(world))
    }

    fn has_objects_of(&self, other: &SceneFile) -> bool {
        (&self.meshes, &self.bodies, &self.articulated) == (&other.meshes, &other.bodies, &other.articulated)
            && (&self.loop_joints, &self.pairs, &self.materials) == (&other.loop_joints, &other.pairs, &other.materials)
            && (&self.mimics, &self.sensors, &self.events) == (&other.mimics, &other.sensors, &other.events)
            && (&self.templates, &self.behaviors) == (&other.templates, &other.behaviors)
    }
}

fn content(path: &Path) -> Result<Content, String> {
    let size = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
    if size > MAX_SAVED_BYTES {
        return Err(format!("the file has {size} bytes; the limit is {MAX_SAVED_BYTES}"));
    }
    let bytes = crate::read_file(path).map_err(|e| e.to_string())?;
    open(HEAD, &bytes).map_err(|e| e.to_string())
}

//! Worlds written as scene files.

use crate::errors::{Error, Result};
use crate::world::inner::Inner;
use std::path::Path;
use tumble::scene::{SaveError, SceneWriter};

/// Writes a world as a scene and returns notes about things that are not in it.
pub fn write(inner: &Inner, path: &Path) -> Result<Vec<String>> {
    let name = |id| inner.world.name(id).unwrap_or_default();
    if let Some(event) = inner.called_event() {
        return Err(Error::value(format!(
            "the world cannot be written as a scene, which has no words for callables: '{event}'"
        )));
    }
    let mut writer = SceneWriter::new(&inner.world).like(&inner.scene);
    for (&id, robot) in &inner.robots {
        writer = writer.with_joint_names(name(id), robot.joints.clone());
    }
    let mut notes = writer.save(path).map_err(|error| match error {
        SaveError::Write { file, source } => Error::File { file: file.display().to_string(), source },
        other => Error::value(other.to_string()),
    })?;
    for (&id, efforts) in &inner.efforts {
        if efforts.iter().any(|effort| *effort != 0.0) {
            notes.push(format!("'{}': its generalized forces are not written; set them again after loading", name(id)));
        }
    }
    Ok(notes)
}

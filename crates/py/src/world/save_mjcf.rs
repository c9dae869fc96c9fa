//! Worlds written as models of MuJoCo.

use crate::errors::{Error, Result};
use crate::world::inner::Inner;
use std::path::Path;
use tumble::scene::mjcf::{MjcfWriter, SaveMjcfError};

/// Writes a world as MJCF and returns notes about everything that MJCF cannot say.
pub fn write(inner: &Inner, path: &Path) -> Result<Vec<String>> {
    let name = |id| inner.world.name(id).unwrap_or_default();
    let mut writer = MjcfWriter::new(&inner.world).like(&inner.scene);
    for (&id, robot) in &inner.robots {
        writer = writer.with_joint_names(name(id), robot.joints.clone());
    }
    let mut notes = writer.save(path).map_err(|error| match error {
        SaveMjcfError::Write { file, source } => Error::File { file: file.display().to_string(), source },
        other => Error::value(other.to_string()),
    })?;
    if let Some(event) = inner.called_event() {
        notes.push(format!("'{event}': callables are left out"));
    }
    for (&id, efforts) in &inner.efforts {
        if efforts.iter().any(|effort| *effort != 0.0) {
            notes.push(format!("'{}': its generalized forces are left out", name(id)));
        }
    }
    Ok(notes)
}

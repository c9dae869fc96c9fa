//! The caves that come with tumble, and lookup of a cave by path or name.

use std::path::{Path, PathBuf};

use super::{Cave, CaveError};
use crate::parse::file::description;
use crate::parse::suggest::{listed, nearest};

/// A cave that is built into the library.
#[derive(Clone, Copy, Debug)]
pub struct ShippedCave {
    /// The name of its file under `caves/`, without the extension.
    pub name: &'static str,
    /// The whole text.
    pub text: &'static str,
}

macro_rules! shipped_caves {
    ($($name:literal),* $(,)?) => {
        &[$(ShippedCave { name: $name, text: include_str!(concat!("../../caves/", $name, ".toml")) }),*]
    };
}

const SHIPPED: &[ShippedCave] =
    shipped_caves!["wall3", "cube4", "cube6", "cylinder5", "sphere5", "curve", "dome", "panorama", "cube_map"];

/// Returns the caves that come with tumble.
pub fn shipped_caves() -> &'static [ShippedCave] {
    SHIPPED
}

impl ShippedCave {
    /// Returns the line that describes the cave.
    pub fn description(&self) -> String {
        description(self.text)
    }

    /// Reads the cave.
    ///
    /// # Errors
    /// None for the shipped texts; the type is that of [`Cave::parse`].
    pub fn read(&self) -> Result<Cave, CaveError> {
        Cave::parse(self.text, &format!("caves/{}.toml", self.name))
    }
}

/// The place where a cave was found.
#[derive(Clone, Debug)]
pub enum CaveSource {
    /// A file.
    Path(PathBuf),
    /// Built in.
    Shipped(ShippedCave),
}

impl CaveSource {
    /// Reads the cave.
    ///
    /// # Errors
    /// As [`Cave::load`].
    pub fn load(&self) -> Result<Cave, CaveError> {
        match self {
            CaveSource::Path(path) => Cave::load(path),
            CaveSource::Shipped(cave) => cave.read(),
        }
    }

    /// Returns the text of a cave that [`CaveSource::load`] reads.
    ///
    /// # Errors
    /// As [`Cave::load`], for a file that cannot be read.
    pub fn text(&self) -> Result<String, CaveError> {
        match self {
            CaveSource::Path(path) => {
                let unread = |source| CaveError::Read { file: path.clone(), source };
                let bytes = crate::open::plain::read_file(path).map_err(unread)?;
                String::from_utf8(bytes)
                    .map_err(|e| CaveError::NotUtf8 { file: path.clone(), byte: e.utf8_error().valid_up_to() })
            }
            CaveSource::Shipped(cave) => Ok(cave.text.to_owned()),
        }
    }
}

/// Finds a cave: the path of a file, or the name of a shipped one. `caves/NAME.toml` of a shipped
/// cave is found from any folder.
///
/// # Errors
/// [`CaveError::Unknown`] for a name that is not shipped, [`CaveError::Read`] for a path that does
/// not exist.
pub fn resolve_cave(name_or_path: &str) -> Result<CaveSource, CaveError> {
    let path = Path::new(name_or_path);
    if path.is_file() {
        return Ok(CaveSource::Path(path.to_path_buf()));
    }
    let named = |cave: &&ShippedCave| name_or_path == cave.name || name_or_path == format!("caves/{}.toml", cave.name);
    if let Some(cave) = SHIPPED.iter().find(named) {
        return Ok(CaveSource::Shipped(*cave));
    }
    if name_or_path.contains(['/', '\\']) || name_or_path.ends_with(".toml") {
        let source = std::fs::metadata(path).err().unwrap_or_else(crate::open::plain::no_regular_file);
        return Err(CaveError::Read { file: path.to_path_buf(), source });
    }
    let names = SHIPPED.iter().map(|cave| cave.name);
    let all = listed(names.clone(), "and");
    let hint = match nearest(name_or_path, names) {
        Some(near) => format!("did you mean `{near}`? There are {all}"),
        None => format!("there are {all}; or give the path of a cave file"),
    };
    Err(CaveError::Unknown { name: name_or_path.to_owned(), hint })
}

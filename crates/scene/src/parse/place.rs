//! The files that a scene names.

use std::path::Path;

/// The place of the files that a scene names.
pub(crate) struct Place<'a> {
    /// The folder of the scene.
    pub folder: &'a Path,
    /// Names and contents of files that are given with the text of the scene.
    pub files: &'a [(&'a str, &'a str)],
}

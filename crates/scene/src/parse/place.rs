//! The files that a scene names.

use std::path::Path;

/// The place of the files that a scene names.
pub(crate) struct Place<'a> {
    /// The folder of the scene.
    pub folder: &'a Path,
    /// Names and contents of files that are given with the text of the scene.
    pub files: &'a [(&'a str, &'a str)],
}

impl<'a> Place<'a> {
    /// Returns the contents of a file that is given with the text of the scene.
    pub(crate) fn text(&self, name: &str) -> Option<&'a str> {
        self.files.iter().find(|(given, _)| *given == name).map(|(_, text)| *text)
    }
}

//! URDF.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::link::{LinkSpec, Surface};

/// What to do about meshes that cannot be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MissingMeshes {
    /// A collision mesh that is missing is an error.
    #[default]
    Error,
    /// It is left out, with a note.
    Skip,
}

/// What a collision mesh collides as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CollisionMeshes {
    /// As it is, where it is closed; an open one as its convex hull, with a note.
    #[default]
    Exact,
    /// As its convex hull.
    Hull,
}

/// How a URDF is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UrdfOptions {
    /// Whether the root link floats; else it is fixed to the base.
    pub floating: bool,
    /// Folders of packages by name.
    pub packages: BTreeMap<String, PathBuf>,
    /// Default [`MissingMeshes::Error`].
    pub missing_meshes: MissingMeshes,
    /// Default [`CollisionMeshes::Exact`].
    pub collision_meshes: CollisionMeshes,
    /// Surface of all links.
    pub surface: Surface,
    /// Whether the look of `surface` stands instead of the file's colours.
    pub color: bool,
}

pub(crate) struct Robot {
    pub(crate) links: Vec<LinkSpec>,
    pub(crate) notes: Vec<String>,
}

pub(crate) fn read_file(_path: &Path, _options: &UrdfOptions) -> Result<Robot, std::io::Error> {
    Err(std::io::Error::other("not yet"))
}

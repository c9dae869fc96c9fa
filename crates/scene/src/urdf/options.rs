//! How a URDF is read.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::parse::link::Surface;
/// The treatment of collision meshes that do not exist or cannot be read. Visual meshes are never
/// an error: missing ones are left out with a note, unreadable ones when they are drawn
/// ([`visual_notes`](crate::visual_notes)).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MissingMeshes {
    /// An error.
    #[default]
    Error,
    /// Left out, with a note.
    Skip,
}

/// The shape that a collision mesh collides as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CollisionMeshes {
    /// The mesh itself if it is closed; an open one as its convex hull, with a note.
    #[default]
    Exact,
    /// Its convex hull.
    Hull,
}

/// How a URDF is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UrdfOptions {
    /// Whether the root link floats. Otherwise it is fixed to the base.
    pub floating: bool,
    /// Folders of packages by name, for `package://NAME/…`. Other packages are searched in the
    /// folders above the URDF.
    pub packages: BTreeMap<String, PathBuf>,
    /// Default [`MissingMeshes::Error`].
    pub missing_meshes: MissingMeshes,
    /// Default [`CollisionMeshes::Exact`].
    pub collision_meshes: CollisionMeshes,
    /// Surface of all links.
    pub surface: Surface,
    /// Whether the appearance of `surface` replaces the file's colors.
    pub recolor: bool,
    /// Whether the friction of `surface` holds for collisions of SDFormat without `mu`, which is 1 by that format otherwise.
    pub friction_given: bool,
    /// Whether the velocities in `<limit>` are [enforced](tumble_core::DofSettings::max_velocity). Default `false`: in URDF they bound the
    /// commands of a controller, while an enforced one also holds against gravity and blows. Effort bounds drives in either case.
    pub velocity_limits: bool,
}

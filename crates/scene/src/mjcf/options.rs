//! How an MJCF file is read.

use crate::urdf::{CollisionMeshes, MissingMeshes};

/// How an MJCF file is read.
#[derive(Clone, Debug, PartialEq)]
pub struct MjcfOptions {
    /// Default [`MissingMeshes::Error`].
    pub missing_meshes: MissingMeshes,
    /// Default [`CollisionMeshes::Hull`], as in MuJoCo.
    pub collision_meshes: CollisionMeshes,
    /// The keyframe that the model starts in, by its name, or by its number from 0 if no keyframe
    /// has that name. Default: the model's reference configuration.
    pub keyframe: Option<String>,
}

impl Default for MjcfOptions {
    fn default() -> MjcfOptions {
        MjcfOptions { missing_meshes: MissingMeshes::Error, collision_meshes: CollisionMeshes::Hull, keyframe: None }
    }
}

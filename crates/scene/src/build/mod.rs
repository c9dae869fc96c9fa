//! Builds worlds from scenes: shapes, bodies, joints, and the mesh files that they need.

pub(crate) mod appearance;
pub(crate) mod articulated;
pub(crate) mod behaviors;
pub(crate) mod collada;
pub(crate) mod error;
pub(crate) mod event;
pub(crate) mod grid;
pub(crate) mod heights;
pub(crate) mod mesh_files;
pub(crate) mod meshes;
mod mimic;
mod sensor;
pub(crate) mod shapes;
pub(crate) mod slow;
pub(crate) mod textures;
pub(crate) mod visual_mesh;
pub(crate) mod world;

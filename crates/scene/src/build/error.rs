//! Why a scene could not be built.

use std::path::PathBuf;

use thiserror::Error;
use tumble_core::WorldError;

/// Why a checked scene could not be built into a world.
#[derive(Debug, Error)]
pub enum BuildError {
    /// A mesh file could not be read.
    #[error("{scene}: mesh \"{mesh}\": cannot read {}: {source}", file.display())]
    MeshFile {
        /// The scene.
        scene: String,
        /// The mesh.
        mesh: String,
        /// Its file.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// A mesh is not a closed solid, or has invalid numbers.
    #[error("{scene}: mesh \"{mesh}\"{}: {why}", file.as_ref().map_or(String::new(), |f| format!(" ({})", f.display())))]
    Mesh {
        /// The scene.
        scene: String,
        /// The mesh.
        mesh: String,
        /// Its file, if it has one.
        file: Option<PathBuf>,
        /// From the reader or the check; names the line, the vertex or the triangle.
        why: String,
    },
    /// A body's shape or a constant of it is invalid.
    #[error("{scene}: body \"{body}\": {why}")]
    Body {
        /// The scene.
        scene: String,
        /// The body.
        body: String,
        /// From the shape or the body.
        why: String,
    },
    /// A shape or a constant of an articulated body is invalid.
    #[error("{scene}: articulated \"{body}\": {why}")]
    Articulated {
        /// The scene.
        scene: String,
        /// The body.
        body: String,
        /// From the shape or the body; names the link.
        why: String,
    },
    /// A loop joint is invalid.
    #[error("{scene}: {why}")]
    LoopJoint {
        /// The scene.
        scene: String,
        /// From the joint; names the joint.
        why: String,
    },
    /// A coupling of two joints is invalid.
    #[error("{scene}: {why}")]
    Mimic {
        /// The scene.
        scene: String,
        /// From the coupling; names it.
        why: String,
    },
    /// A sensor is invalid.
    #[error("{scene}: {why}")]
    Sensor {
        /// The scene.
        scene: String,
        /// From the sensor; names it.
        why: String,
    },
    /// A soft body, a particle system, a flock or a field is invalid.
    #[error("{scene}: \"{name}\": {why}")]
    Behavior {
        /// The scene.
        scene: String,
        /// Its name.
        name: String,
        /// From the behavior; names the constant.
        why: String,
    },
    /// The exact state of a saved scene is damaged or of another version.
    #[error("{scene}: the state in {} cannot be used: {why}; without the line `saved_world` the text counts", file.display())]
    Saved {
        /// The scene.
        scene: String,
        /// Its file.
        file: PathBuf,
        /// From the archive.
        why: String,
    },
    /// The world refused a setting.
    #[error("{scene}: {source}")]
    World {
        /// The scene.
        scene: String,
        /// From the world.
        source: WorldError,
    },
}

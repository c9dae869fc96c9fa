//! Errors of scene files: one line per problem, or a report with the lines of the file.

use std::path::PathBuf;

use thiserror::Error;

use crate::mjcf::MjcfError;
use crate::parse::problem::{Invalid, Problem};
use crate::sdformat::SdformatError;
use crate::urdf::UrdfError;

/// Why a scene could not be read.
#[derive(Debug, Error)]
pub enum SceneError {
    /// The file could not be opened or read.
    #[error("{}: cannot read it: {source}; give the path of a scene.toml or its folder, a URDF, MJCF or SDF file, or a mesh", file.display())]
    Read {
        /// The path that was tried.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{}: the file is larger than {limit} bytes, the limit for scenes; put meshes into separate files", file.display())]
    TooLarge {
        /// The path that was tried.
        file: PathBuf,
        /// The most bytes allowed.
        limit: u64,
    },
    /// The file is not UTF-8.
    #[error("{}:{line}: byte {byte} of the file is not UTF-8; a scene is a UTF-8 text in TOML", file.display())]
    NotUtf8 {
        /// The path that was tried.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Offset of the first invalid byte, from 0.
        byte: usize,
    },
    /// The format of the file is not supported, or the file is not text.
    #[error("{}: {why}", file.display())]
    Format {
        /// The path that was tried.
        file: PathBuf,
        /// The format found, and the supported ones.
        why: String,
    },
    /// A robot's URDF is invalid.
    #[error(transparent)]
    Urdf(#[from] UrdfError),
    /// A model of MuJoCo is invalid.
    #[error(transparent)]
    Mjcf(Box<MjcfError>),
    /// A file of Gazebo is invalid.
    #[error(transparent)]
    Sdformat(#[from] SdformatError),
    /// The name is not a path and not a shipped scene.
    #[error("no scene `{name}`: {hint}")]
    Unknown {
        /// The given name.
        name: String,
        /// The nearest name, or all names.
        hint: String,
    },
    /// The text has one or more problems.
    #[error("{0}")]
    Invalid(Box<Invalid>),
}

impl SceneError {
    /// Returns the error as a report for people: the message, and for each problem of the text the
    /// lines of the file with the place marked. Escape codes for color only if `color`.
    pub fn report(&self, color: bool) -> String {
        match self {
            SceneError::Invalid(invalid) => invalid.report(color),
            SceneError::Urdf(error) => error.report(color),
            SceneError::Mjcf(error) => error.report(color),
            SceneError::Sdformat(error) => error.report(color),
            other => format!("error: {other}\n"),
        }
    }

    /// Returns the problems of the text in the order of the file; empty for the other kinds of
    /// error.
    pub fn problems(&self) -> &[Problem] {
        match self {
            SceneError::Invalid(invalid) => &invalid.problems,
            _ => &[],
        }
    }
}

//! Errors of URDF files.

use std::path::PathBuf;

use thiserror::Error;
use tumble_core::articulated::ModelError;

use crate::parse::problem::Invalid;

/// Largest URDF in bytes: 64 MiB.
pub(super) const MAX_BYTES: u64 = 64 << 20;

/// Why a URDF could not be read.
#[derive(Debug, Error)]
pub enum UrdfError {
    /// The file could not be opened or read.
    #[error("{}: cannot read the URDF: {source}", file.display())]
    Read {
        /// The path that was tried.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{}: the file is larger than {MAX_BYTES} bytes, the limit for URDFs", file.display())]
    TooLarge {
        /// The path that was tried.
        file: PathBuf,
    },
    /// The file is not UTF-8.
    #[error("{}:{line}: byte {byte} of the file is not UTF-8; a URDF is a UTF-8 text in XML", file.display())]
    NotUtf8 {
        /// The path that was tried.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Offset of the first invalid byte, from 0.
        byte: usize,
    },
    /// The text has one or more problems.
    #[error("{0}")]
    Invalid(Box<Invalid>),
    /// The links do not form a tree that can move.
    #[error("{}: {source}", file.display())]
    Model {
        /// The file.
        file: PathBuf,
        /// From the model.
        source: ModelError,
    },
    /// A mesh cannot be read, or a shape or constant is invalid.
    #[error("{}: {why}", file.display())]
    Body {
        /// The file.
        file: PathBuf,
        /// The reason; names the link.
        why: String,
    },
}

impl UrdfError {
    /// Returns the error as a report for people, as
    /// [`SceneError::report`](crate::SceneError::report).
    pub fn report(&self, color: bool) -> String {
        match self {
            UrdfError::Invalid(invalid) => invalid.report(color),
            other => format!("error: {other}\n"),
        }
    }
}

//! Errors of SDF files.

use std::path::PathBuf;

use thiserror::Error;

use crate::parse::problem::Invalid;
use crate::urdf::UrdfError;

/// Why an SDF file could not be read.
#[derive(Debug, Error)]
pub enum SdformatError {
    /// The file could not be opened or read.
    #[error("{}: cannot read the SDF file: {source}", file.display())]
    Read {
        /// The path that was tried.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// The file is too large, or not UTF-8.
    #[error("{why}")]
    Text {
        /// The reason; names the file.
        why: String,
    },
    /// The text has one or more problems.
    #[error("{0}")]
    Invalid(Box<Invalid>),
    /// The file has none or several articulated bodies, where one is expected.
    #[error("{}: it has {count} bodies of joined links ({}); expected one", file.display(), names.join(", "))]
    Bodies {
        /// The file.
        file: PathBuf,
        /// Their number.
        count: usize,
        /// Their names, the first few.
        names: Vec<String>,
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

impl SdformatError {
    /// Returns the error as a report for people, as
    /// [`SceneError::report`](crate::SceneError::report).
    pub fn report(&self, color: bool) -> String {
        match self {
            SdformatError::Invalid(invalid) => invalid.report(color),
            other => format!("error: {other}\n"),
        }
    }
}

impl From<UrdfError> for SdformatError {
    /// Takes the errors of reading an XML text.
    fn from(error: UrdfError) -> SdformatError {
        match error {
            UrdfError::Read { file, source } => SdformatError::Read { file, source },
            UrdfError::Invalid(invalid) => SdformatError::Invalid(invalid),
            other => SdformatError::Text { why: other.to_string().replace("URDF", "SDF file") },
        }
    }
}

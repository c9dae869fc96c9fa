//! Errors of MJCF files.

use std::path::PathBuf;

use thiserror::Error;

use crate::error::SceneError;
use crate::parse::problem::{Invalid, Problem};

/// Largest size of an MJCF file and of all that it includes, in bytes: 16 MiB.
pub(super) const MAX_BYTES: u64 = 16 << 20;

/// Why an MJCF file could not be read.
#[derive(Debug, Error)]
pub enum MjcfError {
    /// The file could not be opened or read.
    #[error("{}: cannot read the MJCF file: {source}", file.display())]
    Read {
        /// The path that was tried.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{}: the file is larger than {MAX_BYTES} bytes, the limit for MJCF; put meshes into separate files", file.display())]
    TooLarge {
        /// The path that was tried.
        file: PathBuf,
    },
    /// The file is not UTF-8.
    #[error("{}:{line}: byte {byte} of the file is not UTF-8; MJCF is a UTF-8 text in XML", file.display())]
    NotUtf8 {
        /// The path that was tried.
        file: PathBuf,
        /// The line, from 1.
        line: usize,
        /// Offset of the first invalid byte, from 0.
        byte: usize,
    },
    /// One or more files have problems: one entry for each such file, the model first, then the
    /// files that it includes.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
    Invalid(Vec<Invalid>),
    /// The model has no articulated body, or several, where one is expected.
    #[error("{}: the model has {count} articulated bodies{}; expected one, or read the whole model as a scene", file.display(), listed(names))]
    Bodies {
        /// The file.
        file: PathBuf,
        /// Their number.
        count: usize,
        /// Their names.
        names: Vec<String>,
    },
    /// The world of the model cannot be built.
    #[error("{why}")]
    Body {
        /// The reason; names the file and the body.
        why: String,
    },
}

fn listed(names: &[String]) -> String {
    match names {
        [] => String::new(),
        names => format!(" ({})", names.iter().take(8).map(String::as_str).collect::<Vec<_>>().join(", ")),
    }
}

impl MjcfError {
    /// Returns the error as a report for people, as
    /// [`SceneError::report`](crate::SceneError::report).
    pub fn report(&self, color: bool) -> String {
        match self {
            MjcfError::Invalid(files) => files.iter().map(|file| file.report(color)).collect(),
            other => format!("error: {other}\n"),
        }
    }

    /// Returns the problems of all files; empty for the other kinds of error.
    pub fn problems(&self) -> Vec<&Problem> {
        match self {
            MjcfError::Invalid(files) => files.iter().flat_map(|file| &file.problems).collect(),
            _ => Vec::new(),
        }
    }
}

impl From<MjcfError> for SceneError {
    fn from(error: MjcfError) -> SceneError {
        SceneError::Mjcf(Box::new(error))
    }
}

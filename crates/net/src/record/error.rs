//! Errors of recording, reading and recovering.

use std::path::{Path, PathBuf};

/// An error of this module. The message names the file, and for a damaged file the byte.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The operating system reported an error.
    #[error("{}: {what}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The operation.
        what: &'static str,
        /// The system's error.
        source: std::io::Error,
    },
    /// The container's writer failed, usually because the disk is full.
    #[error("{}: cannot write the recording: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The writer's error.
        source: mcap::McapError,
    },
    /// The input cannot be recorded.
    #[error("cannot record {what}: {why}")]
    Input {
        /// The entity, frame or option.
        what: String,
        /// The value, and the valid values.
        why: String,
    },
    /// The file is not an MCAP file.
    #[error("{}: not an MCAP file: {why}", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
        /// Description of the content.
        why: String,
    },
    /// An MCAP file that is not a recording of tumble.
    #[error("{}: not a tumble recording: {why}", path.display())]
    NotARecording {
        /// The file.
        path: PathBuf,
        /// The missing or different part.
        why: String,
    },
    /// The file is damaged.
    #[error("{}: damaged at byte {offset}: {what}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Offset of the damaged record.
        offset: u64,
        /// Description of the damage.
        what: String,
    },
    /// A cut or damaged file contains no whole frame.
    #[error("{}: nothing to recover: no whole frame before byte {offset} ({what})", path.display())]
    NothingToRecover {
        /// The file.
        path: PathBuf,
        /// Offset at which reading ended.
        offset: u64,
        /// The reason why it ended.
        what: String,
    },
}

/// Result of this module.
pub(crate) type Result<T> = std::result::Result<T, RecordError>;

impl RecordError {
    pub(crate) fn io(path: &Path, what: &'static str) -> impl FnOnce(std::io::Error) -> RecordError {
        let path = path.to_owned();
        move |source| RecordError::Io { path, what, source }
    }

    pub(crate) fn write(path: &Path) -> impl FnOnce(mcap::McapError) -> RecordError {
        let path = path.to_owned();
        move |source| match source {
            mcap::McapError::Io(source) => RecordError::Io { path, what: "cannot write", source },
            source => RecordError::Write { path, source },
        }
    }

    pub(crate) fn input(what: impl Into<String>, why: impl Into<String>) -> RecordError {
        RecordError::Input { what: what.into(), why: why.into() }
    }

    pub(crate) fn corrupt(path: &Path, offset: u64, what: impl Into<String>) -> RecordError {
        RecordError::Corrupt { path: path.to_owned(), offset, what: what.into() }
    }
}

//! Errors of cave files.

use std::path::PathBuf;

use thiserror::Error;

use super::Cave;
use crate::parse::problem::{Invalid, Problem};
use crate::parse::suggest::{listed, nearest};

/// Why a cave could not be read, or why a facet of it was not found.
#[derive(Debug, Error)]
pub enum CaveError {
    /// The file could not be opened or read.
    #[error("{}: cannot read the cave: {source}; give the path of a cave file or the name of a shipped one", file.display())]
    Read {
        /// The path that was tried.
        file: PathBuf,
        /// From the system.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error("{}: the file is larger than {limit} bytes, the limit for caves", file.display())]
    TooLarge {
        /// The path that was tried.
        file: PathBuf,
        /// The most bytes allowed.
        limit: u64,
    },
    /// The file is not UTF-8.
    #[error("{}: byte {byte} of the file is not UTF-8; a cave is a UTF-8 text in TOML", file.display())]
    NotUtf8 {
        /// The path that was tried.
        file: PathBuf,
        /// Offset of the first invalid byte, from 0.
        byte: usize,
    },
    /// The name is not a path and not a shipped cave.
    #[error("no cave `{name}`: {hint}")]
    Unknown {
        /// The given name.
        name: String,
        /// The nearest name, or all names.
        hint: String,
    },
    /// The cave has no facet of that name.
    #[error("{file}: no facet `{name}`; {hint}")]
    NoFacet {
        /// The cave's file.
        file: String,
        /// The given name.
        name: String,
        /// The nearest name, or all names.
        hint: String,
    },
    /// The text has one or more problems.
    #[error("{0}")]
    Invalid(Box<Invalid>),
}

impl CaveError {
    /// Returns the error as a report for people. Escape codes for color only if `color`.
    pub fn report(&self, color: bool) -> String {
        match self {
            CaveError::Invalid(invalid) => invalid.report(color),
            other => format!("error: {other}\n"),
        }
    }

    /// Returns the problems of the text in the order of the file; empty for the other kinds of
    /// error.
    pub fn problems(&self) -> &[Problem] {
        match self {
            CaveError::Invalid(invalid) => &invalid.problems,
            _ => &[],
        }
    }

    pub(crate) fn no_facet(cave: &Cave, name: &str) -> CaveError {
        let names = cave.facets.iter().map(|facet| facet.name.as_str());
        let all = listed(names.clone().take(20), "and");
        let hint = match nearest(name, names) {
            Some(near) => format!("did you mean `{near}`? It has {all}"),
            None => format!("it has {all}"),
        };
        CaveError::NoFacet { file: cave.file.clone(), name: name.to_owned(), hint }
    }
}

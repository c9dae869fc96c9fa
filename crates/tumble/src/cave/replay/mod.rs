//! Recorded runs: replay of frames, and replay of the users' inputs in a new simulation.

pub mod frames;
pub mod replayed_input;

use crate::failure::Failure;
use std::path::Path;

/// Returns the failure of an unusable recording, whose message names the file once.
fn named(file: &Path, error: &dyn std::fmt::Display) -> Failure {
    let (file, error) = (file.display().to_string(), error.to_string());
    Failure::input(if error.starts_with(&file) { error } else { format!("{file}: {error}") })
}

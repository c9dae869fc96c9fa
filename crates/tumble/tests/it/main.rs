//! The `tumble` command as its users run it: processes, files, exit codes.

mod bad_input;
mod common;
mod determinism;
mod machines;
mod outputs;
mod picture;
mod scenes;

//! Conversion between numpy arrays and Rust.

pub mod convert;
pub mod state;
pub mod whole;

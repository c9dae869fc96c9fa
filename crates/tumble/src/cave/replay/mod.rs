//! Recorded runs: frames that are shown again, and inputs that are applied again.

pub mod frames;
pub mod replayed_input;

//! Recorded runs: replay of frames, and replay of the users' inputs in a new simulation.

pub mod frames;
pub mod replayed_input;

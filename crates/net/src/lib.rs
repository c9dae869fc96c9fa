//! Recordings, and NetSync sessions over their transports: everything that leaves or enters a
//! process.
//!
//! [`record`] writes and reads MCAP files: Foxglove's published schemas for the picture and one
//! channel of our own for the exact state. [`sync`] keeps the processes of a cave showing the same
//! frame. [`control`] reads what an operator's console asks for. Nothing in this crate steps a world.

pub mod control;
pub mod record;
pub mod sync;
pub mod world;

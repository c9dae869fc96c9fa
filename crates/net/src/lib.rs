//! Recordings, and NetSync sessions over their transports: everything that leaves or enters a
//! process.
//!
//! [`record`] writes and reads MCAP files: Foxglove's published schemas for the picture and one
//! channel of our own for the exact state. [`sync`] keeps the processes of a cave showing the same
//! frame. [`control`] reads what an operator's console asks for, and [`browser`] what a
//! web browser sends that shows a facet, and [`vrpn`] the stream of a tracker's server. Nothing in this crate steps a world.

pub mod browser;
pub mod control;
mod names;
pub mod record;
pub mod sync;
pub mod vrpn;
pub mod world;

//! What leaves and enters a process: recordings now, NetSync sessions and transports later.
//!
//! [`record`] writes and reads MCAP files: Foxglove's published schemas for what is seen, a channel of our own for
//! the exact state. Nothing here ever steps a world.

pub mod record;
pub mod world;

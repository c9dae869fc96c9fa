//! What leaves and enters a process: recordings, and NetSync sessions over their transports.
//!
//! [`record`] writes and reads MCAP files: Foxglove's published schemas for what is seen, a channel of our own for
//! the exact state. [`sync`] keeps the processes of a cave together. Nothing here ever steps a world.

pub mod record;
pub mod sync;
pub mod world;

//! Shared memory between the processes of one machine, by iceoryx2.
//!
//! A message is written once for all facets that it is for, and read where it lies; a [`wakeup`] wakes who waits, nobody spins. The buffers overflow safely: a
//! reader that was stopped or killed never holds the writer up. What that costs, reliability, comes back by numbers: see [`reassembly`].
//!
//! All work is done in `recv`; there is no thread. A side that looks in only after a long picture finds its samples in the buffer, or asks for them again.

mod facet;
mod node_lock;
mod ports;
mod reassembly;
mod server;
mod service;
mod wakeup;

// The header of a sample: public for fuzz targets and tests alone.
#[cfg(feature = "fuzzing")]
pub mod wire;
#[cfg(not(feature = "fuzzing"))]
mod wire;

pub use facet::ShmFacet;
pub use ports::folder;
pub use server::ShmServer;

use std::time::Duration;

/// A side that had nothing to send for so long says that it lives.
pub const PING_INTERVAL: Duration = Duration::from_millis(200);
/// A connection of which nothing was heard for so long is closed.
pub const IDLE_TIMEOUT: Duration = Duration::from_secs(2);
/// A facet that looks for its server asks this often.
pub const CONNECT_INTERVAL: Duration = Duration::from_millis(50);

/// Removes what killed processes of this user left in shared memory and in the folder. A launcher calls it after it has killed a process.
///
/// Errors: iceoryx2 or the system refuses.
pub fn clean_up() -> Result<(), crate::sync::transport::LinkError> {
    ports::clean_up()
}

/// A number that no other process draws.
fn random_id() -> Result<u64, crate::sync::transport::LinkError> {
    Ok(crate::sync::udp::Entropy::system()?.next_u64())
}

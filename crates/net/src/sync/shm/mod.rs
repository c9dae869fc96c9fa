//! Shared memory between the processes of one machine, over iceoryx2.
//!
//! A message is written once for all its receivers and read in place. `wakeup.rs` wakes waiting
//! processes; no process spins. The buffers overflow safely: a reader that was stopped or killed
//! never blocks the writer. Sequence numbers and resend requests make this reliable, see
//! `reassembly.rs`.
//!
//! All work is done in `recv`; there is no thread. A side that calls `recv` only after a long
//! picture finds its samples in the buffer, or requests them again.

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

/// Idle time after which a side sends a ping.
pub const PING_INTERVAL: Duration = Duration::from_millis(200);
/// Time without any message after which a connection is closed.
pub const IDLE_TIMEOUT: Duration = Duration::from_secs(2);
/// Interval between two Hello samples of a facet that looks for its server.
pub const CONNECT_INTERVAL: Duration = Duration::from_millis(50);

/// Removes the shared memory and files that killed processes of this user left. A launcher calls it
/// after it has killed a process.
///
/// # Errors
/// iceoryx2 or the system refuses.
pub fn clean_up() -> Result<(), crate::sync::transport::LinkError> {
    ports::clean_up()
}

/// Returns a random number.
fn random_id() -> Result<u64, crate::sync::transport::LinkError> {
    Ok(crate::sync::udp::Entropy::system()?.next_u64())
}

//! Datagrams between machines: sealed, repaired, in order.
//!
//! ```text
//! socket ──► packet ──► session { window → seal → frames → inbox } ──► messages
//!            header      replay    open    parse     reassemble
//! socket ◄── packet ◄── session { seal ◄ frames ◄ outbox } ◄── messages
//! ```
//!
//! [`ServerMachine`] and [`FacetMachine`] are pure: datagrams and the time in, datagrams and events out. They have no socket and no clock, so a test drives them
//! through a [`network`] that loses, repeats, reorders and damages by a seed. [`UdpServer`] and [`UdpFacet`] put a socket and two threads around
//! them: one that receives, one that waits for the next thing that is due. So a facet that renders for long still acknowledges, and a server that
//! simulates still repairs.
//!
//! `docs/transports.md` has the packets, the threats and the figures.

mod facet;
mod inbox;
mod outbox;
mod server;
mod session;
mod socket;
mod window;

// Packet formats and the network with faults: public for fuzz targets and tests alone.
#[cfg(feature = "fuzzing")]
pub mod frames;
#[cfg(not(feature = "fuzzing"))]
mod frames;
#[cfg(feature = "fuzzing")]
pub mod handshake;
#[cfg(not(feature = "fuzzing"))]
mod handshake;
#[cfg(feature = "fuzzing")]
pub mod keys;
#[cfg(not(feature = "fuzzing"))]
mod keys;
#[cfg(feature = "fuzzing")]
pub mod network;
#[cfg(feature = "fuzzing")]
pub mod packet;
#[cfg(not(feature = "fuzzing"))]
mod packet;

pub use keys::{Entropy, SharedKey};
pub use socket::{UdpFacet, UdpServer};

#[cfg(not(feature = "fuzzing"))]
use {facet::FacetMachine, server::ServerMachine, session::Numbering};
#[cfg(feature = "fuzzing")]
pub use {
    facet::{FacetMachine, FacetSettings},
    server::{ServerMachine, ServerSettings},
    session::{Numbering, Session},
};

use std::time::Duration;

/// How often, and how long at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// A side that had nothing to send for so long asks for a sign of life.
    pub ping_interval: Duration,
    /// A connection of which nothing was heard for so long is closed.
    pub idle_timeout: Duration,
    /// A facet that looks for its server asks this often.
    pub connect_interval: Duration,
}

impl Default for Timing {
    fn default() -> Timing {
        Timing {
            ping_interval: Duration::from_millis(200),
            idle_timeout: Duration::from_secs(2),
            connect_interval: Duration::from_millis(100),
        }
    }
}

//! UDP between machines: encrypted, reliable and ordered.
//!
//! ```text
//! socket ──► packet ──► session { window → seal → frames → inbox } ──► messages
//!            header      replay    open    parse     reassemble
//! socket ◄── packet ◄── session { seal ◄ frames ◄ outbox } ◄── messages
//! ```
//!
//! The state machines of server and facet have no socket and no clock: datagrams and times go in,
//! datagrams and events come out. Tests drive them through a simulated network that loses, repeats,
//! reorders and damages packets by a seed. [`UdpServer`] and [`UdpFacet`] put a socket and two
//! threads around them: one receives, the other waits for the next due work. So a facet that
//! renders for long still acknowledges, and a server that simulates still repairs.
//!
//! `docs/transports.md` describes packets, threats and measurements.

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

/// Intervals and timeouts of a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// Idle time after which a side sends a ping.
    pub ping_interval: Duration,
    /// Time without any packet after which a connection is closed.
    pub idle_timeout: Duration,
    /// Interval between two Hellos of a facet that looks for its server.
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

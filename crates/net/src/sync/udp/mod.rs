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

pub mod facet;
pub mod frames;
pub mod handshake;
pub mod inbox;
pub mod keys;
pub mod network;
pub mod outbox;
pub mod packet;
pub mod server;
pub mod session;
pub mod socket;
pub mod window;

pub use facet::FacetMachine;
pub use keys::{Entropy, SharedKey};
pub use server::ServerMachine;
pub use session::Numbering;
pub use socket::{UdpFacet, UdpServer};

use std::time::Duration;

/// How often, and how long at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Timing {
    /// A side that had nothing to send for so long asks for a sign of life.
    pub ping: Duration,
    /// A connection of which nothing was heard for so long is closed.
    pub silence: Duration,
    /// A facet that looks for its server asks this often.
    pub ask: Duration,
}

impl Default for Timing {
    fn default() -> Timing {
        Timing { ping: Duration::from_millis(200), silence: Duration::from_secs(2), ask: Duration::from_millis(100) }
    }
}

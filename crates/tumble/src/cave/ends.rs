//! The two ends of whatever carries a run's frames.

use crate::failure::Failure;
use std::net::{SocketAddr, UdpSocket};
use std::time::Duration;
use tumble::net::sync::shm::{ShmFacet, ShmServer};
use tumble::net::sync::transport::{Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, Message, ServerLink};
use tumble::net::sync::udp::{SharedKey, Timing, UdpFacet, UdpServer};
use tumble::scene::cave::Cave;

/// The server's end.
pub enum ServerEnd {
    Shm(Box<ShmServer>),
    Udp(Box<UdpServer>),
}

/// A facet's end.
pub enum FacetEnd {
    Shm(Box<ShmFacet>),
    Udp(Box<UdpFacet>),
}

/// How a facet finds the server.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub enum Address {
    /// The run's name in shared memory.
    Memory(String),
    /// The server's address.
    Udp(SocketAddr),
}

/// The cave's key, where it has one.
pub fn key(cave: &Cave) -> Result<Option<SharedKey>, Failure> {
    cave.security.as_ref().map(|s| SharedKey::read(&s.key_file)).transpose().map_err(Failure::input)
}

impl FacetEnd {
    /// Begins to look for the server.
    pub fn open(address: &Address, facet: FacetNumber, cave: &Cave) -> Result<FacetEnd, Failure> {
        let failed = |e: LinkError| Failure::run("the connection to the server", e);
        Ok(match address {
            Address::Memory(run) => FacetEnd::Shm(Box::new(ShmFacet::new(run, facet).map_err(failed)?.silent_after(silence(cave)))),
            Address::Udp(server) => FacetEnd::Udp(Box::new(UdpFacet::connect(*server, facet, key(cave)?, timing(cave)).map_err(failed)?)),
        })
    }
}

/// A link is given up no sooner than a facet is dropped.
pub fn silence(cave: &Cave) -> Duration {
    Duration::from_millis(cave.sync.drop_timeout_ms.into())
}

/// The same for datagrams.
pub fn timing(cave: &Cave) -> Timing {
    let silence = silence(cave);
    Timing { silence, ping: (silence / 8).min(Timing::default().ping), ..Timing::default() }
}

/// This machine's address as `node` would see it; `None` where it cannot be told. Nothing is sent.
pub fn seen_from(node: &str, port: u16) -> Option<std::net::IpAddr> {
    let socket = UdpSocket::bind(("0.0.0.0", 0)).ok()?;
    socket.connect((node, port)).ok()?;
    Some(socket.local_addr().ok()?.ip())
}

impl ServerLink for ServerEnd {
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        match self {
            ServerEnd::Shm(link) => link.send(to, delivery, message),
            ServerEnd::Udp(link) => link.send(to, delivery, message),
        }
    }

    fn send_all(&mut self, to: &[FacetNumber], delivery: Delivery, message: &[u8]) -> Result<usize, LinkError> {
        match self {
            ServerEnd::Shm(link) => link.send_all(to, delivery, message),
            ServerEnd::Udp(link) => link.send_all(to, delivery, message),
        }
    }

    fn recv(&mut self, timeout: Duration, message: &mut Vec<u8>) -> Result<Option<(FacetNumber, LinkEvent)>, LinkError> {
        match self {
            ServerEnd::Shm(link) => link.recv(timeout, message),
            ServerEnd::Udp(link) => link.recv(timeout, message),
        }
    }

    fn close(&mut self, facet: FacetNumber) {
        match self {
            ServerEnd::Shm(link) => link.close(facet),
            ServerEnd::Udp(link) => link.close(facet),
        }
    }

    fn counters(&self, facet: FacetNumber) -> LinkCounters {
        match self {
            ServerEnd::Shm(link) => link.counters(facet),
            ServerEnd::Udp(link) => link.counters(facet),
        }
    }

    fn strangers(&self) -> LinkCounters {
        match self {
            ServerEnd::Shm(link) => link.strangers(),
            ServerEnd::Udp(link) => link.strangers(),
        }
    }
}

impl FacetLink for FacetEnd {
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        match self {
            FacetEnd::Shm(link) => link.send(delivery, message),
            FacetEnd::Udp(link) => link.send(delivery, message),
        }
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        match self {
            FacetEnd::Shm(link) => link.recv(timeout, message),
            FacetEnd::Udp(link) => link.recv(timeout, message),
        }
    }

    fn close(&mut self) {
        match self {
            FacetEnd::Shm(link) => link.close(),
            FacetEnd::Udp(link) => link.close(),
        }
    }

    fn counters(&self) -> LinkCounters {
        match self {
            FacetEnd::Shm(link) => link.counters(),
            FacetEnd::Udp(link) => link.counters(),
        }
    }
}

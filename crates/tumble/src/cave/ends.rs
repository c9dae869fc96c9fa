//! The two ends of whatever carries a run's frames.

use super::stage::Setting;
use crate::failure::Failure;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::time::{Duration, Instant};
use tumble::net::sync::shm::{ShmFacet, ShmServer};
use tumble::net::sync::transport::{
    Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, Message, ServerLink,
};
use tumble::net::sync::udp::{SharedKey, Timing, UdpFacet, UdpServer};
use tumble::scene::cave::Cave;

/// The server's end.
pub enum ServerEnd {
    Shm(Box<ShmServer>),
    Udp(Box<UdpServer>),
}

/// A facet's end.
pub struct FacetEnd {
    link: Link,
    /// Where the server may be anew: a run that begins again has another name or port.
    looking: Option<Looking>,
}

enum Link {
    Shm(Box<ShmFacet>),
    Udp(Box<UdpFacet>),
}

/// What is asked for the server's address while there is no connection.
struct Looking {
    /// The cave's place, by which its run is found.
    place: String,
    cave: Cave,
    facet: FacetNumber,
    address: Address,
    connected: bool,
    asked: Instant,
}

/// Between two looks for a server's new address.
const ASK: Duration = Duration::from_millis(250);

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
    let read = |file: &Path| {
        // a pipe would be waited for
        if std::fs::metadata(file).is_ok_and(|about| !about.is_file()) {
            return Err(Failure::input(format!("key file {}: is no regular file", file.display())));
        }
        SharedKey::read(file).map_err(Failure::input)
    };
    cave.security.as_ref().map(|s| read(&s.key_file)).transpose()
}

impl FacetEnd {
    /// Begins to look for the server. `again`: where it is found is asked of the cave's lock whenever there is no connection; else it stays there.
    pub fn open(address: &Address, facet: FacetNumber, setting: &Setting, again: bool) -> Result<FacetEnd, Failure> {
        let link = Link::open(address, facet, &setting.cave)?;
        let looking = || Looking {
            place: setting.place.clone(),
            cave: setting.cave.clone(),
            facet,
            address: address.clone(),
            connected: false,
            asked: Instant::now(),
        };
        Ok(FacetEnd { link, looking: again.then(looking) })
    }

    /// Goes where the server is now, if that is elsewhere than it was.
    fn look(&mut self) {
        let Some(looking) = self.looking.as_mut().filter(|l| !l.connected && l.asked.elapsed() >= ASK) else { return };
        looking.asked = Instant::now();
        let Ok(Some(address)) = super::lock::find(&looking.place) else { return };
        if address == looking.address {
            return;
        }
        // what fails now is tried again, as long as the facet waits at all
        if let Ok(link) = Link::open(&address, looking.facet, &looking.cave) {
            (self.link, looking.address) = (link, address);
        }
    }
}

impl Link {
    fn open(address: &Address, facet: FacetNumber, cave: &Cave) -> Result<Link, Failure> {
        let failed = |e: LinkError| Failure::run("the connection to the server", e);
        Ok(match address {
            Address::Memory(run) => {
                Link::Shm(Box::new(ShmFacet::new(run, facet).map_err(failed)?.silent_after(silence(cave))))
            }
            Address::Udp(server) => {
                Link::Udp(Box::new(UdpFacet::connect(*server, facet, key(cave)?, timing(cave)).map_err(failed)?))
            }
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

    fn recv(
        &mut self,
        timeout: Duration,
        message: &mut Vec<u8>,
    ) -> Result<Option<(FacetNumber, LinkEvent)>, LinkError> {
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
        match &mut self.link {
            Link::Shm(link) => link.send(delivery, message),
            Link::Udp(link) => link.send(delivery, message),
        }
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        self.look();
        let event = match &mut self.link {
            Link::Shm(link) => link.recv(timeout, message),
            Link::Udp(link) => link.recv(timeout, message),
        }?;
        if let (Some(looking), Some(event)) = (&mut self.looking, &event) {
            looking.connected = !matches!(event, LinkEvent::Closed(_));
        }
        Ok(event)
    }

    fn close(&mut self) {
        match &mut self.link {
            Link::Shm(link) => link.close(),
            Link::Udp(link) => link.close(),
        }
    }

    fn counters(&self) -> LinkCounters {
        match &self.link {
            Link::Shm(link) => link.counters(),
            Link::Udp(link) => link.counters(),
        }
    }
}

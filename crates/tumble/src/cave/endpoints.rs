//! The two ends of whatever carries a run's frames.

use super::address::ServerAddress;
use super::run_setup::RunSetup;
use crate::failure::Failure;
use std::path::Path;
use std::time::{Duration, Instant};
use tumble::net::sync::shm::{ShmFacet, ShmServer};
use tumble::net::sync::transport::{
    Delivery, FacetLink, FacetNumber, LinkCounters, LinkError, LinkEvent, Message, ServerLink,
};
use tumble::net::sync::udp::{SharedKey, Timing, UdpFacet, UdpServer};
use tumble::scene::cave::Cave;

/// The server's end.
pub enum ServerEndpoint {
    Shm(Box<ShmServer>),
    Udp(Box<UdpServer>),
}

/// A facet's end.
pub struct FacetEndpoint {
    link: Link,
    /// Where the server may be anew: a run that begins again has another name or port.
    lookup: Option<ServerLookup>,
}

enum Link {
    Shm(Box<ShmFacet>),
    Udp(Box<UdpFacet>),
}

/// What is asked for the server's address while there is no connection.
struct ServerLookup {
    /// The cave's place, by which its run is found.
    place: String,
    cave: Cave,
    facet: FacetNumber,
    address: ServerAddress,
    connected: bool,
    last_lookup: Instant,
}

/// Between two looks for a server's new address.
const LOOKUP_INTERVAL: Duration = Duration::from_millis(250);

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

impl FacetEndpoint {
    /// Begins to look for the server. `again`: where it is found is asked of the cave's lock whenever there is no connection; else it stays there.
    pub fn open(
        address: &ServerAddress,
        facet: FacetNumber,
        setup: &RunSetup,
        again: bool,
    ) -> Result<FacetEndpoint, Failure> {
        let link = Link::open(address, facet, &setup.cave)?;
        let lookup = || ServerLookup {
            place: setup.place.clone(),
            cave: setup.cave.clone(),
            facet,
            address: address.clone(),
            connected: false,
            last_lookup: Instant::now(),
        };
        Ok(FacetEndpoint { link, lookup: again.then(lookup) })
    }

    /// Goes where the server is now, if that is elsewhere than it was.
    fn follow_server(&mut self) {
        let Some(lookup) = self.lookup.as_mut().filter(|l| !l.connected && l.last_lookup.elapsed() >= LOOKUP_INTERVAL)
        else {
            return;
        };
        lookup.last_lookup = Instant::now();
        let Ok(Some(address)) = super::lock::find_run(&lookup.place) else { return };
        if address == lookup.address {
            return;
        }
        // what fails now is tried again, as long as the facet waits at all
        if let Ok(link) = Link::open(&address, lookup.facet, &lookup.cave) {
            (self.link, lookup.address) = (link, address);
        }
    }
}

impl Link {
    fn open(address: &ServerAddress, facet: FacetNumber, cave: &Cave) -> Result<Link, Failure> {
        let failed = |e: LinkError| Failure::run("the connection to the server", e);
        Ok(match address {
            ServerAddress::Memory(run) => {
                Link::Shm(Box::new(ShmFacet::new(run, facet).map_err(failed)?.with_idle_timeout(idle_timeout(cave))))
            }
            ServerAddress::Udp(server) => {
                Link::Udp(Box::new(UdpFacet::connect(*server, facet, key(cave)?, timing(cave)).map_err(failed)?))
            }
        })
    }
}

/// A link is given up no sooner than a facet is dropped.
pub fn idle_timeout(cave: &Cave) -> Duration {
    Duration::from_millis(cave.sync.drop_timeout_ms.into())
}

/// The same for datagrams.
pub fn timing(cave: &Cave) -> Timing {
    let idle_timeout = idle_timeout(cave);
    Timing { idle_timeout, ping_interval: (idle_timeout / 8).min(Timing::default().ping_interval), ..Timing::default() }
}

impl ServerLink for ServerEndpoint {
    fn send(&mut self, to: FacetNumber, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        match self {
            ServerEndpoint::Shm(link) => link.send(to, delivery, message),
            ServerEndpoint::Udp(link) => link.send(to, delivery, message),
        }
    }

    fn send_all(&mut self, to: &[FacetNumber], delivery: Delivery, message: &[u8]) -> Result<usize, LinkError> {
        match self {
            ServerEndpoint::Shm(link) => link.send_all(to, delivery, message),
            ServerEndpoint::Udp(link) => link.send_all(to, delivery, message),
        }
    }

    fn recv(
        &mut self,
        timeout: Duration,
        message: &mut Vec<u8>,
    ) -> Result<Option<(FacetNumber, LinkEvent)>, LinkError> {
        match self {
            ServerEndpoint::Shm(link) => link.recv(timeout, message),
            ServerEndpoint::Udp(link) => link.recv(timeout, message),
        }
    }

    fn close(&mut self, facet: FacetNumber) {
        match self {
            ServerEndpoint::Shm(link) => link.close(facet),
            ServerEndpoint::Udp(link) => link.close(facet),
        }
    }

    fn counters(&self, facet: FacetNumber) -> LinkCounters {
        match self {
            ServerEndpoint::Shm(link) => link.counters(facet),
            ServerEndpoint::Udp(link) => link.counters(facet),
        }
    }

    fn unknown_peers(&self) -> LinkCounters {
        match self {
            ServerEndpoint::Shm(link) => link.unknown_peers(),
            ServerEndpoint::Udp(link) => link.unknown_peers(),
        }
    }
}

impl FacetLink for FacetEndpoint {
    fn send(&mut self, delivery: Delivery, message: &[u8]) -> Result<bool, LinkError> {
        match &mut self.link {
            Link::Shm(link) => link.send(delivery, message),
            Link::Udp(link) => link.send(delivery, message),
        }
    }

    fn recv(&mut self, timeout: Duration, message: &mut Message) -> Result<Option<LinkEvent>, LinkError> {
        self.follow_server();
        let event = match &mut self.link {
            Link::Shm(link) => link.recv(timeout, message),
            Link::Udp(link) => link.recv(timeout, message),
        }?;
        if let (Some(lookup), Some(event)) = (&mut self.lookup, &event) {
            lookup.connected = !matches!(event, LinkEvent::Closed(_));
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

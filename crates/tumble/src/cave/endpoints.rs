//! Endpoints of a run's transport, chosen at run time.

use super::address::{RunKey, RunServer, ServerAddress};
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

/// The server's endpoint.
pub enum ServerEndpoint {
    Shm(Box<ShmServer>),
    Udp(Box<UdpServer>),
}

/// A facet's endpoint.
pub struct FacetEndpoint {
    link: Link,
    /// Search for the server's address, which changes when a run is started again.
    lookup: Option<ServerLookup>,
}

enum Link {
    Shm(Box<ShmFacet>),
    Udp(Box<UdpFacet>),
}

/// State of the search for the server's address while there is no connection.
struct ServerLookup {
    /// Identity of the cave, by which its run is found.
    place: String,
    cave: Cave,
    facet: FacetNumber,
    server: RunServer,
    /// Whether a run at another address is another run, because the user gave the address.
    only_here: bool,
    connected: bool,
    last_lookup: Instant,
}

/// Interval between two searches for the server's address.
const LOOKUP_INTERVAL: Duration = Duration::from_millis(100);

/// Reads the cave's key, if the cave has one.
pub fn key(cave: &Cave) -> Result<Option<SharedKey>, Failure> {
    let read = |file: &Path| {
        let wrong = |why: &dyn std::fmt::Display| Failure::input(format!("[security] of {}: {why}", cave.file));
        // reading a pipe would block
        if std::fs::metadata(file).is_ok_and(|about| !about.is_file()) {
            return Err(wrong(&format!("key file {}: is no regular file", file.display())));
        }
        SharedKey::read(file).map_err(|e| wrong(&e))
    };
    cave.security.as_ref().map(|s| read(&s.key_file)).transpose()
}

impl FacetEndpoint {
    /// Starts to connect to the server. With `again`, the address is read from the cave's lock file
    /// while there is no connection; otherwise it never changes. A key of the run is read there in
    /// any case, since each run has another one.
    pub fn open(
        server: &RunServer,
        facet: FacetNumber,
        setup: &RunSetup,
        again: bool,
    ) -> Result<FacetEndpoint, Failure> {
        let link = Link::open(server, facet, &setup.cave)?;
        let lookup = || ServerLookup {
            place: setup.place.clone(),
            cave: setup.cave.clone(),
            facet,
            server: server.clone(),
            only_here: !again,
            connected: false,
            last_lookup: Instant::now(),
        };
        Ok(FacetEndpoint { link, lookup: (again || server.key.is_some()).then(lookup) })
    }

    /// Reconnects if the server's address has changed.
    fn follow_server(&mut self) {
        // a run with another key is another server, which this link cannot recognize
        let due = |l: &&mut ServerLookup| {
            (!l.connected || l.server.key.is_some()) && l.last_lookup.elapsed() >= LOOKUP_INTERVAL
        };
        let Some(lookup) = self.lookup.as_mut().filter(due) else { return };
        lookup.last_lookup = Instant::now();
        let Ok(Some(server)) = super::lock::find_run(&lookup.place) else { return };
        if server == lookup.server || lookup.only_here && server.address != lookup.server.address {
            return;
        }
        // a failure is retried for as long as the facet waits
        if let Ok(link) = Link::open(&server, lookup.facet, &lookup.cave) {
            (self.link, lookup.server) = (link, server);
        }
    }
}

impl Link {
    fn open(server: &RunServer, facet: FacetNumber, cave: &Cave) -> Result<Link, Failure> {
        let failed = |e: LinkError| Failure::run("the connection to the server", e);
        Ok(match &server.address {
            ServerAddress::Memory(run) => {
                Link::Shm(Box::new(ShmFacet::new(run, facet).map_err(failed)?.with_idle_timeout(idle_timeout(cave))))
            }
            ServerAddress::Udp(address) => {
                let key = key(cave)?.or(server.key.as_ref().map(RunKey::shared));
                Link::Udp(Box::new(UdpFacet::connect(*address, facet, key, timing(cave)).map_err(failed)?))
            }
        })
    }
}

/// Returns the idle timeout of links, which equals the drop timeout of facets.
pub fn idle_timeout(cave: &Cave) -> Duration {
    Duration::from_millis(cave.sync.drop_timeout_ms.into())
}

/// Returns the timing of UDP links.
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

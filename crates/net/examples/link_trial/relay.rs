//! A bad network as a process: forwards the facets' datagrams from `--listen` to `--address`, and
//! the answers back, with the given faults.

use super::Failure;
use super::options::Options;
use std::collections::BTreeMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tumble_net::sync::udp::network::Network;

/// Maximum number of facets behind one relay.
const MAX_FACETS: usize = 64;

struct Relay {
    network: Mutex<Network>,
    earlier: Condvar,
    start: Instant,
}

impl Relay {
    fn send(&self, from: SocketAddr, to: SocketAddr, datagram: &[u8]) {
        self.network.lock().unwrap_or_else(PoisonError::into_inner).send(self.start.elapsed(), from, to, datagram);
        self.earlier.notify_one();
    }

    /// Returns the next datagram once it has arrived.
    fn next(&self) -> (SocketAddr, SocketAddr, Vec<u8>) {
        let mut network = self.network.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            let now = self.start.elapsed();
            if let Some(arrived) = network.receive(now) {
                return arrived;
            }
            let wait = network.next().map_or(Duration::from_secs(1), |at| at.saturating_sub(now));
            network = self.earlier.wait_timeout(network, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

type Backs = Mutex<BTreeMap<SocketAddr, Arc<UdpSocket>>>;

/// Runs until it is killed.
pub fn run(options: &Options) -> Result<(), Failure> {
    let server = options.address;
    let relay = Arc::new(Relay {
        network: Mutex::new(Network::new(options.seed, options.faults)),
        earlier: Condvar::new(),
        start: Instant::now(),
    });
    let front = Arc::new(UdpSocket::bind(options.listen)?);
    let backs: Arc<Backs> = Arc::default();
    {
        let (relay, front, backs) = (relay.clone(), front.clone(), backs.clone());
        std::thread::spawn(move || deliver(&relay, &front, &backs, server));
    }
    let mut buffer = [0; 2048];
    loop {
        let (length, from) = front.recv_from(&mut buffer)?;
        let mut known = backs.lock().unwrap_or_else(PoisonError::into_inner);
        if !known.contains_key(&from) && known.len() < MAX_FACETS {
            let any: SocketAddr =
                if server.ip().is_loopback() { ([127, 0, 0, 1], 0).into() } else { ([0, 0, 0, 0], 0).into() };
            let back = Arc::new(UdpSocket::bind(any)?);
            known.insert(from, back.clone());
            let relay = relay.clone();
            std::thread::spawn(move || bring_back(&relay, &back, server, from));
        }
        drop(known);
        relay.send(from, server, &buffer[..length]);
    }
}

/// Forwards the datagrams that have arrived: to the server through the socket of the sending facet.
fn deliver(relay: &Relay, front: &UdpSocket, backs: &Backs, server: SocketAddr) {
    loop {
        let (from, to, datagram) = relay.next();
        let back = backs.lock().unwrap_or_else(PoisonError::into_inner).get(&from).cloned();
        // a datagram that cannot be sent is lost, as on a network
        let _ = match back {
            Some(back) if to == server => back.send_to(&datagram, server),
            _ => front.send_to(&datagram, to),
        };
    }
}

/// Receives the server's answers to one facet.
fn bring_back(relay: &Relay, back: &UdpSocket, server: SocketAddr, facet: SocketAddr) {
    let mut buffer = [0; 2048];
    loop {
        match back.recv_from(&mut buffer) {
            Ok((length, from)) if from == server => relay.send(server, facet, &buffer[..length]),
            _ => {}
        }
    }
}

//! Sealed datagrams of trackers: relays forward OSC over the same protocol as frames go over UDP, with
//! a key of its own. So datagrams are authenticated, encrypted and taken once.

use super::budget::SenderBudgets;
use super::osc::OscDecoder;
use super::socket::{POLL_INTERVAL, lock, take};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use tumble::net::sync::transport::{LinkError, LinkEvent, Refused, ServerLink};
use tumble::net::sync::udp::{SharedKey, Timing, UdpServer};

/// Number of relays that may send to a server at a time.
pub const MAX_RELAYS: u16 = 8;

/// Binds the address for relays with the cave's key.
///
/// # Errors
/// The system refuses.
pub fn bind(address: SocketAddr, key: &SharedKey) -> Result<UdpServer, LinkError> {
    UdpServer::bind(address, MAX_RELAYS, Some(key.for_trackers()), Timing::default())
}

/// Receives until the end is requested. The number of a relay takes the place of its address.
pub fn listen(mut link: UdpServer, decoder: &Mutex<OscDecoder>, end: &AtomicBool) {
    let (start, mut budgets, mut bytes) = (Instant::now(), SenderBudgets::default(), Vec::new());
    let mut counted = Instant::now();
    while !end.load(Ordering::Relaxed) {
        match link.recv(POLL_INTERVAL, &mut bytes) {
            Ok(Some((relay, LinkEvent::Message))) => {
                let from = (Ipv4Addr::LOCALHOST, relay).into();
                take(&mut lock(decoder), &mut budgets, start, Instant::now(), from, &bytes);
            }
            Ok(_) => {}
            Err(_) => std::thread::sleep(POLL_INTERVAL),
        }
        if counted.elapsed() >= POLL_INTERVAL {
            count_refused(&link, decoder);
            counted = Instant::now();
        }
    }
    count_refused(&link, decoder);
}

/// Puts the packets that the link refused among the dropped data.
fn count_refused(link: &UdpServer, decoder: &Mutex<OscDecoder>) {
    let links: Vec<_> = (0..MAX_RELAYS).map(|relay| link.counters(relay)).chain([link.unknown_peers()]).collect();
    let mut decoder = lock(decoder);
    for why in Refused::ALL {
        let count: u64 = links.iter().map(|counters| counters.refused_for(why)).sum();
        if count > 0 {
            decoder.counts.dropped.insert(why.name(), count);
        }
    }
}

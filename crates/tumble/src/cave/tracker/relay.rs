//! `tumble relay`: forwards the datagrams of a tracker that cannot seal them, from the machine beside
//! it, to the server of a cave.

use super::osc::MAX_DATAGRAM_BYTES;
use super::socket::POLL_INTERVAL;
use crate::cave::args::RelayOptions;
use crate::cave::endpoints::key;
use crate::cave::signals::Signals;
use crate::failure::Failure;
use std::io::ErrorKind;
use std::net::UdpSocket;
use std::time::{Duration, Instant};
use tumble::net::sync::transport::{Delivery, FacetLink, LinkError, LinkEvent, Message};
use tumble::net::sync::udp::{Timing, UdpFacet};
use tumble::scene::cave::resolve_cave;

/// Interval of the lines about refused senders.
const REPORT_INTERVAL: Duration = Duration::from_secs(5);

/// Forwards until a signal ends it.
pub fn relay(options: &RelayOptions) -> Result<(), Failure> {
    let signals = Signals::watch()?;
    let cave = resolve_cave(&options.cave)?.load()?;
    let key = key(&cave)?.ok_or_else(|| {
        Failure::input(format!("{}: the cave has no [security] with a key_file, which seals datagrams", cave.file))
    })?;
    if !options.listen.ip().is_loopback() && options.from.is_empty() {
        return Err(Failure::input(format!(
            "--listen {}: reachable from other machines; name the tracker with --from IP",
            options.listen
        )));
    }
    let failed = |e: LinkError| Failure::run("the connection to the server", e);
    let mut link =
        UdpFacet::connect(options.to, options.number, Some(key.for_trackers()), Timing::default()).map_err(failed)?;
    let unheard = |e: std::io::Error| Failure::run(&format!("the address {}", options.listen), e);
    let socket = UdpSocket::bind(options.listen).map_err(unheard)?;
    socket.set_read_timeout(Some(POLL_INTERVAL)).map_err(unheard)?;
    let at = socket.local_addr().map_err(unheard)?;
    eprintln!("relay {}: OSC at {at} is sealed and sent to {}", options.number, options.to);
    let (mut bytes, mut strangers, mut reported) = ([0; MAX_DATAGRAM_BYTES + 1], 0u64, Instant::now());
    while !signals.stop_requested() {
        match socket.recv_from(&mut bytes) {
            // a longer one is cut here, and counted by the server
            Ok((length, from)) if options.accepts(from.ip()) => {
                // without a server it is lost, as datagrams are
                link.send(Delivery::Reliable, &bytes[..length]).map_err(failed)?;
            }
            Ok(_) => strangers += 1,
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(_) => std::thread::sleep(POLL_INTERVAL),
        }
        let mut message = Message::default();
        while let Some(event) = link.recv(Duration::ZERO, &mut message).map_err(failed)? {
            match event {
                LinkEvent::Opened => eprintln!("relay {}: is connected", options.number),
                LinkEvent::Closed(_) => eprintln!("relay {}: lost the server; reconnects", options.number),
                LinkEvent::Message => {}
            }
        }
        if strangers > 0 && reported.elapsed() > REPORT_INTERVAL {
            eprintln!("relay {}: {strangers} datagrams from other senders are dropped", options.number);
            (strangers, reported) = (0, Instant::now());
        }
    }
    link.close();
    Ok(())
}

impl RelayOptions {
    fn accepts(&self, from: std::net::IpAddr) -> bool {
        self.from.is_empty() || self.from.iter().any(|known| known.to_canonical() == from.to_canonical())
    }
}

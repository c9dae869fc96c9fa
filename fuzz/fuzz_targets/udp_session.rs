//! A malicious peer that has the key, and unknown peers: sealed frames to a session, and datagrams
//! to a server and a facet. The bytes are a sequence of: length, milliseconds, body.
#![no_main]

use libfuzzer_sys::fuzz_target;
use std::net::SocketAddr;
use std::time::Duration;
use tumble_net::sync::transport::LinkCounters;
use tumble_net::sync::udp::FacetSettings;
use tumble_net::sync::udp::keys::{Agreement, Seal, Side};
use tumble_net::sync::udp::ServerSettings;
use tumble_net::sync::udp::Session;
use tumble_net::sync::udp::{Entropy, FacetMachine, Numbering, ServerMachine, SharedKey, Timing, packet};

fuzz_target!(|bytes: &[u8]| {
    let (shared, timing, numbering) = (SharedKey::new([7; 32]), Timing::default(), Numbering::default());
    let (here, there): (SocketAddr, SocketAddr) = (([10, 0, 0, 1], 7700).into(), ([10, 0, 0, 2], 9000).into());
    let agreed = Agreement { session: 1, facet: 0, facet_nonce: [1; 32], server_nonce: [2; 32] };
    let mut session = Session::new(Duration::ZERO, &shared, agreed, Side::Server, there, timing, numbering);
    let mut seal = Seal::new(&shared, &agreed, Side::Facet, 0);
    let mut server =
        ServerMachine::new(ServerSettings { facets: 1, timing, numbering }, shared.clone(), Entropy::seeded(1));
    let mut facet = FacetMachine::new(
        Duration::ZERO,
        FacetSettings { facet: 0, server: here, timing, numbering },
        shared,
        Entropy::seeded(2),
    );
    let (mut rest, mut now, mut counters, mut datagram) = (bytes, Duration::ZERO, LinkCounters::default(), Vec::new());
    while let [low, high, ms, tail @ ..] = rest {
        let body;
        (body, rest) = tail.split_at((usize::from(u16::from_le_bytes([*low, *high])) % 1160).min(tail.len()));
        now += Duration::from_millis(u64::from(*ms));
        if seal.close(body, &mut datagram) {
            let header = packet::parse(&datagram).expect("a datagram of our own");
            let _ = session.receive(now, &header, &datagram, &mut counters);
            server.receive(now, there, &datagram);
            facet.receive(now, here, &datagram);
        }
        server.receive(now, there, body);
        facet.receive(now, here, body);
        session.transmit(now, &mut counters, &mut |_, sent| assert!(sent.len() <= packet::MAX_DATAGRAM));
        server.transmit(now, &mut |_, _| {});
        facet.transmit(now, &mut |_, _| {});
        while session.pop().is_some() || server.poll().is_some() || facet.poll().is_some() {}
    }
});

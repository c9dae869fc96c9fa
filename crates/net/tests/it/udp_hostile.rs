//! Hostile packets: forged, replayed, cut, flipped, too long, of another version, of an old
//! session, and noise.

use crate::udp::*;
use std::sync::Arc;
use std::time::Duration;
use tumble_net::sync::transport::*;
use tumble_net::sync::udp::ServerSettings;
use tumble_net::sync::udp::Session;
use tumble_net::sync::udp::handshake::{Hello, Reply};
use tumble_net::sync::udp::keys::{Agreement, Handshake, Seal, Side};
use tumble_net::sync::udp::network::{Faults, Random};
use tumble_net::sync::udp::packet::{self, PacketHeader, PacketKind};
use tumble_net::sync::udp::*;

const QUIET: Faults =
    Faults { loss: 0.0, reorder: 0.0, duplicate: 0.0, flip: 0.0, cut: 0.0, delay_s: 0.001, jitter_s: 0.0 };

/// Sets the checksum as a forger would, with knowledge of the format but without the key. Computed
/// by CRC-32's definition, bit by bit.
fn set_checksum(datagram: &mut [u8]) {
    let mut crc = u32::MAX;
    for (at, byte) in datagram.iter().enumerate() {
        if (5..9).contains(&at) {
            continue;
        }
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
        }
    }
    datagram[5..9].copy_from_slice(&(!crc).to_le_bytes());
}

fn changed(datagram: &[u8], change: impl FnOnce(&mut Vec<u8>), valid_checksum: bool) -> Vec<u8> {
    let mut copy = datagram.to_vec();
    change(&mut copy);
    if valid_checksum {
        set_checksum(&mut copy);
    }
    copy
}

/// Returns packets that an attacker on the path makes from a genuine sealed packet, each with the
/// reason of its refusal.
fn attacks(genuine: &[u8], random: &mut Random) -> Vec<(Refused, Vec<u8>)> {
    let bit = |random: &mut Random, from: usize| (from + random.below(genuine.len() - from), 1u8 << random.below(8));
    let (at, mask) = bit(random, 17);
    let (covered, covered_mask) = [bit(random, 13), (13 + random.below(4), 1)][random.below(2)];
    let cut = random.below(genuine.len());
    vec![
        (Refused::Replayed, genuine.to_vec()),
        (Refused::Truncated, genuine[..cut].to_vec()),
        (Refused::Oversize, changed(genuine, |d| d.push(0), false)),
        (Refused::Oversize, changed(genuine, |d| d.resize(1201, 0), false)),
        (Refused::Torn, changed(genuine, |d| d[at] ^= mask, false)),
        // a new number or other bytes under a valid checksum; a number in use would be refused as a
        // replay before the seal is checked
        (Refused::Forged, changed(genuine, |d| d[covered.max(17)] ^= covered_mask, true)).fresh(),
        (Refused::Foreign, changed(genuine, |d| d[2] = (packet::VERSION + 1) << 4 | d[2] & 15, true)),
        (Refused::Foreign, changed(genuine, |d| d[0] ^= 1, true)),
        (Refused::Stale, changed(genuine, |d| d[9] ^= 1, true)),
    ]
}

trait Fresh {
    fn fresh(self) -> Self;
}

impl Fresh for (Refused, Vec<u8>) {
    /// Uses a number that is not taken yet, so that only the seal can detect the forgery.
    fn fresh(mut self) -> Self {
        let sequence = u32::from_le_bytes(self.1[13..17].try_into().unwrap());
        self.1[13..17].copy_from_slice(&(sequence + 1000).to_le_bytes());
        set_checksum(&mut self.1);
        self
    }
}

#[test]
fn attacks_change_nothing_and_are_counted_by_reason() {
    let mut cave = Cave::new(1, 1, QUIET, Numbering::default());
    cave.connect();
    let mut random = Random::new(2);
    let (mut delivered, mut answered) = (0u64, 0u64);
    let mut expected = [[0u64; Refused::ALL.len()]; 2];
    let base = [cave.server.counters(0), cave.facets[0].counters()];
    assert_eq!(cave.server.unknown_peers().refused, [0; Refused::ALL.len()]);
    for k in 0..200u64 {
        assert!(cave.server.send(0, Delivery::Reliable, &Arc::from(message(k, 2500))));
        let until = cave.now + Duration::from_millis(16);
        while cave.now < until {
            // as `advance` does it, with an attacker that copies each packet
            cave.transmit();
            cave.now = cave.network.next().unwrap_or(until).clamp(cave.now, until);
            while let Some((from, to, datagram)) = cave.network.receive(cave.now) {
                let to_server = to == SERVER;
                let receive = |cave: &mut Cave, datagram: &[u8]| match to_server {
                    true => cave.server.receive(cave.now, from, datagram),
                    false => cave.facets[0].receive(cave.now, from, datagram),
                };
                receive(&mut cave, &datagram);
                assert_eq!(
                    packet::parse(&datagram).unwrap().kind,
                    PacketKind::Data,
                    "a forged session is not answered"
                );
                for (why, attack) in attacks(&datagram, &mut random) {
                    receive(&mut cave, &attack);
                    expected[usize::from(!to_server)][why as usize] += 1;
                }
            }
            while let Some((event, bytes)) = cave.facets[0].poll() {
                assert!(event == LinkEvent::Message && bytes == message(delivered, 2500));
                assert!(cave.facets[0].send(cave.now, Delivery::Reliable, &delivered.to_le_bytes()));
                delivered += 1;
            }
            while let Some((_, event, bytes)) = cave.server.poll() {
                assert!(event == LinkEvent::Message && number(&bytes) == answered);
                answered += 1;
            }
            cave.now += Duration::from_micros(1);
        }
    }
    assert_eq!((delivered, answered), (200, 200));
    // the facet counts all in one place; the server counts packets without a known session under
    // unknown peers
    let facet = cave.facets[0].counters();
    let server = cave.server.counters(0);
    let unknown_peers = cave.server.unknown_peers();
    for why in Refused::ALL {
        assert_eq!(facet.refused_for(why) - base[1].refused_for(why), expected[1][why as usize], "facet: {why:?}");
        let at_server = server.refused_for(why) - base[0].refused_for(why) + unknown_peers.refused_for(why);
        assert_eq!(at_server, expected[0][why as usize], "server: {why:?}");
    }
    assert!(expected.iter().all(|counts| counts[Refused::Forged as usize] >= 200), "{expected:?}");
}

#[test]
fn a_server_keeps_nothing_for_strangers_and_never_answers_with_more_bytes() {
    let settings = ServerSettings { facets: 6, timing: Timing::default(), numbering: Numbering::default() };
    let mut server = ServerMachine::new(settings, SharedKey::new(KEY), Entropy::seeded(1));
    let handshake = Handshake::new(&SharedKey::new(KEY));
    let (mut random, mut asked, mut answered, mut datagram) = (Random::new(3), 0, 0, Vec::new());
    let now = Duration::from_secs(100);
    for k in 0..10_000u64 {
        let from = ([10, 1, (k >> 8) as u8, k as u8], 5000).into();
        let mut nonce = [0; 32];
        nonce[..8].copy_from_slice(&k.to_le_bytes());
        let cookie = [random.next_u64() as u8; 32];
        Hello { nonce, facet: (k % 6) as u16, cookie, suspect_session: 0 }.write(
            if k % 2 == 0 { PacketKind::Hello } else { PacketKind::Answer },
            &handshake,
            &mut datagram,
        );
        server.receive(now, from, &datagram);
        asked += datagram.len();
        let largest = datagram.len();
        server.transmit(now, &mut |to, reply| {
            assert!(to == from && reply.len() < largest);
            answered += reply.len();
        });
        // data of unknown sessions: the shortest valid packet
        packet::begin(
            &mut datagram,
            PacketHeader { kind: PacketKind::Data, session: random.next_u64() as u32 | 1, sequence: 1 },
        );
        datagram.push(0);
        handshake.tag(&mut datagram);
        server.receive(now, from, &datagram);
        server.transmit(now, &mut |_, _| panic!("an answer to a peer that has not proved the key"));
    }
    assert!(server.wake().is_none(), "a session was prepared");
    assert!(answered * 2 < asked, "{answered} bytes answer {asked}");
    assert_eq!(server.unknown_peers().refused_for(Refused::Stale), 5_000 + 10_000);
    // a facet that this cave does not have, and one with another key
    Hello { nonce: [1; 32], facet: 6, cookie: [0; 32], suspect_session: 0 }.write(
        PacketKind::Hello,
        &handshake,
        &mut datagram,
    );
    server.receive(now, SERVER, &datagram);
    assert_eq!(server.unknown_peers().refused_for(Refused::UnknownPeer), 1);
    Hello { nonce: [1; 32], facet: 0, cookie: [0; 32], suspect_session: 0 }.write(
        PacketKind::Hello,
        &Handshake::new(&SharedKey::new([8; 32])),
        &mut datagram,
    );
    server.receive(now, SERVER, &datagram);
    assert_eq!(server.unknown_peers().refused_for(Refused::Forged), 1);
    server.transmit(now, &mut |_, _| panic!("an answer to a machine without the key"));
}

/// Replays every packet that the facet sent while it connected, from its own and from another
/// address, before and after the cookies have expired.
#[test]
fn a_recorded_handshake_sent_again_does_not_touch_a_live_session() {
    let mut cave = Cave::new(1, 5, QUIET, Numbering::default());
    cave.recorded = Some(Vec::new());
    cave.connect();
    let recorded = cave.recorded.take().unwrap();
    assert!(recorded.len() >= 3);
    for (round, from) in [facet_address(0), facet_address(1), facet_address(0)].into_iter().enumerate() {
        for datagram in recorded.iter().cycle().take(1000) {
            cave.server.receive(cave.now, from, datagram);
            cave.transmit();
        }
        let end = cave.now + Duration::from_secs(15);
        while cave.now < end {
            cave.advance(end);
        }
        let bytes = message(round as u64, 5000);
        assert!(cave.server.send(0, Delivery::Reliable, &Arc::from(&bytes[..])));
        cave.advance(cave.now + Duration::from_millis(1));
        let end = cave.now + Duration::from_millis(50);
        while cave.now < end {
            cave.advance(end);
        }
        assert_eq!(cave.facets[0].poll(), Some((LinkEvent::Message, bytes)));
        assert_eq!(
            (cave.server.poll(), cave.server.counters(0).opened, cave.facets[0].counters().opened),
            (None, 1, 1)
        );
    }
}

/// Another server has the same key file. An attacker on the path, without the key, sends it packets
/// of a session and delivers its answers to the facet under the right server's address: at once,
/// and while the facet hears nothing and tries to connect again.
#[test]
fn another_server_with_the_key_ends_no_session() {
    let mut cave = Cave::new(1, 21, QUIET, Numbering::default());
    cave.recorded = Some(Vec::new());
    cave.connect();
    cave.advance(cave.now + Duration::from_millis(300));
    let settings = ServerSettings { facets: 1, timing: Timing::default(), numbering: Numbering::default() };
    let mut other = ServerMachine::new(settings, SharedKey::new(KEY), Entropy::seeded(77));
    let seen = cave.recorded.take().unwrap();
    let session = seen
        .iter()
        .filter_map(|d| packet::parse(d).ok())
        .find(|header| header.kind == PacketKind::Data)
        .unwrap()
        .session;
    for datagram in &seen {
        other.receive(cave.now, facet_address(0), datagram);
    }
    let mut answers = Vec::new();
    other.transmit(cave.now, &mut |_, answer| answers.push(answer.to_vec()));
    assert!(
        answers.iter().all(|answer| packet::parse(answer).unwrap().kind == PacketKind::Challenge),
        "Data is not answered"
    );
    // and the former answer of a server to an unknown session: kind 5
    let mut unknown = Vec::new();
    packet::begin(&mut unknown, PacketHeader { kind: PacketKind::Data, session, sequence: 0 });
    unknown[2] = packet::VERSION << 4 | 5;
    Handshake::new(&SharedKey::new(KEY)).tag(&mut unknown);
    answers.push(unknown);
    for answer in answers.iter().cycle().take(100) {
        cave.facets[0].receive(cave.now, SERVER, answer);
    }
    assert_eq!((cave.facets[0].poll(), cave.facets[0].counters().refused_for(Refused::Foreign) > 0), (None, true));

    // nothing arrives for 700 ms except the handshake of the other server
    cave.network.partitioned = true;
    cave.recorded = Some(Vec::new());
    let (end, mut welcomed) = (cave.now + Duration::from_millis(700), 0);
    while cave.now < end {
        cave.advance(end);
        for datagram in cave.recorded.replace(Vec::new()).unwrap() {
            if packet::parse(&datagram).unwrap().kind != PacketKind::Data {
                other.receive(cave.now, facet_address(0), &datagram);
            }
        }
        let mut answers = Vec::new();
        other.transmit(cave.now, &mut |_, answer| answers.push(answer.to_vec()));
        for answer in answers {
            welcomed += u32::from(packet::parse(&answer).unwrap().kind == PacketKind::Welcome);
            cave.facets[0].receive(cave.now, SERVER, &answer);
        }
    }
    assert!(welcomed > 0, "the facet has connected to the wrong server");
    cave.network.partitioned = false;
    let end = cave.now + Duration::from_secs(3);
    while cave.now < end {
        cave.advance(end);
        assert_eq!((cave.facets[0].poll(), cave.server.poll()), (None, None));
    }
    let bytes = message(1, 5000);
    assert!(cave.server.send(0, Delivery::Reliable, &Arc::from(&bytes[..])));
    let end = cave.now + Duration::from_millis(50);
    while cave.now < end {
        cave.advance(end);
    }
    assert_eq!(cave.facets[0].poll(), Some((LinkEvent::Message, bytes)));
    assert_eq!((cave.server.counters(0).opened, cave.facets[0].counters().opened), (1, 1));
}

/// Packets that a facet sent before it learned that its session is over are no attack. Their replay
/// is.
#[test]
fn late_packets_of_a_session_that_is_over_are_no_refusals() {
    let mut cave = Cave::new(1, 22, QUIET, Numbering::default());
    cave.connect();
    cave.advance(cave.now + Duration::from_millis(300));
    cave.recorded = Some(Vec::new());
    for k in 0..5 {
        assert!(cave.facets[0].send(cave.now, Delivery::Reliable, &message(k, 100)));
    }
    cave.transmit();
    cave.server.close(cave.now, 0, &mut |_, _| {});
    let late = cave.recorded.take().unwrap();
    assert!(!late.is_empty());
    let receive =
        |cave: &mut Cave| late.iter().for_each(|datagram| cave.server.receive(cave.now, facet_address(0), datagram));
    receive(&mut cave);
    assert_eq!(cave.server.unknown_peers().refused, [0; Refused::ALL.len()]);
    receive(&mut cave);
    assert_eq!(cave.server.unknown_peers().refused_for(Refused::Replayed), late.len() as u64);
    assert!(
        std::iter::from_fn(|| cave.server.poll()).all(|(_, event, _)| event == LinkEvent::Closed(Closed::ByUs)),
        "nothing of it is taken"
    );
}

/// Returns the resident memory of this process, bytes.
fn resident() -> usize {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    4096 * statm.split(' ').nth(1).unwrap().parse::<usize>().unwrap()
}

/// Noise, noise with a valid header, and noise sealed by a malicious peer that has the key.
#[test]
fn a_million_random_packets_per_parser_full_length() {
    let count = frames(20_000, 1_000_000);
    let mut cave = Cave::new(2, 6, QUIET, Numbering::default());
    cave.connect();
    let agreed = Agreement { session: 1, facet: 0, facet_nonce: [1; 32], server_nonce: [2; 32] };
    let shared = SharedKey::new(KEY);
    let session =
        |side| Session::new(Duration::ZERO, &shared, agreed, side, SERVER, Timing::default(), Numbering::default());
    let mut victim = session(Side::Server);
    let mut seal = Seal::new(&shared, &agreed, Side::Facet, 0);
    let handshake = Handshake::new(&shared);
    let mut random = Random::new(7);
    let mut counters = LinkCounters::default();
    let (mut noise, mut datagram, mut before) = (Vec::new(), Vec::new(), 0);
    for k in 0..count {
        noise.clear();
        let length = random.below(1300);
        noise.resize_with(length, || random.next_u64() as u8);
        if k == count / 2 {
            before = resident();
        }
        // as it is, and with a matching header
        for round in 0..2 {
            let now = cave.now + Duration::from_micros(k);
            cave.server.receive(now, facet_address(3), &noise);
            cave.server.receive(now, facet_address(0), &noise);
            cave.facets[0].receive(now, SERVER, &noise);
            let _ = (packet::parse(&noise), frames::parse(&noise), shm_head(&noise));
            if packet::parse(&noise).is_ok() {
                let _ = (Hello::read(&noise, &handshake), Reply::read(&noise, &handshake));
            }
            if round == 0 && noise.len() >= 33 && noise.len() <= 1200 {
                let length = (noise.len() as u16).to_le_bytes();
                noise[..5].copy_from_slice(&[
                    0x74,
                    0xdb,
                    packet::VERSION << 4 | (1 + k % 6) as u8,
                    length[0],
                    length[1],
                ]);
                set_checksum(&mut noise);
            }
        }
        // sealed: the first bytes are frames, so that the noise gets past the first checks
        noise.truncate(1100);
        if let [kind, rest @ ..] = &mut noise[..] {
            *kind = 1 + (k % 6) as u8 + 16 * (*kind & 1);
            // small numbers, so that they collide
            rest.iter_mut().take(12).enumerate().for_each(|(at, byte)| *byte = if at % 4 > 0 { 0 } else { *byte & 31 });
        }
        assert!(seal.close(&noise, &mut datagram));
        let header = packet::parse(&datagram).unwrap();
        let _ = victim.receive(Duration::from_micros(k), &header, &datagram, &mut counters);
        while victim.pop().is_some() {}
        victim.transmit(Duration::from_micros(k), &mut counters, &mut |_, _| {});
    }
    let grown = resident().saturating_sub(before);
    assert!(grown < 16 << 20, "{grown} bytes more after the second half");
    assert_eq!((cave.server.counters(0).opened, cave.facets[0].counters().opened), (1, 1));
}

fn shm_head(noise: &[u8]) -> bool {
    let mut words = noise.chunks_exact(8).map(|word| u64::from_le_bytes(word.try_into().unwrap()));
    tumble_net::sync::shm::wire::SampleHeader::parse([(); 6].map(|()| words.next().unwrap_or(0))).is_ok()
}

#[test]
fn sequence_numbers_end_before_u64_wraps_and_a_new_session_begins() {
    let numbering = Numbering { sequence: u64::MAX - 100, message: 0 };
    let mut cave = Cave::new(1, 8, QUIET, numbering);
    cave.connect();
    let (mut opened, mut last, mut sent) = (0, None, 0u64);
    while sent < 2000 {
        if cave.server.send(0, Delivery::Reliable, &Arc::from(message(sent, 100))) {
            sent += 1;
        }
        cave.advance(cave.now + Duration::from_millis(3));
        while let Some((event, bytes)) = cave.facets[0].poll() {
            match event {
                LinkEvent::Message => {
                    assert!(last.is_none_or(|last| number(&bytes) > last), "in order, across sessions too");
                    last = Some(number(&bytes));
                }
                LinkEvent::Opened => opened += 1,
                LinkEvent::Closed(_) => {}
            }
        }
        while cave.server.poll().is_some() {}
        assert!(cave.now < Duration::from_secs(120), "{sent} sent");
    }
    // a hundred packets per session and direction
    assert!(opened >= 15, "{opened} sessions");
}

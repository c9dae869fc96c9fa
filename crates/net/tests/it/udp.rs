//! The UDP state machines on a simulated network: messages delivered, their delay and their bytes.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tumble_net::sync::transport::*;
use tumble_net::sync::udp::FacetSettings;
use tumble_net::sync::udp::ServerSettings;
use tumble_net::sync::udp::network::{Faults, Network, Random};
use tumble_net::sync::udp::*;

pub const SERVER: SocketAddr = SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 1)), 7700);
pub const KEY: [u8; 32] = [7; 32];

/// 5 % loss each way, 10 % reordered, 2 % duplicated; a millisecond one way.
pub const BAD: Faults =
    Faults { loss: 0.05, reorder: 0.10, duplicate: 0.02, flip: 0.0, cut: 0.0, delay_s: 0.001, jitter_s: 0.0 };

pub fn facet_address(facet: FacetNumber) -> SocketAddr {
    ([10, 0, 1, facet as u8], 9000).into()
}

/// A server, facets, and a network between them; time advances from one event to the next.
pub struct Cave {
    pub now: Duration,
    pub server: ServerMachine,
    pub facets: Vec<FacetMachine>,
    pub network: Network,
    /// Datagrams that the facets sent, if recording is on.
    pub recorded: Option<Vec<Vec<u8>>>,
}

impl Cave {
    pub fn new(facets: FacetNumber, seed: u64, faults: Faults, numbering: Numbering) -> Cave {
        let timing = Timing::default();
        let server = ServerMachine::new(
            ServerSettings { facets, timing, numbering },
            SharedKey::new(KEY),
            Entropy::seeded(seed),
        );
        let facet = |facet| {
            let settings = FacetSettings { facet, server: SERVER, timing, numbering };
            FacetMachine::new(
                Duration::ZERO,
                settings,
                SharedKey::new(KEY),
                Entropy::seeded(seed + 1 + u64::from(facet)),
            )
        };
        Cave {
            now: Duration::ZERO,
            server,
            facets: (0..facets).map(facet).collect(),
            network: Network::new(seed, faults),
            recorded: None,
        }
    }

    pub fn transmit(&mut self) {
        let (now, network) = (self.now, &mut self.network);
        self.server.transmit(now, &mut |to, datagram| network.send(now, SERVER, to, datagram));
        for (k, facet) in self.facets.iter_mut().enumerate() {
            facet.transmit(now, &mut |to, datagram| {
                self.recorded.iter_mut().for_each(|recorded| recorded.push(datagram.to_vec()));
                network.send(now, facet_address(k as u16), to, datagram)
            });
        }
    }

    /// Advances to the next event, or to `until`.
    pub fn advance(&mut self, until: Duration) {
        self.transmit();
        let wakes = self.facets.iter().map(FacetMachine::wake).chain(self.server.wake()).chain(self.network.next());
        self.now = wakes
            .min()
            .unwrap_or(until)
            .clamp(self.now + Duration::from_micros(1), until.max(self.now + Duration::from_micros(1)));
        while let Some((from, to, datagram)) = self.network.receive(self.now) {
            if to == SERVER {
                self.server.receive(self.now, from, &datagram);
            } else if let Some(k) = (0..self.facets.len()).find(|k| facet_address(*k as u16) == to) {
                self.facets[k].receive(self.now, from, &datagram);
            }
        }
        self.transmit();
    }

    /// Runs until all facets are connected on both sides.
    pub fn connect(&mut self) {
        let (mut server, mut facets) = (0, 0);
        while server < self.facets.len() || facets < self.facets.len() {
            assert!(self.now < Duration::from_secs(20), "{server} and {facets} connected in 20 s");
            self.advance(self.now + Duration::from_millis(10));
            server +=
                std::iter::from_fn(|| self.server.poll()).filter(|(_, event, _)| *event == LinkEvent::Opened).count();
            for facet in &mut self.facets {
                facets += std::iter::from_fn(|| facet.poll()).filter(|(event, _)| *event == LinkEvent::Opened).count();
            }
        }
    }
}

/// Message `k` of a length: its number, then bytes that are computed from it.
pub fn message(k: u64, length: usize) -> Vec<u8> {
    let mut message = k.to_le_bytes().to_vec();
    let mut random = Random::new(k);
    message.extend(std::iter::repeat_with(|| random.next_u64() as u8).take(length - 8));
    message
}

pub fn number(message: &[u8]) -> u64 {
    u64::from_le_bytes(message[..8].try_into().unwrap())
}

/// Result of a stream of frames at 60 Hz.
struct Outcome {
    latencies: Vec<Duration>,
    ratio: f64,
}

impl Outcome {
    fn quantile(&self, q: f64) -> Duration {
        let mut sorted = self.latencies.clone();
        sorted.sort();
        sorted[((sorted.len() - 1) as f64 * q) as usize]
    }
}

/// Sends frames to one facet at 60 Hz, each answered; asserts that they arrive whole, once and in
/// order.
fn stream(frames: u64, length: usize, seed: u64, faults: Faults, numbering: Numbering) -> Outcome {
    let mut cave = Cave::new(1, seed, faults, numbering);
    cave.connect();
    let before = cave.network.bytes;
    let begin = cave.now;
    let due = |k: u64| begin + Duration::from_nanos(k * 1_000_000_000 / 60);
    let (mut sent, mut answered, mut latencies) = (0, 0, Vec::new());
    while answered < frames {
        while sent < frames && cave.now >= due(sent) {
            let bytes: Arc<[u8]> = message(sent, length).into();
            assert!(cave.server.send(0, Delivery::Reliable, &bytes));
            sent += 1;
        }
        cave.advance(if sent < frames { due(sent) } else { cave.now + Duration::from_secs(1) });
        while let Some((event, bytes)) = cave.facets[0].poll() {
            assert_eq!(event, LinkEvent::Message);
            let k = latencies.len() as u64;
            assert!(bytes == message(k, length), "message {} of {} bytes instead of {k}", number(&bytes), bytes.len());
            latencies.push(cave.now - due(k));
            assert!(cave.facets[0].send(cave.now, Delivery::Reliable, &k.to_le_bytes()));
        }
        while let Some((_, event, bytes)) = cave.server.poll() {
            assert_eq!((event, number(&bytes)), (LinkEvent::Message, answered));
            answered += 1;
        }
        assert!(cave.now < due(frames) + Duration::from_secs(10), "{answered} of {frames} answered");
    }
    let ratio = (cave.network.bytes - before) as f64 / (frames as f64 * length as f64);
    let outcome = Outcome { latencies, ratio };
    let [p50, p99, p999, worst] = [0.5, 0.99, 0.999, 1.0].map(|q| 1e3 * outcome.quantile(q).as_secs_f64());
    println!(
        "{frames} frames of {length} bytes: p50 {p50:.2} ms, p99 {p99:.2} ms, p99.9 {p999:.2} ms, worst {worst:.2} ms, {ratio:.3} times the bytes"
    );
    outcome
}

pub fn frames(short: u64, long: u64) -> u64 {
    if std::env::var_os("TUMBLE_SLOW").is_some_and(|v| v == "1") { long } else { short }
}

#[test]
fn a_bad_network_delivers_each_frame_once_in_order_and_soon_full_length() {
    for (length, seed) in [(400, 1), (1 << 10, 2), (4 << 10, 3), (16 << 10, 4), (64 << 10, 5)] {
        let long = if length > 16 << 10 { 10_000 } else { 100_000 };
        let outcome = stream(frames(2_000, long), length, seed, BAD, Numbering::default());
        assert!(outcome.quantile(0.999) < Duration::from_millis(12), "{length}: {:?}", outcome.quantile(0.999));
        assert!(outcome.ratio <= 1.6, "{length}: {}", outcome.ratio);
    }
}

#[test]
fn a_quiet_network_carries_little_more_than_the_messages() {
    let quiet = Faults { delay_s: 0.0002, ..Faults::default() };
    let outcome = stream(500, 16 << 10, 4, quiet, Numbering::default());
    // 15 fragments with 44 bytes around each, three acknowledgements of 48 bytes and one answer of
    // 63 bytes
    assert!(outcome.ratio < 1.0 + (15.0 * 44.0 + 3.0 * 48.0 + 63.0) / 16384.0, "{}", outcome.ratio);
    assert_eq!(outcome.quantile(1.0), Duration::from_micros(200));
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let [a, b] = [(); 2].map(|()| stream(300, 5000, 9, BAD, Numbering::default()));
    assert_eq!((a.latencies, a.ratio.to_bits()), (b.latencies, b.ratio.to_bits()));
}

#[test]
fn message_numbers_wrap_at_u32() {
    let numbering = Numbering { sequence: u64::from(u32::MAX) - 500, message: u32::MAX - 300 };
    stream(1_000, 3000, 5, BAD, numbering);
}

/// Runs for a while and returns the events of the facet and of the server.
fn run_for(cave: &mut Cave, seconds: f64) -> (Vec<LinkEvent>, Vec<LinkEvent>) {
    let end = cave.now + Duration::from_secs_f64(seconds);
    let (mut facet, mut server) = (Vec::new(), Vec::new());
    while cave.now < end {
        cave.advance(end);
        facet.extend(std::iter::from_fn(|| cave.facets[0].poll()).map(|(event, _)| event));
        server.extend(std::iter::from_fn(|| cave.server.poll()).map(|(_, event, _)| event));
    }
    (facet, server)
}

#[test]
fn a_parted_network_closes_and_opens_again() {
    let mut cave = Cave::new(1, 10, BAD, Numbering::default());
    cave.connect();
    assert_eq!(run_for(&mut cave, 60.0), (vec![], vec![]), "an idle connection stays");
    cave.network.partitioned = true;
    let silent = LinkEvent::Closed(Closed::TimedOut);
    assert_eq!(run_for(&mut cave, 2.3), (vec![silent], vec![silent]));
    assert_eq!(run_for(&mut cave, 10.0), (vec![], vec![]));
    cave.network.partitioned = false;
    assert_eq!(run_for(&mut cave, 1.0), (vec![LinkEvent::Opened], vec![LinkEvent::Opened]));
}

#[test]
fn a_server_or_facet_started_again_is_found_within_a_second() {
    let mut cave = Cave::new(1, 11, BAD, Numbering::default());
    cave.connect();
    let timing = Timing::default();
    let settings = ServerSettings { facets: 1, timing, numbering: Numbering::default() };
    cave.server = ServerMachine::new(settings, SharedKey::new(KEY), Entropy::seeded(99));
    assert_eq!(
        run_for(&mut cave, 1.0),
        (vec![LinkEvent::Closed(Closed::ByPeer), LinkEvent::Opened], vec![LinkEvent::Opened])
    );
    let settings = FacetSettings { facet: 0, server: SERVER, timing, numbering: Numbering::default() };
    cave.facets[0] = FacetMachine::new(cave.now, settings, SharedKey::new(KEY), Entropy::seeded(98));
    assert_eq!(
        run_for(&mut cave, 1.0),
        (vec![LinkEvent::Opened], vec![LinkEvent::Closed(Closed::Replaced), LinkEvent::Opened])
    );
    let now = cave.now;
    let network = &mut cave.network;
    cave.server.close(now, 0, &mut |to, datagram| network.send(now, SERVER, to, datagram));
    let (facet, server) = run_for(&mut cave, 1.0);
    assert_eq!(facet, [LinkEvent::Closed(Closed::ByPeer), LinkEvent::Opened]);
    assert_eq!(server, [LinkEvent::Closed(Closed::ByUs), LinkEvent::Opened]);
}

#[test]
fn of_newest_messages_the_last_arrives_and_none_comes_late() {
    let mut cave = Cave::new(1, 12, BAD, Numbering::default());
    cave.connect();
    let (mut last, mut count) = (None, 0);
    // more than the window admits: 64 KiB per millisecond
    for k in 0..1500u64 {
        if k < 1000 {
            assert!(cave.server.send(0, Delivery::Newest, &message(k, 64 << 10).into()));
        }
        let end = cave.now + Duration::from_millis(1);
        while cave.now < end {
            cave.advance(end);
        }
        while let Some((event, bytes)) = cave.facets[0].poll() {
            assert!(event == LinkEvent::Message && bytes == message(number(&bytes), 64 << 10));
            assert!(last.is_none_or(|last| number(&bytes) > last));
            last = Some(number(&bytes));
            count += 1;
        }
    }
    assert_eq!(last, Some(999));
    let replaced = cave.server.counters(0).superseded + cave.facets[0].counters().superseded;
    assert!(count > 100 && count + replaced == 1000, "{count} came, {replaced} were replaced");
}

#[test]
fn long_messages_arrive_whole_and_a_facet_that_takes_nothing_is_let_go() {
    let mut cave = Cave::new(1, 13, BAD, Numbering::default());
    cave.connect();
    assert!(!cave.server.send(0, Delivery::Reliable, &Arc::from(vec![0; MAX_MESSAGE_BYTES + 1])));
    assert!(!cave.server.send(0, Delivery::Reliable, &Arc::from([])));
    let long = message(5, MAX_MESSAGE_BYTES);
    assert!(cave.server.send(0, Delivery::Reliable, &Arc::from(&long[..])));
    let mut got = None;
    while got.is_none() {
        cave.advance(cave.now + Duration::from_secs(1));
        got = cave.facets[0].poll();
        assert!(cave.now < Duration::from_secs(30));
    }
    assert!(got == Some((LinkEvent::Message, long.clone())));
    let mut sent = 0;
    while cave.server.send(0, Delivery::Reliable, &Arc::from(&long[..])) {
        sent += 1;
        assert!(sent <= 4, "64 MiB may wait");
    }
    assert_eq!(cave.server.poll().map(|(_, event, _)| event), Some(LinkEvent::Closed(Closed::Overrun)));
}

//! Simulated network with faults, reproducible by its seed and without a clock.
//!
//! It follows Linux's `netem`: a datagram is delayed by `delay_s` plus up to `jitter_s`. With
//! probability `reorder` it is not delayed at all and overtakes others. Then it may be lost,
//! duplicated or damaged.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::time::Duration;

/// Faults of the network. Probabilities are per datagram and direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    /// Probability of loss.
    pub loss: f64,
    /// Probability that a datagram overtakes others.
    pub reorder: f64,
    /// Probability that a datagram arrives twice.
    pub duplicate: f64,
    /// Probability that a random bit is flipped.
    pub flip: f64,
    /// Probability that a datagram is cut at a random length.
    pub cut: f64,
    /// Delay of one direction, s.
    pub delay_s: f64,
    /// Maximum additional delay, s.
    pub jitter_s: f64,
}

/// Random numbers (splitmix64).
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates the generator.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    /// Returns the next number.
    pub fn next_u64(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Returns a number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a number below `n`; 0 for 0.
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    fn happens(&mut self, share: f64) -> bool {
        self.unit() < share
    }
}

/// A datagram in flight: sender, receiver, bytes.
pub type InFlight = (SocketAddr, SocketAddr, Vec<u8>);

/// A network with its datagrams in flight.
pub struct Network {
    faults: Faults,
    random: Random,
    in_flight: BTreeMap<(Duration, u64), InFlight>,
    count: u64,
    /// While set, every datagram is lost.
    pub partitioned: bool,
    /// Total number of bytes sent, including lost datagrams.
    pub bytes: u64,
}

impl Network {
    /// Creates a network without datagrams.
    pub fn new(seed: u64, faults: Faults) -> Network {
        Network {
            faults,
            random: Random::new(seed),
            in_flight: BTreeMap::new(),
            count: 0,
            partitioned: false,
            bytes: 0,
        }
    }

    /// Sends a datagram.
    pub fn send(&mut self, now: Duration, from: SocketAddr, to: SocketAddr, datagram: &[u8]) {
        self.bytes += datagram.len() as u64;
        let copies = 1 + usize::from(self.random.happens(self.faults.duplicate));
        for _ in 0..copies {
            let lost = self.random.happens(self.faults.loss) || self.partitioned;
            let overtakes = self.random.happens(self.faults.reorder);
            let delay = if overtakes { 0.0 } else { self.faults.delay_s + self.random.unit() * self.faults.jitter_s };
            let mut datagram = datagram.to_vec();
            self.corrupt(&mut datagram);
            if !lost {
                self.count += 1;
                self.in_flight.insert((now + Duration::from_secs_f64(delay), self.count), (from, to, datagram));
            }
        }
    }

    /// Returns the next datagram that has arrived by `now`.
    pub fn receive(&mut self, now: Duration) -> Option<InFlight> {
        let first = self.in_flight.first_entry().filter(|first| first.key().0 <= now)?;
        Some(first.remove())
    }

    /// Returns when the next datagram arrives.
    pub fn next(&self) -> Option<Duration> {
        self.in_flight.keys().next().map(|(at, _)| *at)
    }

    fn corrupt(&mut self, datagram: &mut Vec<u8>) {
        if self.random.happens(self.faults.flip) && !datagram.is_empty() {
            let bit = self.random.below(8 * datagram.len());
            datagram[bit / 8] ^= 1 << (bit % 8);
        }
        if self.random.happens(self.faults.cut) {
            datagram.truncate(self.random.below(datagram.len()));
        }
    }
}

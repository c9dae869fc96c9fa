//! A network with faults, reproducible by its seed. It carries single messages and repairs nothing.
//! A session that works over it works over any link with weaker faults.
//!
//! It has no clock: the caller gives `now`, and messages are delivered in the order of their
//! arrival times.

use std::collections::BTreeMap;
use std::time::Duration;

/// Faults of the network. Probabilities are from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetworkConditions {
    /// Probability that a message is lost.
    pub loss: f64,
    /// Probability that a message arrives twice.
    pub duplication: f64,
    /// Probability that a message is delayed by up to four more times the maximum of `delay`, so
    /// that others overtake it.
    pub reordering: f64,
    /// Probability that one to three bits of a message are flipped, or that its end is cut off.
    pub corruption: f64,
    /// Minimum and maximum delay.
    pub delay: [Duration; 2],
}

impl NetworkConditions {
    /// No delay and no faults.
    pub const PERFECT: NetworkConditions =
        NetworkConditions { loss: 0.0, duplication: 0.0, reordering: 0.0, corruption: 0.0, delay: [Duration::ZERO; 2] };
}

/// Direction of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Destination {
    /// From this facet to the server.
    Server(u16),
    /// From the server to this facet.
    Facet(u16),
}

/// Counts of the network.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkStats {
    /// Messages sent.
    pub sent: u64,
    /// Lost by chance or by a partition.
    pub lost: u64,
    /// Delivered twice.
    pub duplicated: u64,
    /// Held back.
    pub reordered: u64,
    /// Delivered with damage.
    pub corrupted: u64,
}

/// Simulated network between a server and its facets.
pub struct SimulatedNetwork {
    random_state: u64,
    conditions: NetworkConditions,
    partitioned: Vec<u16>,
    in_flight: BTreeMap<(Duration, u64), (Destination, Vec<u8>)>,
    count: u64,
    stats: LinkStats,
}

impl SimulatedNetwork {
    /// Creates the network. The same seed and the same calls give the same deliveries.
    pub fn new(seed: u64, conditions: NetworkConditions) -> SimulatedNetwork {
        SimulatedNetwork {
            random_state: super::facet::splitmix64(seed) | 1,
            conditions,
            partitioned: Vec::new(),
            in_flight: BTreeMap::new(),
            count: 0,
            stats: LinkStats::default(),
        }
    }

    /// Sets the conditions for later messages.
    pub fn set_conditions(&mut self, conditions: NetworkConditions) {
        self.conditions = conditions;
    }

    /// Separates a facet from the server, or connects it again. A separation discards its messages
    /// in flight.
    pub fn set_partitioned(&mut self, facet: u16, partitioned: bool) {
        self.partitioned.retain(|&f| f != facet);
        if partitioned {
            self.partitioned.push(facet);
            self.in_flight
                .retain(|_, (to, _)| !matches!(to, Destination::Server(f) | Destination::Facet(f) if *f == facet));
        }
    }

    /// Returns the counts so far.
    pub fn stats(&self) -> LinkStats {
        self.stats
    }

    /// Sends a message.
    pub fn send(&mut self, now: Duration, to: Destination, message: &[u8]) {
        self.stats.sent += 1;
        let (Destination::Server(facet) | Destination::Facet(facet)) = to;
        if self.partitioned.contains(&facet) || self.happens(self.conditions.loss) {
            self.stats.lost += 1;
            return;
        }
        let twice = self.happens(self.conditions.duplication);
        self.stats.duplicated += u64::from(twice);
        for _ in 0..1 + usize::from(twice) {
            let mut bytes = message.to_vec();
            if self.happens(self.conditions.corruption) {
                self.stats.corrupted += 1;
                self.corrupt(&mut bytes);
            }
            let [min, max] = self.conditions.delay;
            let mut delay = min + (max - min).mul_f64(self.unit());
            if self.happens(self.conditions.reordering) {
                self.stats.reordered += 1;
                delay += max.mul_f64(4.0 * self.unit());
            }
            self.count += 1;
            self.in_flight.insert((now + delay, self.count), (to, bytes));
        }
    }

    /// Returns when the next message arrives.
    pub fn next_arrival(&self) -> Option<Duration> {
        self.in_flight.keys().next().map(|(at, _)| *at)
    }

    /// Returns the next message that has arrived by `now`.
    pub fn receive(&mut self, now: Duration) -> Option<(Destination, Vec<u8>)> {
        let first = self.in_flight.first_entry()?;
        (first.key().0 <= now).then(|| first.remove())
    }

    fn corrupt(&mut self, bytes: &mut Vec<u8>) {
        if self.next_u64().is_multiple_of(4) {
            let keep = self.next_u64() as usize % bytes.len().max(1);
            bytes.truncate(keep);
            return;
        }
        let before = bytes.clone();
        while *bytes == before && !bytes.is_empty() {
            for _ in 0..1 + self.next_u64() % 3 {
                let bit = self.next_u64() as usize % (8 * bytes.len());
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }

    fn happens(&mut self, unit: f64) -> bool {
        self.unit() < unit
    }

    fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// xorshift64*
    fn next_u64(&mut self) -> u64 {
        self.random_state ^= self.random_state >> 12;
        self.random_state ^= self.random_state << 25;
        self.random_state ^= self.random_state >> 27;
        self.random_state.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

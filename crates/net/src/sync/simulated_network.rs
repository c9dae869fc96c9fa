//! A network that does its worst, and the same worst again for the same seed. It carries single messages and mends nothing: what a session survives
//! here it survives over any link that keeps less than its promise.
//!
//! It has no clock: `now` is whatever the caller says, and messages come out in the order of their time of arrival.

use std::collections::BTreeMap;
use std::time::Duration;

/// What happens to messages. Shares are of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NetworkConditions {
    /// Share that is lost.
    pub loss: f64,
    /// Share that arrives twice.
    pub duplication: f64,
    /// Share that is held back by up to four times `delay`, so that others overtake it.
    pub reordering: f64,
    /// Share of which one to three bits are flipped, or the end is cut off.
    pub corruption: f64,
    /// Least and most time under way.
    pub delay: [Duration; 2],
}

impl NetworkConditions {
    /// At once, and all of it.
    pub const PERFECT: NetworkConditions =
        NetworkConditions { loss: 0.0, duplication: 0.0, reordering: 0.0, corruption: 0.0, delay: [Duration::ZERO; 2] };
}

/// Where a message goes: to the server, or to a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Destination {
    /// From this facet to the server.
    Server(u16),
    /// From the server to this facet.
    Facet(u16),
}

/// What the network did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkStats {
    /// Messages given to it.
    pub sent: u64,
    /// Lost, or swallowed by a partition.
    pub lost: u64,
    /// Delivered twice.
    pub duplicated: u64,
    /// Held back.
    pub reordered: u64,
    /// Delivered damaged.
    pub corrupted: u64,
}

/// The network between a server and its facets.
pub struct SimulatedNetwork {
    random_state: u64,
    conditions: NetworkConditions,
    partitioned: Vec<u16>,
    in_flight: BTreeMap<(Duration, u64), (Destination, Vec<u8>)>,
    count: u64,
    stats: LinkStats,
}

impl SimulatedNetwork {
    /// The same seed and the same calls give the same deliveries.
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

    /// Changes the weather for what is sent from now on.
    pub fn set_conditions(&mut self, conditions: NetworkConditions) {
        self.conditions = conditions;
    }

    /// Cuts a facet off, or joins it again. What is under way to and from it is lost.
    pub fn set_partitioned(&mut self, facet: u16, partitioned: bool) {
        self.partitioned.retain(|&f| f != facet);
        if partitioned {
            self.partitioned.push(facet);
            self.in_flight
                .retain(|_, (to, _)| !matches!(to, Destination::Server(f) | Destination::Facet(f) if *f == facet));
        }
    }

    /// What it did so far.
    pub fn stats(&self) -> LinkStats {
        self.stats
    }

    /// Takes a message.
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

    /// When the next message arrives.
    pub fn next_arrival(&self) -> Option<Duration> {
        self.in_flight.keys().next().map(|(at, _)| *at)
    }

    /// The next message that has arrived by `now`.
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

//! A network that does its worst, and the same worst again for the same seed. It carries single messages and mends nothing: what a session survives
//! here it survives over any link that keeps less than its promise.
//!
//! It has no clock: `now` is whatever the caller says, and messages come out in the order of their time of arrival.

use std::collections::BTreeMap;
use std::time::Duration;

/// What happens to messages. Shares are of 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weather {
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

impl Weather {
    /// At once, and all of it.
    pub const CLEAR: Weather =
        Weather { loss: 0.0, duplication: 0.0, reordering: 0.0, corruption: 0.0, delay: [Duration::ZERO; 2] };
}

/// Where a message goes: to the server, or to a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum To {
    /// From this facet to the server.
    Server(u16),
    /// From the server to this facet.
    Facet(u16),
}

/// What the network did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Damage {
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
pub struct Network {
    dice: u64,
    weather: Weather,
    parted: Vec<u16>,
    under_way: BTreeMap<(Duration, u64), (To, Vec<u8>)>,
    count: u64,
    damage: Damage,
}

impl Network {
    /// The same seed and the same calls give the same deliveries.
    pub fn new(seed: u64, weather: Weather) -> Network {
        Network {
            dice: super::facet::mixed(seed) | 1,
            weather,
            parted: Vec::new(),
            under_way: BTreeMap::new(),
            count: 0,
            damage: Damage::default(),
        }
    }

    /// Changes the weather for what is sent from now on.
    pub fn set_weather(&mut self, weather: Weather) {
        self.weather = weather;
    }

    /// Cuts a facet off, or joins it again. What is under way to and from it is lost.
    pub fn part(&mut self, facet: u16, parted: bool) {
        self.parted.retain(|&f| f != facet);
        if parted {
            self.parted.push(facet);
            self.under_way.retain(|_, (to, _)| !matches!(to, To::Server(f) | To::Facet(f) if *f == facet));
        }
    }

    /// What it did so far.
    pub fn damage(&self) -> Damage {
        self.damage
    }

    /// Takes a message.
    pub fn send(&mut self, now: Duration, to: To, message: &[u8]) {
        self.damage.sent += 1;
        let (To::Server(facet) | To::Facet(facet)) = to;
        if self.parted.contains(&facet) || self.happens(self.weather.loss) {
            self.damage.lost += 1;
            return;
        }
        let twice = self.happens(self.weather.duplication);
        self.damage.duplicated += u64::from(twice);
        for _ in 0..1 + usize::from(twice) {
            let mut bytes = message.to_vec();
            if self.happens(self.weather.corruption) {
                self.damage.corrupted += 1;
                self.spoil(&mut bytes);
            }
            let [least, most] = self.weather.delay;
            let mut delay = least + (most - least).mul_f64(self.share());
            if self.happens(self.weather.reordering) {
                self.damage.reordered += 1;
                delay += most.mul_f64(4.0 * self.share());
            }
            self.count += 1;
            self.under_way.insert((now + delay, self.count), (to, bytes));
        }
    }

    /// When the next message arrives.
    pub fn next_arrival(&self) -> Option<Duration> {
        self.under_way.keys().next().map(|(at, _)| *at)
    }

    /// The next message that has arrived by `now`.
    pub fn receive(&mut self, now: Duration) -> Option<(To, Vec<u8>)> {
        let first = self.under_way.first_entry()?;
        (first.key().0 <= now).then(|| first.remove())
    }

    fn spoil(&mut self, bytes: &mut Vec<u8>) {
        if self.roll().is_multiple_of(4) {
            let keep = self.roll() as usize % bytes.len().max(1);
            bytes.truncate(keep);
            return;
        }
        let before = bytes.clone();
        while *bytes == before && !bytes.is_empty() {
            for _ in 0..1 + self.roll() % 3 {
                let bit = self.roll() as usize % (8 * bytes.len());
                bytes[bit / 8] ^= 1 << (bit % 8);
            }
        }
    }

    fn happens(&mut self, share: f64) -> bool {
        self.share() < share
    }

    fn share(&mut self) -> f64 {
        (self.roll() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// xorshift64*
    fn roll(&mut self) -> u64 {
        self.dice ^= self.dice >> 12;
        self.dice ^= self.dice << 25;
        self.dice ^= self.dice >> 27;
        self.dice.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

//! Replay window: remembers which of the last 256 packets were received. It refuses duplicates and
//! supplies the acknowledgements.
//!
//! Bit k stands for the packet `largest - k`. Nothing is ever added to a sequence number, so the
//! window is correct up to `u64::MAX`.

use crate::sync::transport::Refused;

/// Number of packets in the window.
pub const WINDOW: u64 = 256;

/// Received packets of one session and direction.
#[derive(Clone, Debug, Default)]
pub struct ReplayWindow {
    largest: Option<u64>,
    bits: [u64; 4],
}

impl ReplayWindow {
    /// Checks whether a packet may be taken, without changing the window: a packet counts as
    /// received only after its tag was checked.
    ///
    /// # Errors
    /// [`Refused::Stale`] or [`Refused::Replayed`].
    pub fn check(&self, sequence: u64) -> Result<(), Refused> {
        match self.age(sequence) {
            None => Ok(()),
            Some(age) if age >= WINDOW => Err(Refused::Stale),
            Some(age) if self.bit(age) => Err(Refused::Replayed),
            Some(_) => Ok(()),
        }
    }

    /// Marks a packet with a valid tag as received.
    pub fn take(&mut self, sequence: u64) {
        match (self.age(sequence), self.largest) {
            (Some(age), _) if age < WINDOW => self.bits[(age / 64) as usize] |= 1 << (age % 64),
            (Some(_), _) => {}
            (None, largest) => {
                self.shift(largest.map_or(WINDOW, |largest| sequence - largest));
                self.bits[0] |= 1;
                self.largest = Some(sequence);
            }
        }
    }

    /// Returns the largest received packet.
    pub fn largest(&self) -> Option<u64> {
        self.largest
    }

    /// Returns the largest received packet and a mask of the 128 up to it: bit k stands for
    /// `largest - k`.
    pub fn taken(&self) -> Option<(u64, u128)> {
        Some((self.largest?, u128::from(self.bits[0]) | u128::from(self.bits[1]) << 64))
    }

    /// Returns the distance behind the largest packet; `None` ahead of it.
    fn age(&self, sequence: u64) -> Option<u64> {
        self.largest?.checked_sub(sequence)
    }

    fn bit(&self, age: u64) -> bool {
        self.bits[(age / 64) as usize] >> (age % 64) & 1 == 1
    }

    fn shift(&mut self, by: u64) {
        let old = std::mem::take(&mut self.bits);
        if by >= WINDOW {
            return;
        }
        let (words, bits) = ((by / 64) as usize, (by % 64) as u32);
        for word in words..4 {
            self.bits[word] = old[word - words] << bits;
            if bits > 0 && word > words {
                self.bits[word] |= old[word - words - 1] >> (64 - bits);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Reference implementation with a set of numbers.
    fn brute(taken: &BTreeSet<u64>, sequence: u64) -> Result<(), Refused> {
        match taken.last() {
            Some(last) if *last >= sequence && last - sequence >= 256 => Err(Refused::Stale),
            _ if taken.contains(&sequence) => Err(Refused::Replayed),
            _ => Ok(()),
        }
    }

    #[test]
    fn agrees_with_a_set_of_numbers_from_the_start_and_up_to_the_wrap() {
        let mut seed = 1u64;
        for start in [0, 1000, u64::MAX - 900] {
            let (mut window, mut taken) = (ReplayWindow::default(), BTreeSet::new());
            for k in 0..4000u64 {
                seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                let sequence = start.saturating_add(k / 4).saturating_add(seed >> 33 & 511).saturating_sub(200);
                assert_eq!(window.check(sequence), brute(&taken, sequence), "{sequence}");
                if window.check(sequence).is_ok() {
                    window.take(sequence);
                    taken.insert(sequence);
                }
                let largest = *taken.last().unwrap();
                let mask = (0..128)
                    .filter(|k| largest.checked_sub(*k).is_some_and(|s| taken.contains(&s)))
                    .fold(0u128, |m, k| m | 1 << k);
                assert_eq!(window.taken(), Some((largest, mask)));
            }
            assert_eq!(window.check(u64::MAX).is_ok(), !taken.contains(&u64::MAX));
        }
    }
}

//! Histogram of durations in constant memory, for runs of any length.
//!
//! ```text
//! bucket of x = ⌊ ln(x / 1 µs) / ln 1.02 ⌋        so a quantile has an error of at most 2 %
//! ```

use serde::Serialize;

const MIN_S: f64 = 1e-6;
const RATIO: f64 = 1.02;
/// Up to about 2 hours.
const BUCKETS: usize = 1150;

/// Distribution of durations.
pub struct Histogram {
    counts: Vec<u64>,
    count: u64,
    /// The longest duration (s), its frame and simulated time.
    longest: (f64, u64, f64),
}

/// Quantiles of a distribution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Quantiles {
    pub count: u64,
    pub p50_ms: f64,
    pub p99_ms: f64,
    pub max_ms: f64,
    /// Frame with the longest duration, and its simulated time.
    pub max_at_frame: u64,
    pub max_at_s: f64,
}

impl Default for Histogram {
    fn default() -> Histogram {
        Histogram { counts: vec![0; BUCKETS], count: 0, longest: (0.0, 0, 0.0) }
    }
}

impl Histogram {
    /// Adds the duration of a frame, s.
    pub fn add(&mut self, duration: f64, frame: u64, time_s: f64) {
        let bucket = ((duration.max(MIN_S) / MIN_S).ln() / RATIO.ln()) as usize;
        self.counts[bucket.min(BUCKETS - 1)] += 1;
        self.count += 1;
        if duration > self.longest.0 {
            self.longest = (duration, frame, time_s);
        }
    }

    /// Returns the quantile for this fraction, s: the upper end of its bucket, at most the maximum.
    pub fn quantile(&self, share: f64) -> f64 {
        let wanted = (share * self.count as f64).ceil() as u64;
        let mut sum = 0;
        let bucket = self.counts.iter().position(|count| {
            sum += count;
            sum >= wanted
        });
        bucket.map_or(0.0, |k| MIN_S * RATIO.powi(k as i32 + 1)).min(self.longest.0)
    }

    /// Returns the quantiles if there is any value.
    pub fn non_empty(&self) -> Option<Quantiles> {
        (self.count > 0).then(|| self.quantiles())
    }

    /// Returns the quantiles.
    pub fn quantiles(&self) -> Quantiles {
        let (longest, max_at_frame, max_at_s) = self.longest;
        Quantiles {
            count: self.count,
            p50_ms: 1e3 * self.quantile(0.5),
            p99_ms: 1e3 * self.quantile(0.99),
            max_ms: 1e3 * longest,
            max_at_frame,
            max_at_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Histogram;

    #[test]
    fn shares_are_known_to_two_percent_and_the_longest_exactly() {
        let mut histogram = Histogram::default();
        (1..=1000).for_each(|k| histogram.add(k as f64 * 1e-3, k, k as f64));
        for (share, s) in [(0.5, 0.5), (0.99, 0.99), (1.0, 1.0)] {
            let found = histogram.quantile(share);
            assert!(found >= s && found <= 1.021 * s, "{share}: {found}");
        }
        let quantiles = histogram.quantiles();
        assert_eq!(
            (quantiles.count, quantiles.max_ms, quantiles.max_at_frame, quantiles.max_at_s),
            (1000, 1000.0, 1000, 1000.0)
        );
        assert_eq!(Histogram::default().quantiles(), super::Quantiles::default());
    }
}

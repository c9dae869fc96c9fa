//! Random numbers, the same on every machine.

/// splitmix64.
pub struct Random(pub u64);

impl Random {
    /// Returns a number between `−bound` and `bound`.
    pub fn within(&mut self, bound: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^= x >> 31;
        bound * (2.0 * (x >> 11) as f64 / (1u64 << 53) as f64 - 1.0)
    }
}

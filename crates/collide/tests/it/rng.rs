//! A seeded random number generator (splitmix64), so that each failure can be reproduced.

use tumble_collide::{Pose, Quat, Vec3};

/// State of the generator.
pub struct Rng(u64);

impl Rng {
    /// Returns an independent stream per seed.
    pub fn new(seed: u64) -> Rng {
        Rng(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def0)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns a number uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Returns an index uniform in 0..n.
    pub fn below(&mut self, n: usize) -> usize {
        (self.unit() * n as f64) as usize
    }

    /// Returns a vector with each component uniform in [−size, size).
    pub fn vec(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_, _| self.between(-size, size))
    }

    /// Returns a nearly uniform direction.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.vec(1.0);
            if v.norm() > 0.1 && v.norm() < 1.0 {
                return v.normalize();
            }
        }
    }

    /// Returns a pose with any orientation and a translation within `size` on each axis.
    pub fn pose(&mut self, size: f64) -> Pose {
        let turn = Quat::from_scaled_axis(self.direction() * self.between(0.0, 3.1));
        Pose::from_parts(self.vec(size).into(), turn)
    }
}

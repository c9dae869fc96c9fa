//! Random numbers without a state: a hash of a seed, a serial number and a counter (SplitMix64, Steele,
//! Lea and Flood, 2014). The same numbers on every run, in any order and on any number of threads.

use nalgebra::ComplexField;
use std::f64::consts::PI;
use tumble_collide::Vec3;

/// The numbers of one particle.
#[derive(Clone, Copy)]
pub(super) struct Random {
    key: u64,
}

impl Random {
    /// Returns the numbers of a serial number.
    pub fn new(seed: u64, serial: u64) -> Random {
        Random { key: mix(mix(seed).wrapping_add(serial)) }
    }

    /// Returns number `k`, uniform from 0 to below 1.
    pub fn uniform(self, k: u64) -> f64 {
        const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
        (mix(self.key.wrapping_add(GOLDEN.wrapping_mul(k + 1))) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a unit vector, uniform within `half_angle` (rad) of the z axis, from the numbers `k` and
    /// `k + 1`.
    pub fn within_cone(self, half_angle: f64, k: u64) -> Vec3 {
        let z = 1.0 - self.uniform(k) * (1.0 - ComplexField::cos(half_angle));
        let across = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = ComplexField::sin_cos(2.0 * PI * self.uniform(k + 1));
        Vec3::new(across * cos, across * sin, z)
    }
}

/// The finalizer of SplitMix64.
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

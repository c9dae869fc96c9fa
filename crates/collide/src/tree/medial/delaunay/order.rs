//! The insertion order of the points: rounds of doubling size, each along a space-filling curve.
//!
//! Source: Amenta, Choi and Rote, *Incremental constructions con BRIO* (2003). The rounds preserve
//! the expected cost of random insertion; the curve keeps each point close to its predecessor. The
//! random choice is a hash of the index, so the order depends on the points alone.

use crate::Vec3;
use crate::mesh::morton_codes;

/// Returns all indices of `points` in insertion order.
pub(super) fn order(points: &[Vec3]) -> Vec<u32> {
    let mut keys: Vec<(u32, u64, u32)> =
        morton_codes(points).into_iter().zip(0..).map(|(place, n)| (round(u64::from(n)), place, n)).collect();
    keys.sort_unstable();
    keys.into_iter().map(|k| k.2).collect()
}

/// Returns the round of a point: the last round has half of the points, the one before a quarter,
/// and so on.
fn round(n: u64) -> u32 {
    64 - hash(n).trailing_zeros()
}

/// The finalizer of splitmix64 (Steele, Lea and Flood, *Fast splittable pseudorandom number
/// generators*, 2014).
fn hash(n: u64) -> u64 {
    let x = (n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

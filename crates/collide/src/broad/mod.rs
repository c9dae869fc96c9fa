//! The broad phase: which pairs of boxes overlap.

mod brute_force;
mod sweep;

pub use brute_force::BruteForce;
pub use sweep::SweepAndPrune;

use crate::Aabb;

/// Finds the pairs whose boxes overlap.
pub trait BroadPhase: Send {
    /// Fills `out` (cleared first) with all `[i, j]`, `i < j`, whose boxes share a point and of which at
    /// least one is `moving`, in ascending order: the answer does not depend on earlier calls.
    fn pairs(&mut self, boxes: &[Aabb], moving: &[bool], out: &mut Vec<[u32; 2]>);
}

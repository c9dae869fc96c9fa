//! The broad phase: which pairs of boxes overlap.
//!
//! Boxes are filed under handles, moved by handle, and taken out again; then [`BroadPhase::pairs`] tells who overlaps whom.

mod brute_force;
mod cells;
mod fat;
mod sweep;

pub use brute_force::BruteForce;
pub use sweep::SweepAndPrune;

use crate::Aabb;

/// Finds the pairs whose boxes overlap.
///
/// Any box may be given: one with a side that is not a number, or whose `min` exceeds its `max`, overlaps nothing; infinite
/// sides are sides.
pub trait BroadPhase: Send {
    /// Files a box; `moving` says whether it is to be paired with what does not move. Its handle is a small number, fit to index a
    /// table; after [`remove`](Self::remove) it may be given again.
    fn insert(&mut self, bounds: &Aabb, moving: bool) -> u32;

    /// Puts a box elsewhere. A handle that no box has is ignored.
    fn set(&mut self, handle: u32, bounds: &Aabb, moving: bool);

    /// Takes a box out. A handle that no box has is ignored.
    fn remove(&mut self, handle: u32);

    /// Fills `out` (cleared first) with all `[i, j]`, `i < j`, whose boxes share a point (touching counts) and of which at least one
    /// is moving, in ascending order: a function of the boxes under their handles, not of how they came there.
    fn pairs(&mut self, out: &mut Vec<[u32; 2]>);
}

/// The box that overlaps nothing: no comparison with it holds.
const EMPTY: Aabb =
    Aabb { min: crate::Vec3::new(f64::NAN, f64::NAN, f64::NAN), max: crate::Vec3::new(f64::NAN, f64::NAN, f64::NAN) };

/// The box as it takes part.
fn sanitized(bounds: &Aabb) -> Aabb {
    if (0..3).all(|k| bounds.min[k] <= bounds.max[k]) { *bounds } else { EMPTY }
}

//! The broad phase: finds the pairs of boxes that overlap.
//!
//! Boxes are inserted, moved and removed by handle; [`BroadPhase::pairs`] returns the overlapping
//! pairs.

mod brute_force;
mod cells;
mod fat;
mod sweep;

pub use brute_force::BruteForce;
pub use sweep::SweepAndPrune;

use crate::Aabb;

/// Finds the pairs of boxes that overlap.
///
/// Any box is allowed. A box with a side that is not a number, or with `min` above `max`, overlaps
/// nothing. Infinite sides are allowed.
pub trait BroadPhase: Send {
    /// Inserts a box and returns its handle, a small index. If `moving` is false, it is not paired
    /// with other boxes that do not move. A handle can be reused after [`remove`](Self::remove).
    fn insert(&mut self, bounds: &Aabb, moving: bool) -> u32;

    /// Moves a box. Ignores unknown handles.
    fn set(&mut self, handle: u32, bounds: &Aabb, moving: bool);

    /// Removes a box. Ignores unknown handles.
    fn remove(&mut self, handle: u32);

    /// Fills `out` (cleared first) with all `[i, j]`, `i < j`, whose boxes share a point (touching
    /// counts) and of which at least one is moving, in ascending order. The result depends on the
    /// boxes and their handles only, not on the history.
    fn pairs(&mut self, out: &mut Vec<[u32; 2]>);
}

/// A box that overlaps nothing: every comparison with it is false.
const EMPTY: Aabb =
    Aabb { min: crate::Vec3::new(f64::NAN, f64::NAN, f64::NAN), max: crate::Vec3::new(f64::NAN, f64::NAN, f64::NAN) };

/// Returns the box, or [`EMPTY`] if it is invalid.
fn sanitized(bounds: &Aabb) -> Aabb {
    if (0..3).all(|k| bounds.min[k] <= bounds.max[k]) { *bounds } else { EMPTY }
}

//! Fat boxes: the boxes that the cells store. A box can move inside its fat box without an update.

use crate::Aabb;

/// A box in `f32`, rounded outwards (meters, world axes), with a flag for moving bodies, as eight
/// numbers that are compared at once:
///
/// ```text
/// box      min x, y, z   −max x, y, z   0 if it moves, else 1    0
/// query    max x, y, z   −min x, y, z   1 if it moves, else 0    0         a pair: box ≤ query, number by number
/// ```
///
/// A box with a side that is not a number overlaps nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct FatBox([f32; 8]);

/// Fraction of the margin by which the box is shifted ahead.
const MOTION_SHIFT: f64 = 0.5;

/// The other operand of [`FatBox::overlaps`].
#[derive(Clone, Copy, Debug)]
pub(super) struct OverlapQuery([f32; 8]);

impl FatBox {
    pub const EMPTY: FatBox = FatBox([f32::NAN; 8]);
    pub const UNBOUNDED: FatBox = FatBox([f32::NEG_INFINITY; 8]);

    /// Returns the box with a margin, m, in every direction. Part of the margin is shifted to the side on which
    /// the box left its `old` fat box, since the motion probably continues.
    pub fn around(tight: &Aabb, margin: f64, moving: bool, old: &FatBox) -> FatBox {
        let side = |k: usize| {
            let displacement = 0.5 * (tight.min[k] + tight.max[k] - f64::from(old.min(k)) - f64::from(old.max(k)));
            // false if not a number
            let shift = if displacement.abs() < 4.0 * margin {
                (MOTION_SHIFT * displacement).clamp(-MOTION_SHIFT * margin, MOTION_SHIFT * margin)
            } else {
                0.0
            };
            (down(tight.min[k] - margin + shift), down(-tight.max[k] - margin - shift))
        };
        let [x, y, z] = [side(0), side(1), side(2)];
        FatBox([x.0, y.0, z.0, x.1, y.1, z.1, if moving { 0.0 } else { 1.0 }, 0.0])
    }

    /// Returns whether the box lies inside.
    pub fn contains(&self, tight: &Aabb) -> bool {
        let side = |k: usize| (f64::from(self.min(k)) <= tight.min[k]) & (tight.max[k] <= f64::from(self.max(k)));
        side(0) & side(1) & side(2)
    }

    pub fn is_valid(&self) -> bool {
        (0..3).all(|k| self.min(k) <= self.max(k))
    }

    pub fn overlap_query(&self) -> OverlapQuery {
        let [a, b, c, d, e, f, still, _] = self.0;
        OverlapQuery([-d, -e, -f, -a, -b, -c, 1.0 - still, 0.0])
    }

    /// Returns whether the two share a point and one of them moves. Branch-free: eight comparisons
    /// cost less than one misprediction.
    #[inline(always)]
    pub fn overlaps(&self, overlap_query: &OverlapQuery) -> bool {
        self.0.iter().zip(&overlap_query.0).fold(true, |all, (a, b)| all & (a <= b))
    }

    pub fn min(&self, axis: usize) -> f32 {
        self.0[axis]
    }

    pub fn max(&self, axis: usize) -> f32 {
        -self.0[axis + 3]
    }

    /// Returns the parts on either side of a plane.
    pub fn split(&self, axis: usize, at: f32) -> [FatBox; 2] {
        let (mut low, mut high) = (*self, *self);
        (low.0[axis + 3], high.0[axis]) = (-at, at);
        [low, high]
    }
}

/// A box in `f32`, rounded to nearest, in the layout of [`FatBox`]: half the memory, and sufficient
/// for most pairs. Rounding is monotonic, so if two rounded sides differ, the exact sides differ in
/// the same sense.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rounded([f32; 8]);

/// The result of a comparison of rounded boxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum RoundedOverlap {
    No,
    Yes,
    /// Some sides are equal after rounding.
    Uncertain,
}

impl Rounded {
    pub fn new(b: &Aabb) -> Rounded {
        let (min, max) = (b.min.map(|x| x as f32), b.max.map(|x| -(x as f32)));
        Rounded([min.x, min.y, min.z, max.x, max.y, max.z, -1.0, -1.0])
    }

    /// Returns whether the boxes share a point.
    #[inline(always)]
    pub fn overlaps(&self, other: &Rounded) -> RoundedOverlap {
        let [a, b, c, d, e, f, g, h] = other.0;
        let overlap_query = [-d, -e, -f, -a, -b, -c, -g, -h];
        let not_above = self.0.iter().zip(&overlap_query).fold(true, |all, (a, b)| all & (a <= b));
        let below = self.0.iter().zip(&overlap_query).fold(true, |all, (a, b)| all & (a < b));
        if not_above != below {
            RoundedOverlap::Uncertain
        } else if below {
            RoundedOverlap::Yes
        } else {
            RoundedOverlap::No
        }
    }
}

/// Returns a pair as one number, smaller handle first; the order of the numbers is the order of the
/// pairs.
pub(super) fn pair(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// Returns the greatest `f32` not above `x`.
fn down(x: f64) -> f32 {
    let near = x as f32;
    if f64::from(near) > x { near.next_down() } else { near }
}

//! Two boxes in the frame of the first, the input of the box-box tests.

use crate::{Mat3, Vec3};

/// The two boxes in A's frame.
pub(super) struct BoxPair {
    /// Half extents of A and of B, meters.
    pub a: Vec3,
    pub b: Vec3,
    /// Axes of B as columns.
    pub r: Mat3,
    /// Center of B, meters.
    pub t: Vec3,
}

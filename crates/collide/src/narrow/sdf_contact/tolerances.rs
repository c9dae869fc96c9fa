//! Tolerances that several searches share.

/// Pieces that an edge is halved into against a body that is not convex, in radii of the smaller body.
pub(super) const MAX_PIECE: f64 = 0.03;
/// Slopes that differ by this are the same.
pub(super) const LEVEL_SLOPE: f64 = 1e-7;
/// An edge that slopes less than this over a face lies on it.
pub(super) const FLAT_SLOPE: f64 = 0.15;
/// Slopes across an edge down to this are rounding's.
pub(super) const SLOPE_ROUNDING: f64 = 1e-6;
/// An overlap is deep if it is more than this, in radii of the smaller body.
pub(super) const DEEP_OVERLAP: f64 = 0.03;

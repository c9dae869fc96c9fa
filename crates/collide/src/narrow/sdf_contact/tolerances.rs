//! Tolerances shared by several searches.

/// Maximum length of the pieces of an edge against a body that is not convex, in radii of the
/// smaller body.
pub(super) const MAX_PIECE: f64 = 0.03;
/// Largest slope that is treated as zero.
pub(super) const LEVEL_SLOPE: f64 = 1e-7;
/// Slope over a face below which an edge lies on it.
pub(super) const FLAT_SLOPE: f64 = 0.15;
/// Largest slope across an edge that is due to rounding.
pub(super) const SLOPE_ROUNDING: f64 = 1e-6;
/// Depth above which an overlap is deep, in radii of the smaller body.
pub(super) const DEEP_OVERLAP: f64 = 0.03;

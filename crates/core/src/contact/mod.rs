//! Contact detection: broad phase, filters and narrow phase for pairs of parts, and the constants
//! of the pairs.

mod coplanar;
mod curvature;
pub(crate) mod detect;
mod internal_edges;
pub(crate) mod laws;
pub(crate) mod motion;
pub(crate) mod own_tests;
pub(crate) mod pair;
pub(crate) mod pair_material;
mod separation;
pub(crate) mod surfaces;
pub(crate) mod time_of_impact;
pub(crate) mod warm_starts;
pub(crate) mod wrench;

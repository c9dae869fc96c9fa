//! Articulated bodies in reduced coordinates (thesis §III.B, [RBDA]).

mod joint;
mod model;

pub use joint::Joint;
pub use model::{Frame, Link, LinkMass, MOST_LINKS, Model, ModelBuilder, ModelError};

//! Articulated bodies in reduced coordinates (thesis §III.B, [RBDA]).

mod abm;
mod compiled;
mod dynamics;
mod factor;
mod joint;
mod model;
mod whiten;

pub use dynamics::{Dynamics, Scratch, forward_dynamics};
pub use joint::Joint;
pub use model::{Frame, Link, LinkMass, MOST_LINKS, Model, ModelBuilder, ModelError};

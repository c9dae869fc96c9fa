//! Articulated bodies in reduced coordinates (thesis §III.B, [RBDA]).

mod abm;
mod batch;
mod compiled;
mod dynamics;
mod factor;
mod joint;
mod lanes;
mod model;
mod whiten;

pub use batch::BatchDynamics;
pub use dynamics::{Dynamics, Scratch, forward_dynamics};
pub use joint::Joint;
pub use lanes::Lanes;
pub use model::{Frame, Link, LinkMass, MOST_LINKS, Model, ModelBuilder, ModelError};

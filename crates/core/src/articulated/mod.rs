//! Articulated bodies in reduced coordinates (thesis §III.B, [RBDA]).

mod coordinates;
mod crba;
mod energy;
mod jacobian;
mod joint;
mod kinematics;
mod model;
mod rnea;

pub use coordinates::{difference, integrate, normalize};
pub use crba::MassMatrix;
pub use energy::{center_of_mass, energy, momentum};
pub use jacobian::{link_jacobian, point_jacobian};
pub use joint::Joint;
pub use kinematics::{Kinematics, LinkMotion, Rates};
pub use model::{Frame, Link, LinkMass, MOST_LINKS, Model, ModelBuilder, ModelError};
pub use rnea::{InverseDynamics, inverse_dynamics};

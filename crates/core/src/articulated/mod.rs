//! Articulated bodies in reduced coordinates (thesis §III.B, [RBDA]).

mod abm;
mod batch;
mod body;
mod coast;
mod compiled;
mod coordinates;
mod crba;
mod drives;
mod dynamics;
mod energy;
mod factor;
mod freedom;
mod jacobian;
mod joint;
mod kinematics;
mod lanes;
mod model;
mod object;
mod playback;
mod rnea;
mod sines;
mod whiten;

pub use batch::BatchDynamics;
pub use body::{ArticulatedBody, ArticulatedError, Collider};
pub use coordinates::{difference, integrate, normalize};
pub use crba::MassMatrix;
pub use dynamics::{Dynamics, Scratch, forward_dynamics};
pub use energy::{center_of_mass, energy, momentum};
pub use freedom::{Coupling, Drive, Freedom, Spring};
pub use jacobian::{link_jacobian, point_jacobian};
pub use joint::Joint;
pub use kinematics::{Kinematics, LinkMotion, Rates};
pub use lanes::Lanes;
pub use model::{Frame, Link, LinkMass, MOST_LINKS, Model, ModelBuilder, ModelError};
pub use playback::{Playback, PlaybackError};
pub use rnea::{InverseDynamics, inverse_dynamics};

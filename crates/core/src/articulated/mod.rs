//! Articulated bodies in reduced coordinates (thesis §III.B, RBDA).

mod algorithms;
mod body;
mod builder;
mod builder_error;
mod collider;
mod joint_rows;
mod link_builder;
mod model;
mod object;
mod parts;
mod shapes;
mod simd;
mod swing;
mod turning;

pub use algorithms::crba::MassMatrix;
pub use algorithms::derivatives::{
    ForwardDynamicsDerivatives, InverseDynamicsDerivatives, forward_dynamics_derivatives, inverse_dynamics_derivatives,
};
pub use algorithms::dynamics::{Dynamics, Scratch, forward_dynamics};
pub use algorithms::energy::{center_of_mass, energy, momentum};
pub use algorithms::jacobian::{link_jacobian, point_jacobian};
pub use algorithms::kinematics::{Kinematics, LinkMotion, Rates};
pub use algorithms::rnea::{InverseDynamics, inverse_dynamics};
pub use algorithms::singular::SingularJoint;
pub use body::{ArticulatedBody, ArticulatedError};
pub use builder::ArticulationBuilder;
pub use builder_error::ArticulationError;
pub use collider::Collider;
pub use link_builder::LinkBuilder;
pub use model::coordinates::{difference, integrate, normalize};
pub(crate) use model::dof::twist_fault;
pub use model::dof::{Coupling, DofSettings, Drive, Spring};
pub use model::joint::Joint;
pub use model::playback::{Playback, PlaybackError};
pub use model::{Link, LinkFrame, LinkMass, MAX_LINKS, Model, ModelBuilder, ModelError};
pub(crate) use parts::ArticulatedParts;
pub use simd::batch::BatchDynamics;
pub use simd::lanes::Lanes;

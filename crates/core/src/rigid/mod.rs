//! The rigid body (thesis §III.A): state `X = [x, q, P, H]`.
//!
//! | numbers | meaning |
//! |---|---|
//! | 0–2 | position of the center of mass `x`, meters |
//! | 3–6 | orientation `q` as `x, y, z, w` |
//! | 7–9 | linear momentum `P`, N·s |
//! | 10–12 | angular momentum `H` about the center of mass, world axes, N·m·s |
//!
//! Generalized velocity `v = [ω; v]`, world axes at the center of mass; mass matrix
//! `M = diag(R·I·Rᵀ, m·1)`. Its root is `diag(I^½·Rᵀ, √m·1)`, with `I^½` the symmetric root of the
//! body inertia.
//!
//! The frame of the part has its origin at the center of mass of the uniform shape (thesis
//! §III.A.1) and the axes of the body. A center of mass of the body's own
//! ([`RigidBody::with_center_of_mass`]) is a point of that frame: the part state is then that of the
//! shape's center, and forces and impulses at it act with the lever arm. The *frame of the body*, in which users place it, is that of its shape: a mesh keeps the
//! frame of its file, and [`RigidBody::center_of_mass`] is a point of it. State, velocities and
//! parts refer to the center of mass; [`World::pose`](crate::World::pose),
//! [`World::set_pose`](crate::World::set_pose) and [`RigidBody::with_pose`] convert.

mod body;
mod error;
mod inertia;
mod locked;
mod object;
pub(crate) mod rotation;
mod state;
mod turning;

pub use body::RigidBody;
pub(crate) use body::check_shape_name;
pub use error::BodyError;
pub use locked::LockedAxes;
pub(crate) use state::{orientation, vec3};
pub(crate) use turning::resisting;

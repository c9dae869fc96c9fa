//! New kinds of objects and a stepper for tumble, made in a crate of their own by the public
//! interface alone.
//!
//! | object | integrates | collides | constrains | acts |
//! |---|---|---|---|---|
//! | [`Particle`] | 3 degrees of freedom, state `[x, v]` | a sphere that never rotates | | |
//! | [`Bead`] | 1 degree of freedom on a cycloid, state `[φ, p]`, inertia depends on the angle | a sphere | itself: a stop on the wire | |
//! | [`Rod`] | | | two objects, or one and a point: fixed distance, or a rope | |
//! | [`Lookout`] | as a particle | | | carries a camera and a lamp |
//! | [`Torus`] | as a rigid body | by an intersection test of its own | | |
//! | [`Wind`] | | | | drag on the listed objects |
//!
//! [`Graded`] is a stepper.

mod bead;
mod graded;
mod lookout;
mod particle;
mod rod;
mod torus;
mod wind;

pub use bead::Bead;
pub use graded::Graded;
pub use lookout::Lookout;
pub use particle::Particle;
pub use rod::{End, Rod};
pub use torus::Torus;
pub use wind::Wind;

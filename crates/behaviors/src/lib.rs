//! Behaviors on the public interfaces of tumble-core (thesis §V.B.5).
//!
//! Nothing here needs a change of a stepper or a solver. [`non_spinning()`] is a constructor: the
//! locked axes of a rigid body already are this behavior. [`Boid`] is an object with a state of its
//! own. [`Flock`] is a force on its boids, computed by [`Steering`].
//!
//! ```
//! use tumble_behaviors::{Boid, Flock, Steering};
//! use tumble_core::prelude::*;
//! let mut world = World::default();
//! let flock = world.add(Flock::new("flock", Steering::default())?)?;
//! for k in 0..20 {
//!     let boid = Boid::new(Shape::sphere(0.2)?, 1.0)?;
//!     Flock::add(&mut world, flock, boid.with_position(Vec3::new(2.0 * k as f64, 0.0, 0.0)))?;
//! }
//! world.step()?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod boid;
mod crowd;
mod dart;
mod error;
mod fields;
mod flock;
mod grid;
mod helm;
mod kept;
mod non_spinning;
mod particles;
mod record;
mod registers;
mod sight;
mod springs;
mod steering;

pub use boid::Boid;
pub use error::BehaviorError;
pub use fields::{
    Attractor, Buoyancy, DragLaw, Explosion, Panel, Panels, Submerged, Targets, Wind, silhouette, submerged,
};
pub use flock::Flock;
pub use helm::{BodyFlock, Helm};
pub use non_spinning::non_spinning;
pub use particles::{Emitter, Particle, ParticleLook, ParticleSettings, ParticleSystem};
pub use record::{read_object, serialize_record};
pub use springs::{Cloth, Grid, Jelly, MeshSpring, Origin, SpringMesh};
pub use steering::{Flyer, Search, Steering};

/// The tutorial, whose programs run as tests.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/new_behavior.md")]
struct Tutorial;

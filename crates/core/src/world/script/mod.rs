//! Scripted events: what happens in a world at a time, at a contact, in a sensor, when a joint breaks or
//! a key is pressed, and what is done then (the scripted events of the thesis, §I and §II.C).
//!
//! A [`ScriptedEvent`] is an object of the world with a [`Trigger`] and [`Action`]s. Its numbers (how
//! often it fired, when, and for which body) are a part of the state `X`, so snapshots, forks and
//! roll-backs have them. An action never adds or removes an object: a [`Template`] brings its bodies
//! along, disabled, and spawning enables one of them. Therefore a snapshot from before a spawn fits the
//! world after it.
//!
//! Events fire at the end of a frame: all triggers are looked at first, then the actions run in the order
//! in which the events were added. What an event does over time (paths, forces, targets of drives, joints
//! that hold bodies where they met) follows from the state alone, at the start of each frame
//! (`guide.rs`).
//!
//! ```
//! # fn run() -> Result<(), Box<dyn std::error::Error>> {
//! use tumble_core::prelude::*;
//! use tumble_core::{Action, ScriptedEvent, Template, Trigger};
//! let mut world = World::default();
//! let ball = RigidBody::new(Shape::sphere(0.1)?).with_mass(1.0);
//! let balls = Template::add(&mut world, "ball", &ball, 5, false)?;
//! let drop = ScriptedEvent::new("drop", Trigger::Every { period: 0.5, first: 0.5 });
//! world.add(drop.with_action(Action::spawn(balls, Pose::translation(0.0, 0.0, 1.0), Vec3::zeros())))?;
//! while world.time() < 1.1 {
//!     world.step()?;
//! }
//! assert_eq!(Template::counts(&world, balls), Some([2, 0]));
//! # Ok(())
//! # }
//! # run().unwrap();
//! ```

mod action;
mod call;
mod check;
mod event;
mod fire;
mod guide;
mod looks;
mod perform;
mod spline;
mod template;
mod trigger;

pub use action::{Action, CameraChange, LightChange, Subject};
pub use call::Firing;
pub use check::EventError;
pub use event::ScriptedEvent;
pub use looks::Looks;
pub use spline::{Ends, Keyframe, Smoothness, Spline, SplineError, SplinePoint};
pub use template::{MAX_SPAWNED, Template};
pub use trigger::{MAX_KEY_BYTES, Trigger};

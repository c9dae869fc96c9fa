//! The names that most programs need.
//!
//! ```
//! use tumble_core::prelude::*;
//! let mut world = World::default();
//! world.step()?;
//! # Ok::<(), StepError>(())
//! ```

pub use crate::{
    ArticulatedBody, BodyView, Collider, ContactPoint, Joint, LinkMass, LoopJoint, Material, Mode, ModelBuilder,
    Object, ObjectId, RigidBody, Settings, StepError, StepReport, World, WorldError,
};
pub use tumble_collide::{CompoundPart, Mat3, Pose, Quat, Shape, TreeSettings, TriMesh, Vec3};

//! Dynamics for tumble: the traits, rigid and articulated bodies, contact rows, solvers,
//! integrators, steppers and the world.
//!
//! A step reads the state, accumulates forces, finds contacts, turns test impulses into rows,
//! solves all rows together and writes the state. Equal inputs give equal bits: this crate reads
//! no file and no clock, starts no thread and uses no GPU. `docs/references.md` lists the thesis,
//! RBDA and all other sources that the modules cite.
//!
//! SI units, radians, z up; sizes of shapes are full lengths. `docs/conventions.md` has these and
//! the other conventions beside those of Python and of scene files.
//!
//! ```
//! use tumble_core::prelude::*;
//! let mut world = World::default();
//! world.add(RigidBody::fixed(Shape::half_space()))?;
//! let ball = RigidBody::new(Shape::sphere(0.1)?).with_name("ball").with_mass(2.0);
//! let ball = world.add(ball.with_pose(Pose::translation(0.0, 0.0, 1.0)))?;
//! for _ in 0..240 {
//!     world.step()?;
//! }
//! assert!((world.body(ball)?.position().z - 0.1).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(test, allow(clippy::disallowed_methods))]

pub mod archive;
pub mod articulated;
mod clone_by_field;
mod constraint;
mod contact;
mod derived;
mod each_object;
mod force;
mod integrators;
pub mod linearize;
mod object;
pub mod prelude;
mod report;
mod rigid;
mod rotation_vector;
mod sensor;
mod settings;
pub mod solver;
pub mod spatial;
mod step;
mod threads;
mod titled;
mod world;

pub use archive::ArchiveError;
pub use articulated::{
    ArticulatedBody, ArticulatedError, ArticulationBuilder, ArticulationError, Collider, Coupling, DofSettings, Drive,
    Joint, LinkBuilder, LinkMass, Model, ModelBuilder, ModelError, Playback, Spring,
};
pub use constraint::builder::RowBuilder;
pub use constraint::loop_joint::{
    Anchor, JointForce, JointPlace, LoopJoint, LoopJointError, LoopJointKind, PositionError, Transmission,
};
pub use constraint::mimic::{JointRef, Mimic, MimicError};
pub use constraint::rows;
pub use contact::pair_material::{PairMaterial, PairSide};
pub use derived::Cache;
pub use linearize::{LinearizeError, LinearizedStep, Switch, Switching};
pub use object::collidable::{CollisionGroup, ContactFrame};
pub use object::frame_state::{Frame, FrameImpulse};
pub use object::intersect::IntersectPart;
pub use object::mesh_key::MeshKey;
pub use object::mounts::{CameraMount, Detail, LightMount, Spread};
pub use object::part_state::{ForceSlice, Forces, PartPoint, PartState, PointLoad, StateRange, StateSizes, Wrench};
pub use object::visual::{Drawn, Visual, VisualGeometry, VisualMesh};
pub use object::{
    Appearance, CameraCarrier, Cloud, CloudSphere, Collidable, Combine, Constraint, Energy, ForceGenerator, Fork,
    FrameState, Integratable, Intersect, Level, LightCarrier, Material, Momentum, MomentumKind, NetSync, Object,
    PartSurface, Renderable, RowTarget, ShapeFilter, ShapeFilters, ShapeMaterials, SpringRow, SyncError, shape_meeting,
};
pub use report::{StepReport, UnreachableJoint, WorstSolve};
pub use rigid::{BodyError, LockedAxes, RigidBody};
pub use sensor::{
    MAX_DELAY, MAX_DELAYED_PIXELS, Optics, Sensor, SensorError, SensorImage, SensorKind, SensorNoise, SensorPlace,
};
pub use settings::{Integrator, Settings, SettingsError};
pub use step::{Backtracking, STEPPERS, StepContext, Stepper, TimeStepping, stepper_by_name};
pub use tumble_collide as collide;
pub use world::script::{
    Action, CameraChange, Ends, EventError, Firing, Keyframe, LightChange, Looks, MAX_KEY_BYTES, MAX_SPAWNED,
    ScriptedEvent, Smoothness, Spline, SplineError, SplinePoint, Subject, Template, Trigger,
};
pub use world::sleep::Sleep;
pub use world::view::{Mode, ObjectId, Status, WorldView};
pub use world::{
    BodyDistance, BodyView, ContactPoint, Event, EventKind, Overlap, PickForce, PointDepth, QueryFilter, Ray,
    RayCastHit, Replica, ReplicaError, ShapeCastHit, ShapeOverlap, SnapshotError, StateMemory, StateMemoryHold,
    StepError, TouchingPair, WorkingMemory, World, WorldError, WorldState,
};

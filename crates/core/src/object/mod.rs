//! Objects: the traits of the thesis (§IV.A).
//!
//! A new kind of object is a type of any crate that implements [`Object`] and some of the other
//! traits. All numbers that change with time are in the world's flat state `X`. An object is a
//! model that reads its own range of it, so that saving, forking and the stages of integrators copy
//! a slice.

mod appearance;
mod by_jacobian;
pub(crate) mod collidable;
mod conserved;
mod constraint;
mod deforming;
mod force;
pub(crate) mod frame_state;
mod integratable;
pub(crate) mod intersect;
mod material;
pub(crate) mod mesh_key;
pub(crate) mod mounts;
pub(crate) mod net_sync;
pub(crate) mod part_state;
mod shape_filters;
mod shape_materials;
pub(crate) mod visual;

pub use appearance::Appearance;
pub use collidable::Collidable;
pub use conserved::{Energy, Momentum};
pub use constraint::{Constraint, Level, RowTarget, SpringRow};
pub use deforming::{Cloud, CloudSphere, PartSurface};
pub use force::ForceGenerator;
pub use frame_state::FrameState;
pub use integratable::{Integratable, MomentumKind};
pub use intersect::Intersect;
pub use material::{Combine, Material};
pub use mounts::{CameraCarrier, LightCarrier};
pub use net_sync::{NetSync, SyncError};
pub(crate) use shape_filters::{FilterClass, FilteredPart, ShapeClass, has_sensor};
pub use shape_filters::{ShapeFilter, ShapeFilters, shape_meeting};
pub use shape_materials::ShapeMaterials;
pub use visual::Renderable;

use crate::archive::{ObjectIndices, ObjectRecord};
use crate::derived::Cache;
use crate::world::view::ObjectId;
use part_state::PartState;
use std::any::Any;

/// Anything in a world. Nine accessors return its other traits; all are `None` by default (the
/// thesis's `ImplementsInterface`, §IV.B.1).
pub trait Object: Fork + Any + Send + Sync {
    /// Returns the name that the object is to have in a world, of any length. By default it is
    /// empty, and the world makes one: [`World::name`](crate::World::name) returns the name in the
    /// world.
    fn name(&self) -> &str {
        ""
    }
    /// Makes the cache for [`refresh`](Self::refresh) and for all calls with a cache; empty by
    /// default.
    fn new_cache(&self) -> Cache {
        Cache::default()
    }
    /// Writes the cache and the poses and velocities of the parts from the object's range `x` of
    /// the state, and depends on nothing else (thesis `UpdateState`).
    /// [`Integratable::accelerations`] writes the accelerations.
    fn refresh(&self, x: &[f64], cache: &mut Cache, part_states: &mut [PartState]) {
        let _ = (x, cache, part_states);
    }
    /// Returns the interface of an object with a state that the integrator advances.
    fn integratable(&self) -> Option<&dyn Integratable> {
        None
    }
    /// Returns the interface of an object with parts that collide.
    fn collidable(&self) -> Option<&dyn Collidable> {
        None
    }
    /// Returns the interface of an object that constrains itself or others.
    fn constraint(&self) -> Option<&dyn Constraint> {
        None
    }
    /// Returns the interface of an object that applies forces to others; it need not have a state
    /// (thesis §IV.B.2: "live").
    fn force(&self) -> Option<&dyn ForceGenerator> {
        None
    }
    /// Returns the interface of an object with a state that the world advances once per frame.
    fn frame_state(&self) -> Option<&dyn FrameState> {
        None
    }
    /// Returns the interface of an object that can be drawn.
    fn renderable(&self) -> Option<&dyn Renderable> {
        None
    }
    /// Returns the interface of an object that carries cameras.
    fn camera(&self) -> Option<&dyn CameraCarrier> {
        None
    }
    /// Returns the interface of an object that carries lights.
    fn light(&self) -> Option<&dyn LightCarrier> {
        None
    }
    /// Returns whether it has no meaning without another object, as a joint without a body that it joins or a sensor
    /// without the body that carries it. [`World::remove`](crate::World::remove) removes it with that object. False by default.
    fn attached_to(&self, other: ObjectId) -> bool {
        let _ = other;
        false
    }
    /// Returns its constants for an archive, with other objects by index; `None`, the default, for an object that the caller
    /// of [`World::archive`](crate::World::archive) writes itself.
    fn record(&self, indices: &ObjectIndices) -> Option<ObjectRecord> {
        let _ = indices;
        None
    }
    /// Returns the interface of an object that is synchronized with copies of itself in other
    /// processes.
    fn net_sync(&self) -> Option<&dyn NetSync> {
        None
    }
}

/// Makes an independent copy of an object. Every object that is [`Clone`] has it.
pub trait Fork {
    /// Returns the copy.
    fn fork(&self) -> Box<dyn Object>;
}

impl<T: Object + Clone> Fork for T {
    fn fork(&self) -> Box<dyn Object> {
        Box::new(self.clone())
    }
}

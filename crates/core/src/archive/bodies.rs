//! Rigid and articulated bodies as data. What their constructors compute (roots of inertias, whitening, caches) is computed anew.

use super::records::{Known, Tables, VisualRecord, shape};
use super::{ArchiveError, damaged};
use crate::articulated::{ArticulatedParts, Collider};
use crate::collidable::{CollisionKind, Material};
use crate::mounts::{CameraCarrier, CameraMount, LightCarrier, LightMount};
use crate::object::{Object, Renderable};
use crate::{ArticulatedBody, Coupling, Freedom, Model, RigidBody};
use serde::{Deserialize, Serialize};
use tumble_collide::{ContactMode, Mat3, Pose, Vec3};

/// A rigid body.
#[derive(Serialize, Deserialize)]
pub(super) struct RigidRecord {
    name: String,
    shape: u32,
    /// Mass, kg, and inertia, kg·m²; `None` of a fixture.
    mass: Option<(f64, Mat3)>,
    material: Material,
    linear_damping: f64,
    angular_damping: f64,
    contact_mode: ContactMode,
    kind: CollisionKind,
    meets: u64,
    initial_pose: Pose,
    initial_velocity: [Vec3; 2],
    visuals: Vec<VisualRecord>,
    cameras: Vec<CameraMount>,
    lights: Vec<LightMount>,
}

impl RigidRecord {
    pub fn of(body: &RigidBody, tables: &mut Tables) -> RigidRecord {
        RigidRecord {
            name: body.name().into(),
            shape: tables.shapes.place(body.shape()),
            mass: (!body.is_fixture()).then(|| (body.mass(), *body.inertia())),
            material: body.material,
            linear_damping: body.linear_damping,
            angular_damping: body.angular_damping,
            contact_mode: body.contact_mode,
            kind: body.kind,
            meets: body.meets,
            initial_pose: body.initial_pose,
            initial_velocity: [body.initial_velocity, body.initial_angular_velocity],
            visuals: body.visuals().iter().map(|visual| VisualRecord::of(visual, tables)).collect(),
            cameras: body.cameras().to_vec(),
            lights: body.lights().to_vec(),
        }
    }

    pub fn body(self, known: &Known) -> Result<RigidBody, ArchiveError> {
        let shape = shape(&known.shapes, self.shape)?;
        let mut body = match self.mass {
            Some((mass, inertia)) => RigidBody::new(self.name, shape, mass, inertia).map_err(damaged)?,
            None => RigidBody::fixture(self.name, shape),
        };
        (body.material, body.contact_mode) = (self.material, self.contact_mode);
        (body.linear_damping, body.angular_damping) = (self.linear_damping, self.angular_damping);
        (body.kind, body.meets) = (self.kind, self.meets);
        let [velocity, angular_velocity] = self.initial_velocity;
        let visuals = self.visuals.into_iter().map(|v| v.visual(known)).collect::<Result<_, _>>()?;
        let body = body.at(self.initial_pose).moving(velocity, angular_velocity).drawn_as(visuals);
        Ok(body.carrying(self.cameras, self.lights))
    }
}

/// A shape on a link.
#[derive(Serialize, Deserialize)]
struct ColliderRecord {
    link: Option<usize>,
    pose: Pose,
    shape: u32,
    material: Material,
    contact_mode: ContactMode,
    kind: CollisionKind,
    meets: u64,
}

impl ColliderRecord {
    fn of(link: Option<usize>, collider: &Collider, tables: &mut Tables) -> ColliderRecord {
        let Collider { pose, shape, material, contact_mode, kind, meets } = collider;
        ColliderRecord {
            link,
            pose: *pose,
            shape: tables.shapes.place(shape),
            material: *material,
            contact_mode: *contact_mode,
            kind: *kind,
            meets: *meets,
        }
    }

    fn collider(self, known: &Known) -> Result<(Option<usize>, Collider), ArchiveError> {
        let ColliderRecord { link, pose, shape: place, material, contact_mode, kind, meets } = self;
        Ok((link, Collider { pose, shape: shape(&known.shapes, place)?, material, contact_mode, kind, meets }))
    }
}

/// An articulated body.
#[derive(Serialize, Deserialize)]
pub(super) struct ArticulatedRecord {
    name: String,
    model: Model,
    base: Pose,
    colliders: Vec<ColliderRecord>,
    visuals: Vec<VisualRecord>,
    cameras: Vec<CameraMount>,
    lights: Vec<LightMount>,
    freedoms: Vec<Freedom>,
    couplings: Vec<Coupling>,
    self_collision: bool,
    apart: Vec<[Option<usize>; 2]>,
    start: Vec<f64>,
}

impl ArticulatedRecord {
    pub fn of(body: &ArticulatedBody, tables: &mut Tables) -> ArticulatedRecord {
        let parts = body.to_parts();
        ArticulatedRecord {
            name: body.name().into(),
            model: body.model().clone(),
            base: *body.base(),
            colliders: parts.colliders.iter().map(|(link, c)| ColliderRecord::of(*link, c, tables)).collect(),
            visuals: parts.visuals.iter().map(|visual| VisualRecord::of(visual, tables)).collect(),
            cameras: parts.cameras,
            lights: parts.lights,
            freedoms: body.freedoms().to_vec(),
            couplings: parts.couplings,
            self_collision: body.self_collision,
            apart: parts.apart,
            start: parts.start,
        }
    }

    pub fn body(self, known: &Known) -> Result<ArticulatedBody, ArchiveError> {
        if !self.model.is_sound() {
            return Err(damaged(format!("'{}' is no tree of links", self.name)));
        }
        let mut body = ArticulatedBody::new(self.name, self.model);
        for (index, freedom) in self.freedoms.into_iter().enumerate() {
            body.set_freedom(index, freedom).map_err(damaged)?;
        }
        body.self_collision = self.self_collision;
        let parts = ArticulatedParts {
            colliders: self.colliders.into_iter().map(|c| c.collider(known)).collect::<Result<_, _>>()?,
            visuals: self.visuals.into_iter().map(|v| v.visual(known)).collect::<Result<_, _>>()?,
            cameras: self.cameras,
            lights: self.lights,
            couplings: self.couplings,
            apart: self.apart,
            start: self.start,
        };
        body.with_parts(self.base, parts).map_err(damaged)
    }
}

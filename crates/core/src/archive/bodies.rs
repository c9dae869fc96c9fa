//! Rigid and articulated bodies as data. What their constructors compute (roots of inertias,
//! whitening, caches) is computed anew.

use super::records::{LoadedTables, Tables, VisualRecord, shape};
use super::{ArchiveError, damaged};
use crate::articulated::{ArticulatedParts, Collider};
use crate::object::collidable::CollisionGroup;
use crate::object::mounts::{CameraCarrier, CameraMount, LightCarrier, LightMount};
use crate::object::{Material, ShapeFilter, ShapeFilters, ShapeMaterials};
use crate::object::{Object, Renderable};
use crate::{ArticulatedBody, Coupling, DofSettings, LockedAxes, Model, RigidBody};
use serde::{Deserialize, Serialize};
use tumble_collide::{ContactMode, Mat3, Pose, Vec3};

/// A rigid body.
#[derive(Serialize, Deserialize)]
pub(super) struct RigidRecord {
    name: String,
    shape: u32,
    /// Mass, kg, and inertia, kg·m²; `None` for a fixed body.
    mass: Option<(f64, Mat3)>,
    material: Material,
    shape_materials: Vec<(usize, Material)>,
    shape_filters: Vec<(usize, ShapeFilter)>,
    shape_name: Option<String>,
    linear_damping: f64,
    angular_damping: f64,
    gravity_scale: f64,
    locked: LockedAxes,
    /// Center of mass in the frame of the part.
    center: Vec3,
    contact_mode: ContactMode,
    group: CollisionGroup,
    mask: u64,
    sensor: bool,
    one_way: Option<Vec3>,
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
            shape: tables.shapes.index(body.shape()),
            mass: (!body.is_fixed()).then(|| (body.mass(), *body.inertia())),
            material: body.material,
            shape_materials: body.shape_materials().to_vec(),
            shape_filters: body.shape_filters().to_vec(),
            shape_name: body.shape_name.clone(),
            linear_damping: body.linear_damping,
            angular_damping: body.angular_damping,
            gravity_scale: body.gravity_scale,
            locked: body.locked,
            center: body.center_in_part(),
            contact_mode: body.contact_mode,
            group: body.group,
            mask: body.mask,
            sensor: body.sensor,
            one_way: body.one_way,
            initial_pose: body.initial_pose,
            initial_velocity: [body.initial_velocity, body.initial_angular_velocity],
            visuals: body.visuals().iter().map(|visual| VisualRecord::of(visual, tables)).collect(),
            cameras: body.cameras().to_vec(),
            lights: body.lights().to_vec(),
        }
    }

    pub fn body(self, tables: &LoadedTables) -> Result<RigidBody, ArchiveError> {
        let shape = shape(&tables.shapes, self.shape)?;
        let body = match self.mass {
            Some((mass, inertia)) => RigidBody::fixed(shape).with_mass_and_inertia(mass, inertia),
            None => RigidBody::fixed(shape),
        };
        let mut body = body.with_center_in_part(self.center);
        for (shape, material) in self.shape_materials {
            body.set_shape_material(shape, Some(material));
        }
        for (shape, filter) in self.shape_filters {
            body.set_shape_filter(shape, Some(filter));
        }
        body.shape_name = self.shape_name;
        (body.material, body.contact_mode) = (self.material, self.contact_mode);
        (body.linear_damping, body.angular_damping) = (self.linear_damping, self.angular_damping);
        (body.gravity_scale, body.locked) = (self.gravity_scale, self.locked);
        (body.group, body.mask, body.sensor) = (self.group, self.mask, self.sensor);
        body.one_way = self.one_way;
        let [velocity, angular_velocity] = self.initial_velocity;
        let visuals = self.visuals.into_iter().map(|v| v.visual(tables)).collect::<Result<_, _>>()?;
        let body = body
            .with_name(self.name)
            .with_pose(self.initial_pose)
            .with_velocity(velocity)
            .with_angular_velocity(angular_velocity)
            .with_visuals(visuals);
        Ok(body.carrying(self.cameras, self.lights))
    }
}

/// A shape on a link.
#[derive(Serialize, Deserialize)]
struct ColliderRecord {
    /// Index in the frames of the model.
    link: usize,
    pose: Pose,
    shape: u32,
    material: Material,
    contact_mode: ContactMode,
    group: CollisionGroup,
    mask: u64,
    name: Option<String>,
    shape_materials: ShapeMaterials,
    shape_filters: ShapeFilters,
    one_way: Option<Vec3>,
    sensor: bool,
}

impl ColliderRecord {
    fn of(link: usize, collider: &Collider, tables: &mut Tables) -> ColliderRecord {
        let Collider {
            pose,
            shape,
            material,
            contact_mode,
            group,
            mask,
            name,
            shape_materials,
            shape_filters,
            one_way,
            sensor,
        } = collider;
        ColliderRecord {
            link,
            pose: *pose,
            shape: tables.shapes.index(shape),
            material: *material,
            contact_mode: *contact_mode,
            group: *group,
            mask: *mask,
            name: name.clone(),
            shape_materials: shape_materials.clone(),
            shape_filters: shape_filters.clone(),
            one_way: *one_way,
            sensor: *sensor,
        }
    }

    fn collider(self, tables: &LoadedTables) -> Result<(usize, Collider), ArchiveError> {
        let ColliderRecord {
            link,
            pose,
            shape: index,
            material,
            contact_mode,
            group,
            mask,
            name,
            shape_materials,
            shape_filters,
            one_way,
            sensor,
        } = self;
        let shape = shape(&tables.shapes, index)?;
        Ok((
            link,
            Collider {
                pose,
                shape,
                material,
                contact_mode,
                group,
                mask,
                name,
                shape_materials,
                shape_filters,
                one_way,
                sensor,
            },
        ))
    }
}

/// An articulated body.
#[derive(Serialize, Deserialize)]
pub(super) struct ArticulatedRecord {
    name: String,
    model: Model,
    base: Pose,
    colliders: Vec<ColliderRecord>,
    /// Each with its link, an index in the frames of the model.
    visuals: Vec<(usize, VisualRecord)>,
    cameras: Vec<CameraMount>,
    lights: Vec<LightMount>,
    dofs: Vec<DofSettings>,
    couplings: Vec<Coupling>,
    self_collision: bool,
    excluded_pairs: Vec<[Option<usize>; 2]>,
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
            visuals: parts.visuals.iter().map(|(link, visual)| (*link, VisualRecord::of(visual, tables))).collect(),
            cameras: parts.cameras,
            lights: parts.lights,
            dofs: body.dofs().to_vec(),
            couplings: parts.couplings,
            self_collision: body.self_collision,
            excluded_pairs: parts.excluded_pairs,
            start: parts.start,
        }
    }

    pub fn body(self, tables: &LoadedTables) -> Result<ArticulatedBody, ArchiveError> {
        if !self.model.is_sound() {
            return Err(damaged(format!("'{}' is no tree of links", self.name)));
        }
        let mut body = ArticulatedBody::new(self.name, self.model);
        for (index, dof) in self.dofs.into_iter().enumerate() {
            body.set_dof(index, dof).map_err(damaged)?;
        }
        body.self_collision = self.self_collision;
        let parts = ArticulatedParts {
            colliders: self.colliders.into_iter().map(|c| c.collider(tables)).collect::<Result<_, _>>()?,
            visuals: self
                .visuals
                .into_iter()
                .map(|(link, v)| Ok((link, v.visual(tables)?)))
                .collect::<Result<_, ArchiveError>>()?,
            cameras: self.cameras,
            lights: self.lights,
            couplings: self.couplings,
            excluded_pairs: self.excluded_pairs,
            start: self.start,
        };
        body.with_parts(self.base, parts).map_err(damaged)
    }
}

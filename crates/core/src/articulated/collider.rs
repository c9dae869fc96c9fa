//! Shapes on links.

use crate::object::collidable::CollisionGroup;
use crate::object::{Intersect, Material, ShapeFilter, ShapeFilters, ShapeMaterials};
use std::sync::Arc;
use tumble_collide::{ContactMode, Pose, Shape, Vec3};

/// A shape on a link.
#[derive(Clone, Debug)]
pub struct Collider {
    /// Pose of the shape in the frame of its link; for a mesh, the pose of its file's frame.
    /// [`add_collider`](super::ArticulatedBody::add_collider) replaces it by the pose of the part's frame
    /// in the frame of the moving link; for a mesh that frame is at the center of mass.
    pub pose: Pose,
    /// Geometry.
    pub shape: Shape,
    /// Surface constants.
    pub material: Material,
    /// How a mesh or cylinder collides.
    pub contact_mode: ContactMode,
    /// Collision group of the part.
    pub group: CollisionGroup,
    /// Groups that the part collides with, one bit each.
    pub mask: u64,
    /// Name of a shape that is no compound; parts of a compound have [their own](tumble_collide::CompoundPart::name).
    pub name: Option<String>,
    /// Surface constants of those parts of a compound that have their own.
    pub shape_materials: ShapeMaterials,
    /// Filters of those parts of a compound that have their own.
    pub shape_filters: ShapeFilters,
    /// Direction, of any length above 0, in the frame of the shape, of a collider that collides on one side only, as a
    /// [one-sided body](crate::RigidBody::with_one_way) does; `None` for all others.
    pub one_way: Option<Vec3>,
    /// Whether it is a sensor, as a [body](crate::RigidBody::with_sensor) may be: it has no contacts, and the world reports the
    /// parts of other objects that overlap it.
    pub sensor: bool,
}

impl Collider {
    /// Makes a collider with the default material that collides with every group.
    pub fn new(shape: Shape, pose: Pose) -> Collider {
        Collider {
            pose,
            shape,
            material: Material::default(),
            contact_mode: ContactMode::default(),
            group: CollisionGroup::default(),
            mask: u64::MAX,
            name: None,
            shape_materials: ShapeMaterials::default(),
            shape_filters: ShapeFilters::default(),
            one_way: None,
            sensor: false,
        }
    }

    /// Sets the name, by which contacts, hits and events report the shape.
    #[must_use]
    pub fn with_name(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// Sets the constants of its surface.
    #[must_use]
    pub fn with_material(mut self, material: Material) -> Self {
        self.material = material;
        self
    }

    /// Sets the constants of the surface of one part of its compound.
    #[must_use]
    pub fn with_shape_material(mut self, shape: usize, material: Material) -> Self {
        self.shape_materials.set(shape, Some(material));
        self
    }

    /// Sets what one part of its compound collides with, and whether it is a sensor.
    #[must_use]
    pub fn with_shape_filter(mut self, shape: usize, filter: ShapeFilter) -> Self {
        self.shape_filters.set(shape, Some(filter));
        self
    }

    /// Sets its collision group and the groups that it collides with, one bit each.
    #[must_use]
    pub fn with_groups(mut self, group: CollisionGroup, mask: u64) -> Self {
        (self.group, self.mask) = (group, mask);
        self
    }

    /// Sets how its mesh or cylinder collides.
    #[must_use]
    pub fn with_contact_mode(mut self, mode: ContactMode) -> Self {
        self.contact_mode = mode;
        self
    }

    /// Makes it a sensor: it has no contacts, and the world reports the bodies that overlap it
    /// ([`World::events`](crate::World::events), [`World::touching`](crate::World::touching)).
    #[must_use]
    pub fn with_sensor(mut self, sensor: bool) -> Self {
        self.sensor = sensor;
        self
    }

    /// Makes it collide on one side only: with what comes against `direction` (any length above 0, the frame of the
    /// shape).
    #[must_use]
    pub fn with_one_way(mut self, direction: Vec3) -> Self {
        self.one_way = Some(direction);
        self
    }
}

/// A collider with its link.
#[derive(Clone)]
pub(super) struct LinkCollider {
    /// An intersection test of its own.
    pub intersect: Option<Arc<dyn Intersect>>,
    /// Moving link; `None` for the base.
    pub link: Option<usize>,
    /// Index in [`Model::frames`](super::Model::frames) of the link that it was added to.
    pub frame: usize,
    /// The collider, with its pose in the frame of the link or base.
    pub collider: Collider,
}

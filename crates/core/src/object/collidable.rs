//! The trait of objects with parts that collide: shapes, materials and filters (thesis §IV.A.3).

use super::{Intersect, Material, ShapeFilter};
use tumble_collide::{ContactMode, Shape, Vec3};

/// Collision group of a part, 0 to 63 (thesis `CollisionObjectType`). Pairs are filtered by group.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub struct CollisionGroup(u8);

impl CollisionGroup {
    /// Returns group number `n`; `None` above 63.
    pub const fn new(n: u8) -> Option<CollisionGroup> {
        if n < 64 { Some(CollisionGroup(n)) } else { None }
    }

    /// Returns the group as one bit of a mask.
    pub const fn bit(self) -> u64 {
        1 << self.0
    }
}

/// Frame of a contact: a world point and orthonormal axes, normal first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactFrame {
    /// World point, meters.
    pub point: Vec3,
    /// Normal and two tangents, unit, right-handed.
    pub axes: [Vec3; 3],
}

impl ContactFrame {
    /// Makes a frame whose tangents are a fixed function of the normal.
    pub fn new(point: Vec3, normal: Vec3) -> ContactFrame {
        let smallest = normal.iamin();
        let first = normal.cross(&Vec3::ith(smallest, 1.0)).normalize();
        ContactFrame { point, axes: [normal, first, normal.cross(&first)] }
    }
}

/// An object with parts that collide.
pub trait Collidable {
    /// Returns the number of parts; 1 by default. Each has a row in the table of part states, so an
    /// object with a state returns its [`StateSizes::parts`](super::part_state::StateSizes::parts).
    fn parts(&self) -> usize {
        1
    }
    /// Returns the shape of a part, in the part's frame; `None` for a part that never collides: one
    /// for forces, joints or visuals.
    fn shape(&self, part: usize) -> Option<&Shape>;
    /// Returns the intersection test of a part's own; `None` for contacts of its shape.
    fn intersect(&self, part: usize) -> Option<&dyn Intersect> {
        let _ = part;
        None
    }
    /// Returns the direction, unit, in the frame of the part, of a part that collides on one side only: with what
    /// comes against this direction, as an open terrain and a one-way platform. None by default.
    fn one_way(&self, part: usize) -> Option<Vec3> {
        let _ = part;
        None
    }
    /// Returns the surface constants of a part.
    fn material(&self, part: usize) -> Material {
        let _ = part;
        Material::default()
    }
    /// Returns the surface constants of single shapes of a part, for those that have their own: the
    /// index of a compound's part with its constants, ascending. None by default.
    fn shape_materials(&self, part: usize) -> &[(usize, Material)] {
        let _ = part;
        &[]
    }
    /// Returns what single shapes of a part collide with, for those that have a filter of their own: the index of a compound's
    /// part with its filter, ascending. The others have that of the part. None by default.
    fn shape_filters(&self, part: usize) -> &[(usize, ShapeFilter)] {
        let _ = part;
        &[]
    }
    /// Returns the name of a part: that of the link whose shape it is, as its user named the link. None by default.
    fn part_name(&self, part: usize) -> Option<&str> {
        let _ = part;
        None
    }
    /// Returns the name of a shape of a part, which contacts report by its index: a compound's part, or 0. None by
    /// default, except for parts of a compound with names.
    fn shape_name(&self, part: usize, shape: usize) -> Option<&str> {
        self.shape(part)?.part_name(shape)
    }
    /// Returns the collision group of a part.
    fn collision_group(&self, part: usize) -> CollisionGroup {
        let _ = part;
        CollisionGroup::default()
    }
    /// Returns whether a part collides with parts of group `other`. Two parts collide if this is
    /// true for both.
    fn collides_with(&self, part: usize, other: CollisionGroup) -> bool {
        let _ = (part, other);
        true
    }
    /// Returns whether a part is a sensor: it has no contacts, and the world reports the parts of
    /// other objects that overlap it ([`World::events`](crate::World::events)).
    fn is_sensor(&self, part: usize) -> bool {
        let _ = part;
        false
    }
    /// Returns how a part's mesh or cylinder collides. A pair collides by spheres if either part
    /// does.
    fn contact_mode(&self, part: usize) -> ContactMode {
        let _ = part;
        ContactMode::Surface
    }
    /// Returns whether impulses can move a part; false for a part of a moving object that is fixed
    /// to the world.
    fn part_moves(&self, part: usize) -> bool {
        let _ = part;
        true
    }
    /// Returns the part with which a part moves as one: the same for all parts of a link. Their surfaces are one surface
    /// to others, without edges between them. The part itself by default.
    fn carrier(&self, part: usize) -> usize {
        part
    }
    /// Returns whether two parts of this same object collide.
    fn parts_collide(&self, part_a: usize, part_b: usize) -> bool {
        let _ = (part_a, part_b);
        false
    }
}

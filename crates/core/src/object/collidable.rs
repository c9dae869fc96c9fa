//! The trait of objects with parts that collide: shapes, materials, filters, and the test impulse (thesis §IV.A.3).

use super::part_state::PartState;
use super::{Integratable, Material};
use crate::derived::Cache;
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
    /// Returns the number of parts; each has a row in the table of part states.
    fn parts(&self) -> usize;
    /// Returns the shape of a part, in the part's frame; `None` for a part that never collides: one for forces, joints or visuals.
    fn shape(&self, part: usize) -> Option<&Shape>;
    /// Returns the surface constants of a part.
    fn material(&self, part: usize) -> Material;
    /// Returns the collision group of a part.
    fn collision_group(&self, part: usize) -> CollisionGroup;
    /// Returns whether a part collides with parts of group `other`. Two parts collide if this is true for both.
    fn collides_with(&self, part: usize, other: CollisionGroup) -> bool;
    /// Returns how a part's mesh or cylinder collides. A pair collides by spheres if either part does.
    fn contact_mode(&self, part: usize) -> ContactMode {
        let _ = part;
        ContactMode::Surface
    }
    /// Returns whether impulses can move a part; false for a part of a moving object that is fixed to the world.
    fn part_moves(&self, part: usize) -> bool {
        let _ = part;
        true
    }
    /// Returns whether two parts of this same object collide.
    fn parts_collide(&self, part_a: usize, part_b: usize) -> bool {
        let _ = (part_a, part_b);
        false
    }
    /// Adds the whitened response to unit impulses along these axes at this world point (thesis `ApplyTestImpulse`): `sign · L⁻ᵀJᵀ`, one
    /// row of `dof` numbers per axis.
    #[allow(clippy::too_many_arguments)]
    fn test_impulse(
        &self,
        cache: &mut Cache,
        part: usize,
        part_state: &PartState,
        point: &Vec3,
        axes: &[Vec3],
        sign: f64,
        y: &mut [f64],
    );
}

/// Adds the test impulse of a single rigid part with generalized velocity `[ω; v]` at the part's origin.
pub fn rigid_test_impulse(
    body: &dyn Integratable,
    cache: &mut Cache,
    part_state: &PartState,
    point: &Vec3,
    axes: &[Vec3],
    sign: f64,
    y: &mut [f64],
) {
    let r = point - part_state.position();
    for (axis, y) in axes.iter().zip(y.chunks_exact_mut(6)) {
        let moment = r.cross(axis);
        let jacobian = [moment.x, moment.y, moment.z, axis.x, axis.y, axis.z];
        let mut response = [0.0; 6];
        body.solve_lt(cache, &jacobian, &mut response);
        for (y, response) in y.iter_mut().zip(response) {
            *y += sign * response;
        }
    }
}

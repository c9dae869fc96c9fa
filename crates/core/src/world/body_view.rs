//! One part of an object, read between steps.

use super::{ContactPoint, World, WorldError};
use crate::object::part_state::PartState;
use crate::world::view::{Mode, ObjectId};
use tumble_collide::{Pose, Quat, Vec3};

/// One part of an object: the whole of a rigid body, or a link of an articulated body. World axes,
/// SI units.
#[derive(Clone, Copy)]
pub struct BodyView<'w> {
    world: &'w World,
    id: ObjectId,
    part: usize,
    part_state: &'w PartState,
}

impl World {
    /// Returns part 0 of an object for reading; [`BodyView::part`] returns the others.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed, [`WorldError::NoPart`] if it has no parts,
    /// such as a force.
    pub fn body(&self, id: ObjectId) -> Result<BodyView<'_>, WorldError> {
        let name = self.name(id).ok_or(WorldError::Stale)?;
        let missing = || WorldError::NoPart { name: name.to_string(), part: 0 };
        Ok(BodyView { world: self, id, part: 0, part_state: self.part_state(id, 0).ok_or_else(missing)? })
    }
}

impl<'w> BodyView<'w> {
    /// Returns another part of the same object.
    ///
    /// # Errors
    /// [`WorldError::NoPart`] if the object has no such part.
    pub fn part(&self, part: usize) -> Result<BodyView<'w>, WorldError> {
        let missing = || WorldError::NoPart { name: self.name().to_string(), part };
        Ok(BodyView { part, part_state: self.world.part_state(self.id, part).ok_or_else(missing)?, ..*self })
    }

    /// Returns the object's id.
    pub fn id(&self) -> ObjectId {
        self.id
    }

    /// Returns the object's name.
    pub fn name(&self) -> &'w str {
        self.world.name(self.id).unwrap_or_default()
    }

    /// Returns the pose of the frame by which the body is placed: for a mesh, that of its file.
    pub fn pose(&self) -> Pose {
        self.world.pose(self.id, self.part).unwrap_or(self.part_state.pose)
    }

    /// Returns the origin of the frame of [`pose`](Self::pose), meters.
    pub fn position(&self) -> Vec3 {
        self.pose().translation.vector
    }

    /// Returns the orientation of the body's axes.
    pub fn orientation(&self) -> Quat {
        self.part_state.pose.rotation
    }

    /// Returns the velocity of the center of mass of a rigid body, or of the origin of a link, m/s.
    pub fn velocity(&self) -> Vec3 {
        self.center().velocity
    }

    /// Returns the angular velocity, rad/s.
    pub fn angular_velocity(&self) -> Vec3 {
        self.part_state.angular_velocity
    }

    /// Returns the velocity of the material point at world point `p`, m/s.
    pub fn velocity_at(&self, p: &Vec3) -> Vec3 {
        self.part_state.velocity_at(p)
    }

    /// Returns the rate of change of [`velocity`](Self::velocity) in the last step, m/s².
    pub fn acceleration(&self) -> Vec3 {
        self.center().acceleration
    }

    fn center(&self) -> PartState {
        let center = if self.part == 0 { self.world.center_state(self.id) } else { None };
        center.unwrap_or(*self.part_state)
    }

    /// Returns the angular acceleration in the last step, rad/s².
    pub fn angular_acceleration(&self) -> Vec3 {
        self.part_state.angular_acceleration
    }

    /// Returns whether the object is static, kinematic or dynamic.
    pub fn mode(&self) -> Mode {
        self.world.status(self.id).map_or(Mode::Static, |status| status.mode)
    }

    /// Returns whether the object sleeps (see [`Sleep`](crate::Sleep)).
    pub fn is_asleep(&self) -> bool {
        self.world.asleep(self.id)
    }

    /// Returns the contacts of this part in the last sub-step.
    pub fn contacts(&self) -> impl Iterator<Item = &'w ContactPoint> + use<'w> {
        let side = (self.id, self.part);
        self.world.contacts_of(self.id).filter(move |c| side == (c.a, c.part_a) || side == (c.b, c.part_b))
    }
}

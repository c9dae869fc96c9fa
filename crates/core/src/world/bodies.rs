//! Access to the objects of a world between steps.

use super::{World, WorldError};
use crate::articulated::{ArticulatedBody, ArticulatedError, LinkMass};
use crate::object::part_state::{PartPoint, PartState};
use crate::object::{Integratable, Intersect, Object};
use crate::rigid::{RigidBody, orientation, vec3};
use crate::world::view::{Mode, ObjectId, Status};
use std::sync::Arc;
use tumble_collide::{Mat3, Pose, Vec3};

impl World {
    /// Returns an object by id; `None` if it was removed.
    pub fn object(&self, id: ObjectId) -> Option<&dyn Object> {
        self.core.table.get(id).map(|placed| placed.object.as_ref())
    }

    /// Returns the name of an object: its own, or the one that the world made (see
    /// [`add`](Self::add)).
    pub fn name(&self, id: ObjectId) -> Option<&str> {
        self.core.table.get(id).map(|placed| &*placed.name)
    }

    /// Returns the name of a shape, by its object, part and number as contacts, hits and events report them; `None` for a
    /// shape without one and for a removed object.
    pub fn shape_name(&self, id: ObjectId, part: usize, shape: usize) -> Option<&str> {
        self.object(id)?.collidable()?.shape_name(part, shape)
    }

    /// Returns the name of the link of a part as contacts, hits and events report it: the link to which the shape was added, also
    /// if it is a fixed one. `None` for rigid bodies, for a base without shapes and for a removed object.
    pub fn part_name(&self, id: ObjectId, part: usize) -> Option<&str> {
        self.object(id)?.collidable()?.part_name(part)
    }

    /// Returns an object by id, as its own type; `None` if it was removed or has another type.
    pub fn get<T: Object>(&self, id: ObjectId) -> Option<&T> {
        let object: &dyn std::any::Any = self.object(id)?;
        object.downcast_ref()
    }

    /// Returns an object by id, as its own type, for changes of its constants between steps. Its
    /// state is in the world. `None` if it was removed or has another type.
    pub fn get_mut<T: Object>(&mut self, id: ObjectId) -> Option<&mut T> {
        self.core.wake(id);
        self.note_drives(id);
        let place = self.core.table.place(id)?;
        let object: &mut dyn std::any::Any = self.core.table.placed[place].object.as_mut();
        object.downcast_mut()
    }

    /// Returns the settings of an object: mode, enabled, collidable; `None` if it was removed.
    pub fn status(&self, id: ObjectId) -> Option<Status> {
        self.core.objects().get(id).map(|e| e.status)
    }

    /// Sets an object's mode: static, kinematic or dynamic.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed.
    pub fn set_mode(&mut self, id: ObjectId, mode: Mode) -> Result<(), WorldError> {
        self.status_mut(id)?.mode = mode;
        Ok(())
    }

    /// Enables or disables an object. A disabled object does not move, collide or act, and keeps
    /// its state.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed.
    pub fn set_enabled(&mut self, id: ObjectId, enabled: bool) -> Result<(), WorldError> {
        let mends = enabled && self.status(id).is_some_and(|status| !status.enabled);
        self.status_mut(id)?.enabled = enabled;
        if self.object(id).is_some_and(|object| object.constraint().is_some()) {
            self.core.find_joined();
        }
        self.core.wake_near(id);
        if mends {
            self.find_turns(id); // it did not follow while it was broken
        }
        Ok(())
    }

    /// Enables or disables an object's collisions.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed.
    pub fn set_collidable(&mut self, id: ObjectId, collidable: bool) -> Result<(), WorldError> {
        self.status_mut(id)?.collidable = collidable;
        self.core.wake_near(id);
        Ok(())
    }

    /// Replaces an object by one with the same state, by its place in the order of objects.
    pub(crate) fn replace_object(&mut self, order: usize, object: Box<dyn Object>) {
        if let Some(place) = self.ids().get(order).and_then(|id| self.core.table.place(*id)) {
            self.core.table.walk.unsettle(place);
            self.core.table.placed[place].object = object;
        }
    }

    /// Sets or removes the intersection test of a rigid body's own, without waking it.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed or is no rigid body.
    pub fn set_intersect(&mut self, id: ObjectId, test: Option<Arc<dyn Intersect>>) -> Result<(), WorldError> {
        let place = self.core.table.place(id).ok_or(WorldError::Stale)?;
        self.core.table.walk.unsettle(place);
        let object: &mut dyn std::any::Any = self.core.table.placed[place].object.as_mut();
        object.downcast_mut::<RigidBody>().ok_or(WorldError::Stale)?.set_intersect(test);
        Ok(())
    }

    /// Sets or removes the intersection test of a link's own, or of one of its shapes, as
    /// [`ArticulatedBody::set_intersect`] does, without waking it.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if the object was removed or is no articulated body, and the errors of that function.
    pub fn set_link_intersect(
        &mut self,
        id: ObjectId,
        link: &str,
        shape: Option<usize>,
        test: Option<Arc<dyn Intersect>>,
    ) -> Result<(), WorldError> {
        self.core.wake(id);
        let place = self.core.table.place(id).ok_or(WorldError::Stale)?;
        self.core.table.walk.unsettle(place);
        let object: &mut dyn std::any::Any = self.core.table.placed[place].object.as_mut();
        let body = object.downcast_mut::<ArticulatedBody>().ok_or(WorldError::Stale)?;
        Ok(body.set_intersect(link, shape, test)?)
    }

    /// Wakes an object and returns its settings for a change.
    fn status_mut(&mut self, id: ObjectId) -> Result<&mut Status, WorldError> {
        self.core.wake(id);
        self.core.forces.wrenches.clear(); // a force that is disabled leaves what it wrote for settled objects
        let place = self.core.table.place(id).ok_or(WorldError::Stale)?;
        Ok(&mut self.core.state.objects[place].status)
    }

    /// Returns whether an object sleeps (see [`Sleep`](crate::Sleep)); any change of it wakes it.
    pub fn asleep(&self, id: ObjectId) -> bool {
        self.view().asleep(id)
    }

    /// Returns the state of one part: pose, velocity, acceleration. `None` if the object was
    /// removed or has no such part.
    pub fn part_state(&self, id: ObjectId, part: usize) -> Option<&PartState> {
        let entry = self.core.table.get(id)?;
        self.core.derived.part_states[entry.state_range.parts.clone()].get(part)
    }

    /// Returns the pose of the frame that places a part. For a mesh of a rigid body it is the frame
    /// of the mesh file, whereas the part state is at the center of mass. For other parts it is the
    /// pose of the part state.
    pub fn pose(&self, id: ObjectId, part: usize) -> Option<Pose> {
        let pose = self.part_state(id, part)?.pose;
        Some(self.get::<RigidBody>(id).map_or(pose, |body| body.frame_of(&pose)))
    }

    /// Returns an object's range of the state; `None` if it was removed.
    pub fn state_of(&self, id: ObjectId) -> Option<&[f64]> {
        Some(&self.core.state.x[self.core.table.get(id)?.state_range.x.clone()])
    }

    /// Writes an object's whole range of the state; the object's type documents its numbers.
    ///
    /// # Errors
    /// [`WorldError::Stale`], or [`WorldError::BadState`] if the numbers are no state of the
    /// object.
    pub fn write_state_of(&mut self, id: ObjectId, x: &[f64]) -> Result<(), WorldError> {
        self.core.wake(id);
        let entry = self.core.table.get(id).ok_or(WorldError::Stale)?;
        let (object, fits) = (&entry.object, x.len() == entry.state_range.x.len());
        let accepted = match (object.integratable(), object.frame_state()) {
            _ if !fits => false,
            (None, None) => false,
            (body, follower) => body.is_none_or(|b| b.accepts(x)) && follower.is_none_or(|f| f.accepts(x)),
        };
        if !accepted {
            return Err(WorldError::BadState(entry.name.to_string()));
        }
        self.core.state.x[entry.state_range.x.clone()].copy_from_slice(x);
        self.core.integration().refresh_one(id);
        self.core.wake_near(id);
        Ok(())
    }

    /// Moves the frame of a rigid body to a pose; the velocity of its center of mass does not
    /// change.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, is not a rigid body, or the pose is not finite.
    pub fn set_pose(&mut self, id: ObjectId, pose: Pose) -> Result<(), WorldError> {
        self.edit_rigid(id, |body, x| {
            let mut v = [0.0; 6];
            body.velocity(x, &mut v);
            let pose = body.center_pose_of(&pose);
            x[..3].copy_from_slice(pose.translation.vector.as_slice());
            x[3..7].copy_from_slice(pose.rotation.coords.as_slice());
            body.write_velocity(x, &v);
        })
    }

    /// Sets velocity (m/s, of the center of mass) and angular velocity (rad/s, world axes) of a
    /// rigid body. A kinematic body follows them. A static body takes zeros alone.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, is not a rigid body or is static, or a number is not finite.
    pub fn set_velocity(&mut self, id: ObjectId, velocity: Vec3, angular_velocity: Vec3) -> Result<(), WorldError> {
        let (w, v) = (angular_velocity, velocity);
        if (v, w) != (Vec3::zeros(), Vec3::zeros()) && self.status(id).is_some_and(|s| s.mode == Mode::Static) {
            return Err(WorldError::Static(self.name(id).unwrap_or_default().into()));
        }
        self.edit_rigid(id, |body, x| body.write_velocity(x, &[w.x, w.y, w.z, v.x, v.y, v.z]))
    }

    /// Sets the velocity of a kinematic body so that its frame is at `target` at the end of the
    /// next step. A body of another mode is placed by [`set_pose`](Self::set_pose).
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, is not a rigid body or is not kinematic, or the target is not finite.
    pub fn move_to(&mut self, id: ObjectId, target: Pose) -> Result<(), WorldError> {
        let dt = self.core.settings.dt;
        let name = self.name(id).ok_or(WorldError::Stale)?;
        let (name, rigid) = (name.to_string(), self.get::<RigidBody>(id).is_some());
        if let Some(Status { mode, .. }) = self.status(id).filter(|s| rigid && s.mode != Mode::Kinematic) {
            return Err(WorldError::NotKinematic { name, mode });
        }
        if !target.to_homogeneous().iter().all(|x| x.is_finite()) {
            return Err(WorldError::NotFinite(name));
        }
        self.edit_rigid(id, |body, x| {
            let target = body.center_pose_of(&target);
            let v = (target.translation.vector - vec3(x)) / dt;
            let w = (target.rotation * orientation(x).inverse()).scaled_axis() / dt;
            body.write_velocity(x, &[w.x, w.y, w.z, v.x, v.y, v.z]);
        })
    }

    /// Sets the [`armature`](crate::articulated::Link::armature) of the joint that moves a link of an articulated body, kg·m² or kg.
    /// Positions and velocities stay.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed or is not an articulated body, the link does not exist or does not move, its
    /// joint has no armature, or the value is out of its range. Nothing is changed then.
    pub fn set_armature(&mut self, id: ObjectId, link: &str, armature: f64) -> Result<(), WorldError> {
        self.change_articulated(id, |body| body.with_armature(link, armature))
    }

    /// Sets mass, center of mass and inertia of a link of an articulated body, in the frame of the link. Those of links that are
    /// fixed to it stay; together they are the mass of the moving link that carries them. Positions and velocities stay. A
    /// link that is fixed to the base has no effect on motion.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed or is not an articulated body, the link does not exist, a number is out of its
    /// range, or a joint then moves no inertia. Nothing is changed then.
    pub fn set_link_mass(&mut self, id: ObjectId, link: &str, mass: LinkMass) -> Result<(), WorldError> {
        self.change_articulated(id, |body| body.with_link_mass(link, mass))
    }

    /// Changes an articulated body; its state stays.
    fn change_articulated(
        &mut self,
        id: ObjectId,
        change: impl FnOnce(ArticulatedBody) -> Result<ArticulatedBody, ArticulatedError>,
    ) -> Result<(), WorldError> {
        self.core.wake(id);
        let core = &mut self.core;
        let entry = core.table.get(id).ok_or(WorldError::Stale)?;
        let any: &dyn std::any::Any = entry.object.as_ref();
        let old = any.downcast_ref::<ArticulatedBody>();
        let new = change(old.ok_or_else(|| WorldError::NotArticulated(entry.name.to_string()))?.clone())?;
        let place = core.table.place(id).ok_or(WorldError::Stale)?;
        core.table.placed[place].object = Box::new(new);
        core.integration().refresh_one(id);
        Ok(())
    }

    /// Changes constants of a rigid body: mass, inertia, center of mass, damping, locked axes. The
    /// pose of its frame stays, and so does its motion, except along axes that are locked now; the
    /// velocity is that of the new center of mass.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, is not a rigid body, or a constant is out of its
    /// range. Nothing is changed then.
    pub fn change_body(&mut self, id: ObjectId, change: impl FnOnce(&mut RigidBody)) -> Result<(), WorldError> {
        self.core.wake(id);
        let core = &mut self.core;
        let entry = core.table.get(id).ok_or(WorldError::Stale)?;
        let any: &dyn std::any::Any = entry.object.as_ref();
        let old = any.downcast_ref::<RigidBody>().ok_or_else(|| WorldError::NotRigid(entry.name.to_string()))?;
        let mut new = old.clone();
        change(&mut new);
        new.validate().map_err(|why| WorldError::Body { name: entry.name.to_string(), why })?;
        let x = &mut core.state.x[entry.state_range.x.clone()];
        let (mut v, q) = ([0.0; 6], orientation(x));
        old.velocity(x, &mut v);
        let moved = q * (new.center_of_mass() - old.center_of_mass());
        if moved != Vec3::zeros() {
            let (center, along) = (vec3(x) + moved, vec3(&v[3..]) + vec3(&v).cross(&moved));
            x[..3].copy_from_slice(center.as_slice());
            v[3..].copy_from_slice(along.as_slice());
        }
        new.write_velocity(x, &v);
        let place = core.table.place(id).ok_or(WorldError::Stale)?;
        core.table.placed[place].object = Box::new(new);
        core.integration().refresh_one(id);
        Ok(())
    }

    /// Sets the mass of a rigid body, kg; its inertia changes by the same factor. The velocity stays.
    ///
    /// # Errors
    /// [`WorldError`], as [`change_body`](Self::change_body).
    pub fn set_mass(&mut self, id: ObjectId, mass: f64) -> Result<(), WorldError> {
        self.change_body(id, |body| {
            let inertia = body.inertia() * (mass / body.mass());
            *body = body.clone().with_mass_and_inertia(mass, inertia);
        })
    }

    /// Sets the inertia of a rigid body, about its center of mass, body axes, kg·m². The angular
    /// velocity stays.
    ///
    /// # Errors
    /// [`WorldError`], as [`change_body`](Self::change_body).
    pub fn set_inertia(&mut self, id: ObjectId, inertia: Mat3) -> Result<(), WorldError> {
        self.change_body(id, |body| *body = body.clone().with_inertia(inertia))
    }

    /// Sets the center of mass of a rigid body, a point of its frame, meters. Its inertia is that
    /// about the new center.
    ///
    /// # Errors
    /// [`WorldError`], as [`change_body`](Self::change_body).
    pub fn set_center_of_mass(&mut self, id: ObjectId, center: Vec3) -> Result<(), WorldError> {
        self.change_body(id, |body| *body = body.clone().with_center_of_mass(center))
    }

    /// Returns the state of a part with its origin at the center of mass of a rigid body: other than
    /// [`part_state`](Self::part_state) if the body has a center of mass of its own. Its acceleration
    /// then has an error of first order in the step, since forces are evaluated within the step.
    pub fn center_state(&self, id: ObjectId) -> Option<PartState> {
        let part = *self.part_state(id, 0)?;
        let offset = self.get::<RigidBody>(id).map_or_else(Vec3::zeros, RigidBody::center_in_part);
        if offset == Vec3::zeros() {
            return Some(part);
        }
        let center = part.pose.transform_point(&offset.into()).coords;
        let (velocity, mut pose) = (part.velocity_at(&center), part.pose);
        pose.translation.vector = center;
        let acceleration = part.acceleration_following(&center, &velocity);
        Some(PartState { pose, velocity, acceleration, bias_acceleration: Vec3::zeros(), ..part })
    }

    /// Applies a force (N) at a world point of one part during the next frame.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, has no such part, or a number is not finite.
    pub fn apply_force(&mut self, id: ObjectId, part: usize, force: Vec3, point: &Vec3) -> Result<(), WorldError> {
        let index = self.part(id, part, &[force, *point])?;
        self.unsettle(id);
        let arm = point - self.core.derived.part_states[index].position();
        self.core.state.applied[index].force += force;
        self.core.state.applied[index].torque += arm.cross(&force);
        Ok(())
    }

    /// Applies a torque (N·m, world axes) to one part during the next frame.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, has no such part, or a number is not finite.
    pub fn apply_torque(&mut self, id: ObjectId, part: usize, torque: Vec3) -> Result<(), WorldError> {
        let index = self.part(id, part, &[torque])?;
        self.unsettle(id);
        self.core.state.applied[index].torque += torque;
        Ok(())
    }

    /// Applies generalized forces during the next frame, one per degree of freedom of the object:
    /// joint torques (N·m) and forces (N).
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, the count is not its degrees of freedom, or a number
    /// is not finite.
    pub fn apply_generalized(&mut self, id: ObjectId, forces: &[f64]) -> Result<(), WorldError> {
        self.unsettle(id);
        let entry = self.core.table.get(id).ok_or(WorldError::Stale)?;
        let name = || entry.name.to_string();
        if forces.len() != entry.state_range.v.len() {
            return Err(WorldError::DofCount { name: name(), dof: entry.state_range.v.len(), given: forces.len() });
        }
        if forces.iter().any(|x| !x.is_finite()) {
            return Err(WorldError::NotFinite(name()));
        }
        let applied = &mut self.core.state.applied_generalized[entry.state_range.v.clone()];
        applied.iter_mut().zip(forces).for_each(|(applied, force)| *applied += force);
        Ok(())
    }

    /// Returns the generalized forces that are applied to an object during the next frame, one per degree of freedom, N·m and N;
    /// `None` if it was removed.
    pub fn applied_generalized(&self, id: ObjectId) -> Option<&[f64]> {
        self.core.state.applied_generalized.get(self.core.table.get(id)?.state_range.v.clone())
    }

    /// Replaces the generalized forces that are applied to an object during the next frame, one per degree of freedom, N·m and N.
    ///
    /// # Errors
    /// As [`apply_generalized`](Self::apply_generalized); the forces then stay.
    pub fn set_applied_generalized(&mut self, id: ObjectId, forces: &[f64]) -> Result<(), WorldError> {
        let before = self.applied_generalized(id).ok_or(WorldError::Stale)?.to_vec();
        let range = self.core.table.get(id).ok_or(WorldError::Stale)?.state_range.v.clone();
        self.core.state.applied_generalized[range.clone()].fill(0.0);
        let outcome = self.apply_generalized(id, forces);
        if outcome.is_err() {
            self.core.state.applied_generalized[range].copy_from_slice(&before);
        }
        outcome
    }

    /// Removes the forces that were applied for the next frame.
    pub fn clear_applied(&mut self) {
        self.core.state.clear_applied();
    }

    /// Applies an impulse (N·s) at a world point of one part, at once.
    ///
    /// # Errors
    /// [`WorldError`]: the object was removed, has no such part, or a number is not finite, one of the state after it
    /// included; the state then stays.
    pub fn apply_impulse(&mut self, id: ObjectId, part: usize, impulse: Vec3, point: &Vec3) -> Result<(), WorldError> {
        let index = self.part(id, part, &[impulse, *point])?;
        let place = self.core.table.place(id).ok_or(WorldError::Stale)?;
        self.core.wake(id);
        let part_state = self.core.derived.part_states[index];
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let at = PartPoint { part, part_state: &part_state, point: *point, axes: &axes };
        match self.core.kick_by(id, std::iter::once((at, impulse))) {
            true => Ok(()),
            false => Err(WorldError::NotFinite(self.core.table.placed[place].name.to_string())),
        }
    }

    fn unsettle(&mut self, id: ObjectId) {
        if let Some(place) = self.core.table.place(id) {
            self.core.table.walk.unsettle(place);
        }
    }

    pub(super) fn part(&self, id: ObjectId, part: usize, numbers: &[Vec3]) -> Result<usize, WorldError> {
        let entry = self.core.table.get(id).ok_or(WorldError::Stale)?;
        if part >= entry.state_range.parts.len() {
            return Err(WorldError::NoPart { name: entry.name.to_string(), part });
        }
        if numbers.iter().flat_map(|v| v.iter()).any(|x| !x.is_finite()) {
            return Err(WorldError::NotFinite(entry.name.to_string()));
        }
        Ok(entry.state_range.parts.start + part)
    }

    fn edit_rigid(&mut self, id: ObjectId, edit: impl FnOnce(&RigidBody, &mut [f64])) -> Result<(), WorldError> {
        self.core.wake(id);
        let core = &mut self.core;
        let entry = core.table.get(id).ok_or(WorldError::Stale)?;
        let any: &dyn std::any::Any = entry.object.as_ref();
        let body = any.downcast_ref::<RigidBody>().ok_or_else(|| WorldError::NotRigid(entry.name.to_string()))?;
        let mut x = core.state.x[entry.state_range.x.clone()].to_vec();
        edit(body, &mut x);
        if !body.accepts(&x) {
            return Err(WorldError::BadState(entry.name.to_string()));
        }
        core.state.x[entry.state_range.x.clone()].copy_from_slice(&x);
        core.integration().refresh_one(id);
        core.wake_near(id);
        Ok(())
    }
}

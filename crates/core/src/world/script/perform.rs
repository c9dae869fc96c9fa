//! Actions at the moment at which an event fires.

use super::action::{Action, Subject};
use super::template::HEADER;
use super::{EventError, ScriptedEvent, Template, Trigger};
use crate::constraint::loop_joint::LoopJoint;
use crate::object::Object;
use crate::rigid::RigidBody;
use crate::world::sleep::RestTimer;
use crate::world::view::ObjectId;
use crate::world::{StepError, World, WorldError};
use tumble_collide::{Pose, Vec3};

impl World {
    /// Does an action now, between two steps, as an event that fires does it.
    ///
    /// # Errors
    /// [`WorldError::Event`] for an action that goes on after its firing or is drawn (a force for some time, a path, a
    /// drive, a color, a camera, a light, a joint that is attached `here`), and for an action that names a wrong object or
    /// number; the errors of the changes themselves.
    pub fn perform_action(&mut self, action: &Action) -> Result<(), WorldError> {
        let event = ScriptedEvent::new("an action", Trigger::Time { at: 1.0 });
        let wrong = |why| WorldError::Event { name: event.name().into(), why };
        if action.goes_on() {
            return Err(wrong(EventError::GoesOn));
        }
        event.check(action, self).map_err(wrong)?;
        self.act(&event, ObjectId::default(), action, 0, None)
    }

    /// Runs the actions of an event, in their order.
    pub(super) fn perform(&mut self, id: ObjectId, other: u32) -> Result<(), StepError> {
        let Some(event) = self.get::<ScriptedEvent>(id).cloned() else { return Ok(()) };
        for (action, memory) in event.with_memory() {
            match self.act(&event, id, action, memory, self.core.other(other)) {
                // the object was removed
                Ok(()) | Err(WorldError::Stale) => {}
                Err(why) => return Err(StepError::Event { event: self.name(id).unwrap_or_default().into(), why }),
            }
        }
        Ok(())
    }

    fn act(
        &mut self,
        event: &ScriptedEvent,
        id: ObjectId,
        action: &Action,
        memory: usize,
        other: Option<ObjectId>,
    ) -> Result<(), WorldError> {
        let who = |body: &Subject| match body {
            Subject::Part(id, part) => Ok((*id, *part)),
            Subject::Other => other.map(|id| (id, 0)).ok_or(WorldError::Stale),
        };
        match action {
            Action::Spawn { template, pose, velocity, angular_velocity, from } => {
                let (mut pose, mut motion) = (*pose, [*velocity, *angular_velocity]);
                if let Some(from) = from {
                    let thrower = *self.part_state(*from, 0).ok_or(WorldError::Stale)?;
                    let frame = self.pose(*from, 0).ok_or(WorldError::Stale)?;
                    pose = frame * pose;
                    let center = pose.transform_point(&self.spawned_center(*template).into());
                    motion = motion.map(|v| frame.rotation * v);
                    motion[0] += thrower.velocity_at(&center.coords);
                    motion[1] += thrower.angular_velocity;
                }
                self.spawn(*template, pose, motion)
            }
            Action::Push { body, impulse, point } => {
                let (body, part) = who(body)?;
                let at = match point {
                    Some(point) => {
                        self.pose(body, part).ok_or(WorldError::Stale)?.transform_point(&(*point).into()).coords
                    }
                    None => self.center(body, part)?,
                };
                self.apply_impulse(body, part, *impulse, &at)
            }
            Action::SetVelocity { body, velocity, angular_velocity } => {
                match self.set_velocity(who(body)?.0, *velocity, *angular_velocity) {
                    // whatever touched may be the ground
                    Err(WorldError::Static(_)) if *body == Subject::Other => Ok(()),
                    outcome => outcome,
                }
            }
            Action::Remove(body) => self.set_enabled(who(body)?.0, false),
            Action::Enable(object) => self.set_enabled(*object, true),
            Action::Disable(object) => self.set_enabled(*object, false),
            Action::Attach { joint, here } => {
                if *here {
                    self.note_frame(id, *joint, memory)?;
                }
                self.set_enabled(*joint, true)
            }
            Action::Recolor { body, .. } => {
                let body = who(body)?.0;
                let stamp = self.frame() as f64;
                if let Some(k) = event.colored_place(action, body) {
                    self.write_memory(id, memory + k, &[stamp]);
                }
                Ok(())
            }
            // these follow from the state at the start of each frame, or when the world is drawn
            Action::Force { .. } | Action::MoveAlong { .. } | Action::Drive { .. } => Ok(()),
            Action::Camera(_) | Action::Light(_) => Ok(()),
        }
    }

    /// Enables the first disabled body of a template, or the oldest one, with a pose of its frame and
    /// [velocity, angular velocity].
    fn spawn(&mut self, template: ObjectId, pose: Pose, [velocity, angular]: [Vec3; 2]) -> Result<(), WorldError> {
        let (bodies, reuse) = {
            let template = self.get::<Template>(template).ok_or(WorldError::Stale)?;
            (template.bodies.clone(), template.reuse)
        };
        let mut x = self.state_of(template).ok_or(WorldError::Stale)?.to_vec();
        let free = bodies.iter().position(|id| self.status(*id).is_some_and(|status| !status.enabled));
        let oldest = || {
            let present = (0..bodies.len()).filter(|k| self.status(bodies[*k]).is_some());
            present.min_by(|a, b| x[HEADER + a].total_cmp(&x[HEADER + b]))
        };
        let Some(chosen) = free.or_else(|| if reuse { oldest() } else { None }) else {
            x[1] += 1.0;
            return self.write_state_of(template, &x);
        };
        let id = bodies[chosen];
        self.set_enabled(id, true)?;
        self.set_pose(id, pose)?;
        self.set_velocity(id, velocity, angular)?;
        // it begins as a new body does
        let place = self.core.table.place(id).ok_or(WorldError::Stale)?;
        let (serial, part) =
            (self.core.state.objects[place].serial, self.core.table.placed[place].state_range.parts.start);
        self.core.table.walk.unsettle(place);
        self.core.state.objects[place].rest = RestTimer::default();
        self.core.state.accelerations[part] = [Vec3::zeros(); 2];
        let shown = &mut self.core.derived.part_states[part];
        (shown.acceleration, shown.angular_acceleration) = (Vec3::zeros(), Vec3::zeros());
        self.core.state.warm.forget(serial);
        (x[0], x[HEADER + chosen]) = (x[0] + 1.0, self.frame() as f64);
        self.write_state_of(template, &x)
    }

    /// Returns the center of mass of the bodies of a template in their frame, m.
    fn spawned_center(&self, template: ObjectId) -> Vec3 {
        let first = self.get::<Template>(template).and_then(|template| template.bodies.first().copied());
        first.and_then(|id| self.get::<RigidBody>(id)).map_or_else(Vec3::zeros, RigidBody::center_of_mass)
    }

    /// Returns the center of mass of a part, world axes, m.
    fn center(&self, id: ObjectId, part: usize) -> Result<Vec3, WorldError> {
        let range = self.core.table.get(id).ok_or(WorldError::Stale)?;
        let center = range.object.integratable().map_or_else(Vec3::zeros, |body| body.part_center(part));
        let part_state = self.part_state(id, part).ok_or(WorldError::Stale)?;
        Ok(part_state.pose.transform_point(&center.into()).coords)
    }

    /// Writes the frame of side B of a joint that is where the frame of side A is now, in the axes of B's part.
    fn note_frame(&mut self, event: ObjectId, joint: ObjectId, memory: usize) -> Result<(), WorldError> {
        let [a, b] = self.get::<LoopJoint>(joint).ok_or(WorldError::Stale)?.sides();
        let pose = |part: Option<(ObjectId, usize)>| match part {
            Some((id, part)) => self.part_state(id, part).map(|s| s.pose).ok_or(WorldError::Stale),
            None => Ok(Pose::identity()),
        };
        let frame = pose(b.part)?.inverse() * pose(a.part)? * a.frame;
        let (p, q) = (frame.translation.vector, frame.rotation.coords);
        self.write_memory(event, memory, &[p.x, p.y, p.z, q.x, q.y, q.z, q.w]);
        Ok(())
    }

    /// Writes numbers of the state of an event.
    fn write_memory(&mut self, event: ObjectId, at: usize, numbers: &[f64]) {
        if let Some(placed) = self.core.table.get(event) {
            let start = placed.state_range.x.start + at;
            self.core.state.x[start..start + numbers.len()].copy_from_slice(numbers);
        }
    }
}

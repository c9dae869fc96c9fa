//! Effects of events over time: they follow from the state alone, at the start of each frame.
//!
//! **Paths.** At the end of a frame a body on a path `p` has the pose `p(t)` and the velocity `ṗ(t)`. Within a frame a
//! kinematic body moves uniformly. What rests on it takes its velocity in the middle of a sub-step `h`, and keeps it to
//! the middle of the next one. So that both are equally far at the end, the velocity is a mean over a window that is
//! half a sub-step later, and the frame starts from where that velocity leads to the path:
//!
//! ```text
//! v = (p(t + dt + h/2) − p(t + h/2))/dt,    x = p(t + dt) − dt·v
//! ```
//!
//! A load then lags by `O(h²)` of its acceleration at any time; with `v = (p(t + dt) − p(t))/dt` it would lag by `h·v/2`.

use super::ScriptedEvent;
use super::action::{Action, Subject};
use super::event::{FIRED, OTHER, STAMP, TIME};
use super::spline::Spline;
use crate::articulated::Drive;
use crate::constraint::loop_joint::LoopJoint;
use crate::object::Integratable;
use crate::rigid::{RigidBody, vec3};
use crate::world::Core;
use crate::world::view::{Mode, ObjectId};
use crate::{Anchor, ArticulatedBody};
use nalgebra::{Quaternion, Translation3, Unit};
use std::any::Any;
use std::sync::Arc;
use tumble_collide::{Pose, Quat, Vec3};

/// A body on its path: the latest event that moves it.
struct Mover {
    body: ObjectId,
    path: Arc<Spline>,
    stamp: f64,
    /// Time at which the path begins, s.
    start: f64,
}

/// Something that the latest event decides.
struct Latest<T> {
    of: (ObjectId, usize),
    stamp: f64,
    value: T,
}

/// Keeps the value of the latest stamp; among equal ones the last.
fn keep<T>(list: &mut Vec<Latest<T>>, new: Latest<T>) {
    match list.iter_mut().find(|old| old.of == new.of) {
        Some(old) if old.stamp <= new.stamp => *old = new,
        Some(_) => {}
        None => list.push(new),
    }
}

impl Core {
    /// Prepares the coming frame: velocities of bodies on paths, forces, targets of drives, frames of joints.
    pub(crate) fn guide(&mut self) {
        if self.scripted().next().is_none() {
            return;
        }
        let (dt, half) = (self.settings.dt, 0.5 * self.settings.dt / f64::from(self.settings.substeps.max(1)));
        for Mover { body, path, start, .. } in self.movers() {
            let time = self.state.time - start;
            if path.repeats() || time < path.duration() {
                let ends = [time + half, time + dt + half].map(|time| path.at(time).pose);
                self.aim(body, &path.at(time + dt).pose, ends);
            }
        }
        self.push_on();
        self.set_drives();
        self.set_frames();
    }

    /// Ends the frame: bodies on paths get their exact pose and velocity.
    pub(super) fn finish_paths(&mut self) {
        let dt = self.settings.dt;
        for Mover { body, path, start, .. } in self.movers() {
            let time = self.state.time - start;
            // one frame more than the path: it comes to rest
            if path.repeats() || time < path.duration() + dt {
                let point = path.at(time);
                let state = (point.pose, point.velocity, point.angular_velocity);
                self.place(body, state);
            }
        }
    }

    /// Returns the bodies on paths, each with the latest event that moves it.
    fn movers(&self) -> Vec<Mover> {
        let mut movers: Vec<Mover> = Vec::new();
        for (x, event) in self.fired() {
            for action in event.actions().iter() {
                let Action::MoveAlong { body, path } = action else { continue };
                let new = Mover { body: *body, path: path.clone(), stamp: x[STAMP], start: x[TIME] };
                match movers.iter_mut().find(|old| old.body == new.body) {
                    Some(old) if old.stamp <= new.stamp => *old = new,
                    Some(_) => {}
                    None => movers.push(new),
                }
            }
        }
        movers
    }

    /// Walks the enabled events that have fired, each with its numbers.
    pub(super) fn fired(&self) -> impl Iterator<Item = (&[f64], &ScriptedEvent)> {
        let numbers = |place: usize| &self.state.x[self.table.placed[place].state_range.x.clone()];
        self.scripted().map(move |(place, event)| (numbers(place), event)).filter(|(x, _)| x[FIRED] > 0.0)
    }

    /// Sets pose and velocity of a kinematic body such that it moves in the coming frame as from `from` to `to`, and
    /// its frame is at `end` at the end.
    fn aim(&mut self, id: ObjectId, end: &Pose, [from, to]: [Pose; 2]) {
        let dt = self.settings.dt;
        self.write_motion(id, |body, x| {
            let [end, from, to] = [end, &from, &to].map(|frame| body.center_pose_of(frame));
            let v = (to.translation.vector - from.translation.vector) / dt;
            let w = (to.rotation * from.rotation.inverse()).scaled_axis() / dt;
            let start = end.translation.vector - dt * v;
            let turned = Quat::from_scaled_axis(-dt * w) * end.rotation;
            x[..3].copy_from_slice(start.as_slice());
            x[3..7].copy_from_slice(turned.coords.as_slice());
            body.write_velocity(x, &[w.x, w.y, w.z, v.x, v.y, v.z]);
        });
    }

    /// Sets pose, velocity and angular velocity of the frame of a kinematic body.
    fn place(&mut self, id: ObjectId, (pose, velocity, w): (Pose, Vec3, Vec3)) {
        self.write_motion(id, |body, x| {
            let center = body.center_pose_of(&pose);
            let v = velocity + w.cross(&(center.translation.vector - pose.translation.vector));
            x[..3].copy_from_slice(center.translation.vector.as_slice());
            x[3..7].copy_from_slice(center.rotation.coords.as_slice());
            body.write_velocity(x, &[w.x, w.y, w.z, v.x, v.y, v.z]);
        });
    }

    fn write_motion(&mut self, id: ObjectId, write: impl FnOnce(&RigidBody, &mut [f64])) {
        let Some(place) = self.table.place(id) else { return };
        let status = self.state.objects[place].status;
        if status.mode != Mode::Kinematic || !status.enabled {
            return; // the mode was changed since the event was added
        }
        let placed = &self.table.placed[place];
        let any: &dyn Any = placed.object.as_ref();
        let Some(body) = any.downcast_ref::<RigidBody>() else { return };
        write(body, &mut self.state.x[placed.state_range.x.clone()]);
        self.wake(id);
        self.integration().refresh_one(id);
    }

    /// Applies the forces that events exert for some time.
    fn push_on(&mut self) {
        let (now, dt) = (self.state.time, self.settings.dt);
        let mut acting = Vec::new();
        for (x, event) in self.fired() {
            for action in event.actions().iter() {
                let Action::Force { body, force, torque, duration } = action else { continue };
                // the share of the frame in which it still acts; times are sums of steps
                let share = ((x[TIME] + duration - now) / dt).clamp(0.0, 1.0);
                let body = match body {
                    Subject::Part(id, part) => Some((*id, *part)),
                    Subject::Other => self.other(x[OTHER] as u32).map(|id| (id, 0)),
                };
                acting.extend(body.filter(|_| share > 1e-6).map(|body| (body, share * force, share * torque)));
            }
        }
        for ((id, part), force, torque) in acting {
            self.wake(id);
            let Some(placed) = self.table.get(id) else { continue };
            let index = placed.state_range.parts.start + part;
            if part >= placed.state_range.parts.len() {
                continue;
            }
            let center = placed.object.integratable().map_or_else(Vec3::zeros, |body| body.part_center(part));
            let arm = self.derived.part_states[index].pose.rotation * center;
            let applied = &mut self.state.applied[index];
            applied.force += force;
            applied.torque += torque + arm.cross(&force);
        }
    }

    /// Sets the targets of drives that events decide.
    fn set_drives(&mut self) {
        let mut targets: Vec<Latest<f64>> = Vec::new();
        for (place, event) in self.scripted() {
            let x = &self.state.x[self.table.placed[place].state_range.x.clone()];
            for action in event.actions().iter() {
                let Action::Drive { body, dof, target, original } = action else { continue };
                let fired = x[FIRED] > 0.0;
                let value = if fired { *target } else { original.unwrap_or(*target) };
                keep(&mut targets, Latest { of: (*body, *dof), stamp: if fired { x[STAMP] } else { 0.0 }, value });
            }
        }
        for Latest { of: (id, dof), value, .. } in targets {
            let Some(place) = self.table.place(id) else { continue };
            if drive(self.table.placed[place].object.as_ref(), dof).and_then(target_of) == Some(value) {
                continue;
            }
            self.wake(id);
            let any: &mut dyn Any = self.table.placed[place].object.as_mut();
            if let Some(body) = any.downcast_mut::<ArticulatedBody>() {
                if let Some(mut settings) = body.dofs().get(dof).cloned() {
                    with_target(&mut settings.drive, value);
                    let _ = body.set_dof(dof, settings); // a finite target, checked when the event was added
                }
            } else if let Some(joint) = any.downcast_mut::<LoopJoint>()
                && let Some(mut settings) = joint.dof_at(dof).cloned()
            {
                with_target(&mut settings.drive, value);
                let _ = joint.set_dof_at(dof, settings);
            }
        }
    }

    /// Gives joints the frames at which events attached them.
    fn set_frames(&mut self) {
        let mut frames: Vec<Latest<Pose>> = Vec::new();
        for (x, event) in self.fired() {
            for (action, at) in event.with_memory() {
                let Action::Attach { joint, here: true } = action else { continue };
                let rotation = Unit::new_unchecked(Quaternion::new(x[at + 6], x[at + 3], x[at + 4], x[at + 5]));
                let value = Pose::from_parts(Translation3::from(vec3(&x[at..])), rotation);
                keep(&mut frames, Latest { of: (*joint, 0), stamp: x[STAMP], value });
            }
        }
        for Latest { of: (id, _), value, .. } in frames {
            let Some(place) = self.table.place(id) else { continue };
            let any: &mut dyn Any = self.table.placed[place].object.as_mut();
            if let Some(joint) = any.downcast_mut::<LoopJoint>()
                && joint.sides()[1].frame != value
            {
                let [_, b] = joint.sides();
                joint.set_second_side(Anchor { frame: value, ..b });
                self.wake(id);
            }
        }
    }
}

/// Returns the drive of a degree of freedom of an articulated body, or that of a loop joint.
pub(super) fn drive(object: &dyn crate::object::Object, dof: usize) -> Option<&Drive> {
    let any: &dyn Any = object;
    if let Some(body) = any.downcast_ref::<ArticulatedBody>() {
        return body.dofs().get(dof).map(|settings| &settings.drive);
    }
    any.downcast_ref::<LoopJoint>().and_then(|joint| joint.dof_at(dof)).map(|settings| &settings.drive)
}

/// Returns the target of a drive that has one.
pub(super) fn target_of(drive: &Drive) -> Option<f64> {
    match drive {
        Drive::Position { target, .. } | Drive::Velocity { target, .. } => Some(*target),
        Drive::None | Drive::Playback { .. } => None,
    }
}

fn with_target(drive: &mut Drive, value: f64) {
    if let Drive::Position { target, .. } | Drive::Velocity { target, .. } = drive {
        *target = value;
    }
}

//! Checks of an event when it is added to a world.

use super::action::{Action, CameraChange, Subject};
use super::guide::{drive, target_of};
use super::template::MAX_SPAWNED;
use super::trigger::{MAX_KEY_BYTES, Trigger};
use super::{ScriptedEvent, Template};
use crate::constraint::loop_joint::LoopJoint;
use crate::object::has_sensor;
use crate::rigid::RigidBody;
use crate::world::World;
use crate::world::view::{Mode, ObjectId};
use tumble_collide::Vec3;

/// Why an event cannot be added.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EventError {
    /// A number is out of its range.
    #[error("{what} is {value}; expected {expected}")]
    Range {
        /// The number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        expected: &'static str,
    },
    /// A vector, a pose or a color has a number that is not finite, or a color is out of 0 to 1.
    #[error("{0} has a number that is not finite or out of its range")]
    Numbers(&'static str),
    /// The object is not in the world.
    #[error("{0} is not in the world")]
    Gone(&'static str),
    /// The object is of another kind.
    #[error("'{name}' is not {expected}")]
    Kind {
        /// Name of the object.
        name: String,
        /// The kind that it must be of.
        expected: &'static str,
    },
    /// A template has too many or no bodies.
    #[error("a template has {0} bodies; expected 1 to {max}", max = MAX_SPAWNED)]
    Count(usize),
    /// The other body of a trigger that has none, or of any.
    #[error("{0}")]
    Other(&'static str),
    /// An action that is done now goes on after its firing.
    #[error("this action goes on after its firing, or is drawn; expected it among the actions of an event")]
    GoesOn,
    /// The name of a key.
    #[error("the name of a key is {0} bytes long; expected 1 to {max}", max = MAX_KEY_BYTES)]
    Key(usize),
}

const FOR_OTHER: &str = "the other body of a trigger that has none; expected a contact, a parting, a body that enters or leaves, or an event after one";

impl ScriptedEvent {
    /// Checks all numbers and objects, and fills in the present targets of drives.
    pub(crate) fn prepare(&mut self, world: &World) -> Result<(), EventError> {
        at_least_0("the delay", self.delay())?;
        if self.times() == 0 {
            return Err(EventError::Range { what: "the number of firings", value: 0.0, expected: "at least 1" });
        }
        check_trigger(self.trigger(), world)?;
        for action in self.actions().iter() {
            self.check(action, world)?;
        }
        if self.actions().iter().any(|action| matches!(action, Action::Drive { original: None, .. })) {
            for action in self.actions_mut() {
                if let Action::Drive { body, dof, original, .. } = action {
                    let present = || world.object(*body).and_then(|o| drive(o, *dof)).and_then(target_of);
                    *original = original.or_else(present);
                }
            }
        }
        Ok(())
    }

    pub(super) fn check(&self, action: &Action, world: &World) -> Result<(), EventError> {
        let moving = |body: &Subject| self.check_body(body, world);
        match action {
            Action::Spawn { template, pose, velocity, angular_velocity, from } => {
                of_kind::<Template>(world, *template, "a template")?;
                from.iter().try_for_each(|id| body(world, *id, 0).map(drop))?;
                finite("a pose", pose.to_homogeneous().iter())?;
                finite("a velocity", velocity.iter().chain(angular_velocity))
            }
            Action::Push { body, impulse, point } => {
                finite("an impulse", impulse.iter().chain(point.iter().flatten()))?;
                moving(body)
            }
            Action::Force { body, force, torque, duration } => {
                above_0("the duration of a force", *duration)?;
                finite("a force", force.iter().chain(torque))?;
                moving(body)
            }
            Action::SetVelocity { body, velocity, angular_velocity } => {
                finite("a velocity", velocity.iter().chain(angular_velocity))?;
                moving(body)?;
                match body {
                    Subject::Part(id, _) => {
                        of_kind::<RigidBody>(world, *id, "a rigid body")?;
                        let fixed = world.status(*id).is_some_and(|status| status.mode == Mode::Static);
                        if fixed && (*velocity, *angular_velocity) != (Vec3::zeros(), Vec3::zeros()) {
                            return Err(kind(world, *id, "dynamic or kinematic; a static body has no velocity"));
                        }
                        Ok(())
                    }
                    Subject::Other => Ok(()),
                }
            }
            Action::Remove(body) => moving(body),
            Action::Enable(id) | Action::Disable(id) => {
                world.object(*id).map(drop).ok_or(EventError::Gone("an object that is enabled or disabled"))
            }
            Action::Attach { joint, .. } => of_kind::<LoopJoint>(world, *joint, "a loop joint"),
            Action::Recolor { body, color } => {
                if !color.iter().all(|c| (0.0..=1.0).contains(c)) {
                    return Err(EventError::Numbers("a color"));
                }
                if *body == Subject::Other && self.trigger().others().is_empty() {
                    return Err(EventError::Other(
                        "only a trigger with a list of bodies can recolor the other one; expected the bodies by name",
                    ));
                }
                moving(body)
            }
            Action::MoveAlong { body, .. } => {
                of_kind::<RigidBody>(world, *body, "a rigid body")?;
                let kinematic = world.status(*body).is_some_and(|status| status.mode == Mode::Kinematic);
                if kinematic {
                    Ok(())
                } else {
                    Err(kind(world, *body, "kinematic; only such a body moves along a path"))
                }
            }
            Action::Drive { body, dof, target, .. } => {
                let object = world.object(*body).ok_or(EventError::Gone("a body with a drive"))?;
                if drive(object, *dof).and_then(target_of).is_none() {
                    return Err(kind(world, *body, "a body or joint with a drive to a position or velocity there"));
                }
                finite("the target of a drive", [target].into_iter())
            }
            Action::Camera(CameraChange::Named(_)) => Ok(()),
            Action::Camera(CameraChange::LookAt { eye, target, vertical_fov }) => {
                finite("a camera", eye.iter().chain(target))?;
                if (eye - target).norm() < 1e-9 || !(*vertical_fov > 0.0 && *vertical_fov < std::f64::consts::PI) {
                    return Err(EventError::Numbers("a camera"));
                }
                Ok(())
            }
            Action::Light(change) => {
                if !change.color.iter().flatten().all(|c| (0.0..=1.0).contains(c)) {
                    return Err(EventError::Numbers("the color of a light"));
                }
                change.intensity.map_or(Ok(()), |intensity| at_least_0("the intensity of a light", intensity))
            }
        }
    }

    fn check_body(&self, who: &Subject, world: &World) -> Result<(), EventError> {
        match who {
            Subject::Part(id, part) => body(world, *id, *part),
            Subject::Other if self.trigger().has_other() => Ok(()),
            Subject::Other => Err(EventError::Other(FOR_OTHER)),
        }
    }
}

fn check_trigger(trigger: &Trigger, world: &World) -> Result<(), EventError> {
    let bodies = |list: &[ObjectId]| list.iter().try_for_each(|id| body(world, *id, 0));
    match trigger {
        Trigger::Time { at } => above_0("the time of an event", *at),
        Trigger::Every { period, first } => {
            above_0("the period of an event", *period)?;
            above_0("the first time of an event", *first)
        }
        Trigger::Contact { a, b, impulse } => {
            at_least_0("the impulse of an event", *impulse)?;
            bodies(a)?;
            bodies(b)
        }
        Trigger::Touching { a, b } | Trigger::Parting { a, b } => bodies(a).and_then(|()| bodies(b)),
        Trigger::Enters { sensor, bodies: list } | Trigger::Leaves { sensor, bodies: list } => {
            let object = world.object(*sensor).ok_or(EventError::Gone("the sensor of an event"))?;
            if !object.collidable().is_some_and(has_sensor) {
                return Err(kind(world, *sensor, "a sensor"));
            }
            bodies(list)
        }
        Trigger::Asleep { bodies: list } | Trigger::Awake { bodies: list } => bodies(list),
        Trigger::Breaks { joint } => of_kind::<LoopJoint>(world, *joint, "a loop joint"),
        Trigger::Key { key } if (1..=MAX_KEY_BYTES).contains(&key.len()) => Ok(()),
        Trigger::Key { key } => Err(EventError::Key(key.len())),
        Trigger::Fired { event } => of_kind::<ScriptedEvent>(world, *event, "an event"),
    }
}

fn body(world: &World, id: ObjectId, part: usize) -> Result<(), EventError> {
    world.object(id).ok_or(EventError::Gone("a body of an event"))?;
    match world.part_state(id, part) {
        Some(_) => Ok(()),
        None => Err(kind(world, id, "a body with such a part")),
    }
}

fn of_kind<T: crate::object::Object>(world: &World, id: ObjectId, expected: &'static str) -> Result<(), EventError> {
    world.object(id).ok_or(EventError::Gone(expected))?;
    if world.get::<T>(id).is_some() { Ok(()) } else { Err(kind(world, id, expected)) }
}

fn kind(world: &World, id: ObjectId, expected: &'static str) -> EventError {
    EventError::Kind { name: world.name(id).unwrap_or_default().into(), expected }
}

fn finite<'a>(what: &'static str, mut numbers: impl Iterator<Item = &'a f64>) -> Result<(), EventError> {
    if numbers.all(|x| x.is_finite()) { Ok(()) } else { Err(EventError::Numbers(what)) }
}

fn above_0(what: &'static str, value: f64) -> Result<(), EventError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(EventError::Range { what, value, expected: "above 0" }) }
}

fn at_least_0(what: &'static str, value: f64) -> Result<(), EventError> {
    if value >= 0.0 && value.is_finite() {
        Ok(())
    } else {
        Err(EventError::Range { what, value, expected: "at least 0" })
    }
}

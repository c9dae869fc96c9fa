//! Actions of a scripted event.

use super::spline::Spline;
use crate::world::view::ObjectId;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tumble_collide::{Pose, Vec3};

/// The body that an action is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Subject<B = ObjectId> {
    /// A part of an object.
    Part(B, usize),
    /// The body that made the event fire: the one that entered, or the second side of a contact.
    Other,
}

/// A deed of a [`ScriptedEvent`](super::ScriptedEvent) that fires. World axes and SI units unless it
/// says otherwise. An action on an object that was removed from the world does nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Action<B = ObjectId> {
    /// Enables a body of a template at a pose. If all are in use, the oldest one is used again or none is
    /// spawned, as the template says.
    Spawn {
        /// The [`Template`](super::Template).
        template: B,
        /// Pose of the body's frame, in the world or in the frame of `from`.
        pose: Pose,
        /// Velocity of its center of mass, m/s, in the same axes.
        velocity: Vec3,
        /// Angular velocity, rad/s, in the same axes.
        angular_velocity: Vec3,
        /// The body that throws it: its frame places the new body, and its velocity at that place is
        /// added. `None` for the world.
        from: Option<B>,
    },
    /// An impulse at once.
    Push {
        /// The body.
        body: Subject<B>,
        /// N·s.
        impulse: Vec3,
        /// Point of the part's frame that it acts at, m; `None` for the center of mass.
        point: Option<Vec3>,
    },
    /// A constant force at the center of mass, and a torque, for some time. A new firing begins anew.
    Force {
        /// The body.
        body: Subject<B>,
        /// N.
        force: Vec3,
        /// N·m.
        torque: Vec3,
        /// s, above 0. The impulse is exactly force times duration.
        duration: f64,
    },
    /// Sets the velocity of a rigid body, dynamic or kinematic.
    SetVelocity {
        /// The body.
        body: Subject<B>,
        /// Velocity of the center of mass, m/s.
        velocity: Vec3,
        /// rad/s.
        angular_velocity: Vec3,
    },
    /// Disables a body. A body of a template can be spawned again.
    Remove(Subject<B>),
    /// Enables an object of any kind: a body, a joint, a force, an event.
    Enable(B),
    /// Disables an object of any kind.
    Disable(B),
    /// Enables a loop joint.
    Attach {
        /// The joint.
        joint: B,
        /// Whether its sides are joined where they are at this moment: the frame of side B becomes that
        /// of side A. Otherwise the joint's own frames are brought together.
        here: bool,
    },
    /// Gives all visuals of a body another color.
    Recolor {
        /// The body. [`Subject::Other`] requires a trigger with a list of bodies.
        body: Subject<B>,
        /// sRGB, each 0 to 1.
        color: [f32; 3],
    },
    /// Moves a kinematic rigid body along a path, which begins when the event fires. The latest firing
    /// counts.
    MoveAlong {
        /// The body.
        body: B,
        /// Poses of the body's frame over the time since the event fired.
        #[serde(with = "tumble_collide::shared")]
        path: Arc<Spline>,
    },
    /// Sets the target of a drive: a position (rad or m) or a velocity (rad/s or m/s), as the drive has
    /// it. The latest firing counts.
    Drive {
        /// An articulated body or a loop joint.
        body: B,
        /// Degree of freedom of the articulated body; 0 of a loop joint.
        dof: usize,
        /// The new target.
        target: f64,
        /// The target while no event has set it. `None` takes the present one when the event is added.
        original: Option<f64>,
    },
    /// Looks from elsewhere.
    Camera(CameraChange),
    /// Changes a light of the scene.
    Light(LightChange),
}

/// A camera to look from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum CameraChange {
    /// A camera by its name: `scene`, or that of a mounted one.
    Named(String),
    /// A fixed camera.
    LookAt {
        /// The eye, m.
        eye: Vec3,
        /// The point in the center of the image, m.
        target: Vec3,
        /// Vertical field of view, rad, above 0 and below π.
        vertical_fov: f64,
    },
}

/// Another intensity and color of a light of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightChange {
    /// Index of the light among those of the scene, from 0.
    pub light: usize,
    /// At least 0; `None` leaves it.
    pub intensity: Option<f64>,
    /// sRGB, each 0 to 1; `None` leaves it.
    pub color: Option<[f64; 3]>,
}

impl<B> Subject<B> {
    fn map<C>(&self, f: &mut dyn FnMut(&B) -> C) -> Subject<C> {
        match self {
            Subject::Part(body, part) => Subject::Part(f(body), *part),
            Subject::Other => Subject::Other,
        }
    }
}

impl<B> Action<B> {
    /// Returns the same action with other names of objects.
    pub fn map<C>(&self, f: &mut dyn FnMut(&B) -> C) -> Action<C> {
        match self {
            &Action::Spawn { ref template, pose, velocity, angular_velocity, ref from } => Action::Spawn {
                template: f(template),
                pose,
                velocity,
                angular_velocity,
                from: from.as_ref().map(&mut *f),
            },
            &Action::Push { ref body, impulse, point } => Action::Push { body: body.map(f), impulse, point },
            &Action::Force { ref body, force, torque, duration } => {
                Action::Force { body: body.map(f), force, torque, duration }
            }
            &Action::SetVelocity { ref body, velocity, angular_velocity } => {
                Action::SetVelocity { body: body.map(f), velocity, angular_velocity }
            }
            Action::Remove(body) => Action::Remove(body.map(f)),
            Action::Enable(object) => Action::Enable(f(object)),
            Action::Disable(object) => Action::Disable(f(object)),
            Action::Attach { joint, here } => Action::Attach { joint: f(joint), here: *here },
            Action::Recolor { body, color } => Action::Recolor { body: body.map(f), color: *color },
            Action::MoveAlong { body, path } => Action::MoveAlong { body: f(body), path: path.clone() },
            &Action::Drive { ref body, dof, target, original } => {
                Action::Drive { body: f(body), dof, target, original }
            }
            Action::Camera(change) => Action::Camera(change.clone()),
            Action::Light(change) => Action::Light(*change),
        }
    }

    /// Returns whether it follows from the state of its event after the firing.
    pub(super) fn goes_on(&self) -> bool {
        let lasting = matches!(self, Action::Force { .. } | Action::MoveAlong { .. } | Action::Drive { .. });
        lasting || self.is_look() || matches!(self, Action::Attach { here: true, .. })
    }

    /// Returns the body that it is about, if it may be a part of an object or the *other* one.
    pub fn subject(&self) -> Option<&Subject<B>> {
        match self {
            Action::Push { body, .. }
            | Action::Force { body, .. }
            | Action::SetVelocity { body, .. }
            | Action::Remove(body)
            | Action::Recolor { body, .. } => Some(body),
            _ => None,
        }
    }

    /// Returns the same for a change.
    pub fn subject_mut(&mut self) -> Option<&mut Subject<B>> {
        match self {
            Action::Push { body, .. }
            | Action::Force { body, .. }
            | Action::SetVelocity { body, .. }
            | Action::Remove(body)
            | Action::Recolor { body, .. } => Some(body),
            _ => None,
        }
    }

    /// Returns whether it changes what is drawn besides poses.
    pub(super) fn is_look(&self) -> bool {
        matches!(self, Action::Recolor { .. } | Action::Camera(_) | Action::Light(_))
    }
}

//! Errors of calls to a world.

use super::script::EventError;
use crate::articulated::ArticulatedError;
use crate::constraint::mimic::MimicError;
use crate::rigid::BodyError;
use crate::settings::SettingsError;
use crate::titled::titled;
use crate::world::view::Mode;

/// Reason why a call to a world failed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// Another object has the name.
    #[error("an object named '{0}' is already in the world; names must be unique")]
    DuplicateName(String),
    /// A constant of a body is out of its range.
    #[error("body '{name}': {why}")]
    Body {
        /// Name of the body.
        name: String,
        /// The constant and its range.
        why: BodyError,
    },
    /// A scripted event, or its template, cannot be added.
    #[error("{}: {why}", titled("event", name))]
    Event {
        /// Name of the event or template.
        name: String,
        /// The fault.
        why: EventError,
    },
    /// A setting is out of its range.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The id belongs to no object of this world.
    #[error("no such object: it was removed, or belongs to another world")]
    Stale,
    /// The call needs a rigid body.
    #[error("'{0}' is not a rigid body")]
    NotRigid(String),
    /// The call needs an articulated body.
    #[error("'{0}' is not an articulated body")]
    NotArticulated(String),
    /// A constant of an articulated body is not valid.
    #[error(transparent)]
    Articulated(#[from] ArticulatedError),
    /// Two joints cannot be coupled like that.
    #[error(transparent)]
    Mimic(#[from] MimicError),
    /// The call needs a loop joint.
    #[error("'{0}' is not a loop joint")]
    NotJoint(String),
    /// The call needs a kinematic body.
    #[error(
        "body '{name}' is {mode}, and move_to is for kinematic bodies: set its position and orientation to place it, or make it kinematic"
    )]
    NotKinematic {
        /// Name of the body.
        name: String,
        /// Its mode.
        mode: Mode,
    },
    /// A static body has no velocity.
    #[error("body '{0}' is static and has no velocity; a kinematic body moves at the velocity that it is given")]
    Static(String),
    /// A sensor cannot read what it names, or the object is no sensor.
    #[error("{}: {why}", titled("sensor", name))]
    Sensor {
        /// Name of the sensor.
        name: String,
        /// The fault.
        why: String,
    },
    /// The object has more or fewer collidable parts than part states.
    #[error("'{name}' has {parts} collidable parts and {part_states} part states; the numbers must be equal")]
    Parts {
        /// Name of the object.
        name: String,
        /// Number of parts of its `Collidable`.
        parts: usize,
        /// Number of part states in its `StateSizes`.
        part_states: usize,
    },
    /// The object has no such part.
    #[error("'{name}' has no part {part}")]
    NoPart {
        /// Name of the object.
        name: String,
        /// Index of the part.
        part: usize,
    },
    /// The slice does not have one number per degree of freedom of the object.
    #[error("'{name}' has {dof} degrees of freedom, and {given} numbers were given")]
    DofCount {
        /// Name of the object.
        name: String,
        /// Its degrees of freedom.
        dof: usize,
        /// Length of the slice.
        given: usize,
    },
    /// The numbers are not a state of this object: wrong length, not finite, or an orientation that
    /// is not of unit length.
    #[error(
        "'{0}': the numbers are not a state of this object (wrong length, not finite, or an orientation that is not of unit length)"
    )]
    BadState(String),
    /// A number is not finite.
    #[error("'{0}': a number is not finite")]
    NotFinite(String),
}

//! Errors of loop joints.

/// Why a loop joint cannot be made or changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopJointError {
    /// Both sides are the world.
    #[error("loop joint '{0}' joins the world to itself; one side must be a part of an object")]
    NoPart(String),
    /// Both sides are the same part.
    #[error("loop joint '{0}' joins a part to itself; its sides must be two parts, or a part and the world")]
    SamePart(String),
    /// A gear, a rack or a pulley has one side only.
    #[error("loop joint '{0}': a {1} joins two parts, and one side is the world")]
    OnePart(String, &'static str),
    /// The object or part of a side does not exist.
    #[error("loop joint '{name}': there is no such object, or it has no part {part}")]
    Gone {
        /// Loop joint.
        name: String,
        /// Part of the side.
        part: usize,
    },
    /// A frame, point or axis is not finite.
    #[error("loop joint '{0}': a frame, point or axis is not finite")]
    NotFinite(String),
    /// The axis has length 0.
    #[error("loop joint '{0}': the axis has length 0; it must have a direction")]
    Axis(String),
    /// The two axes are parallel.
    #[error("loop joint '{0}': its two axes are parallel; expected perpendicular ones")]
    Parallel(String),
    /// A setting is out of its range.
    #[error("loop joint '{name}': {what} is {value}; it must be {expected}")]
    Range {
        /// Loop joint.
        name: String,
        /// The setting.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        expected: &'static str,
    },
    /// The kind of joint has fewer degrees of freedom.
    #[error("loop joint '{name}': there is no degree of freedom {dof}; a {kind} joint has {count}, from 0")]
    NoDof {
        /// Loop joint.
        name: String,
        /// Kind of joint.
        kind: &'static str,
        /// The degree of freedom that was asked for.
        dof: usize,
        /// Number of its degrees of freedom.
        count: usize,
    },
    /// The kind of joint has no such setting.
    #[error("loop joint '{name}': a {kind} joint has no {what}")]
    Kind {
        /// Loop joint.
        name: String,
        /// Kind of joint.
        kind: &'static str,
        /// The setting.
        what: &'static str,
    },
}

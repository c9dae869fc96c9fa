//! Errors of loop joints.

use super::LoopJointKind;
use crate::titled::titled;

/// Why a loop joint cannot be made or changed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LoopJointError {
    /// Both sides are the world.
    #[error("{} joins the world to itself; one side must be a part of an object", titled("loop joint", .0))]
    NoPart(String),
    /// Both sides are the same part.
    #[error("{} joins a part to itself; its sides must be two parts, or a part and the world", titled("loop joint", .0))]
    SamePart(String),
    /// A gear, a rack or a pulley has one side only.
    #[error("{}: a {} joins two parts, and one side is the world", titled("loop joint", .0), .1)]
    OnePart(String, &'static str),
    /// The object or part of a side does not exist.
    #[error("{}: there is no such object, or it has no part {part}", titled("loop joint", name))]
    Gone {
        /// Loop joint.
        name: String,
        /// Part of the side.
        part: usize,
    },
    /// A frame, point or axis is not finite.
    #[error("{}: a frame, point or axis is not finite", titled("loop joint", .0))]
    NotFinite(String),
    /// The axis has length 0.
    #[error("{}: the axis has length 0; it must have a direction", titled("loop joint", .0))]
    Axis(String),
    /// The two axes are parallel.
    #[error("{}: its two axes are parallel; expected perpendicular ones", titled("loop joint", .0))]
    Parallel(String),
    /// A setting is out of its range.
    #[error("{}: {what} is {value}; it must be {expected}", titled("loop joint", name))]
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
    #[error("{}: there is no degree of freedom {dof}; a {kind} joint has {count}, from 0", titled("loop joint", name))]
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
    #[error("{}: a {kind} joint has no {what}", titled("loop joint", name))]
    Kind {
        /// Loop joint.
        name: String,
        /// Kind of joint.
        kind: &'static str,
        /// The setting.
        what: &'static str,
    },
    /// The kind of joint has no such parameter.
    #[error("{}: a {} joint has no {parameter}; kinds with it: {}", titled("loop joint", name), kind.name(), LoopJointKind::names_with(parameter).join(", "))]
    Parameter {
        /// Loop joint.
        name: String,
        /// Kind of joint.
        kind: LoopJointKind,
        /// Name of the parameter: that of Python.
        parameter: &'static str,
    },
}

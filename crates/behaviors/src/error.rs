//! Errors of behaviors: bodies that do not spin, flocks, force fields, particles and spring meshes.

use std::fmt;
use tumble_core::WorldError;

/// Reason why a behavior was not made, changed or added.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum BehaviorError {
    /// A constant is out of its range.
    Range {
        /// The constant.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its range.
        range: &'static str,
    },
    /// The id belongs to no flock of this world.
    NoFlock,
    /// The object is not a boid of this flock.
    NoBoid,
    /// The world refuses the object.
    World(WorldError),
}

impl fmt::Display for BehaviorError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BehaviorError::Range { what, value, range } => write!(f, "{what} is {value}, but must be {range}"),
            BehaviorError::NoFlock => write!(f, "no such flock: it was removed, or the id is of another object"),
            BehaviorError::NoBoid => write!(f, "the object is not a boid of this flock"),
            BehaviorError::World(why) => why.fmt(f),
        }
    }
}

impl std::error::Error for BehaviorError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            BehaviorError::World(why) => Some(why),
            _ => None,
        }
    }
}

impl From<WorldError> for BehaviorError {
    fn from(why: WorldError) -> BehaviorError {
        BehaviorError::World(why)
    }
}

/// Returns an error if a constant is not finite or not within its range.
pub(crate) fn check(what: &'static str, value: f64, fits: bool, range: &'static str) -> Result<(), BehaviorError> {
    if value.is_finite() && fits { Ok(()) } else { Err(BehaviorError::Range { what, value, range }) }
}

//! Errors of boids and flocks.

use std::fmt;
use tumble_core::WorldError;

/// An error of a boid or a flock.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum FlockError {
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
    /// The world refuses the boid.
    World(WorldError),
}

impl fmt::Display for FlockError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            FlockError::Range { what, value, range } => write!(f, "{what} is {value}, but must be {range}"),
            FlockError::NoFlock => write!(f, "no such flock: it was removed, or the id is of another object"),
            FlockError::NoBoid => write!(f, "the object is not a boid of this flock"),
            FlockError::World(why) => why.fmt(f),
        }
    }
}

impl std::error::Error for FlockError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            FlockError::World(why) => Some(why),
            _ => None,
        }
    }
}

impl From<WorldError> for FlockError {
    fn from(why: WorldError) -> FlockError {
        FlockError::World(why)
    }
}

/// Returns an error if a constant is not finite or not within its range.
pub(crate) fn check(what: &'static str, value: f64, fits: bool, range: &'static str) -> Result<(), FlockError> {
    if value.is_finite() && fits { Ok(()) } else { Err(FlockError::Range { what, value, range }) }
}

//! What can be wrong with a shape or a mesh.

use thiserror::Error;

/// A shape that cannot be built, or a question that it cannot answer.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ShapeError {
    /// A length that is zero, negative or not finite.
    #[error("{what} is {value}, but must be a finite length above 0 m")]
    Length {
        /// Which length.
        what: &'static str,
        /// What was given, metres.
        value: f64,
    },
    /// A density that is zero, negative or not finite.
    #[error("density is {0}, but must be finite and above 0 kg/m³")]
    Density(f64),
    /// A half-space has no volume, mass or centre.
    #[error("a half-space is unbounded and has no mass properties; make the body static")]
    Unbounded,
}

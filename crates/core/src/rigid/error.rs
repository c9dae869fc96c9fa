//! Errors of rigid bodies.

/// The reason why the constants of a body are not valid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The mass is not a positive finite number.
    #[error("body '{name}': mass is {mass} kg; it must be finite and above 0")]
    Mass {
        /// Body.
        name: String,
        /// Value given.
        mass: f64,
    },
    /// No body has this inertia.
    #[error(
        "body '{name}': inertia has principal moments {moments:?} kg·m²; each must be finite and above 0, and none above the sum of the other two"
    )]
    Inertia {
        /// Body.
        name: String,
        /// Principal moments of the value given.
        moments: [f64; 3],
    },
    /// A constant is out of its range.
    #[error("body '{name}': {what} is {value}; it must be {wanted}")]
    Range {
        /// Body.
        name: String,
        /// Name of the constant.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        wanted: &'static str,
    },
    /// The shape has no mass properties of its own.
    #[error("body '{name}': {why}")]
    Shape {
        /// Body.
        name: String,
        /// Reason, from the shape.
        why: String,
    },
}

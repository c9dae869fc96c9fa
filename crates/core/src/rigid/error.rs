//! Errors of rigid bodies.

/// The reason why the constants of a body are not valid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The mass, kg, is not a positive finite number.
    #[error("mass is {0} kg; it must be finite and above 0")]
    Mass(f64),
    /// No body has this inertia.
    #[error(
        "inertia has principal moments {moments:?} kg·m²; each must be finite and above 0, and none above the sum of the other two"
    )]
    Inertia {
        /// Principal moments of the value given.
        moments: [f64; 3],
    },
    /// A constant is out of its range.
    #[error("{what} is {value}; it must be {expected}")]
    Range {
        /// Name of the constant.
        what: &'static str,
        /// Value given.
        value: f64,
        /// Admissible range.
        expected: &'static str,
    },
    /// Two shapes of one body, or of one link, have the same name.
    #[error("shapes {first} and {second} are both named '{name}'; give the shapes of one body or link different names")]
    ShapeNames {
        /// Number of the first one, from 0, as contacts report it.
        first: usize,
        /// Number of the second one.
        second: usize,
        /// The name.
        name: String,
    },
    /// The name of a shape is not valid.
    #[error("the name of a shape is '{name}'; {expected}")]
    ShapeName {
        /// The name.
        name: String,
        /// The name that is expected.
        expected: &'static str,
    },
    /// The shape has no mass properties of its own, for the reason that it gives.
    #[error("{0}")]
    Shape(String),
}

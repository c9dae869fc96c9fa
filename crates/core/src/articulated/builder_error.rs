//! Errors of building an articulated body from links.

use super::body::ArticulatedError;
use super::model::ModelError;
use tumble_collide::ShapeError;

/// Why an articulated body cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArticulationError {
    /// The parent of a link was not added before it.
    #[error("articulated body '{body}', link '{link}': its parent '{parent}' was not added before it; {known}")]
    Parent {
        /// Body.
        body: String,
        /// Link.
        link: String,
        /// Name given as the parent.
        parent: String,
        /// A sentence with the names of the links before it.
        known: String,
    },
    /// The mass of a shape cannot be computed.
    #[error("articulated body '{body}', link '{link}': {why}")]
    Shape {
        /// Body.
        body: String,
        /// Link.
        link: String,
        /// Reason.
        why: ShapeError,
    },
    /// A link has a mass, and no shape over which it is distributed.
    #[error(
        "articulated body '{body}', link '{link}': it has a mass but no shape over which it is distributed; give it a shape, or a center of mass (a point mass there) and, if it has one, an inertia"
    )]
    NoShape {
        /// Body.
        body: String,
        /// Link.
        link: String,
    },
    /// A link and a shape of it have masses.
    #[error(
        "articulated body '{body}', link '{link}': it has a mass, and a shape of it has one too; give a mass to the link, or masses or densities to its shapes"
    )]
    TwoMasses {
        /// Body.
        body: String,
        /// Link.
        link: String,
    },
    /// A setting does not fit the joint of a link.
    #[error("articulated body '{body}', link '{link}': {what}, and its joint has {dof} degrees of freedom")]
    Joint {
        /// Body.
        body: String,
        /// Link.
        link: String,
        /// The setting.
        what: &'static str,
        /// Degrees of freedom of the joint.
        dof: usize,
    },
    /// The tree of links is not valid.
    #[error("articulated body '{body}': {why}")]
    Model {
        /// Body.
        body: String,
        /// Reason.
        why: ModelError,
    },
    /// A constant is not valid.
    #[error(transparent)]
    Body(#[from] ArticulatedError),
}

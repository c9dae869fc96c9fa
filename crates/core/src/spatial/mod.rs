//! Spatial algebra: motions and forces of six numbers [RBDA §2].
//!
//! | type | numbers | meaning |
//! |---|---|---|
//! | [`Motion`] | angular, linear | velocity or acceleration of a body, at one of its points |
//! | [`Force`] | torque, force | wrench or momentum, the torque about a point |
//! | [`Transform`] | `R`, `p` | change of frame, for both of the above; never stored as 6×6 |
//! | [`Inertia`] | mass, first moment, inertia about the frame's origin: 10 | of a rigid body |
//! | [`ArticulatedInertia`] | `J`, `H`, `M`: 21 | of a body with descendants attached by joints |
//!
//! Motion and force are different spaces: the one product between them is [`Motion::power`], W.
//! Angular parts come first.
//!
//! ```
//! use tumble_core::spatial::{Force, Motion, Vector};
//! let turning = Motion::new(Vector::new(0.0, 0.0, 2.0), Vector::default());
//! let pushed = Force::new(Vector::default(), Vector::new(0.0, 3.0, 0.0)).from_arm(Vector::new(0.5, 0.0, 0.0));
//! assert_eq!(turning.power(pushed), 3.0);
//! ```
//! ```compile_fail,E0308
//! # use tumble_core::spatial::Motion;
//! Motion::<f64>::default().power(Motion::default());
//! ```
//!
//! All types are generic over a [`Scalar`]: `f64`, or the lanes of a SIMD register, so that one
//! code computes one state or several.

mod articulated;
mod inertia;
mod matrix;
mod motion;
mod scalar;
mod transform;
mod trig;
mod vector;

pub use articulated::ArticulatedInertia;
pub use inertia::Inertia;
pub use matrix::{Matrix, Symmetric};
pub use motion::{Force, Motion};
pub use scalar::Scalar;
pub use transform::Transform;
pub use vector::Vector;

//! A rigid body that does not spin (thesis §V.B.5).
//!
//! The thesis overrides the three methods that receive forces, impulses and test impulses, so that
//! they act on the center of mass alone:
//!
//! ```text
//! F at p  →  m·v̇ = F,  τ = 0            J·M⁻¹·Jᵀ = n·n/m
//! ```
//!
//! Locked axes of rotation give the same equations (`W = 0` in the rows of contacts), so this is a
//! constructor and no type of its own.
//!
//! | symbol | meaning |
//! |---|---|
//! | `F`, `p` | force or impulse and its point |
//! | `m`, `v` | mass; velocity of the center of mass |
//! | `J`, `n` | row of a contact; its direction |
//!
//! Departure: an initial angular velocity is discarded. In the thesis such a body keeps its spin for
//! ever, since nothing acts on it.

use tumble_core::{LockedAxes, RigidBody};

/// Returns the body with all rotations locked: forces and impulses act on its center of mass alone,
/// and its orientation stays. Its locked translations stay locked.
pub fn non_spinning(body: RigidBody) -> RigidBody {
    let locked = LockedAxes { rotation: [true; 3], ..body.locked };
    body.with_locked(locked)
}

//! The trait of objects with a state.

use super::part_state::{ForceSlice, Forces, PartState, StateRange, StateSizes};
use super::{Energy, Momentum};
use crate::derived::Cache;
use crate::world::view::WorldView;
use tumble_collide::Vec3;

/// An object with a state (thesis `Integratable` and `SimulationState`, §IV.A.1–2).
///
/// `x` is always the object's own range of the state. `v`, `dp`, `u` and `j` have one number per degree of freedom: generalized velocity, change of
/// the quantity of motion that the state holds, whitened velocity `u = L·v`, and generalized force or impulse. The mass matrix is `M = LᵀL`. `cache`
/// was made by the object's [`new_cache`](super::Object::new_cache); the four maps hold at the state of its last
/// [`refresh`](super::Object::refresh).
pub trait Integratable {
    /// Returns the numbers of entries that the object needs in the world's tables.
    fn state_sizes(&self) -> StateSizes;
    /// Writes the state at time 0.
    fn write_initial(&self, x: &mut [f64]);
    /// Returns whether `x`, of the right length, is an admissible state: finite, with orientations of unit length.
    fn accepts(&self, x: &[f64]) -> bool {
        x.iter().all(|x| x.is_finite())
    }
    /// Adds the forces on the object that it knows itself (gravity, damping) to its own rows of the table of forces.
    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces);
    /// Writes the generalized velocity at `x`.
    fn velocity(&self, x: &[f64], v: &mut [f64]);
    /// Changes the quantity of motion in `x` so that the generalized velocity is `v`: the inverse of [`velocity`](Self::velocity).
    fn write_velocity(&self, x: &mut [f64], v: &[f64]);
    /// Returns which quantity of motion the state holds.
    fn momentum_kind(&self) -> MomentumKind {
        MomentumKind::Conjugate
    }
    /// Writes the rate of the state's quantity of motion under the forces `f`: of momentum, or of velocity (the thesis's derivative).
    fn derivative(&self, cache: &mut Cache, x: &[f64], f: &ForceSlice, dp: &mut [f64]);
    /// Returns the reason why the state of the last refresh has no motion (a singular mass matrix). The step then ends with this as its error.
    fn singularity(&self, cache: &mut Cache) -> Option<String> {
        let _ = cache;
        None
    }
    /// Writes the accelerations of the parts for a rate `dp` of the state's quantity of motion.
    fn accelerations(&self, cache: &mut Cache, x: &[f64], dp: &[f64], part_states: &mut [PartState]);
    /// Writes `dp − M·v̇`, the part of the rate of momentum that changes directions but no velocity: `ω × H` of a rigid
    /// body, Coriolis terms. Rows at the acceleration level need `v̇`. Zero by default, for a constant mass matrix.
    fn gyroscopic(&self, x: &[f64], out: &mut [f64]) {
        let _ = x;
        out.fill(0.0);
    }
    /// Adds `h·dp` to the state's quantity of motion. Positions stay.
    fn kick(&self, x: &mut [f64], dp: &[f64], h: f64);
    /// Advances the state by `h` seconds without forces: exact, or symmetric and of second order at least.
    fn free_motion(&self, cache: &mut Cache, x: &mut [f64], h: f64);
    /// Moves the positions for `h` seconds with constant generalized velocity `v`; exact for rotations. The quantity of motion stays.
    fn integrate_positions(&self, x: &mut [f64], v: &[f64], h: f64);
    /// Moves the positions by `h·v` as a displacement, not a motion: kinetic energy stays, and linear momentum does to second order at least. The
    /// default is [`integrate_positions`](Self::integrate_positions), for a constant mass matrix. A rigid body scales its angular momentum. An object
    /// whose state holds velocities transports them in parallel.
    fn displace(&self, cache: &mut Cache, x: &mut [f64], v: &[f64], h: f64) {
        let _ = cache;
        self.integrate_positions(x, v, h);
    }
    /// Converts a velocity `v` at a finite `displacement` from some state to the rate of that displacement: the inverse of the
    /// differential of the exponential map of [`integrate_positions`](Self::integrate_positions). The default leaves `v` as it is, for coordinates that
    /// add up.
    fn pull_back(&self, displacement: &[f64], v: &mut [f64]) {
        let _ = (displacement, v);
    }
    /// Writes `u = L·v`.
    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]);
    /// Writes `v = L⁻¹·u`.
    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]);
    /// Writes `y = L⁻ᵀ·j`: the whitened response to a generalized impulse `j`.
    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]);
    /// Writes `j = Lᵀ·u`: the generalized impulse of a change of `u`.
    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]);
    /// Writes the whitened velocity `u = L·v` of the state. An object whose state holds the momentum `p` may write `L⁻ᵀ·p`, the same with less
    /// rounding.
    fn whitened_velocity(&self, cache: &mut Cache, x: &[f64], u: &mut [f64]) {
        let mut v = vec![0.0; u.len()];
        self.velocity(x, &mut v);
        self.mul_l(cache, &v, u);
    }
    /// Writes the part of [`derivative`](Self::derivative) that [`free_motion`](Self::free_motion) applies by itself: zero if free motion keeps the
    /// state's quantity of motion; the acceleration without forces of an object whose state holds velocities.
    fn free_motion_rate(&self, cache: &mut Cache, x: &[f64], out: &mut [f64]) {
        let _ = (cache, x);
        out.fill(0.0);
    }
    /// Returns whether the object may fall asleep (see [`Sleep`](crate::Sleep)): its own forces must not depend on time.
    fn may_sleep(&self) -> bool {
        false
    }
    /// Returns kinetic energy, and potential energy in uniform gravity (0 at the world's origin), J.
    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy;
    /// Returns linear momentum, N·s, and angular momentum about the world's origin, N·m·s.
    fn momentum(&self, x: &[f64]) -> Momentum;
}

/// The quantity of motion that a state holds, and that [`Integratable::kick`] changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MomentumKind {
    /// The generalized momentum `p = M·v`. An impulse acts where it meets the object.
    Conjugate,
    /// The generalized velocity `v`: for objects whose mass matrix turns with their pose. `time_stepping` evaluates all that pushes such an object (mass
    /// matrix, rows, the velocity before the push) in the middle of the step.
    Velocity,
}

/// The maps between a change of the state's quantity of motion and a change of whitened velocity.
impl dyn Integratable + '_ {
    /// Returns whether the state holds velocities.
    pub(crate) fn holds_velocity(&self) -> bool {
        self.momentum_kind() == MomentumKind::Velocity
    }

    /// Writes the change `du` of whitened velocity for a change `dp` of the state: `L⁻ᵀ·dp` of a momentum, `L·dp` of a velocity.
    pub(crate) fn whiten_change(&self, cache: &mut Cache, dp: &[f64], du: &mut [f64]) {
        match self.momentum_kind() {
            MomentumKind::Conjugate => self.solve_lt(cache, dp, du),
            MomentumKind::Velocity => self.mul_l(cache, dp, du),
        }
    }

    /// Writes the change `dp` of the state for a change `du` of whitened velocity: the inverse of [`whiten_change`](Self::whiten_change).
    pub(crate) fn unwhiten_change(&self, cache: &mut Cache, du: &[f64], dp: &mut [f64]) {
        match self.momentum_kind() {
            MomentumKind::Conjugate => self.mul_lt(cache, du, dp),
            MomentumKind::Velocity => self.solve_l(cache, du, dp),
        }
    }
}

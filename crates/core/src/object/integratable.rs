//! The trait of objects with a state.

use super::part_state::{ForceSlice, Forces, PartPoint, PartState, PointLoad, StateRange, StateSizes};
use super::{Energy, Momentum, Object, by_jacobian};
use crate::derived::Cache;
use crate::world::view::WorldView;
use tumble_collide::Vec3;

/// An object with a state (thesis `Integratable` and `SimulationState`, §IV.A.1–2).
///
/// `x` is always the object's own range of the state. `v`, `dp`, `u` and `j` have one number per
/// degree of freedom: generalized velocity, change of the quantity of motion that the state holds,
/// whitened velocity `u = L·v`, and generalized force or impulse. The mass matrix is `M = LᵀL`.
/// `cache` was made by the object's [`new_cache`](Object::new_cache); the Jacobian and the four
/// maps hold at the state of its last [`refresh`](Object::refresh).
///
/// The required methods are the sizes, the first state, the Jacobian and the four maps. Provided
/// methods are right for an object whose state is `x = [q, v]`, with coordinates that add up
/// (`q̇ = v`) and a constant mass matrix, and whose masses are points at the origins of its parts.
/// An object of another kind overrides the ones that differ.
pub trait Integratable: Object {
    /// Returns the numbers of entries that the object needs in the world's tables.
    fn state_sizes(&self) -> StateSizes;
    /// Writes the state at time 0.
    fn write_initial(&self, x: &mut [f64]);
    /// Adds the Jacobian of a material point's velocity along each axis, `axis·velocity = J·v`: one
    /// row of `dof` numbers per axis. An object without parts adds nothing.
    fn jacobian(&self, cache: &mut Cache, at: &PartPoint, j: &mut [f64]);
    /// Writes `u = L·v`.
    fn mul_l(&self, cache: &mut Cache, v: &[f64], u: &mut [f64]);
    /// Writes `v = L⁻¹·u`.
    fn solve_l(&self, cache: &mut Cache, u: &[f64], v: &mut [f64]);
    /// Writes `y = L⁻ᵀ·j`: the whitened response to a generalized impulse `j`.
    fn solve_lt(&self, cache: &mut Cache, j: &[f64], y: &mut [f64]);
    /// Writes `j = Lᵀ·u`: the generalized impulse of a change of `u`.
    fn mul_lt(&self, cache: &mut Cache, u: &[f64], j: &mut [f64]);

    /// Writes the change of the state's momentum for a change `du` of whitened velocity: `Lᵀ·du`, the default. Objects
    /// whose cache has more than their own inertia, for the time of one step, override it.
    fn momentum_change(&self, cache: &mut Cache, du: &[f64], dp: &mut [f64]) {
        self.mul_lt(cache, du, dp);
    }

    /// Returns the mass of a part as a point at its origin, kg: gravity, energy and momentum of the
    /// provided methods. 0 by default.
    fn part_mass(&self, part: usize) -> f64 {
        let _ = part;
        0.0
    }
    /// Returns the center of mass of a part in the frame of the part, m, for forces that act on
    /// masses. The origin by default; the provided methods do not use it.
    fn part_center(&self, part: usize) -> Vec3 {
        let _ = part;
        Vec3::zeros()
    }
    /// Returns which quantity of motion the state holds. [`MomentumKind::Velocity`] by default.
    fn momentum_kind(&self) -> MomentumKind {
        MomentumKind::Velocity
    }
    /// Returns whether `x`, of the right length, is an admissible state: finite, with orientations
    /// of unit length.
    fn accepts(&self, x: &[f64]) -> bool {
        x.iter().all(|x| x.is_finite())
    }
    /// Writes the generalized velocity at `x`. The default copies the last numbers of the state,
    /// one per degree of freedom.
    fn velocity(&self, x: &[f64], v: &mut [f64]) {
        v.copy_from_slice(&x[x.len() - v.len()..]);
    }
    /// Changes the quantity of motion in `x` so that the generalized velocity is `v`: the inverse
    /// of [`velocity`](Self::velocity).
    fn write_velocity(&self, x: &mut [f64], v: &[f64]) {
        let first = x.len() - v.len();
        x[first..].copy_from_slice(v);
    }
    /// Writes the whitened velocity `u = L·v` of the state. An object whose state holds the
    /// momentum `p` may write `L⁻ᵀ·p`, the same with less rounding.
    fn whitened_velocity(&self, cache: &mut Cache, x: &[f64], u: &mut [f64]) {
        let mut v = vec![0.0; u.len()];
        self.velocity(x, &mut v);
        self.mul_l(cache, &v, u);
    }
    /// Adds `h·dp` to the state's quantity of motion. Positions stay. The default adds to the last
    /// numbers of the state, one per degree of freedom.
    fn kick(&self, x: &mut [f64], dp: &[f64], h: f64) {
        let first = x.len() - dp.len();
        x[first..].iter_mut().zip(dp).for_each(|(x, dp)| *x += h * dp);
    }
    /// Moves the positions for `h` seconds with constant generalized velocity `v`; exact for
    /// rotations. The quantity of motion stays. The default adds `h·v` to the first numbers of the
    /// state, one per degree of freedom.
    fn integrate_positions(&self, x: &mut [f64], v: &[f64], h: f64) {
        x.iter_mut().zip(v).for_each(|(x, v)| *x += h * v);
    }
    /// Writes the generalized velocity `v` that takes the positions of `from` to those of `to` in one second: the
    /// inverse of [`integrate_positions`](Self::integrate_positions), along the shorter way. The default subtracts the
    /// first numbers of the states, one per degree of freedom.
    fn difference(&self, from: &[f64], to: &[f64], v: &mut [f64]) {
        v.iter_mut().zip(from.iter().zip(to)).for_each(|(v, (from, to))| *v = to - from);
    }
    /// Advances the state by `h` seconds without forces: exact, or symmetric and of second order at
    /// least. The default moves the positions with the velocity of the state.
    fn free_motion(&self, cache: &mut Cache, x: &mut [f64], h: f64) {
        let _ = cache;
        let mut v = vec![0.0; self.state_sizes().dof];
        self.velocity(x, &mut v);
        self.integrate_positions(x, &v, h);
    }
    /// Writes the part of [`derivative`](Self::derivative) that [`free_motion`](Self::free_motion)
    /// applies by itself: zero if free motion keeps the state's quantity of motion, the default;
    /// the acceleration without forces of an object whose state holds velocities.
    fn free_motion_rate(&self, cache: &mut Cache, x: &[f64], out: &mut [f64]) {
        let _ = (cache, x);
        out.fill(0.0);
    }
    /// Moves the positions by `h·v` as a displacement, not a motion: kinetic energy stays, and
    /// linear momentum does to second order at least. The default is
    /// [`integrate_positions`](Self::integrate_positions). A rigid body scales its angular
    /// momentum. An object whose state holds velocities and whose mass matrix is not constant
    /// transports them in parallel.
    fn displace(&self, cache: &mut Cache, x: &mut [f64], v: &[f64], h: f64) {
        let _ = cache;
        self.integrate_positions(x, v, h);
    }
    /// Converts a velocity `v` at a finite `displacement` from some state to the rate of that
    /// displacement: the inverse of the differential of the exponential map of
    /// [`integrate_positions`](Self::integrate_positions). The default leaves `v` as it is, for
    /// coordinates that add up.
    fn pull_back(&self, displacement: &[f64], v: &mut [f64]) {
        let _ = (displacement, v);
    }
    /// Adds the forces on the object that it knows itself (gravity, damping) to its own rows of the
    /// table of forces. The default adds the weights of the parts.
    fn accumulate_forces(&self, me: &StateRange, view: &WorldView, out: &mut Forces) {
        for (part, wrench) in out.wrenches[me.parts.clone()].iter_mut().enumerate() {
            wrench.force += self.part_mass(part) * view.gravity;
        }
    }
    /// Writes the rate of the state's quantity of motion under the forces `f`: of momentum, or of
    /// velocity (the thesis's derivative). The default is `ṗ = Jᵀ·F`, and `v̇ = M⁻¹·JᵀF` plus
    /// [`free_motion_rate`](Self::free_motion_rate).
    fn derivative(&self, cache: &mut Cache, x: &[f64], f: &ForceSlice, dp: &mut [f64]) {
        by_jacobian::derivative(self, cache, x, f, dp);
    }
    /// Replaces the rate `dp` of the state's quantity of motion at one time by its mean over a step of
    /// `h` seconds, as far as the object knows it. Integrators of first and second order use it: a
    /// rigid body with damping `c` decays by `exp(−c·h)`, since `dp/dt = f − c·p` has the mean
    /// `(f − c·p)·(1 − exp(−c·h))/(c·h)`. The default keeps the rate.
    fn mean_rate(&self, h: f64, dp: &mut [f64]) {
        let _ = (h, dp);
    }
    /// Writes `dp − M·v̇`, the part of the rate of momentum that changes directions but no
    /// velocity: `ω × L` of a rigid body, Coriolis terms. Rows at the acceleration level need `v̇`.
    /// Zero by default.
    fn gyroscopic(&self, x: &[f64], out: &mut [f64]) {
        let _ = x;
        out.fill(0.0);
    }
    /// Writes the accelerations of the parts for a rate `dp` of the state's quantity of motion:
    /// `J·v̇` plus the bias accelerations of the [`PartState`].
    fn accelerations(&self, cache: &mut Cache, x: &[f64], dp: &[f64], part_states: &mut [PartState]) {
        by_jacobian::accelerations(self, cache, x, dp, part_states);
    }
    /// Adds the whitened response to unit impulses along the axes at a point (thesis
    /// `ApplyTestImpulse`): `sign·L⁻ᵀJᵀ`, one row of `dof` numbers per axis.
    fn test_impulse(&self, cache: &mut Cache, at: &PartPoint, sign: f64, y: &mut [f64]) {
        by_jacobian::test_impulse(self, cache, at, sign, y);
    }
    /// Does what [`test_impulse`](Self::test_impulse) does, with the same bits, and leaves the cache unchanged; returns true. The rows of
    /// contacts of such objects are made on several threads at once. The default does nothing and returns false.
    fn test_impulse_shared(&self, cache: &Cache, at: &PartPoint, sign: f64, y: &mut [f64]) -> bool {
        let _ = (cache, at, sign, y);
        false
    }
    /// Returns the part that forces turn back and forth fastest, with the angular frequency, rad/s:
    /// those of the object's own joints, and `loads`, the forces of loop joints in the last sub-step.
    /// Parts have the accelerations of the sub-step. The steps of the world are divided so that
    /// [`Settings::max_turn`](crate::Settings::max_turn) is not exceeded. 0 by default.
    fn turning_rate(
        &self,
        cache: &mut Cache,
        part_states: &[PartState],
        gravity: &Vec3,
        loads: &mut dyn Iterator<Item = PointLoad>,
    ) -> (usize, f64) {
        let _ = (cache, part_states, gravity, loads);
        (0, 0.0)
    }
    /// Returns the length of the steps that the object's rate and mass matrix are made for, s, as those of springs that are
    /// implicit in time. `backtracking` takes steps of `time_stepping` of this length while such an object moves: no event can be
    /// located within one. At least a ten-thousandth of `Settings::dt`, and finite; the step ends with
    /// [`StepError::MadeForStep`](crate::StepError::MadeForStep) otherwise. `None` by default: any length will do.
    fn made_for_step(&self) -> Option<f64> {
        None
    }
    /// Returns the reason why the state of the last refresh has no motion (a singular mass matrix).
    /// The step then ends with this as its error.
    fn singularity(&self, cache: &mut Cache) -> Option<String> {
        let _ = cache;
        None
    }
    /// Returns whether the object may fall asleep (see [`Sleep`](crate::Sleep)): its own forces
    /// must not depend on time.
    fn may_sleep(&self) -> bool {
        false
    }
    /// Returns kinetic energy, and potential energy in uniform gravity (0 at the world's origin),
    /// J. The default is `½|L·v|²` and the energy of the weights of the parts.
    fn energy(&self, x: &[f64], gravity: &Vec3) -> Energy {
        by_jacobian::energy(self, x, gravity)
    }
    /// Returns linear momentum, N·s, and angular momentum about the world's origin, N·m·s. The
    /// default is that of the masses of the parts.
    fn momentum(&self, x: &[f64]) -> Momentum {
        by_jacobian::momentum(self, x)
    }
}

/// The quantity of motion that a state holds, and that [`Integratable::kick`] changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MomentumKind {
    /// The generalized momentum `p = M·v`. `time_stepping` applies impulses at the object's
    /// position at the time of its first impact in the step, or in the middle of a step without
    /// one.
    Conjugate,
    /// The generalized velocity `v`. `time_stepping` applies all impulses in the middle of the
    /// step, so that the cache of an object whose mass matrix depends on its pose is computed once.
    Velocity,
}

/// The maps between a change of the state's quantity of motion and a change of whitened velocity.
impl dyn Integratable + '_ {
    /// Returns whether the state holds velocities.
    pub(crate) fn holds_velocity(&self) -> bool {
        self.momentum_kind() == MomentumKind::Velocity
    }

    /// Writes the change `du` of whitened velocity for a change `dp` of the state: `L⁻ᵀ·dp` of a
    /// momentum, `L·dp` of a velocity.
    pub(crate) fn whiten_change(&self, cache: &mut Cache, dp: &[f64], du: &mut [f64]) {
        match self.momentum_kind() {
            MomentumKind::Conjugate => self.solve_lt(cache, dp, du),
            MomentumKind::Velocity => self.mul_l(cache, dp, du),
        }
    }

    /// Writes the change `dp` of the state for a change `du` of whitened velocity: the inverse of
    /// [`whiten_change`](Self::whiten_change).
    pub(crate) fn unwhiten_change(&self, cache: &mut Cache, du: &[f64], dp: &mut [f64]) {
        match self.momentum_kind() {
            MomentumKind::Conjugate => self.momentum_change(cache, du, dp),
            MomentumKind::Velocity => self.solve_l(cache, du, dp),
        }
    }
}

//! A hand that pulls at a point of a body: a damped spring to a point of the world.
//!
//! ```text
//! K = Y Yᵀ                        inverse mass of the point, 3 x 3, from test impulses: the same for rigid bodies and links
//! v⁺ = (v + h ω² d) / (1 + h ω)²   one implicit step of the critically damped spring d̈ = −ω² d − 2 ω ḋ
//! F = K⁺ (v⁺ − v) / h             the force that gives the point this velocity if no other force acts
//! C = Z Zᵀ                        inverse inertia of the part, from test couples
//! τ = C⁺ (w⁺ − w) / h             w⁺ = w / (1 + h ω/2): the grip damps the rotation, which a force at one point cannot do
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | d | from the point to its target, m |
//! | v, w | velocity of the point, angular velocity of the part |
//! | ω | the spring's frequency, rad/s |
//! | h | length of a frame, s |
//! | Y, Z | whitened responses to unit impulses at the point, and to unit couples |
//! | ⁺ of a matrix | pseudo-inverse: there is no force along directions in which the part cannot move |
//!
//! Stiffness and damping are proportional to the effective mass at the point. A light and a heavy
//! body therefore follow the hand alike, and the implicit step is stable for any ω h. Under gravity
//! g a body comes to rest g/ω² below the hand.

use super::{Coordinates, World, WorldError};
use crate::derived::Cache;
use crate::object::Integratable;
use crate::object::part_state::{PartPoint, Wrench};
use crate::world::view::ObjectId;
use nalgebra::Matrix3;
use tumble_collide::Vec3;

/// The part cannot move along directions of an effective mass that is this many times the smallest.
const CLOSED: f64 = 1e9;

const AXES: [Vec3; 3] = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

/// A damped spring between a point of a part and a point of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PickForce {
    /// The object.
    pub id: ObjectId,
    /// Index of its part.
    pub part: usize,
    /// The held point, in the part's frame, m.
    pub point: Vec3,
    /// The target of that point, world frame, m.
    pub target: Vec3,
    /// Frequency of the spring, rad/s, above 0; from rest a distance shrinks to 5 % in 4.7/ω.
    pub frequency: f64,
}

impl PickForce {
    /// Applies the force during the next frame. Returns the force, N, and the torque about the held
    /// point, N·m, world axes. Both are zero if the part does not move.
    ///
    /// # Errors
    /// [`WorldError::Stale`], [`WorldError::NoPart`], [`WorldError::NotFinite`].
    pub fn apply(&self, world: &mut World) -> Result<Wrench, WorldError> {
        let index = world.part(self.id, self.part, &[self.point, self.target, Vec3::repeat(self.frequency)])?;
        world.core.wake(self.id);
        let (h, part_state) = (world.core.settings.dt, world.core.derived.part_states[index]);
        let Coordinates { objects, caches, .. } = world.core.coordinates(None);
        let entry = objects.get(self.id).ok_or(WorldError::Stale)?;
        let reached = entry.moves() && entry.object.collidable().is_none_or(|c| c.part_moves(self.part));
        let Some(body) = entry.object.integratable().filter(|_| reached) else { return Ok(Wrench::default()) };
        let (dof, cache) = (entry.state_range.v.len(), &mut caches[entry.place]);
        let held = part_state.pose.rotation * self.point + part_state.position();
        let (v, omega) = (part_state.velocity_at(&held), self.frequency.max(0.0));
        let wanted = (v + (self.target - held) * (h * omega * omega)) / (1.0 + h * omega).powi(2);
        let at = PartPoint { part: self.part, part_state: &part_state, point: held, axes: &AXES };
        let mut impulses = vec![0.0; 3 * dof];
        body.test_impulse(cache, &at, 1.0, &mut impulses);
        let force = mass(&impulses, dof) * (wanted - v) / h;
        let slowed = part_state.angular_velocity * (1.0 / (1.0 + 0.5 * h * omega) - 1.0);
        let torque = mass(&couples(body, cache, &at, dof), dof) * slowed / h;
        world.apply_force(self.id, self.part, force, &held)?;
        world.apply_torque(self.id, self.part, torque)?;
        Ok(Wrench { torque, force })
    }
}

/// Returns the whitened responses of a part to unit couples about x, y and z, a row of `dof`
/// numbers each. The couple about an axis is a force along the third axis with an arm of 1 m along
/// the second, and the opposite force at the origin.
fn couples(body: &dyn Integratable, cache: &mut Cache, at: &PartPoint, dof: usize) -> Vec<f64> {
    let mut z = vec![0.0; 3 * dof];
    let origin = at.part_state.position();
    for (k, row) in z.chunks_exact_mut(dof.max(1)).enumerate() {
        let (arm, axes) = (AXES[(k + 1) % 3], &[AXES[(k + 2) % 3]]);
        body.test_impulse(cache, &PartPoint { point: origin + arm, axes, ..*at }, 1.0, row);
        body.test_impulse(cache, &PartPoint { point: origin, axes, ..*at }, -1.0, row);
    }
    z
}

/// Returns the pseudo-inverse of `Y Yᵀ`.
fn mass(y: &[f64], dof: usize) -> Matrix3<f64> {
    let k = Matrix3::from_fn(|r, c| (0..dof).map(|i| y[r * dof + i] * y[c * dof + i]).sum());
    let mut eigen = k.symmetric_eigen();
    let easiest = eigen.eigenvalues.max();
    eigen.eigenvalues.apply(|x| *x = if *x * CLOSED > easiest && easiest > 0.0 { 1.0 / *x } else { 0.0 });
    eigen.recompose()
}

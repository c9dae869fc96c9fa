//! A hand that pulls at a point of a body: a damped spring to a point of the world.
//!
//! ```text
//! K = Y Yᵀ                       inverse mass of the point, 3 x 3, from test impulses: the same for rigid bodies and links
//! v⁺ = (v + h ω² d) / (1 + h ω)²  one implicit step of the critically damped spring d̈ = −ω² d − 2 ω ḋ
//! F = K⁺ (v⁺ − v) / h            the force that gives the point this velocity, were it alone
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | d | from the point to where it is wanted, m |
//! | v | velocity of the point, m/s |
//! | ω | the spring's frequency, rad/s |
//! | h | length of a frame, s |
//! | K⁺ | pseudo-inverse: nothing is asked of directions in which the point cannot move |
//!
//! Stiffness and damping are in proportion to the mass that the point shows, so that a feather and a wrecking ball come to the hand alike, and the
//! implicit step is stable for any ω h. Under gravity g a body hangs g/ω² below the hand.

use super::{World, WorldError};
use crate::view::ObjectId;
use nalgebra::Matrix3;
use tumble_collide::Vec3;

/// Directions in which the point is this many times harder to move than in the easiest count as closed to it.
const CLOSED: f64 = 1e9;

/// What is pulled, where at, where to, how hard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// The object.
    pub id: ObjectId,
    /// Its part.
    pub part: usize,
    /// The point that is held, in the part's frame, m.
    pub point: Vec3,
    /// Where it is wanted, world axes, m.
    pub target: Vec3,
    /// Frequency of the spring, rad/s, above 0; a distance shrinks to 5 % in about 4.7/ω.
    pub frequency: f64,
}

impl World {
    /// Pulls during the next frame. The force, N, world axes; zero on what does not move or has no parts that impulses reach.
    ///
    /// # Errors
    /// [`WorldError::Stale`], [`WorldError::NoPart`], [`WorldError::NotFinite`].
    pub fn pull(&mut self, pull: &Pull) -> Result<Vec3, WorldError> {
        let index = self.part(pull.id, pull.part, &[pull.point, pull.target, Vec3::repeat(pull.frequency)])?;
        let (site, h) = (self.core.sites[index], self.core.settings.dt);
        let held = site.pose.rotation * pull.point + site.position();
        let (v, omega) = (site.velocity_at(&held), pull.frequency.max(0.0));
        let wanted = (v + (pull.target - held) * (h * omega * omega)) / (1.0 + h * omega).powi(2);
        let force = self.mass_at(pull.id, pull.part, index, &held) * (wanted - v) / h;
        self.apply_force(pull.id, pull.part, force, &held)?;
        Ok(force)
    }

    /// What mass a point of a part shows, kg: 3 x 3, the pseudo-inverse of what unit impulses do to the velocity there.
    fn mass_at(&self, id: ObjectId, part: usize, index: usize, point: &Vec3) -> Matrix3<f64> {
        let entry = &self.core.table.slots[id];
        let (Some(collidable), true) = (entry.object.collidable().filter(|c| c.part_moves(part)), entry.moves()) else { return Matrix3::zeros() };
        let dof = entry.span.v.len();
        let mut y = vec![0.0; 3 * dof];
        collidable.test_impulse(part, &self.core.sites[index], point, &[Vec3::x(), Vec3::y(), Vec3::z()], 1.0, &mut y);
        let k = Matrix3::from_fn(|r, c| (0..dof).map(|i| y[r * dof + i] * y[c * dof + i]).sum());
        let mut eigen = k.symmetric_eigen();
        let easiest = eigen.eigenvalues.max();
        eigen.eigenvalues.apply(|x| *x = if *x * CLOSED > easiest && easiest > 0.0 { 1.0 / *x } else { 0.0 });
        eigen.recompose()
    }
}

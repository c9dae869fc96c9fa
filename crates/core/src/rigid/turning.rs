//! How fast the forces of loop joints turn a rigid body back and forth, and the inertia with which it resists in one
//! step (equations in `step/turning.rs`).

use super::inertia::symmetric;
use super::object::{BodyCache, Resistance};
use super::{LockedAxes, RigidBody};
use crate::derived::Cache;
use crate::object::part_state::PointLoad;
use crate::step::{add_stiffness, rate_squared};
use nalgebra::SymmetricEigen;
use tumble_collide::{Mat3, Pose};

impl RigidBody {
    /// Returns the angular frequency, rad/s, in a pose of the part under `loads`; 0 without any.
    pub(super) fn fastest_turn(&self, pose: &Pose, loads: &mut dyn Iterator<Item = PointLoad>) -> f64 {
        let Some(stiffness) = self.stiffness(pose, loads) else { return 0.0 };
        let turned = |k: usize| self.omega(&pose.rotation, &stiffness.column(k).into_owned());
        rate_squared(&Mat3::from_columns(&[turned(0), turned(1), turned(2)])).sqrt()
    }

    /// Returns the stiffness `K` of `loads` in a pose of the part, N·m/rad; `None` without any.
    pub(crate) fn stiffness(&self, pose: &Pose, loads: &mut dyn Iterator<Item = PointLoad>) -> Option<Mat3> {
        let first = loads.next()?;
        let center = pose.translation.vector - self.part_arm(&pose.rotation);
        let mut stiffness = Mat3::zeros();
        for load in std::iter::once(first).chain(loads) {
            add_stiffness(&mut stiffness, &(load.point - center), &load.force);
        }
        Some(stiffness)
    }

    /// Returns the angular frequency of a stiffness, rad/s, that turns a body with its inertia and `added` to it, all in
    /// body axes.
    pub(crate) fn turning_rate_of(&self, stiffness: &Mat3, added: &Mat3) -> f64 {
        let factor = (self.inertia.tensor + added).cholesky();
        factor.map_or(0.0, |factor| rate_squared(&factor.solve(stiffness)).sqrt())
    }

    /// Returns whether it moves along and turns about all axes.
    pub(crate) fn is_free(&self) -> bool {
        self.locked == LockedAxes::default()
    }

    /// Returns whether it can resist turning: it turns about all axes.
    pub(crate) fn can_resist(&self) -> bool {
        self.locked.rotates_freely()
    }

    /// Adds to the inertia by which a cache, at all states of its next refreshes, responds to impulses; body axes, kg·m².
    pub(crate) fn resist(&self, cache: &mut Cache, added: Option<Mat3>) {
        let cache: &mut BodyCache = cache.get();
        cache.resistance = added.map(|added| Box::new(Resistance::new(added)));
    }
}

/// Returns the part of a stiffness that resists: that of the symmetric part without its negative eigenvalues.
pub(crate) fn resisting(stiffness: &Mat3) -> Mat3 {
    let eigen = SymmetricEigen::new(symmetric(stiffness));
    let axes = eigen.eigenvectors;
    axes * Mat3::from_diagonal(&eigen.eigenvalues.map(|k| k.max(0.0))) * axes.transpose()
}

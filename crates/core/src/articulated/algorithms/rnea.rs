//! Inverse dynamics by the recursive Newton–Euler algorithm: the forces for a given motion [RBDA
//! §5.3].
//!
//! The outward pass is [`Kinematics::accelerations`] with `−g` added to the base, which includes
//! weights. Each link then needs a force and a torque about its origin, and the inward pass adds
//! them to the parent's:
//!
//! ```text
//! f = m·(a + α×c + ω×(ω×c)) − f_ext           n = I·α + ω×I·ω + m·c×a − n_ext
//! τ = S_ωᵀ·n + S_vᵀ·f + a·q̈               f_λ += f,   n_λ += n + r×f
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `f`, `n` | force, and torque about the link's origin, that the joint transmits to the link |
//! | `f_ext`, `n_ext` | external wrench on the link |
//! | `a` | armature of the joint |
//! | `τ` | generalized force, one number per velocity number |
//!
//! Others as in `kinematics.rs`.

use crate::articulated::algorithms::kinematics::{Kinematics, Rates};
use crate::articulated::model::Model;
use crate::object::part_state::Wrench;
use tumble_collide::Vec3;

/// Buffers of inverse dynamics.
#[derive(Clone, Debug)]
pub struct InverseDynamics {
    accelerations: Vec<Rates>,
    loads: Vec<Wrench>,
}

impl InverseDynamics {
    /// Allocates buffers for `model`.
    pub fn new(model: &Model) -> InverseDynamics {
        let count = model.links().len();
        InverseDynamics { accelerations: vec![Rates::zero(); count], loads: vec![Wrench::default(); count] }
    }

    /// Writes `tau = M·qdd + C(q, v) − (gravity and wrenches)`: the generalized forces that
    /// accelerate the refreshed motion by `qdd` (empty for none). `wrenches` has one per link,
    /// world axes, torque about the link's origin; empty for none.
    pub fn solve(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        gravity: &Vec3,
        qdd: &[f64],
        wrenches: &[Wrench],
        tau: &mut [f64],
    ) {
        kin.accelerations(model, qdd, &-gravity, &mut self.accelerations);
        self.own_loads(model, kin, wrenches);
        for (i, link) in model.links().iter().enumerate().rev() {
            let load = self.loads[i];
            for k in link.v..link.v + link.joint.dof() {
                let column = &kin.columns()[k];
                tau[k] = column.angular.dot(&load.torque) + column.linear.dot(&load.force);
                if link.armature != 0.0 {
                    tau[k] += link.armature * qdd.get(k).copied().unwrap_or(0.0);
                }
            }
            if let Some(parent) = link.parent {
                self.loads[parent].force += load.force;
                self.loads[parent].torque += load.torque + kin.links()[i].arm.cross(&load.force);
            }
        }
    }

    /// Writes the generalized forces of the refreshed motion at `qdd = 0`.
    pub fn bias(&mut self, model: &Model, kin: &Kinematics, gravity: &Vec3, wrenches: &[Wrench], tau: &mut [f64]) {
        self.solve(model, kin, gravity, &[], wrenches, tau);
    }

    /// Returns the load that each joint transmitted to its link in the last [`solve`](Self::solve):
    /// force, and torque about the link's origin, world axes. It is the sum of the joint reaction
    /// and the generalized force.
    pub fn joint_loads(&self) -> &[Wrench] {
        &self.loads
    }

    fn own_loads(&mut self, model: &Model, kin: &Kinematics, wrenches: &[Wrench]) {
        for (i, link) in model.links().iter().enumerate() {
            let (m, own, a) = (link.mass.mass, &kin.links()[i], &self.accelerations[i]);
            let (c, turn) = (own.center, own.angular);
            let force = m * (a.linear + a.angular.cross(&c) + turn.cross(&turn.cross(&c)));
            let torque = own.inertia * a.angular + turn.cross(&(own.inertia * turn)) + m * c.cross(&a.linear);
            let outside = wrenches.get(i).copied().unwrap_or_default();
            self.loads[i] = Wrench { torque: torque - outside.torque, force: force - outside.force };
        }
    }
}

/// Refreshes the kinematics and calls [`InverseDynamics::solve`]: from `q`, `v`, `qdd` to `tau`.
#[allow(clippy::too_many_arguments, reason = "the arguments of τ = RNEA(q, v, q̈, f), and where to work")]
pub fn inverse_dynamics(
    model: &Model,
    (kin, work): (&mut Kinematics, &mut InverseDynamics),
    gravity: &Vec3,
    q: &[f64],
    v: &[f64],
    qdd: &[f64],
    wrenches: &[Wrench],
    tau: &mut [f64],
) {
    kin.refresh(model, q, v);
    work.solve(model, kin, gravity, qdd, wrenches, tau);
}

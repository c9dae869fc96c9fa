//! Accelerations without any force at other velocities than those that the links were placed with.
//!
//! Poses, articulated inertias and their factors depend on positions alone. Where a method asks for
//! `q̈ = −M⁻¹·C(q, q̇)` at several velocities of one place, the sweeps of biases and accelerations
//! are all that is left to do.

use crate::articulated::algorithms::abm::{Sweep, bias_of, inertia_about_origin, push, spread};
use crate::articulated::algorithms::dynamics::{Dynamics, load_vector};
use crate::articulated::model::compiled::JointKind;
use crate::spatial::{Force, Motion, Vector};

/// Quantities of a link that depend on its velocity, in the sweeps: see [`Slot`](crate::articulated::algorithms::abm::Slot).
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::articulated) struct LinkRates {
    angular: Vector,
    linear: Vector,
    bias_acceleration: Motion,
    bias: Force,
    effort: Force,
    acceleration: Motion,
}

impl Dynamics {
    /// Returns the buffers of [`free_acceleration_again`](Self::free_acceleration_again).
    pub(in crate::articulated) fn link_rates(&self) -> Vec<LinkRates> {
        vec![LinkRates::default(); self.sweep.slots.len()]
    }

    /// Writes `q̈` without any force to `qdd`, for velocities `v` at the positions of the last
    /// [`refresh`](Self::refresh) or [`free_acceleration`](Self::free_acceleration). Returns the
    /// kinetic energy, J, if it is asked for by `ENERGY`.
    pub(in crate::articulated) fn free_acceleration_again<const ENERGY: bool>(
        &self,
        links: &mut [LinkRates],
        v: &[f64],
        qdd: &mut [f64],
    ) -> f64 {
        let (compiled, Sweep { slots, blocks }) = (&self.compiled, &self.sweep);
        let mut doubled = 0.0;
        links[0] = LinkRates::default();
        for (i, body) in compiled.bodies.iter().enumerate() {
            let (slot, parent) = (&slots[i + 1], &links[body.parent]);
            let (outer, carried) = (parent.angular, parent.bias_acceleration);
            let none = Vector::default();
            let (turn, slide) = match body.kind {
                JointKind::Revolute => (slot.rotation.z * v[body.v], none),
                JointKind::Prismatic => (none, slot.rotation.z * v[body.v]),
                JointKind::Spherical(_) => (slot.rotation * load_vector(v, body.v), none),
                JointKind::Floating(_) => (load_vector(v, body.v), load_vector(v, body.v + 3)),
            };
            let sweeping = outer.cross(slot.arm);
            let angular = outer + turn;
            let linear = if ENERGY { parent.linear + sweeping + slide } else { none };
            let bias_acceleration = Motion {
                angular: carried.angular + outer.cross(turn),
                linear: carried.linear + carried.angular.cross(slot.arm) + outer.cross(sweeping + (slide + slide)),
            };
            let (rotational, pair) = inertia_about_origin(body, &slot.rotation);
            let h = slot.rotation.of_constant(&body.moment);
            let bias = bias_of(&rotational, pair, (h, body.mass), angular, &bias_acceleration);
            links[i + 1] = LinkRates { angular, linear, bias_acceleration, bias, ..LinkRates::default() };
            if !ENERGY {
                continue;
            }
            let of_link = angular.dot(rotational * angular) + body.mass * linear.dot(linear);
            doubled += of_link + 2.0 * linear.dot(angular.cross(h));
            if body.armature > 0.0 {
                let rates = if matches!(body.kind, JointKind::Spherical(_)) { 3 } else { 1 };
                doubled += v[body.v..][..rates].iter().map(|rate| body.armature * rate * rate).sum::<f64>();
            }
        }
        for (i, body) in compiled.bodies.iter().enumerate().rev() {
            let (slot, link) = (&slots[i + 1], &mut links[i + 1]);
            let passed = push(body, slot, blocks, link.bias, |_| 0.0, &mut link.effort);
            if body.parent != 0 {
                links[body.parent].bias += passed.from_arm(slot.arm);
            }
        }
        for (i, body) in compiled.bodies.iter().enumerate() {
            let (slot, effort) = (&slots[i + 1], links[i + 1].effort);
            let carried = links[body.parent].acceleration.at(slot.arm);
            links[i + 1].acceleration = spread(body, slot, blocks, &effort, carried, &mut |k, x| qdd[k] = x);
        }
        0.5 * doubled
    }
}

//! A root of the mass matrix from the factors of the articulated-body method, and test impulses
//! through it (thesis §III.B.6).
//!
//! Kinetic energy is a sum of squares, one per joint. With `D = C Cᵀ` and `G = U C⁻ᵀ` at each
//! joint, `V' = X Vₚ` and `V = V' + S v`:
//!
//! ```text
//! vᵀ M v = Σ |uᵢ|²     u = L v:      outward   uᵢ = Gᵀ V' + Cᵀ vᵢ
//!                      v = L⁻¹ u:    outward   vᵢ = C⁻ᵀ (uᵢ − Gᵀ V')
//!                      y = L⁻ᵀ j:    inward    yᵢ = C⁻¹ (jᵢ + Sᵀ P)      Pₚ += Xᵀ (P − G yᵢ)
//!                      j = Lᵀ u:     inward    jᵢ = C uᵢ + Sᵀ P           Pₚ += Xᵀ (P + G uᵢ)
//! ```
//!
//! so `M = LᵀL`. An impulse at one link starts as `P` there and does not affect the rest of the
//! tree: `y` has numbers only on the path to the root, at a cost of O(depth).
//!
//! | joint | `C` | `G` |
//! |---|---|---|
//! | revolute, prismatic | `√D` | `U/√D` |
//! | spherical | `R` own axes to world; `C` of `J + a·1` there | `[C − Vᵀ; Wᵀ]`, `W = C⁻¹ H`, `V = a C⁻¹` with the armature `a` |
//! | floating root | block upper triangular: `C` of `M`, `W = C⁻¹ Hᵀ`, `C` of `J − Wᵀ W` | none: nothing precedes it |

use crate::articulated::algorithms::abm::JointFactor;
use crate::articulated::algorithms::dynamics::{Dynamics, Scratch, load_vector, store_vector};
use crate::articulated::algorithms::factor::{rows_times, rows_transposed_times};
use crate::articulated::model::compiled::{CompiledLink, JointKind};
use crate::spatial::{Force, Motion, Vector};
use tumble_collide::Vec3;

/// Number of rows that walk to the root together.
const ROWS: usize = 3;

impl Dynamics {
    /// Writes `u = L v`: velocities in coordinates in which every mass is 1.
    pub fn mul_l(&self, s: &mut Scratch, v: &[f64], u: &mut [f64]) {
        self.propagate_velocities(s, v);
        for (i, body) in self.compiled.bodies.iter().enumerate() {
            let (slot, motion) = (&self.sweep.slots[i + 1], s.motions[i + 1]);
            match body.kind {
                // Gᵀ V' + Cᵀ v = Gᵀ V + a v/√D, because Gᵀ S = Cᵀ − a/√D.
                JointKind::Revolute | JointKind::Prismatic => {
                    u[body.v] = self.roots[i + 1][1] * (motion.power(slot.column) + body.armature * v[body.v])
                }
                JointKind::Spherical(block) => {
                    let JointFactor { first, w, rotor, .. } = &self.sweep.blocks[block];
                    let mut own = rows_times(w, motion.linear);
                    if body.armature > 0.0 {
                        own -= rows_times(rotor, s.motions[body.parent].angular);
                    }
                    store_vector(u, body.v, first.upper_times(motion.angular) + first.divide_root(own));
                }
                JointKind::Floating(block) => {
                    let JointFactor { first, w, second, .. } = &self.sweep.blocks[block];
                    store_vector(u, body.v, second.upper_times(motion.angular));
                    store_vector(
                        u,
                        body.v + 3,
                        first.upper_times(motion.linear) + first.divide_root(rows_times(w, motion.angular)),
                    );
                }
            }
        }
    }

    /// Writes `v = L⁻¹ u`.
    pub fn solve_l(&self, s: &mut Scratch, u: &[f64], v: &mut [f64]) {
        s.motions[0] = Motion::default();
        for (i, body) in self.compiled.bodies.iter().enumerate() {
            let slot = &self.sweep.slots[i + 1];
            let mut motion = s.motions[body.parent].at(slot.arm);
            match body.kind {
                JointKind::Revolute | JointKind::Prismatic => {
                    let rate = self.roots[i + 1][1] * u[body.v] - slot.inverse * motion.power(slot.column);
                    v[body.v] = rate;
                    let part = if body.kind == JointKind::Revolute { &mut motion.angular } else { &mut motion.linear };
                    *part += slot.rotation.z * rate;
                }
                JointKind::Spherical(block) => {
                    let JointFactor { first, w, rotor, .. } = &self.sweep.blocks[block];
                    let mut carried = rows_times(w, motion.linear);
                    if body.armature > 0.0 {
                        carried -= rows_times(rotor, motion.angular);
                    }
                    let angular = first.upper_solve(load_vector(u, body.v) - first.divide_root(carried));
                    store_vector(v, body.v, slot.rotation.transposed_times(angular - motion.angular));
                    motion.angular = angular;
                }
                JointKind::Floating(block) => {
                    let JointFactor { first, w, second, .. } = &self.sweep.blocks[block];
                    let angular = second.upper_solve(load_vector(u, body.v));
                    let linear =
                        first.upper_solve(load_vector(u, body.v + 3) - first.divide_root(rows_times(w, angular)));
                    motion = Motion::new(angular, linear);
                    store_vector(v, body.v, angular);
                    store_vector(v, body.v + 3, linear);
                }
            }
            s.motions[i + 1] = motion;
        }
    }

    /// Writes `y = L⁻ᵀ j`: the whitened response to generalized impulses. Joints without an impulse on
    /// them or beyond them cost nothing.
    pub fn solve_lt(&self, s: &mut Scratch, j: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        let mut impulses = j.iter().enumerate().filter(|(_, j)| **j != 0.0);
        if let (Some((first, _)), None) = (impulses.next(), impulses.next()) {
            return self.solve_lt_of_one(first, j, y);
        }
        s.forces.fill(Force::default());
        for (i, body) in self.compiled.bodies.iter().enumerate().rev() {
            let own = &j[body.v..body.v + body.kind.dof()];
            if own.iter().all(|j| *j == 0.0) && s.forces[i + 1] == Force::default() {
                continue;
            }
            let passed = self.solve_lt_link(i + 1, body, s.forces[i + 1], |k| j[k], |k, x| y[k] = x);
            s.forces[body.parent] += passed;
        }
    }

    /// The same for an impulse on one degree of freedom alone, with the same bits: only the links from there to the root are visited.
    fn solve_lt_of_one(&self, dof: usize, j: &[f64], y: &mut [f64]) {
        let mut link = self.compiled.bodies.partition_point(|body| body.v <= dof);
        let mut force = Force::default();
        while link != 0 {
            let body = &self.compiled.bodies[link - 1];
            let passed = self.solve_lt_link(link, body, force, |k| j[k], |k, x| y[k] = x);
            (force, link) = (Force::default() + passed, body.parent);
            if force == Force::default() {
                return;
            }
        }
    }

    /// Writes `j = Lᵀ u`: the generalized impulse of a change of `u`.
    pub fn mul_lt(&self, s: &mut Scratch, u: &[f64], j: &mut [f64]) {
        s.forces.fill(Force::default());
        for (i, body) in self.compiled.bodies.iter().enumerate().rev() {
            let (slot, mut p) = (&self.sweep.slots[i + 1], s.forces[i + 1]);
            let [root, inverse_root] = self.roots[i + 1];
            match body.kind {
                JointKind::Revolute => {
                    j[body.v] = root * u[body.v] + slot.rotation.z.dot(p.torque);
                    p += slot.column * (inverse_root * u[body.v]);
                }
                JointKind::Prismatic => {
                    j[body.v] = root * u[body.v] + slot.rotation.z.dot(p.force);
                    p += slot.column * (inverse_root * u[body.v]);
                }
                JointKind::Spherical(block) => {
                    let JointFactor { first, w, rotor, .. } = &self.sweep.blocks[block];
                    let own = load_vector(u, body.v);
                    p += Force::new(first.lower_times(own), rows_transposed_times(w, first.divide_root(own)));
                    store_vector(j, body.v, slot.rotation.transposed_times(p.torque));
                    if body.armature > 0.0 {
                        p.torque -= rows_transposed_times(rotor, first.divide_root(own));
                    }
                }
                JointKind::Floating(block) => {
                    let JointFactor { first, w, second, .. } = &self.sweep.blocks[block];
                    let (angular, linear) = (load_vector(u, body.v), load_vector(u, body.v + 3));
                    store_vector(
                        j,
                        body.v,
                        second.lower_times(angular) + rows_transposed_times(w, first.divide_root(linear)) + p.torque,
                    );
                    store_vector(j, body.v + 3, first.lower_times(linear) + p.force);
                }
            }
            s.forces[body.parent] += p.from_arm(slot.arm);
        }
    }

    /// Adds `sign·L⁻ᵀJᵀ` for the velocities along the world directions `axes` of a point of `link`
    /// at `arm` (m, world axes) from its origin. `y` has one row of [`dof`](Self::dof) numbers per
    /// axis. O(depth) per row; changes only the path to the root.
    pub fn point_response(&self, link: usize, arm: &Vec3, axes: &[Vec3], sign: f64, y: &mut [f64]) {
        let arm = Vector::from(*arm);
        self.walk(link, axes, sign, y, |n| Force::new(arm.cross(n), n));
    }

    /// Adds `sign·L⁻ᵀJᵀ` for the angular velocity of a link along the world direction `axis`.
    pub fn rotation_response(&self, link: usize, axis: &Vec3, sign: f64, y: &mut [f64]) {
        self.walk(link, std::slice::from_ref(axis), sign, y, |n| Force::new(n, Vector::default()));
    }

    /// Carries the impulses that `impulse` makes of the axes to the root, a few rows at a time.
    fn walk(&self, link: usize, axes: &[Vec3], sign: f64, y: &mut [f64], impulse: impl Fn(Vector) -> Force) {
        let dof = self.dof();
        for (axes, y) in axes.chunks(ROWS).zip(y.chunks_mut(ROWS * dof)) {
            let mut forces = [Force::default(); ROWS];
            for (p, n) in forces.iter_mut().zip(axes) {
                *p = impulse((sign * n).into());
            }
            let mut slot = link + 1;
            while slot != 0 {
                let body = &self.compiled.bodies[slot - 1];
                for (row, p) in forces[..axes.len()].iter_mut().enumerate() {
                    *p = self.solve_lt_link(slot, body, *p, |_| 0.0, |k, x| y[row * dof + k] += x);
                }
                slot = body.parent;
            }
        }
    }

    /// Writes `yᵢ` of one joint to `out` and returns the impulse that it passes to the parent,
    /// about the parent's origin.
    #[inline(always)]
    fn solve_lt_link(
        &self,
        i: usize,
        body: &CompiledLink,
        mut p: Force,
        j: impl Fn(usize) -> f64,
        mut out: impl FnMut(usize, f64),
    ) -> Force {
        let slot = &self.sweep.slots[i];
        match body.kind {
            JointKind::Revolute | JointKind::Prismatic => {
                let part = if body.kind == JointKind::Revolute { p.torque } else { p.force };
                let inverse_root = self.roots[i][1];
                let y = inverse_root * (j(body.v) + slot.rotation.z.dot(part));
                out(body.v, y);
                p -= slot.column * (inverse_root * y);
            }
            JointKind::Spherical(block) => {
                let JointFactor { first, w, rotor, .. } = &self.sweep.blocks[block];
                let own = slot.rotation * Vector::new(j(body.v), j(body.v + 1), j(body.v + 2));
                let y = first.lower_solve(own + p.torque);
                (0..3).for_each(|k| out(body.v + k, [y.x, y.y, y.z][k]));
                // P − G y = [P − C y + Vᵀ y; …] and C y = own + P.
                let scaled = first.divide_root(y);
                p = Force::new(-own, p.force - rows_transposed_times(w, scaled));
                if body.armature > 0.0 {
                    p.torque += rows_transposed_times(rotor, scaled);
                }
            }
            JointKind::Floating(block) => {
                let JointFactor { first, w, second, .. } = &self.sweep.blocks[block];
                let own = |k| Vector::new(j(k), j(k + 1), j(k + 2));
                let linear = first.lower_solve(own(body.v + 3) + p.force);
                let angular =
                    second.lower_solve(own(body.v) + p.torque - rows_transposed_times(w, first.divide_root(linear)));
                (0..3).for_each(|k| out(body.v + k, [angular.x, angular.y, angular.z][k]));
                (0..3).for_each(|k| out(body.v + 3 + k, [linear.x, linear.y, linear.z][k]));
            }
        }
        p.from_arm(slot.arm)
    }
}

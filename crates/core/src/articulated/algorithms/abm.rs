//! The articulated-body method: `q̈` from `q`, `q̇` and forces in linear time [RBDA §7.3], thesis
//! §III.B.4.
//!
//! World axes; every quantity of a link refers to its origin, which is at its joint. The transform
//! from parent to child is then a displacement `r`. Accelerations are *classical*: of the material
//! point at the origin, not spatial.
//!
//! ```text
//! place  (outward)    o = oₚ + r                       ω = ωₚ + ω_J          v = vₚ + ωₚ × r + v_J
//!                     α⁰ = α⁰ₚ + ωₚ × ω_J              a⁰ = a⁰ₚ + α⁰ₚ × r + ωₚ × (ωₚ × r + 2 v_J)
//!                     p = [J α⁰ + ω × J ω + h × a⁰;    m a⁰ + α⁰ × h + ω × (ω × h)]
//! fold   (inward)     U = IA S     D = Sᵀ U + a    Ia = IA − U D⁻¹ Uᵀ              IAₚ += Xᵀ Ia X
//! push   (inward)     e = τ − Sᵀ p              p' = p + U D⁻¹ e                pₚ += Xᵀ p'
//! spread (outward)    Â' = X Âₚ                 q̈ = D⁻¹ (e − Uᵀ Â')             Â = Â' + S q̈
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `ω_J`, `v_J` | velocity of the link relative to its parent: `s q̇` of a revolute or prismatic joint; `R q̇` of a spherical one |
//! | `α⁰`, `a⁰` | acceleration of the link with `q̈ = 0`: all centripetal and Coriolis terms |
//! | `J`, `h`, `m` | rigid inertia about the origin, first moment, mass |
//! | `IA`, `p` | articulated inertia, and the force that holds the subtree at `Â = 0`; external wrenches are subtracted from `p` |
//! | `a` | armature of a revolute, prismatic or spherical joint: the inertia of its rotor, as the joint meets it; `a·1` of a spherical one |
//! | `S` | `[s; 0]` of a revolute joint, `[0; s]` of a prismatic one, `[R; 0]` of a spherical one, `1` of a floating root |
//! | `X` | `[1 0; −r× 1]`: motion of the parent at the child's origin |
//! | `Â` | acceleration minus `[α⁰; a⁰]`. Uniform gravity `g` enters as `Â = [0; −g]` of the world |
//!
//! Because `p` contains `α⁰` and `a⁰`, the inward sweep has no velocity-product term `c`, unlike
//! [RBDA Table 7.1]: it is not in the chain of dependent operations. The inward sweep sums over all
//! children; the thesis's Algorithm 1 allows one.
//!
//! A spherical joint has `D = J + a·1 = l d lᵀ`. With `w = l⁻¹ H` and the rows `r = a l⁻¹`, which are 0 without armature:
//!
//! ```text
//! Ia = [a − rᵀ d⁻¹ r    rᵀ d⁻¹ w;    ·    M − wᵀ d⁻¹ w]
//! p' = [R τ − rᵀ d⁻¹ l⁻¹ e;    f + wᵀ d⁻¹ l⁻¹ e]              e = R τ − n of p = [n; f]
//! α̂  = l⁻ᵀ d⁻¹ (l⁻¹ e + r α̂' − w â')                          q̈ = Rᵀ (α̂ − α̂')
//! ```

use crate::articulated::algorithms::factor::{Factor, rows_times, rows_transposed_times};
use crate::articulated::model::compiled::{Compiled, CompiledLink, JointKind};
use crate::spatial::{ArticulatedInertia, Force, Inertia, Matrix, Motion, Scalar, Symmetric, Vector};
use tumble_collide::Vec3;

/// A joint is singular unless its `D` exceeds this fraction of its inertia (the trace of `J` or
/// `M`).
pub(in crate::articulated) const SINGULAR: f64 = 1e-12;

/// Input of a sweep: state and forces. It is a trait and not a set of Rust closures, so that all of
/// it is compiled for the instruction set of the sweep.
pub(in crate::articulated) trait Input<T> {
    /// Returns sine and cosine of the revolute joint of a link, whose angle is position number `q`.
    fn joint_angle_sin_cos(&self, link: usize, q: usize) -> (T, T);
    /// Returns a position number.
    fn q(&self, k: usize) -> T;
    /// Returns a velocity number.
    fn v(&self, k: usize) -> T;
    /// Returns a joint force.
    fn tau(&self, k: usize) -> T;
}

/// Data of a link in the sweeps.
#[derive(Clone, Copy, Debug)]
pub(in crate::articulated) struct Slot<T> {
    /// Axes of its inner frame in the world. The third is `s` of a revolute or prismatic joint.
    pub rotation: Matrix<T>,
    /// `r`: from the parent's origin to its own.
    pub arm: Vector<T>,
    /// `ω`.
    pub angular: Vector<T>,
    /// `[α⁰; a⁰]`.
    pub bias_acceleration: Motion<T>,
    /// `p`.
    pub bias: Force<T>,
    /// `IA`.
    pub inertia: ArticulatedInertia<T>,
    /// `U` of a revolute or prismatic joint.
    pub column: Force<T>,
    /// `D` of a revolute or prismatic joint.
    pub pivot: T,
    /// `D⁻¹`, or 0.
    pub inverse: T,
    /// Remainder of `e`: `D⁻¹ e` of a revolute or prismatic joint in the first number, `l⁻¹ e` of a
    /// spherical one in the first three, `e` of a floating root.
    pub effort: Force<T>,
    /// `Â`.
    pub acceleration: Motion<T>,
    /// Origin in the world; only if requested.
    pub position: Vector<T>,
    /// Velocity of the origin; only if requested.
    pub linear: Vector<T>,
}

/// Factors of a joint with three or six degrees of freedom.
///
/// Spherical joint: `first` factors `J + a·1`, rows `w = l⁻¹ H` and `rotor = a l⁻¹`. Floating root: `first` factors `M`, `w =
/// l⁻¹ Hᵀ`, and `second` factors `J − H M⁻¹ Hᵀ`.
#[derive(Clone, Copy, Debug)]
pub(in crate::articulated) struct JointFactor<T> {
    pub first: Factor<T>,
    pub w: [Vector<T>; 3],
    pub rotor: [Vector<T>; 3],
    pub second: Factor<T>,
}

/// Buffers of the sweeps; slot 0 is the world.
#[derive(Clone, Debug)]
pub(in crate::articulated) struct Sweep<T> {
    pub slots: Vec<Slot<T>>,
    pub blocks: Vec<JointFactor<T>>,
}

impl<T: Scalar> Sweep<T> {
    pub fn new(compiled: &Compiled, zero: T) -> Sweep<T> {
        let (none, one) = (Vector::splat(zero), zero.constant(1.0));
        let (still, no_force) = (Motion::new(none, none), Force::new(none, none));
        let unit =
            Matrix::new(Vector::new(one, zero, zero), Vector::new(zero, one, zero), Vector::new(zero, zero, one));
        let nothing = Symmetric::scaled_identity(zero);
        let inertia = ArticulatedInertia { rotational: nothing, coupling: [none; 3], mass: nothing };
        let world = Slot {
            rotation: unit,
            arm: none,
            angular: none,
            bias_acceleration: still,
            bias: no_force,
            inertia,
            column: no_force,
            pivot: zero,
            inverse: zero,
            effort: no_force,
            acceleration: still,
            position: none,
            linear: none,
        };
        let block =
            JointFactor { first: Factor::zero(zero), w: [none; 3], rotor: [none; 3], second: Factor::zero(zero) };
        Sweep { slots: vec![world; compiled.bodies.len() + 1], blocks: vec![block; compiled.blocks] }
    }

    /// Places every link and sets its rigid inertia and bias. `WHOLE` also writes positions and
    /// velocities of the origins.
    #[inline(always)]
    pub fn place<const WHOLE: bool>(&mut self, compiled: &Compiled, state: &impl Input<T>) {
        self.place_links::<WHOLE, true>(compiled, state);
    }

    /// Places every link for its kinetic energy alone: without biases, and of the inertia only `J`.
    #[inline(always)]
    pub fn place_for_energy(&mut self, compiled: &Compiled, state: &impl Input<T>) {
        self.place_links::<true, false>(compiled, state);
    }

    #[inline(always)]
    fn place_links<const WHOLE: bool, const BIASED: bool>(&mut self, compiled: &Compiled, state: &impl Input<T>) {
        for (i, body) in compiled.bodies.iter().enumerate() {
            let parent = &self.slots[body.parent];
            let turned = parent.rotation.times_constant(&body.turned);
            let mut arm = parent.rotation.of_constant(&body.offset);
            let (outer, outer_bias_acceleration) = (parent.angular, parent.bias_acceleration);
            let (parent_position, parent_linear) = (parent.position, parent.linear);
            let zero = outer.x.constant(0.0);
            let mut turn = Vector::splat(zero);
            let mut slide = turn;
            let rotation = match body.kind {
                JointKind::Revolute => {
                    turn = turned.z * state.v(body.v);
                    turned.times_turn_about_z(state.joint_angle_sin_cos(i, body.q))
                }
                JointKind::Prismatic => {
                    arm += turned.z * state.q(body.q);
                    slide = turned.z * state.v(body.v);
                    turned
                }
                JointKind::Spherical(_) => {
                    let rotation = turned * Matrix::of_quaternion(four(state, body.q));
                    turn = rotation * three(|k| state.v(k), body.v);
                    rotation
                }
                JointKind::Floating(_) => {
                    arm = three(|k| state.q(k), body.q);
                    turn = three(|k| state.v(k), body.v);
                    slide = three(|k| state.v(k), body.v + 3);
                    Matrix::of_quaternion(four(state, body.q + 3))
                }
            };
            let angular = outer + turn;
            let sweeping = outer.cross(arm);
            let slot = &mut self.slots[i + 1];
            (slot.rotation, slot.arm, slot.angular) = (rotation, arm, angular);
            if WHOLE {
                slot.position = parent_position + arm;
                slot.linear = parent_linear + sweeping + slide;
            }
            if BIASED {
                slot.bias_acceleration = Motion {
                    angular: outer_bias_acceleration.angular + outer.cross(turn),
                    linear: outer_bias_acceleration.linear
                        + outer_bias_acceleration.angular.cross(arm)
                        + outer.cross(sweeping + (slide + slide)),
                };
                load(body, slot);
            } else {
                slot.inertia.rotational = inertia_about_origin(body, &slot.rotation).0;
            }
        }
    }

    /// Sweeps inertias inward.
    #[inline(always)]
    pub fn fold(&mut self, compiled: &Compiled) {
        for (i, body) in compiled.bodies.iter().enumerate().rev() {
            self.fold_link(i + 1, body);
        }
    }

    #[inline(always)]
    pub fn fold_link(&mut self, i: usize, body: &CompiledLink) {
        let slot = &mut self.slots[i];
        let left = match body.kind {
            JointKind::Revolute => {
                let s = slot.rotation.z;
                slot.column = slot.inertia.times_angular(s);
                slot.pivot = with_armature(s.dot(slot.column.torque), body.armature);
                slot.inverse = slot.pivot.reciprocal_above(slot.inertia.rotational.trace() * SINGULAR);
                if body.parent == 0 {
                    return;
                }
                slot.inertia.minus_square(slot.column, slot.inverse)
            }
            JointKind::Prismatic => {
                let s = slot.rotation.z;
                slot.column = slot.inertia.times_linear(s);
                slot.pivot = with_armature(s.dot(slot.column.force), body.armature);
                slot.inverse = slot.pivot.reciprocal_above(slot.inertia.mass.trace() * SINGULAR);
                if body.parent == 0 {
                    return;
                }
                slot.inertia.minus_square(slot.column, slot.inverse)
            }
            JointKind::Spherical(block) => spherical_factor(&slot.inertia, body.armature, &mut self.blocks[block]),
            JointKind::Floating(block) => return floating_factor(&slot.inertia, &mut self.blocks[block]),
        };
        if body.parent != 0 {
            let shifted = left.from_arm(slot.arm);
            let parent = &mut self.slots[body.parent];
            parent.inertia = parent.inertia + shifted;
        }
    }

    /// Takes the inward step of forces at one link: the remainder of `bias` goes to the parent's.
    #[inline(always)]
    pub fn push_link(&mut self, i: usize, body: &CompiledLink, state: &impl Input<T>) {
        let slot = &mut self.slots[i];
        let mut effort = slot.effort;
        let passed = push(body, slot, &self.blocks, slot.bias, |k| state.tau(k), &mut effort);
        slot.effort = effort;
        let arm = slot.arm;
        if body.parent != 0 {
            self.slots[body.parent].bias += passed.from_arm(arm);
        }
    }

    /// Runs the whole method in uniform gravity: place, fold, push, spread.
    #[inline(always)]
    pub fn run(&mut self, compiled: &Compiled, gravity: &Vec3, state: &impl Input<T>, out: impl FnMut(usize, T)) {
        self.place::<false>(compiled, state);
        for (i, body) in compiled.bodies.iter().enumerate().rev() {
            self.fold_link(i + 1, body);
            self.push_link(i + 1, body, state);
        }
        let zero = self.slots[0].pivot;
        self.slots[0].acceleration = Motion::new(Vector::splat(zero), Vector::constant(zero, &(-gravity).into()));
        self.spread(compiled, out);
    }

    /// Passes `1/D` of every joint axis, which is 0 of one that meets no inertia, with the number of its link, in
    /// ascending order. Needs folded inertias.
    #[inline(always)]
    pub fn inverses(&self, compiled: &Compiled, mut to: impl FnMut(usize, T)) {
        for (i, body) in compiled.bodies.iter().enumerate() {
            match body.kind {
                JointKind::Revolute | JointKind::Prismatic => to(i, self.slots[i + 1].inverse),
                JointKind::Spherical(block) => self.blocks[block].first.inverses(|x| to(i, x)),
                JointKind::Floating(block) => {
                    let JointFactor { first, second, .. } = &self.blocks[block];
                    first.inverses(|x| to(i, x));
                    second.inverses(|x| to(i, x));
                }
            }
        }
    }

    /// Sweeps accelerations outward, from the world's `Â`. Writes `q̈` to `out`.
    #[inline(always)]
    pub fn spread(&mut self, compiled: &Compiled, mut out: impl FnMut(usize, T)) {
        for (i, body) in compiled.bodies.iter().enumerate() {
            let slot = &self.slots[i + 1];
            let carried = self.slots[body.parent].acceleration.at(slot.arm);
            let a = spread(body, slot, &self.blocks, &slot.effort, carried, &mut out);
            self.slots[i + 1].acceleration = a;
        }
    }
}

/// Returns the force `p'` that a joint passes on, from the force `p` on the subtree of its link and
/// its joint forces `tau`. Writes to `effort` the input of [`spread`].
#[inline(always)]
pub(in crate::articulated) fn push<T: Scalar>(
    body: &CompiledLink,
    slot: &Slot<T>,
    blocks: &[JointFactor<T>],
    p: Force<T>,
    tau: impl Fn(usize) -> T + Copy,
    effort: &mut Force<T>,
) -> Force<T> {
    let s = slot.rotation.z;
    match body.kind {
        JointKind::Revolute => {
            let rate = slot.inverse * (tau(body.v) - s.dot(p.torque));
            effort.torque.x = rate;
            p + slot.column * rate
        }
        JointKind::Prismatic => {
            let rate = slot.inverse * (tau(body.v) - s.dot(p.force));
            effort.torque.x = rate;
            p + slot.column * rate
        }
        JointKind::Spherical(block) => {
            let JointFactor { first, w, rotor, .. } = &blocks[block];
            let mut torque = slot.rotation * three(tau, body.v);
            let e = first.forward(torque - p.torque);
            effort.torque = e;
            if body.armature > 0.0 {
                torque -= rows_transposed_times(rotor, first.divide(e));
            }
            Force::new(torque, p.force + rows_transposed_times(w, first.divide(e)))
        }
        JointKind::Floating(_) => {
            *effort = Force::new(three(tau, body.v), three(tau, body.v + 3)) - p;
            p
        }
    }
}

/// Returns `Â` of a link from `Â' = X Âₚ`; writes its `q̈` to `out`.
#[inline(always)]
pub(in crate::articulated) fn spread<T: Scalar>(
    body: &CompiledLink,
    slot: &Slot<T>,
    blocks: &[JointFactor<T>],
    effort: &Force<T>,
    carried: Motion<T>,
    out: &mut impl FnMut(usize, T),
) -> Motion<T> {
    let s = slot.rotation.z;
    match body.kind {
        JointKind::Revolute => {
            let rate = effort.torque.x - slot.inverse * carried.power(slot.column);
            out(body.v, rate);
            Motion { angular: carried.angular + s * rate, linear: carried.linear }
        }
        JointKind::Prismatic => {
            let rate = effort.torque.x - slot.inverse * carried.power(slot.column);
            out(body.v, rate);
            Motion { angular: carried.angular, linear: carried.linear + s * rate }
        }
        JointKind::Spherical(block) => {
            let JointFactor { first, w, rotor, .. } = &blocks[block];
            let mut rest = effort.torque - rows_times(w, carried.linear);
            if body.armature > 0.0 {
                rest += rows_times(rotor, carried.angular);
            }
            let angular = first.backward(first.divide(rest));
            write_three(body.v, slot.rotation.transposed_times(angular - carried.angular), out);
            Motion { angular, linear: carried.linear }
        }
        JointKind::Floating(block) => {
            let a = solve_floating(&blocks[block], *effort);
            write_three(body.v, a.angular - carried.angular, out);
            write_three(body.v + 3, a.linear - carried.linear, out);
            a
        }
    }
}

/// Returns `Â = D⁻¹ e` of a floating root.
#[inline(always)]
pub(in crate::articulated) fn solve_floating<T: Scalar>(block: &JointFactor<T>, e: Force<T>) -> Motion<T> {
    let JointFactor { first, w, second, .. } = block;
    let f = first.forward(e.force);
    let n = e.torque - rows_transposed_times(w, first.divide(f));
    let angular = second.backward(second.divide(second.forward(n)));
    Motion { angular, linear: first.backward(first.divide(f - rows_times(w, angular))) }
}

/// Returns `D` of a joint with an armature.
#[inline(always)]
fn with_armature<T: Scalar>(pivot: T, armature: f64) -> T {
    pivot + pivot.constant(armature)
}

/// Sets the rigid inertia and the bias `p` of a placed link.
#[inline(always)]
fn load<T: Scalar>(body: &CompiledLink, slot: &mut Slot<T>) {
    let (rotational, pair) = inertia_about_origin(body, &slot.rotation);
    let h = slot.rotation.of_constant(&body.moment);
    let mass = slot.angular.x.constant(body.mass);
    slot.inertia = ArticulatedInertia::rigid(&Inertia { rotational, moment: h, mass });
    slot.bias = bias_of(&rotational, pair, (h, mass), slot.angular, &slot.bias_acceleration);
}

/// Returns `p` of a link with the inertia `J`, which is made of a pair of vectors, the first moment `h` and the mass.
#[inline(always)]
pub(in crate::articulated) fn bias_of<T: Scalar>(
    rotational: &Symmetric<T>,
    [n, m]: [Vector<T>; 2],
    (h, mass): (Vector<T>, T),
    omega: Vector<T>,
    bias_acceleration: &Motion<T>,
) -> Force<T> {
    let spin = n * m.dot(omega) + m * n.dot(omega);
    let torque = *rotational * bias_acceleration.angular + omega.cross(spin) + h.cross(bias_acceleration.linear);
    let force = bias_acceleration.linear * mass + bias_acceleration.angular.cross(h) + omega.cross(omega.cross(h));
    Force { torque, force }
}

/// Returns `J` of a link with these axes, and the pair of vectors that it is made of (`compiled.rs`).
#[inline(always)]
pub(in crate::articulated) fn inertia_about_origin<T: Scalar>(
    body: &CompiledLink,
    rotation: &Matrix<T>,
) -> (Symmetric<T>, [Vector<T>; 2]) {
    let (n, m) = (rotation.of_constant(&body.pair[0]), rotation.of_constant(&body.pair[1]));
    let paired = Symmetric::of_pair(n, m);
    let sphere = n.x.constant(body.sphere);
    let inertia = Symmetric { xx: paired.xx + sphere, yy: paired.yy + sphere, zz: paired.zz + sphere, ..paired };
    (inertia, [n, m])
}

#[inline(always)]
fn spherical_factor<T: Scalar>(
    inertia: &ArticulatedInertia<T>,
    armature: f64,
    block: &mut JointFactor<T>,
) -> ArticulatedInertia<T> {
    let zero = inertia.mass.xx.constant(0.0);
    if armature > 0.0 {
        return spherical_factor_with(inertia, zero.constant(armature), block);
    }
    block.first = Factor::new(&inertia.rotational, inertia.rotational.trace() * SINGULAR);
    block.w = block.first.forward_rows(inertia.coupling);
    let mass = block.first.complement(&inertia.mass, &block.w);
    ArticulatedInertia { rotational: Symmetric::scaled_identity(zero), coupling: [Vector::splat(zero); 3], mass }
}

/// As [`spherical_factor`], with an armature: the joint then passes on torques too.
#[inline(always)]
fn spherical_factor_with<T: Scalar>(
    inertia: &ArticulatedInertia<T>,
    armature: T,
    block: &mut JointFactor<T>,
) -> ArticulatedInertia<T> {
    let zero = armature.constant(0.0);
    let own = Symmetric::scaled_identity(armature);
    let d = inertia.rotational + own;
    block.first = Factor::new(&d, d.trace() * SINGULAR);
    block.w = block.first.forward_rows(inertia.coupling);
    block.rotor = block.first.forward_rows([
        Vector::new(armature, zero, zero),
        Vector::new(zero, armature, zero),
        Vector::new(zero, zero, armature),
    ]);
    let scaled = block.first.divide_rows(block.w);
    let row = |of: fn(&Vector<T>) -> T| {
        scaled[0] * of(&block.rotor[0]) + scaled[1] * of(&block.rotor[1]) + scaled[2] * of(&block.rotor[2])
    };
    ArticulatedInertia {
        rotational: block.first.complement(&own, &block.rotor),
        coupling: [row(|r| r.x), row(|r| r.y), row(|r| r.z)],
        mass: block.first.complement(&inertia.mass, &block.w),
    }
}

#[inline(always)]
fn floating_factor<T: Scalar>(inertia: &ArticulatedInertia<T>, block: &mut JointFactor<T>) {
    let [x, y, z] = inertia.coupling;
    let columns = [Vector::new(x.x, y.x, z.x), Vector::new(x.y, y.y, z.y), Vector::new(x.z, y.z, z.z)];
    block.first = Factor::new(&inertia.mass, inertia.mass.trace() * SINGULAR);
    block.w = block.first.forward_rows(columns);
    let rest = block.first.complement(&inertia.rotational, &block.w);
    block.second = Factor::new(&rest, inertia.rotational.trace() * SINGULAR);
}

/// Returns four position numbers from `k` on.
#[inline(always)]
fn four<T>(state: &impl Input<T>, k: usize) -> [T; 4] {
    [state.q(k), state.q(k + 1), state.q(k + 2), state.q(k + 3)]
}

/// Returns three numbers from `k` on.
#[inline(always)]
pub(in crate::articulated) fn three<T>(from: impl Fn(usize) -> T, k: usize) -> Vector<T> {
    Vector { x: from(k), y: from(k + 1), z: from(k + 2) }
}

/// Writes three numbers from `k` on.
#[inline(always)]
pub(in crate::articulated) fn write_three<T>(k: usize, v: Vector<T>, out: &mut impl FnMut(usize, T)) {
    out(k, v.x);
    out(k + 1, v.y);
    out(k + 2, v.z);
}

//! Articulated-body inertia: a body with descendants attached by joints [RBDA §7.1]. 21 numbers,
//! world axes.
//!
//! ```text
//! IA = [ J   H ]      [n; f] = [J α + H a;  Hᵀ α + M a]
//!      [ Hᵀ  M ]
//! about the point from which this one's origin is at r,  Xᵀ IA X  with  X = [1 0; −r× 1]:
//!      M' = M;   H' = H + r× M;   J' = J − H r× + r× H'ᵀ
//! ```

use super::inertia::Inertia;
use super::matrix::Symmetric;
use super::motion::{Force, Motion};
use super::scalar::Scalar;
use super::vector::Vector;
use std::ops::Add;

/// A symmetric 6×6 matrix by its blocks; `H` by its rows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ArticulatedInertia<T = f64> {
    /// `J`, kg·m².
    pub rotational: Symmetric<T>,
    /// Rows of `H`, kg·m.
    pub coupling: [Vector<T>; 3],
    /// `M`, kg: depends on the direction.
    pub mass: Symmetric<T>,
}

impl<T: Scalar> ArticulatedInertia<T> {
    /// Returns the inertia of a rigid body.
    #[inline(always)]
    pub fn rigid(body: &Inertia<T>) -> ArticulatedInertia<T> {
        let (h, zero) = (body.moment, body.mass.constant(0.0));
        let coupling = [Vector::new(zero, -h.z, h.y), Vector::new(h.z, zero, -h.x), Vector::new(-h.y, h.x, zero)];
        ArticulatedInertia { rotational: body.rotational, coupling, mass: Symmetric::scaled_identity(body.mass) }
    }

    /// Returns `H v`.
    #[inline(always)]
    pub fn coupling_times(&self, v: Vector<T>) -> Vector<T> {
        Vector::new(self.coupling[0].dot(v), self.coupling[1].dot(v), self.coupling[2].dot(v))
    }

    /// Returns `Hᵀ v`.
    #[inline(always)]
    pub fn coupling_transposed_times(&self, v: Vector<T>) -> Vector<T> {
        self.coupling[0] * v.x + self.coupling[1] * v.y + self.coupling[2] * v.z
    }

    /// Returns `IA [α; a]`.
    #[inline(always)]
    pub fn times(&self, a: Motion<T>) -> Force<T> {
        Force {
            torque: self.rotational * a.angular + self.coupling_times(a.linear),
            force: self.coupling_transposed_times(a.angular) + self.mass * a.linear,
        }
    }

    /// Returns `IA s` of a rotation about the axis `s`: `[J s; Hᵀ s]`.
    #[inline(always)]
    pub fn times_angular(&self, s: Vector<T>) -> Force<T> {
        Force { torque: self.rotational * s, force: self.coupling_transposed_times(s) }
    }

    /// Returns `IA s` of a translation along `s`: `[H s; M s]`.
    #[inline(always)]
    pub fn times_linear(&self, s: Vector<T>) -> Force<T> {
        Force { torque: self.coupling_times(s), force: self.mass * s }
    }

    /// Returns `IA − U Uᵀ d`: the inertia that remains beyond a joint with `U = IA s` and `d =
    /// 1/(s·U)`.
    #[inline(always)]
    pub fn minus_square(&self, u: Force<T>, d: T) -> ArticulatedInertia<T> {
        let (n, f) = (u.torque * d, u.force * d);
        let [x, y, z] = self.coupling;
        ArticulatedInertia {
            rotational: self.rotational.minus_outer(u.torque, n),
            coupling: [x - f * u.torque.x, y - f * u.torque.y, z - f * u.torque.z],
            mass: self.mass.minus_outer(u.force, f),
        }
    }

    /// Returns the same inertia about the point from which this one's origin is at `r`.
    #[inline(always)]
    pub fn from_arm(&self, r: Vector<T>) -> ArticulatedInertia<T> {
        let (mx, my, mz) = (self.mass.row_x(), self.mass.row_y(), self.mass.row_z());
        let [hx, hy, hz] = self.coupling;
        // Rows of H' = H + r× M.
        let (gx, gy, gz) = (hx + mz * r.y - my * r.z, hy + mx * r.z - mz * r.x, hz + my * r.x - mx * r.y);
        // J'ᵢⱼ = Jᵢⱼ + (r × row i of H)ⱼ + (r × row j of H')ᵢ.
        let j = &self.rotational;
        let rotational = Symmetric {
            xx: j.xx + (r.y * (hx.z + gx.z) - r.z * (hx.y + gx.y)),
            yy: j.yy + (r.z * (hy.x + gy.x) - r.x * (hy.z + gy.z)),
            zz: j.zz + (r.x * (hz.y + gz.y) - r.y * (hz.x + gz.x)),
            xy: j.xy + (r.z * hx.x - r.x * hx.z) + (r.y * gy.z - r.z * gy.y),
            xz: j.xz + (r.x * hx.y - r.y * hx.x) + (r.y * gz.z - r.z * gz.y),
            yz: j.yz + (r.x * hy.y - r.y * hy.x) + (r.z * gz.x - r.x * gz.z),
        };
        ArticulatedInertia { rotational, coupling: [gx, gy, gz], mass: self.mass }
    }
}

impl<T: Scalar> Add for ArticulatedInertia<T> {
    type Output = ArticulatedInertia<T>;
    #[inline(always)]
    fn add(self, b: ArticulatedInertia<T>) -> ArticulatedInertia<T> {
        let coupling =
            [self.coupling[0] + b.coupling[0], self.coupling[1] + b.coupling[1], self.coupling[2] + b.coupling[2]];
        ArticulatedInertia { rotational: self.rotational + b.rotational, coupling, mass: self.mass + b.mass }
    }
}

//! Factors of symmetric 3×3 blocks: `A = l·diag(d)·lᵀ` with `l` unit lower triangular, so `C =
//! l·√d` has `A = C Cᵀ`.
//!
//! A pivot at or below `least` counts as infinite: its reciprocal and root are 0, and that
//! direction has no response. A singular block thus gives finite numbers everywhere.

use crate::spatial::{Scalar, Symmetric, Vector};

/// `l`, `1/d` and, after [`with_roots`](Factor::with_roots), `√d` and `1/√d`.
#[derive(Clone, Copy, Debug)]
pub(in crate::articulated) struct Factor<T> {
    /// Below the diagonal: rows 2 and 3 of column 1, row 3 of column 2.
    l: [T; 3],
    pivots: Vector<T>,
    inverse: Vector<T>,
    root: Vector<T>,
    inverse_root: Vector<T>,
}

impl<T: Scalar> Factor<T> {
    /// Returns the factor of the zero block.
    pub fn zero(zero: T) -> Factor<T> {
        let none = Vector::splat(zero);
        Factor { l: [zero; 3], pivots: none, inverse: none, root: none, inverse_root: none }
    }

    /// Factors a block, without roots.
    #[inline(always)]
    pub fn new(a: &Symmetric<T>, least: T) -> Factor<T> {
        let ix = a.xx.reciprocal_above(least);
        let (yx, zx) = (a.xy * ix, a.xz * ix);
        let dy = a.yy - a.xy * yx;
        let iy = dy.reciprocal_above(least);
        let ez = a.yz - a.xz * yx;
        let zy = ez * iy;
        let dz = a.zz - a.xz * zx - ez * zy;
        let inverse = Vector::new(ix, iy, dz.reciprocal_above(least));
        let none = Vector::splat(a.xx.constant(0.0));
        Factor { l: [yx, zx, zy], pivots: Vector::new(a.xx, dy, dz), inverse, root: none, inverse_root: none }
    }

    /// Passes the reciprocals of the three pivots.
    #[inline(always)]
    pub fn inverses(&self, mut to: impl FnMut(T)) {
        to(self.inverse.x);
        to(self.inverse.y);
        to(self.inverse.z);
    }

    /// `l⁻¹ x`.
    #[inline(always)]
    pub fn forward(&self, x: Vector<T>) -> Vector<T> {
        let y = x.y - self.l[0] * x.x;
        Vector::new(x.x, y, x.z - self.l[1] * x.x - self.l[2] * y)
    }

    /// `l⁻ᵀ x`.
    #[inline(always)]
    pub fn backward(&self, x: Vector<T>) -> Vector<T> {
        let y = x.y - self.l[2] * x.z;
        Vector::new(x.x - self.l[0] * y - self.l[1] * x.z, y, x.z)
    }

    /// `diag(d)⁻¹ x`.
    #[inline(always)]
    pub fn divide(&self, x: Vector<T>) -> Vector<T> {
        hadamard(self.inverse, x)
    }

    /// `l⁻¹ B`, rows.
    #[inline(always)]
    pub fn forward_rows(&self, rows: [Vector<T>; 3]) -> [Vector<T>; 3] {
        let [x, y, z] = rows;
        let y = y - x * self.l[0];
        [x, y, z - x * self.l[1] - y * self.l[2]]
    }

    /// `diag(d)⁻¹ B`, rows.
    #[inline(always)]
    pub fn divide_rows(&self, rows: [Vector<T>; 3]) -> [Vector<T>; 3] {
        let [x, y, z] = rows;
        [x * self.inverse.x, y * self.inverse.y, z * self.inverse.z]
    }

    /// `A − Wᵀ diag(d)⁻¹ W` of rows `w` of `W`.
    #[inline(always)]
    pub fn complement(&self, a: &Symmetric<T>, w: &[Vector<T>; 3]) -> Symmetric<T> {
        let a = a.minus_outer(w[0], w[0] * self.inverse.x);
        let a = a.minus_outer(w[1], w[1] * self.inverse.y);
        a.minus_outer(w[2], w[2] * self.inverse.z)
    }
}

impl Factor<f64> {
    /// Returns whether all pivots exceed the minimum.
    pub fn is_positive(&self) -> bool {
        self.inverse.x > 0.0 && self.inverse.y > 0.0 && self.inverse.z > 0.0
    }

    /// Adds the roots that the four maps below need.
    pub fn with_roots(mut self) -> Factor<f64> {
        let roots = |i: f64, d: f64| if i > 0.0 { (d.sqrt(), 1.0 / d.sqrt()) } else { (0.0, 0.0) };
        let (i, d) = (self.inverse, self.pivots);
        let (x, y, z) = (roots(i.x, d.x), roots(i.y, d.y), roots(i.z, d.z));
        (self.root, self.inverse_root) = (Vector::new(x.0, y.0, z.0), Vector::new(x.1, y.1, z.1));
        self
    }

    /// `√d⁻¹ x`.
    pub fn divide_root(&self, x: Vector<f64>) -> Vector<f64> {
        hadamard(self.inverse_root, x)
    }

    /// `C⁻¹ x`.
    pub fn lower_solve(&self, x: Vector<f64>) -> Vector<f64> {
        self.divide_root(self.forward(x))
    }

    /// `C⁻ᵀ x`.
    pub fn upper_solve(&self, x: Vector<f64>) -> Vector<f64> {
        self.backward(self.divide_root(x))
    }

    /// `C x`.
    pub fn lower_times(&self, x: Vector<f64>) -> Vector<f64> {
        let s = hadamard(self.root, x);
        Vector::new(s.x, s.y + self.l[0] * s.x, s.z + self.l[1] * s.x + self.l[2] * s.y)
    }

    /// `Cᵀ x`.
    pub fn upper_times(&self, x: Vector<f64>) -> Vector<f64> {
        hadamard(self.root, Vector::new(x.x + self.l[0] * x.y + self.l[1] * x.z, x.y + self.l[2] * x.z, x.z))
    }
}

#[inline(always)]
fn hadamard<T: Scalar>(a: Vector<T>, b: Vector<T>) -> Vector<T> {
    Vector::new(a.x * b.x, a.y * b.y, a.z * b.z)
}

/// `W v` by the rows of `W`.
#[inline(always)]
pub(in crate::articulated) fn rows_times<T: Scalar>(w: &[Vector<T>; 3], v: Vector<T>) -> Vector<T> {
    Vector::new(w[0].dot(v), w[1].dot(v), w[2].dot(v))
}

/// `Wᵀ v` by the rows of `W`.
#[inline(always)]
pub(in crate::articulated) fn rows_transposed_times<T: Scalar>(w: &[Vector<T>; 3], v: Vector<T>) -> Vector<T> {
    w[0] * v.x + w[1] * v.y + w[2] * v.z
}

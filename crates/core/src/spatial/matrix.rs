//! General and symmetric 3×3 matrices.

use super::scalar::Scalar;
use super::vector::Vector;
use std::ops::{Add, Mul};
use tumble_collide::Mat3;

/// A 3×3 matrix by its columns, over any [`Scalar`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Matrix<T = f64> {
    /// First column.
    pub x: Vector<T>,
    /// Second column.
    pub y: Vector<T>,
    /// Third column.
    pub z: Vector<T>,
}

impl<T: Scalar> Matrix<T> {
    /// Makes the matrix `[x y z]` from its columns.
    #[inline(always)]
    pub fn new(x: Vector<T>, y: Vector<T>, z: Vector<T>) -> Matrix<T> {
        Matrix { x, y, z }
    }

    /// Returns the rotation of a quaternion `x, y, z, w` of any length above 0: `1 + s (…)` with `s =
    /// 2/|q|²`.
    #[inline(always)]
    pub fn of_quaternion([x, y, z, w]: [T; 4]) -> Matrix<T> {
        let (zero, one) = (x.constant(0.0), x.constant(1.0));
        let s = (x * x + y * y + z * z + w * w).reciprocal_above(zero) * 2.0;
        let (sx, sy, sz) = (x * s, y * s, z * s);
        let (xx, yy, zz) = (x * sx, y * sy, z * sz);
        let (xy, xz, yz) = (x * sy, x * sz, y * sz);
        let (wx, wy, wz) = (w * sx, w * sy, w * sz);
        Matrix {
            x: Vector::new(one - (yy + zz), xy + wz, xz - wy),
            y: Vector::new(xy - wz, one - (xx + zz), yz + wx),
            z: Vector::new(xz + wy, yz - wx, one - (xx + yy)),
        }
    }

    /// Returns `A·Rz` for the sine and cosine of an angle.
    #[inline(always)]
    pub fn times_turn_about_z(&self, (sin, cos): (T, T)) -> Matrix<T> {
        Matrix { x: self.x * cos + self.y * sin, y: self.y * cos - self.x * sin, z: self.z }
    }

    /// Returns `Aᵀ v`.
    #[inline(always)]
    pub fn transposed_times(&self, v: Vector<T>) -> Vector<T> {
        Vector::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// Returns `A c` for a constant vector.
    #[inline(always)]
    pub fn of_constant(&self, c: &Vector<f64>) -> Vector<T> {
        self.x.times_constant(c.x) + self.y.times_constant(c.y) + self.z.times_constant(c.z)
    }

    /// Returns `A C` for a constant matrix.
    #[inline(always)]
    pub fn times_constant(&self, c: &Matrix<f64>) -> Matrix<T> {
        Matrix { x: self.of_constant(&c.x), y: self.of_constant(&c.y), z: self.of_constant(&c.z) }
    }
}

impl<T: Scalar> Mul<Vector<T>> for Matrix<T> {
    type Output = Vector<T>;
    #[inline(always)]
    fn mul(self, v: Vector<T>) -> Vector<T> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }
}

impl<T: Scalar> Mul for Matrix<T> {
    type Output = Matrix<T>;
    #[inline(always)]
    fn mul(self, b: Matrix<T>) -> Matrix<T> {
        Matrix { x: self * b.x, y: self * b.y, z: self * b.z }
    }
}

impl From<Mat3> for Matrix<f64> {
    fn from(m: Mat3) -> Matrix<f64> {
        Matrix {
            x: m.column(0).into_owned().into(),
            y: m.column(1).into_owned().into(),
            z: m.column(2).into_owned().into(),
        }
    }
}

impl From<Matrix<f64>> for Mat3 {
    fn from(m: Matrix<f64>) -> Mat3 {
        Mat3::from_columns(&[m.x.into(), m.y.into(), m.z.into()])
    }
}

/// A symmetric 3×3 matrix: six numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric<T = f64> {
    /// Row 1, column 1.
    pub xx: T,
    /// Row 2, column 2.
    pub yy: T,
    /// Row 3, column 3.
    pub zz: T,
    /// Row 1, column 2.
    pub xy: T,
    /// Row 1, column 3.
    pub xz: T,
    /// Row 2, column 3.
    pub yz: T,
}

impl<T: Scalar> Symmetric<T> {
    /// Returns `s·1`.
    #[inline(always)]
    pub fn scaled_identity(s: T) -> Symmetric<T> {
        let zero = s.constant(0.0);
        Symmetric { xx: s, yy: s, zz: s, xy: zero, xz: zero, yz: zero }
    }

    /// Returns `a bᵀ + b aᵀ`.
    #[inline(always)]
    pub fn of_pair(a: Vector<T>, b: Vector<T>) -> Symmetric<T> {
        let (x, y, z) = (a.x * b.x, a.y * b.y, a.z * b.z);
        Symmetric {
            xx: x + x,
            yy: y + y,
            zz: z + z,
            xy: a.x * b.y + a.y * b.x,
            xz: a.x * b.z + a.z * b.x,
            yz: a.y * b.z + a.z * b.y,
        }
    }

    /// Returns the first row (and column).
    #[inline(always)]
    pub fn row_x(&self) -> Vector<T> {
        Vector::new(self.xx, self.xy, self.xz)
    }

    /// Returns the second row (and column).
    #[inline(always)]
    pub fn row_y(&self) -> Vector<T> {
        Vector::new(self.xy, self.yy, self.yz)
    }

    /// Returns the third row (and column).
    #[inline(always)]
    pub fn row_z(&self) -> Vector<T> {
        Vector::new(self.xz, self.yz, self.zz)
    }

    /// Returns the sum of the diagonal.
    #[inline(always)]
    pub fn trace(&self) -> T {
        self.xx + self.yy + self.zz
    }

    /// Returns `A − a bᵀ` for parallel `a` and `b`, so that the result is symmetric.
    #[inline(always)]
    pub fn minus_outer(&self, a: Vector<T>, b: Vector<T>) -> Symmetric<T> {
        Symmetric {
            xx: self.xx - a.x * b.x,
            yy: self.yy - a.y * b.y,
            zz: self.zz - a.z * b.z,
            xy: self.xy - a.x * b.y,
            xz: self.xz - a.x * b.z,
            yz: self.yz - a.y * b.z,
        }
    }
}

impl<T: Scalar> Add for Symmetric<T> {
    type Output = Symmetric<T>;
    #[inline(always)]
    fn add(self, b: Symmetric<T>) -> Symmetric<T> {
        Symmetric {
            xx: self.xx + b.xx,
            yy: self.yy + b.yy,
            zz: self.zz + b.zz,
            xy: self.xy + b.xy,
            xz: self.xz + b.xz,
            yz: self.yz + b.yz,
        }
    }
}

impl<T: Scalar> Mul<Vector<T>> for Symmetric<T> {
    type Output = Vector<T>;
    #[inline(always)]
    fn mul(self, v: Vector<T>) -> Vector<T> {
        Vector::new(self.row_x().dot(v), self.row_y().dot(v), self.row_z().dot(v))
    }
}

impl From<Mat3> for Symmetric<f64> {
    /// Takes the symmetric part.
    fn from(m: Mat3) -> Symmetric<f64> {
        let mean = |i: usize, j: usize| 0.5 * (m[(i, j)] + m[(j, i)]);
        Symmetric { xx: m[(0, 0)], yy: m[(1, 1)], zz: m[(2, 2)], xy: mean(0, 1), xz: mean(0, 2), yz: mean(1, 2) }
    }
}

impl From<Symmetric<f64>> for Mat3 {
    fn from(s: Symmetric<f64>) -> Mat3 {
        Mat3::new(s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz)
    }
}

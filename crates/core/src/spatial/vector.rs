//! Vectors of three numbers.

use super::scalar::Scalar;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};
use tumble_collide::Vec3;

/// A vector of three dimensions over any [`Scalar`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector<T = f64> {
    /// First component.
    pub x: T,
    /// Second component.
    pub y: T,
    /// Third component.
    pub z: T,
}

impl<T: Scalar> Vector<T> {
    /// `(x, y, z)`.
    #[inline(always)]
    pub fn new(x: T, y: T, z: T) -> Vector<T> {
        Vector { x, y, z }
    }

    /// Makes a vector of three equal components.
    #[inline(always)]
    pub fn splat(x: T) -> Vector<T> {
        Vector { x, y: x, z: x }
    }

    /// Makes a vector of constants, in every lane of `like`.
    #[inline(always)]
    pub fn constant(like: T, v: &Vector<f64>) -> Vector<T> {
        Vector::new(like.constant(v.x), like.constant(v.y), like.constant(v.z))
    }

    /// Returns the product with a constant.
    #[inline(always)]
    pub fn times_constant(self, s: f64) -> Vector<T> {
        Vector { x: self.x * s, y: self.y * s, z: self.z * s }
    }

    /// Returns `self · other`, summed in the order x, y, z.
    #[inline(always)]
    pub fn dot(self, other: Vector<T>) -> T {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// Returns `self × other`.
    #[inline(always)]
    pub fn cross(self, other: Vector<T>) -> Vector<T> {
        Vector {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }
}

impl<T: Scalar> Add for Vector<T> {
    type Output = Vector<T>;
    #[inline(always)]
    fn add(self, b: Vector<T>) -> Vector<T> {
        Vector { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

impl<T: Scalar> Sub for Vector<T> {
    type Output = Vector<T>;
    #[inline(always)]
    fn sub(self, b: Vector<T>) -> Vector<T> {
        Vector { x: self.x - b.x, y: self.y - b.y, z: self.z - b.z }
    }
}

impl<T: Scalar> Neg for Vector<T> {
    type Output = Vector<T>;
    #[inline(always)]
    fn neg(self) -> Vector<T> {
        Vector { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<T: Scalar> Mul<T> for Vector<T> {
    type Output = Vector<T>;
    #[inline(always)]
    fn mul(self, s: T) -> Vector<T> {
        Vector { x: self.x * s, y: self.y * s, z: self.z * s }
    }
}

impl<T: Scalar> AddAssign for Vector<T> {
    #[inline(always)]
    fn add_assign(&mut self, b: Vector<T>) {
        *self = *self + b;
    }
}

impl<T: Scalar> SubAssign for Vector<T> {
    #[inline(always)]
    fn sub_assign(&mut self, b: Vector<T>) {
        *self = *self - b;
    }
}

impl From<Vec3> for Vector<f64> {
    #[inline(always)]
    fn from(v: Vec3) -> Vector<f64> {
        Vector { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Vector<f64>> for Vec3 {
    #[inline(always)]
    fn from(v: Vector<f64>) -> Vec3 {
        Vec3::new(v.x, v.y, v.z)
    }
}

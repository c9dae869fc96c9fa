//! The scalars of the algebra.

use super::trig;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `f64`, or several of them in the lanes of a SIMD register. Every operation acts on each lane
/// alone and rounds like `f64`, so the bits of a lane do not depend on the number of lanes. No
/// operation fuses a product and a sum into one rounding.
pub trait Scalar:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + Mul<f64, Output = Self>
    + AddAssign
    + SubAssign
{
    /// Returns `value` in every lane. A method, because a value may carry the proof that the
    /// processor supports the instructions.
    fn constant(self, value: f64) -> Self;
    /// Returns the square root.
    fn sqrt(self) -> Self;
    /// Returns `1/self` if `self > least`, else 0; also 0 if either is NaN.
    fn reciprocal_above(self, least: Self) -> Self;
    /// Returns `libm`'s sine and cosine in lanes in which `|self|` exceeds `far` or is NaN, and
    /// `near` in the others.
    fn sin_cos_beyond(self, far: f64, near: (Self, Self)) -> (Self, Self);
    /// Returns sine and cosine of an angle in rad, to one unit in the last place.
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        self.sin_cos_beyond(trig::FAR, trig::sin_cos(self))
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn constant(self, value: f64) -> f64 {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn reciprocal_above(self, least: f64) -> f64 {
        if self > least { 1.0 / self } else { 0.0 }
    }

    #[inline(always)]
    fn sin_cos_beyond(self, far: f64, near: (f64, f64)) -> (f64, f64) {
        if self.abs() <= far { near } else { nalgebra::ComplexField::sin_cos(self) }
    }
}

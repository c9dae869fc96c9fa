//! The numbers that the algebra is written over.

use super::trig;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `f64`, or some of them side by side in the lanes of a SIMD register. Every operation acts on each lane alone and rounds as `f64` does, so a lane's
/// bits do not depend on how many lanes there are. None contracts a product and a sum into one rounding.
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
    /// `value` in every lane. A method, because a value may carry the proof that the processor has the instructions.
    fn constant(self, value: f64) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// `1/self` where `self > least`, 0 elsewhere (and where either is not a number).
    fn reciprocal_above(self, least: Self) -> Self;
    /// `libm`'s sine and cosine in the lanes where `|self|` is above `far` or not a number, `near` in the others.
    fn sin_cos_beyond(self, far: f64, near: (Self, Self)) -> (Self, Self);
    /// Sine and cosine of an angle in radians, to one unit in the last place.
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

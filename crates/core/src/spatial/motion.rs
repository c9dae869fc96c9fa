//! Motions and forces [RBDA §2.2–2.9].
//!
//! ```text
//! power   m · f     = ω·n + v·f
//! cross   m × m'    = [ω × ω'; ω × v' + v × ω']        rate of a motion carried along by m
//! dual    m ×* f    = [ω × n + v × f; ω × f]           rate of a force carried along by m:  (m × m')·f = −m'·(m ×* f)
//! point   at o + r: v' = v + ω × r;   n' = n − r × f
//! ```

use super::scalar::Scalar;
use super::vector::Vector;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// A velocity or an acceleration of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion<T = f64> {
    /// `ω`, rad/s, or its rate.
    pub angular: Vector<T>,
    /// `v` of the body's point at the frame's origin, m/s, or its rate.
    pub linear: Vector<T>,
}

/// A wrench (N·m, N) or a momentum (N·m·s, N·s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force<T = f64> {
    /// `n`, about the frame's origin.
    pub torque: Vector<T>,
    /// `f`.
    pub force: Vector<T>,
}

impl<T: Scalar> Motion<T> {
    /// Makes `[ω; v]`.
    #[inline(always)]
    pub fn new(angular: Vector<T>, linear: Vector<T>) -> Motion<T> {
        Motion { angular, linear }
    }

    /// Returns `ω·n + v·f`, W: the power of `force` on a body with this motion.
    #[inline(always)]
    pub fn power(self, force: Force<T>) -> T {
        self.angular.dot(force.torque) + self.linear.dot(force.force)
    }

    /// Returns `m × m'`: the rate of a motion `other` that is fixed in the moving body.
    #[inline(always)]
    pub fn cross(self, other: Motion<T>) -> Motion<T> {
        Motion {
            angular: self.angular.cross(other.angular),
            linear: self.angular.cross(other.linear) + self.linear.cross(other.angular),
        }
    }

    /// Returns `m ×* f`: the rate of a force that is fixed in the moving body.
    #[inline(always)]
    pub fn cross_force(self, force: Force<T>) -> Force<T> {
        Force {
            torque: self.angular.cross(force.torque) + self.linear.cross(force.force),
            force: self.angular.cross(force.force),
        }
    }

    /// Returns the velocity of the same body at the point at `r`: `v + ω × r`.
    #[inline(always)]
    pub fn at(self, r: Vector<T>) -> Motion<T> {
        Motion { angular: self.angular, linear: self.linear + self.angular.cross(r) }
    }
}

impl<T: Scalar> Force<T> {
    /// Makes `[n; f]`.
    #[inline(always)]
    pub fn new(torque: Vector<T>, force: Vector<T>) -> Force<T> {
        Force { torque, force }
    }

    /// Returns the same wrench with its torque about the point from which this one's is at `r`: `n
    /// + r × f`.
    #[inline(always)]
    pub fn from_arm(self, r: Vector<T>) -> Force<T> {
        Force { torque: self.torque + r.cross(self.force), force: self.force }
    }
}

macro_rules! six_numbers {
    ($type:ident, $first:ident, $second:ident) => {
        impl<T: Scalar> Add for $type<T> {
            type Output = $type<T>;
            #[inline(always)]
            fn add(self, b: $type<T>) -> $type<T> {
                $type { $first: self.$first + b.$first, $second: self.$second + b.$second }
            }
        }
        impl<T: Scalar> Sub for $type<T> {
            type Output = $type<T>;
            #[inline(always)]
            fn sub(self, b: $type<T>) -> $type<T> {
                $type { $first: self.$first - b.$first, $second: self.$second - b.$second }
            }
        }
        impl<T: Scalar> Neg for $type<T> {
            type Output = $type<T>;
            #[inline(always)]
            fn neg(self) -> $type<T> {
                $type { $first: -self.$first, $second: -self.$second }
            }
        }
        impl<T: Scalar> Mul<T> for $type<T> {
            type Output = $type<T>;
            #[inline(always)]
            fn mul(self, s: T) -> $type<T> {
                $type { $first: self.$first * s, $second: self.$second * s }
            }
        }
        impl<T: Scalar> AddAssign for $type<T> {
            #[inline(always)]
            fn add_assign(&mut self, b: $type<T>) {
                *self = *self + b;
            }
        }
        impl<T: Scalar> SubAssign for $type<T> {
            #[inline(always)]
            fn sub_assign(&mut self, b: $type<T>) {
                *self = *self - b;
            }
        }
    };
}

six_numbers!(Motion, angular, linear);
six_numbers!(Force, torque, force);

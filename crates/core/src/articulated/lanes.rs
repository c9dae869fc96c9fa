//! Several `f64` side by side: as plain numbers that every processor has, and in the SIMD registers of those that have them. All round alike, lane by
//! lane: one product or sum, one rounding. The registers come from the crate `pulp`: its tokens prove that the processor was asked.

use crate::spatial::Scalar;
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `N` numbers, one per state of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Default for Lanes<N> {
    fn default() -> Lanes<N> {
        Lanes([0.0; N])
    }
}

impl<const N: usize> Lanes<N> {
    #[inline(always)]
    fn with(self, b: Lanes<N>, f: impl Fn(f64, f64) -> f64) -> Lanes<N> {
        Lanes(std::array::from_fn(|k| f(self.0[k], b.0[k])))
    }
}

/// A [`Scalar`] that is filled from a state per lane.
pub(super) trait Register: Scalar {
    /// Proof that the processor has the instructions.
    type Token: Copy;
    /// The first numbers of a slice, one per lane.
    fn load(token: Self::Token, x: &[f64]) -> Self;
    /// Writes one number per lane to the front of a slice.
    fn store(self, out: &mut [f64]);
}

impl Register for f64 {
    type Token = ();
    #[inline(always)]
    fn load(_: (), x: &[f64]) -> f64 {
        x[0]
    }
    #[inline(always)]
    fn store(self, out: &mut [f64]) {
        out[0] = self;
    }
}

impl<const N: usize> Register for Lanes<N> {
    type Token = ();
    #[inline(always)]
    fn load(_: (), x: &[f64]) -> Lanes<N> {
        Lanes(std::array::from_fn(|k| x[k]))
    }
    #[inline(always)]
    fn store(self, out: &mut [f64]) {
        out.copy_from_slice(&self.0);
    }
}

impl<const N: usize> Scalar for Lanes<N> {
    #[inline(always)]
    fn constant(self, value: f64) -> Lanes<N> {
        Lanes([value; N])
    }

    #[inline(always)]
    fn sqrt(self) -> Lanes<N> {
        Lanes(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn reciprocal_above(self, least: Lanes<N>) -> Lanes<N> {
        self.with(least, Scalar::reciprocal_above)
    }

    #[inline(always)]
    fn sin_cos_beyond(self, far: f64, near: (Lanes<N>, Lanes<N>)) -> (Lanes<N>, Lanes<N>) {
        let each: [(f64, f64); N] = std::array::from_fn(|k| self.0[k].sin_cos_beyond(far, (near.0.0[k], near.1.0[k])));
        (Lanes(each.map(|s| s.0)), Lanes(each.map(|s| s.1)))
    }
}

impl<const N: usize> Add for Lanes<N> {
    type Output = Lanes<N>;
    #[inline(always)]
    fn add(self, b: Lanes<N>) -> Lanes<N> {
        self.with(b, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Lanes<N> {
    type Output = Lanes<N>;
    #[inline(always)]
    fn sub(self, b: Lanes<N>) -> Lanes<N> {
        self.with(b, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Lanes<N> {
    type Output = Lanes<N>;
    #[inline(always)]
    fn mul(self, b: Lanes<N>) -> Lanes<N> {
        self.with(b, |a, b| a * b)
    }
}

impl<const N: usize> Mul<f64> for Lanes<N> {
    type Output = Lanes<N>;
    #[inline(always)]
    fn mul(self, b: f64) -> Lanes<N> {
        Lanes(self.0.map(|a| a * b))
    }
}

impl<const N: usize> Neg for Lanes<N> {
    type Output = Lanes<N>;
    #[inline(always)]
    fn neg(self) -> Lanes<N> {
        Lanes(self.0.map(|a| -a))
    }
}

impl<const N: usize> AddAssign for Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, b: Lanes<N>) {
        *self = *self + b;
    }
}

impl<const N: usize> SubAssign for Lanes<N> {
    #[inline(always)]
    fn sub_assign(&mut self, b: Lanes<N>) {
        *self = *self - b;
    }
}

/// A [`Scalar`] in one SIMD register: its name, `pulp`'s proof, type and suffix, lanes, bytes.
#[cfg(target_arch = "x86_64")]
macro_rules! register {
    ($doc:literal, $name:ident, $token:ty, $type:ident, $lanes:literal, $bytes:literal,
     $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $sqrt:ident, $xor:ident, $greater:ident, $select:ident) => {
        #[doc = $doc]
        #[derive(Clone, Copy, Debug)]
        #[repr(align($bytes))]
        pub(super) struct $name {
            token: $token,
            x: pulp::$type,
        }

        impl Register for $name {
            type Token = $token;
            #[inline(always)]
            fn load(token: $token, x: &[f64]) -> $name {
                let x: [f64; $lanes] = std::array::from_fn(|k| x[k]);
                $name { token, x: pulp::cast(x) }
            }
            #[inline(always)]
            fn store(self, out: &mut [f64]) {
                out.copy_from_slice(&self.lanes());
            }
        }

        impl $name {
            #[inline(always)]
            fn lanes(self) -> [f64; $lanes] {
                pulp::cast(self.x)
            }

            #[inline(always)]
            fn of(self, x: pulp::$type) -> $name {
                $name { token: self.token, x }
            }
        }

        impl Scalar for $name {
            #[inline(always)]
            fn constant(self, value: f64) -> $name {
                self.of(self.token.$splat(value))
            }

            #[inline(always)]
            fn sqrt(self) -> $name {
                self.of(self.token.$sqrt(self.x))
            }

            #[inline(always)]
            fn reciprocal_above(self, least: $name) -> $name {
                let t = self.token;
                self.of(t.$select(t.$greater(self.x, least.x), t.$div(t.$splat(1.0), self.x), t.$splat(0.0)))
            }

            #[inline(always)]
            fn sin_cos_beyond(self, far: f64, near: ($name, $name)) -> ($name, $name) {
                let x = self.lanes();
                if x.iter().all(|x| x.abs() <= far) {
                    return near;
                }
                let (s, c) = (near.0.lanes(), near.1.lanes());
                let each: [(f64, f64); $lanes] = std::array::from_fn(|k| x[k].sin_cos_beyond(far, (s[k], c[k])));
                ($name::load(self.token, &each.map(|s| s.0)), $name::load(self.token, &each.map(|s| s.1)))
            }
        }

        impl Add for $name {
            type Output = $name;
            #[inline(always)]
            fn add(self, b: $name) -> $name {
                self.of(self.token.$add(self.x, b.x))
            }
        }

        impl Sub for $name {
            type Output = $name;
            #[inline(always)]
            fn sub(self, b: $name) -> $name {
                self.of(self.token.$sub(self.x, b.x))
            }
        }

        impl Mul for $name {
            type Output = $name;
            #[inline(always)]
            fn mul(self, b: $name) -> $name {
                self.of(self.token.$mul(self.x, b.x))
            }
        }

        impl Mul<f64> for $name {
            type Output = $name;
            #[inline(always)]
            fn mul(self, b: f64) -> $name {
                self.of(self.token.$mul(self.x, self.token.$splat(b)))
            }
        }

        impl Neg for $name {
            type Output = $name;
            #[inline(always)]
            fn neg(self) -> $name {
                self.of(self.token.$xor(self.x, self.token.$splat(-0.0)))
            }
        }

        impl AddAssign for $name {
            #[inline(always)]
            fn add_assign(&mut self, b: $name) {
                *self = *self + b;
            }
        }

        impl SubAssign for $name {
            #[inline(always)]
            fn sub_assign(&mut self, b: $name) {
                *self = *self - b;
            }
        }
    };
}

#[cfg(target_arch = "x86_64")]
register!(
    "Four lanes of AVX2.", Four, pulp::x86::V3, f64x4, 4, 32,
    splat_f64x4, add_f64x4, sub_f64x4, mul_f64x4, div_f64x4, sqrt_f64x4, xor_f64x4, cmp_gt_f64x4, select_f64x4
);
#[cfg(target_arch = "x86_64")]
register!(
    "Eight lanes of AVX-512.", Eight, pulp::x86::V4, f64x8, 8, 64,
    splat_f64x8, add_f64x8, sub_f64x8, mul_f64x8, div_f64x8, sqrt_f64x8, xor_f64x8, cmp_gt_f64x8, select_f64x8
);

//! Several `f64` in one SIMD register, on processors that have them. Every lane rounds like `f64`:
//! one rounding per product or sum. The registers come from the crate `pulp`, whose tokens prove
//! that the processor supports them.

use crate::spatial::Scalar;
#[cfg(target_arch = "x86_64")]
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `N` numbers, one per state of a batch: input and output of a batch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes<const N: usize>(pub [f64; N]);

impl<const N: usize> Default for Lanes<N> {
    fn default() -> Lanes<N> {
        Lanes([0.0; N])
    }
}

/// A [`Scalar`] with one state per lane.
pub(in crate::articulated) trait Register: Scalar {
    /// Number of lanes.
    const LANES: usize;
    /// Proof that the processor supports the instructions.
    type Token: Copy;
    /// Loads the first numbers of a slice, one per lane.
    fn load(token: Self::Token, x: &[f64]) -> Self;
    /// Stores one number per lane at the start of a slice.
    fn store(self, out: &mut [f64]);
}

impl Register for f64 {
    const LANES: usize = 1;
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

/// A [`Scalar`] in one SIMD register. Arguments: doc line, name, `pulp`'s proof, type and suffix,
/// lanes, bytes.
#[cfg(target_arch = "x86_64")]
macro_rules! register {
    ($doc:literal, $name:ident, $token:ty, $type:ident, $lanes:literal, $bytes:literal,
     $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $sqrt:ident, $xor:ident, $greater:ident, $select:ident) => {
        #[doc = $doc]
        #[derive(Clone, Copy, Debug)]
        #[repr(align($bytes))]
        pub(in crate::articulated) struct $name {
            token: $token,
            x: pulp::$type,
        }

        impl Register for $name {
            const LANES: usize = $lanes;
            type Token = $token;
            #[inline(always)]
            fn load(token: $token, x: &[f64]) -> $name {
                let x: [f64; $lanes] = std::array::from_fn(|k| x[k]);
                $name { token, x: pulp::cast(x) }
            }
            #[inline(always)]
            fn store(self, out: &mut [f64]) {
                out[..$lanes].copy_from_slice(&self.lanes());
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
    "Four lanes of AVX2.",
    Four,
    pulp::x86::V3,
    f64x4,
    4,
    32,
    splat_f64x4,
    add_f64x4,
    sub_f64x4,
    mul_f64x4,
    div_f64x4,
    sqrt_f64x4,
    xor_f64x4,
    cmp_gt_f64x4,
    select_f64x4
);
#[cfg(target_arch = "x86_64")]
register!(
    "Eight lanes of AVX-512.",
    Eight,
    pulp::x86::V4,
    f64x8,
    8,
    64,
    splat_f64x8,
    add_f64x8,
    sub_f64x8,
    mul_f64x8,
    div_f64x8,
    sqrt_f64x8,
    xor_f64x8,
    cmp_gt_f64x8,
    select_f64x8
);

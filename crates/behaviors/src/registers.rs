//! Operations that compilers make no vector instructions of: the choice of lanes, and the columns of a few rows.
//!
//! Both implementations give the same numbers: nothing is computed here but a comparison.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::__m512d;

/// Number of lanes.
pub(crate) const LANES: usize = 8;
/// A number for each lane.
pub(crate) type Lanes = [f64; LANES];

/// Registers of [`LANES`] numbers.
pub(crate) trait Registers: Copy {
    /// Returns the lanes that are at most `limit`, one bit each from the lowest on; none for NaN.
    fn at_most(self, x: &Lanes, limit: f64) -> u8;
    /// Moves the lanes of `bits` to the front, in their order; the others have no meaning then.
    fn pack(self, bits: u8, x: &Lanes) -> Lanes;
    /// As [`pack`](Self::pack).
    fn pack_places(self, bits: u8, x: &[u32; LANES]) -> [u32; LANES];
    /// Returns the first six columns of eight rows.
    fn columns(self, rows: [&Lanes; LANES]) -> [Lanes; 6];
}

/// Plain loops.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

impl Registers for Portable {
    #[inline(always)]
    fn at_most(self, x: &Lanes, limit: f64) -> u8 {
        (0..LANES).fold(0, |bits, k| bits | u8::from(x[k] <= limit) << k)
    }
    #[inline(always)]
    fn pack(self, bits: u8, x: &Lanes) -> Lanes {
        pack(bits, x)
    }
    #[inline(always)]
    fn pack_places(self, bits: u8, x: &[u32; LANES]) -> [u32; LANES] {
        pack(bits, x)
    }
    #[inline(always)]
    fn columns(self, rows: [&Lanes; LANES]) -> [Lanes; 6] {
        std::array::from_fn(|column| rows.map(|row| row[column]))
    }
}

#[inline(always)]
fn pack<T: Copy + Default>(bits: u8, x: &[T; LANES]) -> [T; LANES] {
    let (mut out, mut count) = ([T::default(); LANES], 0);
    for k in 0..LANES {
        // each is written, and kept by the count: no branch to predict
        out[count % LANES] = x[k];
        count += usize::from(bits >> k & 1);
    }
    out
}

#[cfg(target_arch = "x86_64")]
impl Registers for pulp::x86::V4 {
    #[inline(always)]
    fn at_most(self, x: &Lanes, limit: f64) -> u8 {
        self.cmp_le_f64x8(pulp::cast(*x), self.splat_f64x8(limit)).0
    }
    #[inline(always)]
    fn pack(self, bits: u8, x: &Lanes) -> Lanes {
        pulp::cast(self.avx512f._mm512_maskz_compress_pd(bits, pulp::cast(*x)))
    }
    #[inline(always)]
    fn pack_places(self, bits: u8, x: &[u32; LANES]) -> [u32; LANES] {
        pulp::cast(self.avx512vl._mm256_maskz_compress_epi32(bits, pulp::cast(*x)))
    }
    #[inline(always)]
    fn columns(self, [r0, r1, r2, r3, r4, r5, r6, r7]: [&Lanes; LANES]) -> [Lanes; 6] {
        let f = self.avx512f;
        macro_rules! even {
            ($a:expr, $b:expr) => {
                f._mm512_unpacklo_pd(pulp::cast(*$a), pulp::cast(*$b))
            };
        }
        macro_rules! odd {
            ($a:expr, $b:expr) => {
                f._mm512_unpackhi_pd(pulp::cast(*$a), pulp::cast(*$b))
            };
        }
        let [c0, c2, c4] = three(self, even!(r0, r1), even!(r2, r3), even!(r4, r5), even!(r6, r7));
        let [c1, c3, c5] = three(self, odd!(r0, r1), odd!(r2, r3), odd!(r4, r5), odd!(r6, r7));
        [c0, c1, c2, c3, c4, c5]
    }
}

/// Returns three columns of pairs of rows: the first, second and third pair of numbers in a register are those of a column.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn three(token: pulp::x86::V4, a: __m512d, b: __m512d, c: __m512d, d: __m512d) -> [Lanes; 3] {
    /// The first and the third quarter of both, or the second and the fourth.
    const OUTER: i32 = 0b10_00_10_00;
    const INNER: i32 = 0b11_01_11_01;
    let f = token.avx512f;
    let (ends, other_ends) = (f._mm512_shuffle_f64x2::<OUTER>(a, b), f._mm512_shuffle_f64x2::<OUTER>(c, d));
    let (middle, other_middle) = (f._mm512_shuffle_f64x2::<INNER>(a, b), f._mm512_shuffle_f64x2::<INNER>(c, d));
    [
        pulp::cast(f._mm512_shuffle_f64x2::<OUTER>(ends, other_ends)),
        pulp::cast(f._mm512_shuffle_f64x2::<OUTER>(middle, other_middle)),
        pulp::cast(f._mm512_shuffle_f64x2::<INNER>(ends, other_ends)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(registers: impl Registers) {
        let x: Lanes = [0.5, -1.0, f64::NAN, 2.0, 2.5, -0.0, f64::INFINITY, 1e-300];
        assert_eq!(registers.at_most(&x, 2.0), 0b1010_1011);
        assert_eq!(registers.at_most(&x, 0.0), 0b0010_0010);
        let (numbers, places) = ([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], [0, 1, 2, 3, 4, 5, 6, 7]);
        for bits in 0..=255u8 {
            let kept: Vec<u32> = (0..8).filter(|k| bits >> k & 1 == 1).collect();
            assert_eq!(registers.pack_places(bits, &places)[..kept.len()], kept);
            let kept: Vec<f64> = kept.into_iter().map(f64::from).collect();
            assert_eq!(registers.pack(bits, &numbers)[..kept.len()], kept);
        }
        let rows: [Lanes; LANES] = std::array::from_fn(|row| std::array::from_fn(|column| (10 * row + column) as f64));
        let columns = registers.columns(rows.each_ref());
        for (column, lanes) in columns.iter().enumerate() {
            (0..LANES).for_each(|row| assert_eq!(lanes[row], (10 * row + column) as f64));
        }
    }

    #[test]
    fn all_registers_do_the_same() {
        check(Portable);
        #[cfg(target_arch = "x86_64")]
        if let Some(token) = pulp::x86::V4::try_new() {
            check(token);
        }
    }
}

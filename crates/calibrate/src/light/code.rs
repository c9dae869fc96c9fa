//! Patterns of structured light: each pixel of a projector has its own sequence of light and dark.
//!
//! Along one axis of a picture of `n` pixels, for the place `p` of 0 to `n` (middles of pixels at ½):
//!
//! ```text
//! s = ⌊p / STRIPE_PX⌋           stripe
//! g = s ⊕ ⌊s / 2⌋               its Gray code: neighbors differ in one bit
//! a = ½ + ½ cos 2π (p / PERIOD_PX − k / SHIFTS)      shift k = 0 … SHIFTS − 1
//! ```
//!
//! | frames | purpose |
//! |---|---|
//! | white, black | contrast of each pixel of a photograph |
//! | each bit and its inverse | a threshold for each pixel: a bit is 1 where it is brighter than its inverse |
//! | shifts | the place within a period of two stripes, in fractions of a pixel |
//!
//! Sources: Inokuchi et al. (1984) for Gray codes, Bruning et al. (1974) for phases. With six shifts the
//! harmonics 2 to 4 of a projector's and a camera's transfer curve cancel.

use tumble_render::{Image, as_projected};
use tumble_scene::cave::Facet;

/// Width of a stripe, pixels.
pub(crate) const STRIPE_PX: f64 = 8.0;
/// Period of the shifted patterns, pixels.
pub(crate) const PERIOD_PX: f64 = 2.0 * STRIPE_PX;
/// Number of shifts.
pub(crate) const SHIFTS: u32 = 6;

/// One pattern.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pattern {
    /// All pixels on.
    White,
    /// All pixels off.
    Black,
    /// A bit of the Gray code of the stripe.
    Bit {
        /// 0 for columns (to the right), 1 for rows (down).
        axis: usize,
        /// The bit's number; 0 is the finest.
        bit: u32,
        /// Whether light and dark are exchanged.
        inverse: bool,
    },
    /// A cosine.
    Shift {
        /// 0 for columns (to the right), 1 for rows (down).
        axis: usize,
        /// The shift's number.
        k: u32,
    },
}

impl Pattern {
    /// Returns the patterns of a projector in their order: white, black, then for columns and rows the bits
    /// from the coarsest, each before its inverse, and the shifts.
    pub fn sequence(size_px: [u32; 2]) -> Vec<Pattern> {
        let mut out = vec![Pattern::White, Pattern::Black];
        for axis in 0..2 {
            for bit in (0..bits(size_px[axis])).rev() {
                out.extend([false, true].map(|inverse| Pattern::Bit { axis, bit, inverse }));
            }
            out.extend((0..SHIFTS).map(|k| Pattern::Shift { axis, k }));
        }
        out
    }

    /// Returns the code value of a place of the picture, 0 to 1; x to the right and y down, pixels.
    pub fn level(self, place: [f64; 2]) -> f64 {
        match self {
            Pattern::White => 1.0,
            Pattern::Black => 0.0,
            Pattern::Bit { axis, bit, inverse } => {
                let stripe = (place[axis] / STRIPE_PX) as u32;
                let lit = (stripe ^ (stripe >> 1)) >> bit & 1 == 1;
                f64::from(u8::from(lit != inverse))
            }
            Pattern::Shift { axis, k } => {
                let turns = place[axis] / PERIOD_PX - f64::from(k) / f64::from(SHIFTS);
                0.5 + 0.5 * (std::f64::consts::TAU * turns).cos()
            }
        }
    }

    /// Returns a word for file names, such as `x_bit3_inverse`.
    pub fn name(self) -> String {
        match self {
            Pattern::White => "white".into(),
            Pattern::Black => "black".into(),
            Pattern::Bit { axis, bit, inverse } => {
                format!("{}_bit{bit}{}", ["x", "y"][axis], if inverse { "_inverse" } else { "" })
            }
            Pattern::Shift { axis, k } => format!("{}_shift{k}", ["x", "y"][axis]),
        }
    }

    /// Draws the pattern as a facet's projector gets pictures: mirrored, for both eyes, not warped.
    pub fn picture(self, facet: &Facet) -> Image {
        let [width, height] = facet.size_px;
        let mut rgba = Vec::with_capacity(4 * width as usize * height as usize);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let level = self.level([f64::from(x) + 0.5, f64::from(y) + 0.5]);
            let code = (255.0 * level).round() as u8;
            rgba.extend([code, code, code, 255]);
        }
        as_projected(&Image { width, height, rgba }, facet)
    }
}

/// Returns the number of bits of the stripes of `n` pixels, at least 1.
pub(crate) fn bits(n: u32) -> u32 {
    let last = (f64::from(n.max(1)) - 0.5) / STRIPE_PX;
    u32::BITS - (last as u32).max(1).leading_zeros()
}

/// Returns the stripe of a Gray code.
pub(crate) fn stripe(gray: u32) -> u32 {
    (0..u32::BITS).fold(0, |stripe, shift| stripe ^ (gray >> shift))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_stripe_has_its_code_and_neighbors_differ_in_one_bit() {
        for n in [1, 8, 9, 1024, 1080, 1920, 4096] {
            let last = (f64::from(n) - 0.5) as u32 / 8;
            assert!(last < 1 << bits(n), "{n}");
            for s in 0..=last {
                assert_eq!(stripe(s ^ (s >> 1)), s);
                assert_eq!(((s ^ (s >> 1)) ^ ((s + 1) ^ ((s + 1) >> 1))).count_ones(), 1);
            }
        }
        // 128 stripes each way: 7 bits with inverses and 6 shifts
        assert_eq!(Pattern::sequence([1024, 1024]).len(), 2 + 2 * (14 + 6));
    }
}

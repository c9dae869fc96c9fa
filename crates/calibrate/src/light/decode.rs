//! Decoding: the place of the projector that lights each pixel of a photograph.
//!
//! For each pixel, with the code values `I` of the photographs of a sequence:
//!
//! ```text
//! C = I_white − I_black                                    contrast
//! bit = I_bit > I_inverse                                  its own threshold
//! z = (2 / SHIFTS) Σ_k I_k e^{i 2π k / SHIFTS}             |z| amplitude, arg z phase
//! p = PERIOD_PX (m + arg z / 2π),   m such that p is nearest to the middle of the stripe of the Gray code
//! ```
//!
//! A pixel is refused if
//!
//! - it is dark: `C` is below 4 % of the brightest (98th percentile), or below 4 of 255 codes,
//! - a photograph is clipped there: glare,
//! - light comes by way of other screens: `2 |z| < 0.2 C`. Reflected light has lost the fine stripes, so it
//!   has no amplitude (Nayar et al. 2006),
//! - more than one bit of an axis is unsure, `|I_bit − I_inverse| < 0.08 C`; beside an edge only one is,
//! - the phase and the stripe disagree by more than a stripe, or the place is outside of the picture,
//! - it stands alone: fewer than four of its eight neighbors have a place, or it is more than 3 pixels from
//!   their median.

use super::code::{PERIOD_PX, Pattern, SHIFTS, STRIPE_PX, stripe};
use super::photo::Photo;

/// Smallest contrast, as a share of the bright one.
const DARK: f32 = 0.04;
/// Smallest contrast, code values of 0 to 1.
const DARK_CODES: f32 = 4.0 / 255.0;
/// Smallest amplitude from peak to peak, as a share of the contrast.
const INDIRECT: f32 = 0.2;
/// Smallest difference of a bit and its inverse, as a share of the contrast.
const UNSURE: f32 = 0.08;
/// Largest distance from the median of neighbors, pixels of the projector.
const ALONE_PX: f32 = 3.0;

/// Pixels of a photograph without a place, by reason.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Refused {
    /// Too little contrast.
    pub dark: usize,
    /// Clipped in a photograph.
    pub clipped: usize,
    /// Lit by way of other surfaces.
    pub indirect: usize,
    /// Bits and phases that contradict each other, or neighbors that do.
    pub unsure: usize,
}

/// The places of a projector in a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Width and height of the photographs, pixels.
    pub size_px: [u32; 2],
    /// By pixel, rows from the top: place in the projector's picture, pixels, x to the right and y down;
    /// middles of pixels at ½.
    pub places: Vec<Option<[f32; 2]>>,
    /// Pixels without a place.
    pub refused: Refused,
}

impl Decoded {
    /// Returns the number of pixels with a place.
    pub fn count(&self) -> usize {
        self.places.iter().flatten().count()
    }

    /// Returns how many pixels of the projector lie in one of the photograph, along the denser axis, from the
    /// neighbors at a distance; `None` if one of the four has no place.
    pub(crate) fn density(&self, i: usize, reach: usize) -> Option<f64> {
        let (w, h) = (self.size_px[0] as usize, self.size_px[1] as usize);
        let (x, y) = (i % w, i / w);
        if x < reach || y < reach || x + reach >= w || y + reach >= h {
            return None;
        }
        let apart = |step: usize| {
            let (a, b) = (self.places[i - reach * step]?, self.places[i + reach * step]?);
            Some(f64::from((b[0] - a[0]).hypot(b[1] - a[1])) / (2 * reach) as f64)
        };
        Some(apart(1)?.max(apart(w)?))
    }
}

/// Sums of one axis, by pixel.
#[derive(Clone, Default)]
struct Axis {
    gray: Vec<u32>,
    unsure: Vec<u8>,
    cosine: Vec<f32>,
    sine: Vec<f32>,
}

/// Takes the photographs of a sequence one by one, so that one is in memory at a time.
pub struct Decoder {
    projector_px: [u32; 2],
    patterns: Vec<Pattern>,
    next: usize,
    size_px: [u32; 2],
    white: Vec<f32>,
    contrast: Vec<f32>,
    /// The photograph of a bit, until its inverse comes.
    bit: Vec<f32>,
    clipped: Vec<bool>,
    axes: [Axis; 2],
}

impl Decoder {
    /// Begins with the size of a projector's picture.
    pub fn new(projector_px: [u32; 2]) -> Decoder {
        Decoder {
            projector_px,
            patterns: Pattern::sequence(projector_px),
            next: 0,
            size_px: [0; 2],
            white: Vec::new(),
            contrast: Vec::new(),
            bit: Vec::new(),
            clipped: Vec::new(),
            axes: Default::default(),
        }
    }

    /// Returns the pattern that the next photograph shows; `None` after the last one.
    pub fn expected(&self) -> Option<Pattern> {
        self.patterns.get(self.next).copied()
    }

    /// Takes the next photograph.
    ///
    /// # Errors
    /// A photograph of another size than the first, or one too many.
    pub fn add(&mut self, photo: Photo) -> Result<(), String> {
        let pattern =
            self.expected().ok_or_else(|| format!("is one more than the {} patterns", self.patterns.len()))?;
        if self.next == 0 {
            self.begin(photo.size_px);
        }
        if photo.size_px != self.size_px {
            let ([w, h], [w0, h0]) = (photo.size_px, self.size_px);
            return Err(format!("is {w} x {h} pixels, and the first photograph is {w0} x {h0}"));
        }
        self.next += 1;
        if pattern != Pattern::Black {
            self.clipped.iter_mut().zip(&photo.clipped).for_each(|(all, one)| *all |= one);
        }
        match pattern {
            Pattern::White => self.white = photo.codes,
            Pattern::Black => {
                self.contrast = self.white.iter().zip(&photo.codes).map(|(w, b)| w - b).collect();
                self.white = Vec::new();
            }
            Pattern::Bit { inverse: false, .. } => self.bit = photo.codes,
            Pattern::Bit { axis, bit, inverse: true } => self.compare(axis, bit, &photo.codes),
            Pattern::Shift { axis, k } => {
                let (sine, cosine) = (std::f32::consts::TAU * k as f32 / SHIFTS as f32).sin_cos();
                let Axis { cosine: c, sine: s, .. } = &mut self.axes[axis];
                for ((c, s), code) in c.iter_mut().zip(s).zip(&photo.codes) {
                    *c += 2.0 / SHIFTS as f32 * code * cosine;
                    *s += 2.0 / SHIFTS as f32 * code * sine;
                }
            }
        }
        Ok(())
    }

    fn begin(&mut self, size_px: [u32; 2]) {
        let n = size_px[0] as usize * size_px[1] as usize;
        self.size_px = size_px;
        self.clipped = vec![false; n];
        let axis = || Axis { gray: vec![0; n], unsure: vec![0; n], cosine: vec![0.0; n], sine: vec![0.0; n] };
        self.axes = [axis(), axis()];
    }

    /// Sets a bit where it is brighter than its inverse.
    fn compare(&mut self, axis: usize, bit: u32, inverse: &[f32]) {
        let Axis { gray, unsure, .. } = &mut self.axes[axis];
        for (i, (on, off)) in self.bit.iter().zip(inverse).enumerate() {
            gray[i] |= u32::from(on > off) << bit;
            unsure[i] += u8::from((on - off).abs() < UNSURE * self.contrast[i]);
        }
    }

    /// Returns the places.
    ///
    /// # Errors
    /// Photographs that are missing, and photographs without a lit pixel.
    pub fn finish(self) -> Result<Decoded, String> {
        if let Some(missing) = self.expected() {
            return Err(format!(
                "{} photographs of {}: {} and those after it are missing",
                self.next,
                self.patterns.len(),
                missing.name()
            ));
        }
        let mut order: Vec<f32> = self.contrast.clone();
        let at = order.len() * 98 / 100;
        let bright = *order.select_nth_unstable_by(at, f32::total_cmp).1;
        let least = (DARK * bright).max(DARK_CODES);
        let mut refused = Refused::default();
        let mut places = Vec::with_capacity(self.contrast.len());
        for (i, &contrast) in self.contrast.iter().enumerate() {
            let amplitude = |axis: usize| 2.0 * self.axes[axis].cosine[i].hypot(self.axes[axis].sine[i]);
            let mut refuse = |reason: fn(&mut Refused) -> &mut usize| {
                *reason(&mut refused) += 1;
                None
            };
            places.push(match () {
                () if contrast < least => refuse(|r| &mut r.dark),
                () if self.clipped[i] => refuse(|r| &mut r.clipped),
                () if (0..2).any(|axis| amplitude(axis) < INDIRECT * contrast) => refuse(|r| &mut r.indirect),
                () => match (self.place(0, i), self.place(1, i)) {
                    (Some(x), Some(y)) => Some([x, y]),
                    _ => refuse(|r| &mut r.unsure),
                },
            });
        }
        let places = consistent(&places, self.size_px, &mut refused);
        Ok(Decoded { size_px: self.size_px, places, refused })
    }

    /// Joins the stripe and the phase of a pixel.
    fn place(&self, axis: usize, i: usize) -> Option<f32> {
        let Axis { gray, unsure, cosine, sine } = &self.axes[axis];
        let middle = (f64::from(stripe(gray[i])) + 0.5) * STRIPE_PX;
        let turn = f64::from(sine[i]).atan2(f64::from(cosine[i])) / std::f64::consts::TAU;
        let place = PERIOD_PX * ((middle / PERIOD_PX - turn).round() + turn);
        let inside = (0.0..=f64::from(self.projector_px[axis])).contains(&place);
        (unsure[i] <= 1 && inside && (place - middle).abs() <= STRIPE_PX).then_some(place as f32)
    }
}

/// Removes places that differ from those around them.
fn consistent(places: &[Option<[f32; 2]>], [w, h]: [u32; 2], refused: &mut Refused) -> Vec<Option<[f32; 2]>> {
    let (w, h) = (w as usize, h as usize);
    let around = |i: usize| {
        let (x, y) = (i % w, i / w);
        let columns = x.saturating_sub(1)..(x + 2).min(w);
        (y.saturating_sub(1)..(y + 2).min(h))
            .flat_map(move |y| columns.clone().map(move |x| y * w + x))
            .filter(move |j| *j != i)
            .filter_map(|j| places[j])
    };
    let keeps = |i: usize, place: [f32; 2]| {
        (0..2).all(|axis| {
            let mut near: Vec<f32> = around(i).map(|p| p[axis]).collect();
            near.sort_by(f32::total_cmp);
            near.len() >= 4
                && (0.5 * (near[near.len() / 2] + near[(near.len() - 1) / 2]) - place[axis]).abs() <= ALONE_PX
        })
    };
    let mut out = Vec::with_capacity(places.len());
    for (i, place) in places.iter().enumerate() {
        let kept = place.filter(|place| keeps(i, *place));
        refused.unsure += usize::from(place.is_some() && kept.is_none());
        out.push(kept);
    }
    out
}

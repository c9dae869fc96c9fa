//! Errors of sensors: Gaussian noise, a bias that walks, quantization and delay.
//!
//! ```text
//! b_{k+1} = b_k + σ_b·√dt·n          y_k = delay(clamp(q·round((x_k + b_k + σ·n′)/q)))          n, n′ standard normal
//! ```
//!
//! `n` comes from SplitMix64 (Steele, Lea, Flood, *Fast splittable pseudorandom number generators*, 2014) by the
//! transformation of Box and Muller. The 64 bits of the generator are two numbers of the state.
//!
//! | symbol | meaning |
//! |---|---|
//! | `σ`, `σ_b`, `q` | [`SensorNoise::deviation`], [`bias_walk`](SensorNoise::bias_walk), [`quantization`](SensorNoise::quantization) |
//! | `x`, `b`, `y` | true reading, bias, reading |

use super::{MAX_DELAY, SensorKind};
use nalgebra::ComplexField;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use tumble_collide::{Quat, Vec3};

/// Errors of a sensor; none by default. Each number of a reading has a bias of its own, and an image one for all its pixels. An orientation is turned by a rotation vector, rad, about the axes of the site.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SensorNoise {
    /// Standard deviation of white noise on every number of a reading, in its unit; at least 0.
    pub deviation: f64,
    /// Standard deviation of the change of a bias in a second, in the unit of the reading per √s; at least 0.
    pub bias_walk: f64,
    /// Distance of the values that a reading can have; 0 for any value.
    pub quantization: f64,
    /// Frames by which a reading is late, at most [`MAX_DELAY`].
    pub delay: u32,
    /// Start of the generator. Sensors with the same seed in one world still have noise of their own.
    pub seed: u64,
}

impl SensorNoise {
    pub(super) fn range_error(&self) -> Option<(&'static str, f64, &'static str)> {
        let scales = [
            ("the standard deviation", self.deviation),
            ("the walk of the bias", self.bias_walk),
            ("the quantization", self.quantization),
        ];
        let wrong = scales.into_iter().find(|(_, scale)| !(scale.is_finite() && *scale >= 0.0));
        match wrong {
            Some((what, value)) => Some((what, value, "finite and at least 0")),
            None if self.delay > MAX_DELAY => Some(("the delay", f64::from(self.delay), "at most 10000 frames")),
            None => None,
        }
    }

    /// Returns whether readings have no error but their delay.
    pub(crate) fn is_exact(&self) -> bool {
        self.deviation == 0.0 && self.bias_walk == 0.0 && self.quantization == 0.0
    }

    /// Returns the places of the numbers of a sensor. A camera with a delay keeps images of `pixels` numbers, and every camera
    /// has one bias for the whole image.
    pub(super) fn layout(&self, kind: SensorKind, pixels: usize) -> Layout {
        let numbers = if kind.is_camera() && self.delay > 0 { pixels } else { kind.numbers() };
        let random = self.deviation > 0.0 || self.bias_walk > 0.0;
        let errors = match kind {
            SensorKind::Orientation => 3,
            kind if kind.is_camera() => 1,
            _ => numbers,
        };
        let generator = numbers + if random { 2 } else { 0 };
        let bias = generator + if self.bias_walk > 0.0 { errors } else { 0 };
        Layout { numbers, errors, generator: numbers..generator, bias: generator..bias, delay: self.delay as usize }
    }

    /// Writes the first state of the generator of the sensor with this serial number.
    pub(crate) fn start(&self, layout: &Layout, serial: u32, x: &mut [f64]) {
        if !layout.generator.is_empty() {
            let mut stream = SplitMix64(u64::from(serial));
            SplitMix64(self.seed ^ stream.next()).write(&mut x[layout.generator.clone()]);
        }
    }

    /// Returns the bias and the generator of a frame's image. The words in `x` do not change, so an image can be read any
    /// number of times.
    pub(crate) fn of_image(&self, layout: &Layout, x: &[f64], frame: u64) -> Option<(f64, SplitMix64)> {
        let words = x.get(layout.generator.clone()).filter(|words| words.len() == 2)?;
        let mut stream = SplitMix64(frame);
        let bias = x.get(layout.bias.clone()).and_then(|bias| bias.first()).copied().unwrap_or(0.0);
        Some((bias, SplitMix64(SplitMix64::read(words).0 ^ stream.next())))
    }

    /// Changes the bias of a camera's images at the end of a frame of `dt` seconds.
    pub(crate) fn walk_image(&self, layout: &Layout, dt: f64, frame: u64, x: &mut [f64]) {
        if layout.bias.is_empty() {
            return;
        }
        let mut stream = SplitMix64(!frame); // another one than that of the pixels
        let mut generator = SplitMix64(SplitMix64::read(&x[layout.generator.clone()]).0 ^ stream.next());
        x[layout.bias.start] += self.bias_walk * dt.sqrt() * generator.normal();
    }

    /// Puts the present image of a camera with a delay at the end of its line, or in all places of it at its addition.
    pub(crate) fn delay_image(&self, layout: &Layout, first: bool, present: &[f64], x: &mut [f64]) {
        let numbers = layout.numbers;
        if first {
            x[..numbers].copy_from_slice(present);
            x[layout.bias.end..].chunks_exact_mut(numbers).for_each(|late| late.copy_from_slice(present));
            return;
        }
        let line = layout.bias.end;
        x.copy_within(line..line + numbers, 0);
        x.copy_within(line + numbers.., line);
        let last = x.len() - numbers;
        x[last..].copy_from_slice(present);
    }

    /// Writes a reading with its errors to the numbers `x` of the sensor, after a frame of `dt` seconds, or at its
    /// addition for `None`. `present` becomes what the sensor sees now, without the delay.
    pub(crate) fn write(&self, kind: SensorKind, dt: Option<f64>, cutoff: f64, present: &mut [f64], x: &mut [f64]) {
        let layout = self.layout(kind, 0);
        if !layout.generator.is_empty() {
            let mut generator = SplitMix64::read(&x[layout.generator.clone()]);
            let mut errors = [0.0; 4];
            for (k, error) in errors.iter_mut().enumerate().take(layout.errors) {
                if let Some(bias) = x[layout.bias.clone()].get_mut(k) {
                    *bias += self.bias_walk * dt.unwrap_or(0.0).sqrt() * generator.normal();
                    *error = *bias;
                }
                *error += self.deviation * generator.normal();
            }
            generator.write(&mut x[layout.generator.clone()]);
            add(kind, &errors, present);
        }
        if self.quantization > 0.0 {
            present.iter_mut().for_each(|y| *y = self.quantization * (*y / self.quantization).round());
        }
        if kind != SensorKind::Orientation && !(kind == SensorKind::RangeFinder && present[0] < 0.0) {
            present.iter_mut().for_each(|y| *y = y.clamp(-cutoff, cutoff));
        }
        let line = &mut x[layout.bias.end..];
        if dt.is_none() {
            line.chunks_exact_mut(layout.numbers).for_each(|late| late.copy_from_slice(present));
        }
        let (value, late) = match layout.delay {
            0 => (present.to_vec(), line),
            _ => (line[..layout.numbers].to_vec(), line),
        };
        if !late.is_empty() {
            late.copy_within(layout.numbers.., 0);
            let last = late.len() - layout.numbers;
            late[last..].copy_from_slice(present);
        }
        x[..layout.numbers].copy_from_slice(&value);
    }
}

/// Adds errors to a reading. A range finder that sees nothing goes on seeing nothing, and a distance stays at least 0.
fn add(kind: SensorKind, errors: &[f64; 4], present: &mut [f64]) {
    match kind {
        SensorKind::Orientation => {
            let turn = Quat::from_scaled_axis(Vec3::new(errors[0], errors[1], errors[2]));
            let seen = Quat::new_normalize(nalgebra::Quaternion::new(present[3], present[0], present[1], present[2]));
            let coords = (seen * turn).coords;
            let sign = if coords.w < 0.0 { -1.0 } else { 1.0 };
            present.copy_from_slice((sign * coords).as_slice());
        }
        SensorKind::RangeFinder if present[0] < 0.0 => {}
        SensorKind::RangeFinder => present[0] = (present[0] + errors[0]).max(0.0),
        _ => present.iter_mut().zip(errors).for_each(|(y, error)| *y += error),
    }
}

/// Places of a sensor's numbers: the reading, the generator, the bias, the delayed readings.
pub(crate) struct Layout {
    numbers: usize,
    errors: usize,
    generator: Range<usize>,
    bias: Range<usize>,
    delay: usize,
}

impl Layout {
    /// Returns the length of a reading.
    pub fn numbers(&self) -> usize {
        self.numbers
    }

    pub fn len(&self) -> usize {
        self.bias.end + self.delay * self.numbers
    }

    /// Returns whether the words of the generator are whole numbers of 32 bits.
    pub fn generator_is_sound(&self, x: &[f64]) -> bool {
        let sound = |word: &f64| (0.0..4_294_967_296.0).contains(word) && word.fract() == 0.0;
        x[self.generator.clone()].iter().all(sound)
    }
}

/// A generator of 64 bits.
pub(crate) struct SplitMix64(u64);

impl SplitMix64 {
    fn read(words: &[f64]) -> SplitMix64 {
        SplitMix64((words[0] as u64) << 32 | words[1] as u64)
    }

    fn write(&self, words: &mut [f64]) {
        (words[0], words[1]) = ((self.0 >> 32) as f64, (self.0 & 0xffff_ffff) as f64);
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number in (0, 1].
    fn unit(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 1.0) / (1_u64 << 53) as f64
    }

    pub(crate) fn normal(&mut self) -> f64 {
        let (radius, angle) = (self.unit(), std::f64::consts::TAU * self.unit());
        (-2.0 * <f64 as ComplexField>::ln(radius)).sqrt() * <f64 as ComplexField>::cos(angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first numbers of the reference implementation (Vigna, splitmix64.c) from the seed 1234567.
    #[test]
    fn splitmix64_gives_the_published_numbers() {
        let mut generator = SplitMix64(1_234_567);
        let first: Vec<u64> = (0..3).map(|_| generator.next()).collect();
        assert_eq!(first, [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]);
    }

    #[test]
    fn normal_numbers_have_the_moments_of_the_distribution() {
        let mut generator = SplitMix64(7);
        let n = 100_000;
        let numbers: Vec<f64> = (0..n).map(|_| generator.normal()).collect();
        let moment = |k: i32| numbers.iter().map(|x| x.powi(k)).sum::<f64>() / f64::from(n);
        // standard errors: 1/√n, √2/√n, √15/√n, √96/√n
        for (k, expected, error) in [(1, 0.0, 1.0_f64), (2, 1.0, 2.0), (3, 0.0, 15.0), (4, 3.0, 96.0)] {
            assert!((moment(k) - expected).abs() < 4.0 * error.sqrt() / f64::from(n).sqrt(), "{k}: {}", moment(k));
        }
    }
}

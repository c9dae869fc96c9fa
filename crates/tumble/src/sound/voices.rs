//! The signals of an impact and of sliding, at the body.
//!
//! ```text
//! strike     F(t) = (π·J/2τ)·sin(π·t/τ)                        a half sine of the duration τ with the impulse J
//! duration   τ = 2.87·(m²/(R·E*²·v))^(1/5)                     Hertz, for J = m·v; clamped to 20 µs … 20 ms
//! modes      (J/m)·Σ_k W(f_k)·exp(−δ_k·t)·sin(2π·f_k·t)        W(f) = |cos(π·f·τ)/(1 − 4·f²·τ²)|, the spectrum of F
//! click      (J/m)·(h/2c)·(π/τ)·cos(π·t/τ) for t < τ           the dipole of the acceleration F/m, whose derivative radiates
//! rub        white noise in a band about f = v_t/1 mm, with the amplitude √(F_n·v_t)
//! ```
//!
//! The signal of modes is a velocity of the surface in m/s; the factor to a sound pressure is [`GAIN`]. Sources: Landau and
//! Lifshitz, *Theory of Elasticity* §9; van den Doel, Kry and Pai, *FoleyAutomatic* (2001); Chadwick, Zheng and James,
//! *Precomputed Acceleration Noise* (2012).

use super::{RATE_HZ, SoundBody};
use std::f64::consts::{PI, TAU};

/// Sample per m/s of the surface, at 1 m.
pub(super) const GAIN: f64 = 0.05;
/// Sample per √W of friction, at 1 m.
const RUB_GAIN: f64 = 0.004;
/// Speed of sound, m/s, that makes the click small.
const AIR: f64 = 343.0;
/// Below this amplitude a voice ends.
const SILENT: f64 = 1e-6;
/// Longest voice, s.
const LONGEST: f64 = 4.0;

/// An impact on one body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Strike {
    /// Time of the impact, s.
    pub time: f64,
    /// Where, m.
    pub point: [f64; 3],
    /// Normal impulse, N·s.
    pub impulse: f64,
    /// The body that sounds.
    pub body: SoundBody,
    /// Duration of the contact, s.
    pub contact: f64,
}

/// Sliding of one pair in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rub {
    /// Time at its start, s.
    pub time: f64,
    /// Length of the frame, s.
    pub duration: f64,
    /// Where, m.
    pub point: [f64; 3],
    /// Normal force, N.
    pub force: f64,
    /// Tangential speed, m/s.
    pub speed: f64,
}

impl Strike {
    /// Returns the samples from the time of the impact on.
    pub(super) fn samples(&self) -> Vec<f64> {
        let speed = self.impulse / self.body.mass;
        let rate = f64::from(RATE_HZ);
        let mut out = Vec::new();
        for (frequency, decay) in self.body.modes() {
            let amplitude = GAIN * speed * spectrum(frequency, self.contact);
            add_mode(&mut out, amplitude, frequency, decay);
        }
        let click = GAIN * speed * 0.5 * self.body.thickness / AIR * PI / self.contact;
        let length = (self.contact * rate).ceil().max(2.0);
        for n in 0..length as usize {
            // whole samples: no net pressure, however short the contact
            let value = click * libm::cos(PI * (n as f64 + 0.5) / length);
            match out.get_mut(n) {
                Some(sample) => *sample += value,
                None => out.push(value),
            }
        }
        out
    }
}

/// Adds a decaying sine, by the recurrence of a rotation: `z ← z·exp((−δ + 2πi·f)/rate)`.
fn add_mode(out: &mut Vec<f64>, amplitude: f64, frequency: f64, decay: f64) {
    if amplitude <= SILENT {
        return;
    }
    let rate = f64::from(RATE_HZ);
    let seconds = (libm::log(amplitude / SILENT) / decay.max(1e-3)).min(LONGEST);
    let (sin, cos) = libm::sincos(TAU * frequency / rate);
    let shrink = libm::exp(-decay / rate);
    let (mut re, mut im) = (amplitude, 0.0);
    let length = (seconds * rate) as usize;
    if out.len() < length {
        out.resize(length, 0.0);
    }
    for sample in &mut out[..length] {
        *sample += im;
        (re, im) = (shrink * (re * cos - im * sin), shrink * (re * sin + im * cos));
    }
}

/// Returns the spectrum of a half sine of unit impulse at a frequency.
fn spectrum(frequency: f64, contact: f64) -> f64 {
    let x = 2.0 * frequency * contact;
    if (x - 1.0).abs() < 1e-6 { PI / 4.0 } else { (libm::cos(0.5 * PI * x) / (1.0 - x * x)).abs() }
}

impl Rub {
    /// Adds noise to samples from its start on. `state` are the generator and the filter of the pair, which go on from
    /// frame to frame.
    pub(super) fn samples(&self, state: &mut Noise) -> Vec<f64> {
        let rate = f64::from(RATE_HZ);
        let (first, last) = ((self.time * rate).round() as u64, ((self.time + self.duration) * rate).round() as u64);
        let target = RUB_GAIN * (self.force * self.speed).sqrt();
        let cutoff = (self.speed / 1e-3).clamp(40.0, 8000.0);
        let (low, high) = (1.0 - libm::exp(-TAU * cutoff / rate), 1.0 - libm::exp(-TAU * 0.25 * cutoff / rate));
        let count = last.saturating_sub(first).max(1);
        let start = state.amplitude;
        state.amplitude = target;
        (0..count)
            .map(|n| {
                let amplitude = start + (target - start) * (n as f64 + 1.0) / count as f64;
                let white = state.next();
                state.low += low * (white - state.low);
                state.high += high * (state.low - state.high);
                amplitude * (state.low - state.high)
            })
            .collect()
    }
}

/// White noise and its filter.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Noise {
    seed: u64,
    low: f64,
    high: f64,
    amplitude: f64,
}

impl Noise {
    /// Starts from a seed.
    pub fn new(seed: u64) -> Noise {
        Noise { seed, ..Noise::default() }
    }

    /// Returns the next number in −1 … 1 (SplitMix64; Steele, Lea and Flood 2014).
    fn next(&mut self) -> f64 {
        self.seed = self.seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.seed;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

//! From sources to two ears: distance, delay, direction.
//!
//! ```text
//! pressure ∝ 1/max(r, 0.25 m)      arrival after r/c      left cos(φ), right sin(φ),   φ = (1 + s)·π/4
//! ```
//!
//! `s` is the sine of the angle from the middle: −1 at the left, 1 at the right. The sum of the squares of both ears does
//! not depend on it. Sources are where the contact was; the Doppler effect is left out.

use super::voices::Noise;
use super::{Rub, Strike};
use std::collections::BTreeMap;
use tumble_scene::SceneFile;

/// Samples per second.
pub const RATE_HZ: u32 = 48_000;
/// Speed of sound, m/s.
pub const SPEED_OF_SOUND: f64 = 343.0;
/// Distance within which a source becomes no louder, m.
const NEAREST: f64 = 0.25;

/// The place and the orientation of the listener.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Listener {
    /// Between the ears, m.
    pub position: [f64; 3],
    /// Unit vector to the right.
    pub right: [f64; 3],
}

impl Listener {
    /// Hears from the camera of a scene; without one from 3 m before the origin, 1.7 m up.
    pub fn of_scene(scene: &SceneFile) -> Listener {
        match &scene.camera {
            Some(camera) => Listener::looking(camera.eye_m, camera.target_m, camera.up),
            None => Listener::looking([0.0, -3.0, 1.7], [0.0; 3], [0.0, 0.0, 1.0]),
        }
    }

    /// Returns a listener at `eye` that looks at `target`, with `up` up. Straight up or down, the right is x.
    pub fn looking(eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> Listener {
        let [f, u] = [[0, 1, 2].map(|k| target[k] - eye[k]), up];
        let right = [f[1] * u[2] - f[2] * u[1], f[2] * u[0] - f[0] * u[2], f[0] * u[1] - f[1] * u[0]];
        let norm = right.iter().map(|x| x * x).sum::<f64>().sqrt();
        let right = if norm > 1e-9 { right.map(|x| x / norm) } else { [1.0, 0.0, 0.0] };
        Listener { position: eye, right }
    }

    /// Returns the gains of both ears and the delay, s, of a source.
    pub(super) fn hears(&self, point: [f64; 3]) -> ([f64; 2], f64) {
        let away: [f64; 3] = [0, 1, 2].map(|k| point[k] - self.position[k]);
        let r = away.iter().map(|x| x * x).sum::<f64>().sqrt();
        let side = (0..3).map(|k| away[k] * self.right[k]).sum::<f64>() / r.max(NEAREST);
        let (right, left) = libm::sincos((1.0 + side.clamp(-1.0, 1.0)) * std::f64::consts::FRAC_PI_4);
        let near = 1.0 / r.max(NEAREST);
        ([left * near, right * near], r / SPEED_OF_SOUND)
    }
}

/// Two channels.
#[derive(Default)]
pub(super) struct Canvas {
    /// Samples of both ears, without those taken.
    pub samples: Vec<[f64; 2]>,
    /// Number of samples that were taken.
    taken: usize,
}

impl Canvas {
    /// Adds the samples of a source at a point, from a time on, s. Times between samples are interpolated.
    pub fn add(&mut self, listener: &Listener, time: f64, point: [f64; 3], samples: &[f64]) {
        let (gains, delay) = listener.hears(point);
        let at = (time + delay).max(0.0) * f64::from(RATE_HZ);
        let (first, share) = ((at.floor() as usize).saturating_sub(self.taken), at.fract());
        if self.samples.len() < first + samples.len() + 1 {
            self.samples.resize(first + samples.len() + 1, [0.0; 2]);
        }
        let mut before = 0.0;
        for (n, sample) in samples.iter().copied().chain([0.0]).enumerate() {
            let value = (1.0 - share) * sample + share * before;
            before = sample;
            let [left, right] = &mut self.samples[first + n];
            (*left, *right) = (*left + gains[0] * value, *right + gains[1] * value);
        }
    }

    /// Takes the samples before the number `end`.
    pub fn take(&mut self, end: usize) -> Vec<[f64; 2]> {
        let count = end.saturating_sub(self.taken);
        if self.samples.len() < count {
            self.samples.resize(count, [0.0; 2]);
        }
        self.taken += count;
        self.samples.drain(..count).collect()
    }
}

/// Renders strikes and rubs; the noise of a pair that rubs goes on from one call to the next.
#[derive(Default)]
pub(super) struct Renderer {
    pub canvas: Canvas,
    noises: BTreeMap<u64, Noise>,
}

impl Renderer {
    /// Adds sounds, each heard from where the listener is at its time, s.
    pub fn add(&mut self, strikes: &[Strike], rubs: &[(u64, Rub)], ears: impl Fn(f64) -> Listener) {
        for strike in strikes {
            self.canvas.add(&ears(strike.time), strike.time, strike.point, &strike.samples());
        }
        for (number, rub) in rubs {
            let noise = self.noises.entry(*number).or_insert_with(|| Noise::new(*number));
            self.canvas.add(&ears(rub.time), rub.time, rub.point, &rub.samples(noise));
        }
    }
}

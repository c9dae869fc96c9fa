//! How a body sounds: its modes.
//!
//! A body vibrates as a free bar as long as its longest side and as thick as its shortest one (Euler and Bernoulli;
//! Fletcher and Rossing, *The Physics of Musical Instruments*, §2.16):
//!
//! ```text
//! f_k = (β_k²/2π)·(κ/L²)·√(E/ρ),   cos β·cosh β = 1:   β = 4.7300, 7.8532, 10.9956, (k + ½)π,    κ = h/√12
//! decay of the amplitude        exp(−t·π·η·f_k)
//! ```
//!
//! A compact body has its first mode above the audible range, as a billiard ball does. It is heard by the sound of its
//! acceleration alone (`voices.rs`).
//!
//! | symbol | meaning |
//! |---|---|
//! | `L, h` | longest and shortest side of the box of the shape, m |
//! | `κ` | radius of gyration of a rectangular section, m |
//! | `E, ρ, η` | Young's modulus, density, loss factor |

use super::SoundMaterial;
use std::f64::consts::{PI, TAU};

/// Number of modes of a body.
pub const MODES: usize = 8;

/// Highest frequency that is heard, Hz.
const AUDIBLE_HZ: f64 = 18_000.0;

/// Solutions of `cos β·cosh β = 1`; the later ones are `(k + ½)π` to 1e-7.
const BETA: [f64; 3] = [4.730_040_744_862_704, 7.853_204_624_095_838, 10.995_607_838_001_67];

/// A body that sounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoundBody {
    /// Its material.
    pub material: SoundMaterial,
    /// Longest side, m.
    pub length: f64,
    /// Shortest side, m.
    pub thickness: f64,
    /// Mass, kg.
    pub mass: f64,
}

impl SoundBody {
    /// Returns the frequency of mode `k`, from 0, Hz.
    pub fn frequency(&self, k: usize) -> f64 {
        let beta = BETA.get(k).copied().unwrap_or((k as f64 + 1.5) * PI);
        let gyration = self.thickness / 12f64.sqrt();
        beta * beta / TAU * gyration / (self.length * self.length) * self.material.wave_speed()
    }

    /// Returns the rate of decay of the amplitude at a frequency, 1/s.
    pub fn decay(&self, frequency: f64) -> f64 {
        PI * self.material.loss * frequency
    }

    /// Walks the audible modes: frequency, Hz, and decay, 1/s.
    pub fn modes(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        (0..MODES).map(|k| self.frequency(k)).filter(|f| (20.0..AUDIBLE_HZ).contains(f)).map(|f| (f, self.decay(f)))
    }
}

//! The file.

use super::RATE_HZ;
use std::io::Cursor;

/// Longest soundtrack, s.
pub const MAX_SECONDS: f64 = 3600.0;
/// Largest sample of a file.
pub(super) const CEILING: f64 = 0.98;
/// Peak of a track whose gain nobody has chosen: −3 dB.
const USUAL_PEAK: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Peak below which a track is silence: the smallest step of 16 bits at a gain of 120 dB.
const SILENCE: f64 = 3e-11;
/// Largest gain, and smallest with the sign changed, dB.
pub const MAX_GAIN_DB: f64 = 120.0;

/// Why there is no sound.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SoundError {
    /// The run is too long.
    #[error("a soundtrack of {0} s; expected at most {MAX_SECONDS} s", MAX_SECONDS = MAX_SECONDS)]
    Long(f64),
    /// No listener was given.
    #[error("no listener; expected at least one")]
    NoEars,
    /// The gain is out of range.
    #[error("a gain of {0} dB; expected a number from −{MAX_GAIN_DB} to {MAX_GAIN_DB}", MAX_GAIN_DB = MAX_GAIN_DB)]
    Gain(f64),
    /// From the writer of the file.
    #[error("the sound cannot be written: {0}")]
    Wav(#[from] hound::Error),
}

/// A finished soundtrack: left and right.
pub struct Mixed {
    /// Samples of both ears; 1 is full scale.
    pub samples: Vec<[f64; 2]>,
}

impl Mixed {
    /// Returns the largest sample.
    pub fn peak(&self) -> f64 {
        self.samples.iter().flatten().fold(0.0, |most: f64, sample| most.max(sample.abs()))
    }

    /// Returns the factor of the file: it brings the peak to −3 dB of full scale, or is `gain` dB if one is given,
    /// lowered where the peak would exceed 0.98. It is one number for the whole track, so the proportions stay; 1 for
    /// silence.
    ///
    /// # Errors
    /// [`SoundError::Gain`] beyond [`MAX_GAIN_DB`].
    pub fn gain(&self, gain: Option<f64>) -> Result<f64, SoundError> {
        let peak = self.peak();
        match gain {
            Some(db) if db.is_nan() || db.abs() > MAX_GAIN_DB => Err(SoundError::Gain(db)),
            Some(db) => Ok(libm::pow(10.0, db / 20.0).min(if peak > 0.0 { CEILING / peak } else { f64::INFINITY })),
            None if peak < SILENCE => Ok(1.0),
            None => Ok(USUAL_PEAK / peak),
        }
    }

    /// Returns a WAV file of the samples times a factor, which is that of [`Mixed::gain`]: two channels of 16 bits.
    ///
    /// # Errors
    /// [`SoundError::Wav`].
    pub fn wav(&self, gain: f64) -> Result<Vec<u8>, SoundError> {
        let format = hound::WavSpec {
            channels: 2,
            sample_rate: RATE_HZ,
            bits_per_sample: 16,
            sample_format: hound::SampleFormat::Int,
        };
        let mut bytes = Cursor::new(Vec::new());
        let mut writer = hound::WavWriter::new(&mut bytes, format)?;
        for sample in self.samples.iter().flatten() {
            writer.write_sample((sample * gain * f64::from(i16::MAX)).round() as i16)?;
        }
        writer.finalize()?;
        Ok(bytes.into_inner())
    }
}

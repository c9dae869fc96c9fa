//! The file.

use super::RATE_HZ;
use std::io::Cursor;

/// Longest soundtrack, s.
pub const MAX_SECONDS: f64 = 3600.0;
/// Largest sample after the limiter.
const CEILING: f64 = 0.98;

/// Why there is no sound.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SoundError {
    /// The run is too long.
    #[error("a soundtrack of {0} s; expected at most {MAX_SECONDS} s", MAX_SECONDS = MAX_SECONDS)]
    Long(f64),
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

    /// Returns the factor of the limiter: 1, or what brings the peak to 0.98. It is one number for the whole track, so
    /// the proportions stay.
    pub fn limit(&self) -> f64 {
        let peak = self.peak();
        if peak > CEILING { CEILING / peak } else { 1.0 }
    }

    /// Returns a WAV file: two channels of 16 bits.
    ///
    /// # Errors
    /// [`SoundError::Wav`].
    pub fn wav(&self) -> Result<Vec<u8>, SoundError> {
        let format = hound::WavSpec {
            channels: 2,
            sample_rate: RATE_HZ,
            bits_per_sample: 16,
            sample_format: hound::SampleFormat::Int,
        };
        let (mut bytes, limit) = (Cursor::new(Vec::new()), self.limit());
        let mut writer = hound::WavWriter::new(&mut bytes, format)?;
        for sample in self.samples.iter().flatten() {
            writer.write_sample((sample * limit * f64::from(i16::MAX)).round() as i16)?;
        }
        writer.finalize()?;
        Ok(bytes.into_inner())
    }
}

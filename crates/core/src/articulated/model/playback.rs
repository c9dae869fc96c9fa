//! Playback of a recorded motion of one joint (thesis §III.B, scripted skeletons).
//!
//! Between samples the motion is a cubic. Its slope at a sample is that of the parabola through the
//! sample and its neighbors (Bessel's rule). The motion passes through every sample with a
//! continuous velocity and reproduces quadratics exactly.

/// Why a recorded motion is not valid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaybackError {
    /// The numbers of times and values differ, or there are fewer than two.
    #[error("a recorded motion has {times} times and {values} values; it must have as many of each, and at least 2")]
    Count {
        /// Number of times.
        times: usize,
        /// Number of values.
        values: usize,
    },
    /// A number is not finite, or times do not rise.
    #[error(
        "sample {index} of a recorded motion: time {time} s, value {value}; both must be finite and times must rise"
    )]
    Sample {
        /// Index of the sample, from 0.
        index: usize,
        /// Its time.
        time: f64,
        /// Its value.
        value: f64,
    },
    /// A cyclic motion does not end where it starts.
    #[error("a motion that repeats must end where it starts; it starts at {first} and ends at {last}")]
    Cycle {
        /// First value.
        first: f64,
        /// Last value.
        last: f64,
    },
}

/// Position of one degree of freedom over time.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Playback {
    times: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
    repeats: bool,
}

impl Playback {
    /// Makes a motion through `values` (rad or m) at `times` (s, rising). It is constant before the
    /// first and after the last sample.
    ///
    /// # Errors
    /// [`PlaybackError::Count`] or [`PlaybackError::Sample`].
    pub fn new(times: Vec<f64>, values: Vec<f64>) -> Result<Playback, PlaybackError> {
        if times.len() != values.len() || times.len() < 2 {
            return Err(PlaybackError::Count { times: times.len(), values: values.len() });
        }
        let rises = |i: usize| i == 0 || times[i] > times[i - 1];
        let fine = |i: usize| times[i].is_finite() && values[i].is_finite() && rises(i);
        if let Some(index) = (0..times.len()).find(|&i| !fine(i)) {
            return Err(PlaybackError::Sample { index, time: times[index], value: values[index] });
        }
        let mut playback = Playback { times, values, slopes: Vec::new(), repeats: false };
        playback.find_slopes();
        Ok(playback)
    }

    /// Returns the times of the samples, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Returns the positions of the samples, rad or m.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns whether the motion repeats without end.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Makes a motion that repeats without end; its last value must equal its first.
    ///
    /// # Errors
    /// [`PlaybackError::Cycle`] if it does not, and those of [`new`](Self::new).
    pub fn repeating(times: Vec<f64>, values: Vec<f64>) -> Result<Playback, PlaybackError> {
        let mut playback = Playback::new(times, values)?;
        let (first, last) = (playback.values[0], playback.values[playback.values.len() - 1]);
        if (first - last).abs() > 1e-9 {
            return Err(PlaybackError::Cycle { first, last });
        }
        playback.repeats = true;
        playback.find_slopes();
        Ok(playback)
    }

    fn chord(&self, i: usize) -> (f64, f64) {
        let h = self.times[i + 1] - self.times[i];
        (h, (self.values[i + 1] - self.values[i]) / h)
    }

    fn find_slopes(&mut self) {
        let last = self.times.len() - 1;
        let blend = |(h0, d0): (f64, f64), (h1, d1): (f64, f64)| (h1 * d0 + h0 * d1) / (h0 + h1);
        let mut slopes: Vec<f64> = vec![0.0; last + 1];
        for i in 1..last {
            slopes[i] = blend(self.chord(i - 1), self.chord(i));
        }
        if self.repeats {
            slopes[0] = blend(self.chord(last - 1), self.chord(0));
            slopes[last] = slopes[0];
        } else {
            slopes[0] = 2.0 * self.chord(0).1 - if last > 1 { slopes[1] } else { self.chord(0).1 };
            slopes[last] = 2.0 * self.chord(last - 1).1 - if last > 1 { slopes[last - 1] } else { self.chord(0).1 };
        }
        self.slopes = slopes;
    }

    /// Returns position (rad or m) and velocity at time `t`, s.
    pub fn at(&self, t: f64) -> (f64, f64) {
        let last = self.times.len() - 1;
        let (start, end) = (self.times[0], self.times[last]);
        let t = if self.repeats { start + (t - start).rem_euclid(end - start) } else { t };
        if t < start || t > end {
            return (self.values[if t < start { 0 } else { last }], 0.0);
        }
        let i = (self.times.partition_point(|&other| other <= t).max(1) - 1).min(last - 1);
        let (h, chord) = self.chord(i);
        let (s, m0, m1) = ((t - self.times[i]) / h, self.slopes[i], self.slopes[i + 1]);
        // value + h·s·m0 + s²·(…) in the form that is exact at both ends
        let (a, b) = (3.0 * chord - 2.0 * m0 - m1, m0 + m1 - 2.0 * chord);
        (self.values[i] + h * s * (m0 + s * (a + s * b)), m0 + s * (2.0 * a + 3.0 * s * b))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quadratic_is_reproduced_with_its_velocity() {
        let times = vec![0.0, 0.5, 0.8, 2.0];
        let f = |t: f64| 1.0 - 3.0 * t + 2.0 * t * t;
        let motion = Playback::new(times.clone(), times.iter().map(|t| f(*t)).collect()).unwrap();
        for i in 0..=20 {
            let t = 0.1 * i as f64;
            let (value, velocity) = motion.at(t);
            assert!(
                (value - f(t)).abs() < 1e-12 && (velocity - (4.0 * t - 3.0)).abs() < 1e-11,
                "t = {t}: {value} {velocity}"
            );
        }
        assert_eq!(motion.at(3.0), (f(2.0), 0.0));
    }

    #[test]
    fn a_cycle_closes_with_one_velocity() {
        let times: Vec<f64> = (0..=40).map(|i| i as f64 / 40.0).collect();
        let turn = std::f64::consts::TAU;
        let wave = Playback::repeating(times.clone(), times.iter().map(|t| (turn * t).sin()).collect()).unwrap();
        let ((a, va), (b, vb)) = (wave.at(1.0 - 1e-9), wave.at(1.0 + 1e-9));
        assert!((a - b).abs() < 1e-7 && (va - vb).abs() < 1e-6 && (va - turn).abs() < 0.05, "{a} {b} {va} {vb}");
        assert!((wave.at(7.25).0 - 1.0).abs() < 1e-3);
    }

    #[test]
    fn invalid_input_is_reported() {
        assert_eq!(Playback::new(vec![0.0], vec![1.0]), Err(PlaybackError::Count { times: 1, values: 1 }));
        assert!(matches!(Playback::new(vec![0.0, 0.0], vec![1.0, 2.0]), Err(PlaybackError::Sample { index: 1, .. })));
        assert!(matches!(Playback::repeating(vec![0.0, 1.0], vec![1.0, 2.0]), Err(PlaybackError::Cycle { .. })));
    }
}

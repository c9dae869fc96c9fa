//! The 1 € filter (Casiez, Roussel and Vogel 2012) on poses, and their prediction.
//!
//! ```text
//! α(f, Δt) = 1 / (1 + 1 / (2π f Δt))          share of a new value in a low-pass of cutoff f
//! v ← v + α(5 Hz, Δt) ((x − x₁) / Δt − v)      velocity, x₁ the value before
//! f = f₀ + β |v|                               slow motion is smoothed, fast motion follows
//! x̂ ← x̂ + α(f, Δt) (x − x̂)
//! shown = x̂ + v · lead                        rotations: the same with rotation vectors and quaternions
//! ```
//!
//! | symbol | meaning, unit |
//! |---|---|
//! | `f₀` | cutoff at rest, Hz |
//! | `β` | Hz per m/s for positions, Hz per rad/s for rotations |
//! | `lead` | time from the measurement to the light of the picture, s, given with each pose |
//!
//! The paper smooths velocities with 1 Hz, which lags behind a turning head by 0.16 s. For prediction it is 5 Hz here.

use std::f64::consts::TAU;

/// Cutoff of velocities, Hz.
const VELOCITY_HZ: f64 = 5.0;
/// A pause after which the filter begins anew, s.
const FORGET_S: f64 = 0.5;
/// Shortest time between two values, s. Values that follow faster count as one.
const SHORTEST_S: f64 = 1e-4;
/// Largest angle of a prediction, rad, and way, m: a jump of a tracker is not thrown on.
const MAX_LEAD_RAD: f64 = 0.5;
const MAX_LEAD_M: f64 = 0.3;

/// Position, m, and unit quaternion `x y z w`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    pub position: [f64; 3],
    pub rotation: [f64; 4],
}

/// Settings of a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Cutoff at rest, Hz; `None` does not filter.
    pub rest_hz: Option<f64>,
    /// Hz per m/s, and per rad/s.
    pub beta: f64,
}

impl Smoothing {
    /// Hz per m/s and per rad/s: at half a meter or half a radian a second the cutoff is 2.5 Hz above that at rest.
    pub const BETA: f64 = 5.0;
}

/// The filter of one device.
#[derive(Clone, Debug)]
pub struct PoseFilter {
    smoothing: Smoothing,
    /// Time, and the pose as it was measured and as it was filtered.
    last: Option<(f64, Placed, Placed)>,
    velocity: [f64; 3],
    turning: [f64; 3],
}

impl PoseFilter {
    /// Begins without a value.
    pub fn new(smoothing: Smoothing) -> PoseFilter {
        PoseFilter { smoothing, last: None, velocity: [0.0; 3], turning: [0.0; 3] }
    }

    /// Takes the pose at a time, s, and returns the one to show `lead_s` later. The same time again returns the pose that
    /// it had then, with another lead.
    pub fn next(&mut self, time_s: f64, measured: Placed, lead_s: f64) -> Placed {
        let (before, raw, last) = match self.last {
            Some(last) if (0.0..=FORGET_S).contains(&(time_s - last.0)) => last,
            _ => {
                *self = PoseFilter { last: Some((time_s, measured, measured)), ..PoseFilter::new(self.smoothing) };
                return measured;
            }
        };
        let dt = time_s - before;
        if dt < SHORTEST_S {
            return self.predicted(last, lead_s);
        }
        let (step, turn) = between(&last, &measured);
        let (moved, turned) = between(&raw, &measured);
        let blend = share(VELOCITY_HZ, dt);
        for k in 0..3 {
            self.velocity[k] += blend * (moved[k] / dt - self.velocity[k]);
            self.turning[k] += blend * (turned[k] / dt - self.turning[k]);
        }
        let kept = |speed: [f64; 3]| match self.smoothing.rest_hz {
            Some(rest) => share(rest + self.smoothing.beta * norm(speed), dt),
            None => 1.0,
        };
        let (a, b) = (kept(self.velocity), kept(self.turning));
        let filtered = Placed {
            position: std::array::from_fn(|k| last.position[k] + a * step[k]),
            rotation: product(of_vector(turn.map(|t| b * t)), last.rotation),
        };
        self.last = Some((time_s, measured, filtered));
        self.predicted(filtered, lead_s)
    }

    fn predicted(&self, from: Placed, lead_s: f64) -> Placed {
        let ahead = |v: [f64; 3], most: f64| {
            let way = v.map(|v| v * lead_s);
            let size = norm(way);
            if size > most { way.map(|w| w * most / size) } else { way }
        };
        let (way, turn) = (ahead(self.velocity, MAX_LEAD_M), ahead(self.turning, MAX_LEAD_RAD));
        Placed {
            position: std::array::from_fn(|k| from.position[k] + way[k]),
            rotation: product(of_vector(turn), from.rotation),
        }
    }
}

/// Returns the way, m, and the rotation vector, rad, from one pose to another.
fn between(from: &Placed, to: &Placed) -> ([f64; 3], [f64; 3]) {
    let way = std::array::from_fn(|k| to.position[k] - from.position[k]);
    (way, rotation_vector(product(to.rotation, conjugate(from.rotation))))
}

fn share(cutoff_hz: f64, dt: f64) -> f64 {
    1.0 / (1.0 + 1.0 / (TAU * cutoff_hz * dt))
}

fn norm(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn conjugate([x, y, z, w]: [f64; 4]) -> [f64; 4] {
    [-x, -y, -z, w]
}

/// Returns the normalized product of two quaternions.
fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    let q = [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ];
    let n = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    q.map(|c| c / n)
}

/// Returns axis times angle, the shorter way round.
fn rotation_vector([x, y, z, w]: [f64; 4]) -> [f64; 3] {
    let (v, w) = if w < 0.0 { ([-x, -y, -z], -w) } else { ([x, y, z], w) };
    let sine = norm(v);
    let factor = if sine > 1e-12 { 2.0 * sine.atan2(w) / sine } else { 2.0 };
    v.map(|c| c * factor)
}

fn of_vector(v: [f64; 3]) -> [f64; 4] {
    let angle = norm(v);
    let factor = if angle > 1e-12 { (0.5 * angle).sin() / angle } else { 0.5 };
    [v[0] * factor, v[1] * factor, v[2] * factor, (0.5 * angle).cos()]
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 120.0;

    fn about_z(angle: f64) -> [f64; 4] {
        [0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()]
    }

    fn angle(q: [f64; 4]) -> f64 {
        2.0 * q[2].atan2(q[3])
    }

    fn smoothing(rest_hz: Option<f64>) -> Smoothing {
        Smoothing { rest_hz, beta: 5.0 }
    }

    /// Noise of 1 mm at rest, by the closed form of a low-pass: the variance is that of the input times
    /// α / (2 − α). With β the noise of the velocity opens the filter a little.
    #[test]
    fn noise_at_rest_falls_as_that_of_a_low_pass() {
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            ((seed >> 33) as f64 / f64::from(1u32 << 31) - 0.5) * 12f64.sqrt() * 1e-3
        };
        let mut filter = PoseFilter::new(Smoothing { beta: 0.0, ..smoothing(Some(1.0)) });
        let (mut sum, mut count) = (0.0, 0);
        for i in 0..200_000 {
            let measured = Placed { position: [random(), 0.0, 0.0], rotation: about_z(0.0) };
            let shown = filter.next(f64::from(i) / RATE, measured, 0.0).position[0];
            if i > 1000 {
                (sum, count) = (sum + shown * shown, count + 1);
            }
        }
        let a = share(1.0, 1.0 / RATE);
        let wanted = 1e-3 * (a / (2.0 - a)).sqrt();
        let rms = (sum / f64::from(count)).sqrt();
        assert!((rms / wanted - 1.0).abs() < 0.02, "{rms} {wanted}");
        assert!(rms < 0.2e-3);
    }

    /// A head that turns and walks evenly is shown where it will be, without lag.
    #[test]
    fn even_motion_is_predicted() {
        let lead = 0.04;
        let mut filter = PoseFilter::new(smoothing(None));
        let at = |t: f64| Placed { position: [0.8 * t, -0.3 * t, 1.7], rotation: about_z(1.5 * t) };
        let mut worst: f64 = 0.0;
        for i in 0..600 {
            let t = f64::from(i) / RATE;
            let (shown, wanted) = (filter.next(t, at(t), lead), at(t + lead));
            if t > 1.0 {
                worst = worst.max((shown.position[0] - wanted.position[0]).abs());
                let turn = product(shown.rotation, conjugate(wanted.rotation));
                worst = worst.max(norm(rotation_vector(turn)));
            }
        }
        assert!(worst < 1e-9, "{worst}");
    }

    /// A head that turns to and fro by 30 degrees, once in two seconds: the error of an image that is late by
    /// 40 ms is less than a third with prediction, and smoothing adds little.
    #[test]
    fn prediction_removes_most_of_the_lag_of_a_turning_head() {
        let at = |t: f64| 0.52 * (std::f64::consts::PI * t).sin();
        let error = |rest_hz: Option<f64>, lead: f64| {
            let mut filter = PoseFilter::new(smoothing(rest_hz));
            let (mut sum, mut count) = (0.0, 0);
            for i in 0..1200 {
                let t = f64::from(i) / RATE;
                let shown = filter.next(t, Placed { position: [0.0; 3], rotation: about_z(at(t)) }, lead);
                if t > 1.0 {
                    (sum, count) = (sum + (angle(shown.rotation) - at(t + 0.04)).powi(2), count + 1);
                }
            }
            (sum / f64::from(count)).sqrt().to_degrees()
        };
        let (late, ahead, both) = (error(None, 0.0), error(None, 0.04), error(Some(1.5), 0.04));
        assert!((late - 2.65).abs() < 0.1, "{late}");
        assert!(ahead < late / 3.0 && both < late, "{late} {ahead} {both}");
    }

    #[test]
    fn pauses_jumps_and_repeated_times_are_harmless() {
        let mut filter = PoseFilter::new(smoothing(Some(1.0)));
        let placed = |x: f64| Placed { position: [x, 0.0, 0.0], rotation: about_z(x) };
        let mut next = |time_s: f64, at: Placed| filter.next(time_s, at, 0.05);
        next(0.0, placed(0.0));
        let same = next(0.0, placed(5.0));
        assert_eq!(same, placed(0.0));
        // a jump of 5 m is predicted on by 0.3 m at most
        let jumped = next(0.01, placed(5.0));
        assert!(jumped.position[0] <= 5.3, "{jumped:?}");
        // after a pause it begins anew, and at times that go back
        assert_eq!(next(9.0, placed(-2.0)), placed(-2.0));
        assert_eq!(next(1.0, placed(3.0)), placed(3.0));
        // the other sign of a quaternion is the same rotation
        let shown = next(1.01, Placed { rotation: about_z(3.0).map(|c| -c), ..placed(3.0) });
        assert!(shown.rotation.iter().all(|c| c.is_finite()));
        assert!(norm(rotation_vector(product(shown.rotation, conjugate(about_z(3.0))))) < 1e-9);
    }
}

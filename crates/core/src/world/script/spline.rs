//! Splines through keyframes: the path of a kinematic body.
//!
//! Between two keyframes each of the three coordinates and the four numbers of the orientation is a cubic
//! in Hermite form, from the values `p` and the slopes `m` at both:
//!
//! ```text
//! u = (t − t_i)/h,   p(t) = (2u³ − 3u² + 1)·p_i + (u³ − 2u² + u)·h·m_i + (3u² − 2u³)·p_{i+1} + (u³ − u²)·h·m_{i+1}
//! C1    m_i = (h_i·d_{i−1} + h_{i−1}·d_i)/(h_{i−1} + h_i),   d_i = (p_{i+1} − p_i)/h_i       exact for parabolas
//! C2    h_i·m_{i−1} + 2(h_{i−1} + h_i)·m_i + h_{i−1}·m_{i+1} = 3(h_i·d_{i−1} + h_{i−1}·d_i)    equal second derivatives
//! rest  m = 0 at both ends
//! free  C1: the slope of the parabola through three keyframes;   C2: no second derivative (natural spline)
//! loop  the equations of inner keyframes at the seam too
//! ```
//!
//! The orientation is the quaternion `Q/|Q|`, and the angular velocity `ω = 2·Im(Q̇·Q*)/|Q|²`, which is its exact
//! derivative. Signs of the keyframes are chosen such that neighbors are less than 90° apart on the sphere of
//! quaternions, so `Q` does not vanish. Source: de Boor, *A Practical Guide to Splines*, chapter IV.
//!
//! | symbol | meaning |
//! |---|---|
//! | `t_i`, `h_i` | time of a keyframe, and the time to the next one, s |
//! | `p_i`, `m_i` | value and slope at a keyframe |

use nalgebra::{Quaternion, Translation3, Unit};
use serde::{Deserialize, Serialize};
use tumble_collide::{Pose, Vec3};

/// Largest number of keyframes.
const MAX_KEYFRAMES: usize = 10_000;

/// One pose at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Keyframe {
    /// Time since the start of the path, s. The first is 0, and they ascend.
    pub time: f64,
    /// Pose of the body's frame.
    pub pose: Pose,
}

/// How smooth a [`Spline`] is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Smoothness {
    /// Continuous velocity. A keyframe has effect on the two pieces at either side.
    C1,
    /// Continuous velocity and acceleration.
    #[default]
    C2,
}

/// How a [`Spline`] begins and ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Ends {
    /// At rest.
    #[default]
    Rest,
    /// Without a force on it: the motion begins and ends at speed.
    Free,
    /// It begins again where it ends; the first and the last pose are equal.
    Loop,
}

/// Why keyframes make no spline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SplineError {
    /// Too few or too many.
    #[error("a path has {0} keyframes; expected 2 to {max}", max = MAX_KEYFRAMES)]
    Count(usize),
    /// The times do not ascend from 0.
    #[error(
        "keyframe {index} has the time {time} s; expected 0 for the first one, and more than the time before for the others"
    )]
    Time {
        /// Number of the keyframe, from 1.
        index: usize,
        /// Its time, s.
        time: f64,
    },
    /// A number is not finite.
    #[error("keyframe {0} has a number that is not finite")]
    NotFinite(usize),
    /// The orientation turns too far between two keyframes.
    #[error("the orientation between keyframes {0} and {next} is not defined; expected keyframes less than half a turn apart", next = .0 + 1)]
    Turn(usize),
    /// A loop with a gap.
    #[error("the first and the last pose of a path that repeats differ; expected the same pose")]
    Open,
}

/// Position and motion at a time of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SplinePoint {
    /// The pose.
    pub pose: Pose,
    /// Velocity of its origin, m/s.
    pub velocity: Vec3,
    /// Angular velocity, rad/s, in the axes of the keyframes.
    pub angular_velocity: Vec3,
}

/// Position and orientation as numbers: x, y, z, then the quaternion x, y, z, w.
type Numbers = [f64; 7];

/// A smooth motion through keyframes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Record", into = "Record")]
pub struct Spline {
    record: Record,
    values: Vec<Numbers>,
    slopes: Vec<Numbers>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Record {
    keyframes: Vec<Keyframe>,
    smoothness: Smoothness,
    ends: Ends,
}

impl TryFrom<Record> for Spline {
    type Error = SplineError;

    fn try_from(record: Record) -> Result<Spline, SplineError> {
        Spline::new(record.keyframes, record.smoothness, record.ends)
    }
}

impl From<Spline> for Record {
    fn from(spline: Spline) -> Record {
        spline.record
    }
}

impl Spline {
    /// Makes the path through at least two keyframes.
    ///
    /// ```
    /// # use tumble_core::{Ends, Keyframe, Smoothness, Spline, collide::Pose};
    /// let ends = [0.0, 2.0].map(|t| Keyframe { time: t, pose: Pose::translation(t, 0.0, 0.0) });
    /// let path = Spline::new(ends.to_vec(), Smoothness::C2, Ends::Rest)?;
    /// assert_eq!(path.at(1.0).velocity.x, 1.5); // 3/2 of the mean speed in the middle
    /// # Ok::<(), tumble_core::SplineError>(())
    /// ```
    ///
    /// # Errors
    /// [`SplineError`]: too few keyframes, times that do not ascend from 0, numbers that are not finite, a
    /// loop whose ends differ.
    pub fn new(keyframes: Vec<Keyframe>, smoothness: Smoothness, ends: Ends) -> Result<Spline, SplineError> {
        if !(2..=MAX_KEYFRAMES).contains(&keyframes.len()) {
            return Err(SplineError::Count(keyframes.len()));
        }
        for (index, keyframe) in keyframes.iter().enumerate() {
            let Keyframe { time, pose } = *keyframe;
            let numbers = pose.translation.vector.iter().chain(pose.rotation.coords.iter());
            if !numbers.chain([&time]).all(|x| x.is_finite()) {
                return Err(SplineError::NotFinite(index + 1));
            }
            let right = if index == 0 { time == 0.0 } else { time - keyframes[index - 1].time > 1e-9 };
            if !right {
                return Err(SplineError::Time { index: index + 1, time });
            }
        }
        let mut values: Vec<Numbers> = keyframes.iter().map(|k| numbers(&k.pose)).collect();
        for k in 1..values.len() {
            let before = values[k - 1];
            if (3..7).map(|i| before[i] * values[k][i]).sum::<f64>() < 0.0 {
                values[k][3..].iter_mut().for_each(|q| *q = -*q);
            }
        }
        let (first, last) = (values[0], values[values.len() - 1]);
        let apart = |sign: f64| {
            let gap = |i: usize| (last[i] - if i < 3 { first[i] } else { sign * first[i] }).abs();
            (0..7).map(gap).fold(0.0, f64::max)
        };
        // after an odd number of turns the quaternion comes back with the other sign, and so do its slopes
        let seam = if apart(1.0) <= apart(-1.0) { 1.0 } else { -1.0 };
        if ends == Ends::Loop && apart(seam) > 1e-9 {
            return Err(SplineError::Open);
        }
        let times: Vec<f64> = keyframes.iter().map(|k| k.time).collect();
        let slopes = slopes(&times, &values, smoothness, ends, seam);
        let spline = Spline { record: Record { keyframes, smoothness, ends }, values, slopes };
        for piece in 0..times.len() - 1 {
            let least = |sample: i32| spline.quaternion(piece, f64::from(sample) / 16.0)[0].norm();
            if (0..16).map(least).fold(1.0, f64::min) < 0.1 {
                return Err(SplineError::Turn(piece + 1));
            }
        }
        Ok(spline)
    }

    /// Returns the time of the last keyframe, s.
    pub fn duration(&self) -> f64 {
        self.record.keyframes.last().map_or(0.0, |k| k.time)
    }

    /// Returns whether it begins again at its end.
    pub fn repeats(&self) -> bool {
        self.record.ends == Ends::Loop
    }

    /// Returns how smooth it is at its keyframes.
    pub fn smoothness(&self) -> Smoothness {
        self.record.smoothness
    }

    /// Returns how it begins and ends.
    pub fn ends(&self) -> Ends {
        self.record.ends
    }

    /// Returns the keyframes.
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.record.keyframes
    }

    /// Returns pose and velocities at a time since its start, s. Before the start and after the end of a path
    /// that does not repeat the body is at rest.
    pub fn at(&self, time: f64) -> SplinePoint {
        let (keyframes, duration) = (&self.record.keyframes, self.duration());
        let inside = (0.0..duration).contains(&time);
        let time = match self.repeats() {
            true => time - (time / duration).floor() * duration,
            false => time.clamp(0.0, duration),
        };
        let piece = keyframes.partition_point(|k| k.time <= time).clamp(1, keyframes.len() - 1) - 1;
        let h = keyframes[piece + 1].time - keyframes[piece].time;
        let u = (time - keyframes[piece].time) / h;
        let moves = if inside || self.repeats() { 1.0 } else { 0.0 };
        let [turned, turning] = self.quaternion(piece, u);
        let spin = (turning * turned.conjugate()).imag() * (2.0 / turned.norm_squared());
        let moved = [0, 1, 2].map(|i| self.cubic(piece, u, i));
        let [origin, velocity] = [0, 1].map(|k| Vec3::from(moved.map(|both| both[k])));
        SplinePoint {
            pose: Pose::from_parts(Translation3::from(origin), Unit::new_normalize(turned)),
            velocity: moves * velocity,
            angular_velocity: moves * spin,
        }
    }

    /// Returns number `i` and its rate at the share `u` of a piece.
    fn cubic(&self, piece: usize, u: f64, i: usize) -> [f64; 2] {
        let h = self.record.keyframes[piece + 1].time - self.record.keyframes[piece].time;
        let ([p, q], [m, n]) = ([0, 1].map(|k| self.values[piece + k][i]), [0, 1].map(|k| self.slopes[piece + k][i]));
        let value = p + (3.0 - 2.0 * u) * u * u * (q - p) + u * (u - 1.0) * h * ((u - 1.0) * m + u * n);
        let rate = 6.0 * u * (1.0 - u) * (q - p) / h + (3.0 * u - 1.0) * (u - 1.0) * m + u * (3.0 * u - 2.0) * n;
        [value, rate]
    }

    /// Returns the quaternion before it is normalized, and its rate.
    fn quaternion(&self, piece: usize, u: f64) -> [Quaternion<f64>; 2] {
        let q = [3, 4, 5, 6].map(|i| self.cubic(piece, u, i));
        [0, 1].map(|k| Quaternion::new(q[3][k], q[0][k], q[1][k], q[2][k]))
    }
}

fn numbers(pose: &Pose) -> Numbers {
    let (p, q) = (&pose.translation.vector, &pose.rotation.coords);
    [p.x, p.y, p.z, q.x, q.y, q.z, q.w]
}

/// Returns the slopes at all keyframes. `seam` is the sign of the quaternion after one round of a loop.
fn slopes(times: &[f64], values: &[Numbers], smoothness: Smoothness, ends: Ends, seam: f64) -> Vec<Numbers> {
    let mut slopes = vec![[0.0; 7]; values.len()];
    for i in 0..7 {
        let sign = if i < 3 { 1.0 } else { seam };
        let steps: Vec<f64> = times.windows(2).map(|t| t[1] - t[0]).collect();
        let secants: Vec<f64> = values.windows(2).zip(&steps).map(|(v, h)| (v[1][i] - v[0][i]) / h).collect();
        for (slope, m) in slopes.iter_mut().zip(slopes_of(&steps, &secants, smoothness, ends, sign)) {
            slope[i] = m;
        }
    }
    slopes
}

fn slopes_of(h: &[f64], d: &[f64], smoothness: Smoothness, ends: Ends, sign: f64) -> Vec<f64> {
    let n = d.len();
    // left and right of each keyframe; the neighbors of the first one are behind the seam of a loop
    let before = |k: usize| if k == 0 { (h[n - 1], sign * d[n - 1]) } else { (h[k - 1], d[k - 1]) };
    let parabola = |k: usize| {
        let (hl, dl) = before(k);
        (h[k] * dl + hl * d[k]) / (hl + h[k])
    };
    let inner = if ends == Ends::Loop { 0..n } else { 1..n };
    let mut m = vec![0.0; n + 1];
    match smoothness {
        Smoothness::C1 => {
            inner.for_each(|k| m[k] = parabola(k));
            if ends == Ends::Free {
                let end = |h0: f64, h1: f64, d0: f64, d1: f64| ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
                m[0] = if n == 1 { d[0] } else { end(h[0], h[1], d[0], d[1]) };
                m[n] = if n == 1 { d[0] } else { end(h[n - 1], h[n - 2], d[n - 1], d[n - 2]) };
            }
        }
        Smoothness::C2 => {
            // rows `below·m[k−1] + diagonal·m[k] + above·m[k+1] = right`, dense: paths are short
            let rows = if ends == Ends::Loop { n } else { n + 1 };
            let mut band = vec![[0.0, 1.0, 0.0, 0.0]; rows];
            for k in inner {
                let (hl, dl) = before(k);
                band[k] = [h[k], 2.0 * (hl + h[k]), hl, 3.0 * (h[k] * dl + hl * d[k])];
            }
            if ends == Ends::Free {
                band[0] = [0.0, 2.0, 1.0, 3.0 * d[0]];
                band[n] = [1.0, 2.0, 0.0, 3.0 * d[n - 1]];
            }
            match ends {
                Ends::Loop => m[..n].copy_from_slice(&cyclic(&band, sign)),
                _ => m = tridiagonal(&band),
            }
        }
    }
    if ends == Ends::Loop {
        m[n] = sign * m[0];
    }
    m
}

/// Solves rows `[below, diagonal, above, right]`.
fn tridiagonal(rows: &[[f64; 4]]) -> Vec<f64> {
    let (mut above, mut x) = (vec![0.0; rows.len()], vec![0.0; rows.len()]);
    for (k, [below, diagonal, up, right]) in rows.iter().enumerate() {
        let (last_above, last_x) = if k == 0 { (0.0, 0.0) } else { (above[k - 1], x[k - 1]) };
        let pivot = diagonal - below * last_above;
        (above[k], x[k]) = (up / pivot, (right - below * last_x) / pivot);
    }
    for k in (0..rows.len().saturating_sub(1)).rev() {
        x[k] -= above[k] * x[k + 1];
    }
    x
}

/// Solves rows whose first has its `below` in the last column and whose last has its `above` in the first one, both
/// times `sign`: by the bordering of Sherman and Morrison.
fn cyclic(rows: &[[f64; 4]], sign: f64) -> Vec<f64> {
    let n = rows.len();
    if n == 1 {
        let [below, diagonal, above, right] = rows[0];
        return vec![right / (diagonal + sign * (below + above))];
    }
    let (corner_top, corner_low) = (sign * rows[0][0], sign * rows[n - 1][2]);
    let gamma = -rows[0][1];
    let mut bordered = rows.to_vec();
    bordered[0][1] -= gamma;
    bordered[n - 1][1] -= corner_low * corner_top / gamma;
    let x = tridiagonal(&bordered);
    for (k, row) in bordered.iter_mut().enumerate() {
        row[3] = match k {
            0 => gamma,
            k if k == n - 1 => corner_low,
            _ => 0.0,
        };
    }
    let z = tridiagonal(&bordered);
    let factor = (x[0] + corner_top * x[n - 1] / gamma) / (1.0 + z[0] + corner_top * z[n - 1] / gamma);
    x.iter().zip(&z).map(|(x, z)| x - factor * z).collect()
}

//! A pose in 20 bytes, with a stated error.
//!
//! | | how | error, at most |
//! |---|---|---|
//! | position | three i32 in 1/65536 m; what lies beyond ±32768 m saturates and is counted | `2⁻¹⁷` m (7.6 µm) per axis |
//! | rotation | the largest component of `x, y, z, w` is made positive and left out; the others, within ±1/√2, in 20 bits each | 5e-6 rad |
//!
//! A component `c` travels as `n = round(√2·c·N)`, `N = 2¹⁹ − 1`; so 0 stays 0 and the error of a component is at most `e = 1/(2√2·N) = 6.75e-7`. The
//! one left out is `√(1 − Σc²)`, off by at most `e·Σ|c|/|largest| ≤ 3e`; the quaternion by at most `e·√(3 + 9)`, the angle by twice that: 4.7e-6 rad.
//!
//! The two bits above the three times 20 say which component was left out, the two above those are zero.

use super::wire::{Bytes, Fault};
use tumble_collide::{Pose, Quat, Vec3};

/// Bytes of a pose.
pub const POSE_BYTES: usize = 20;
/// Largest error of a position along an axis, m, within [`MOST_M`].
pub const POSITION_ERROR_M: f64 = 1.0 / 131_072.0;
/// Largest error of a rotation, rad.
pub const ROTATION_ERROR_RAD: f64 = 5e-6;
/// Positions beyond saturate, m.
pub const MOST_M: f64 = 32_767.999;

const PER_M: f64 = 65_536.0;
const N: i32 = (1 << 19) - 1;
const MASK: u64 = (1 << 20) - 1;

/// Appends a finite pose; whether its position fitted.
pub fn put_pose(out: &mut Vec<u8>, pose: &Pose) -> bool {
    let position = pose.translation.vector;
    for &x in position.iter() {
        out.extend(((x * PER_M).round() as i32).to_le_bytes()); // saturates
    }
    out.extend(pack(&pose.rotation).to_le_bytes());
    position.amax() <= MOST_M
}

/// Reads a pose.
pub(crate) fn get_pose(bytes: &mut Bytes<'_>) -> Result<Pose, Fault> {
    let mut position = [0.0; 3];
    for x in &mut position {
        *x = i32::from_le_bytes(bytes.array()?) as f64 / PER_M;
    }
    let rotation = unpack(bytes.u64()?).ok_or(Fault::Malformed("a rotation that is none"))?;
    Ok(Pose::from_parts(Vec3::from(position).into(), rotation))
}

fn pack(rotation: &Quat) -> u64 {
    let c = rotation.coords;
    let left_out = c.iamax();
    let sign = if c[left_out] < 0.0 { -1.0 } else { 1.0 };
    let others = (0..4).filter(|&k| k != left_out).map(|k| {
        let n = (sign * c[k] * std::f64::consts::SQRT_2 * N as f64).round() as i32;
        (n.clamp(-N, N) + N) as u64
    });
    others.fold(left_out as u64, |packed, n| packed << 20 | n)
}

fn unpack(packed: u64) -> Option<Quat> {
    let left_out = (packed >> 60) as usize;
    let (mut c, mut sum, mut shift) = ([0.0; 4], 0.0, 60);
    if left_out > 3 {
        return None;
    }
    for (_, c) in c.iter_mut().enumerate().filter(|(k, _)| *k != left_out) {
        shift -= 20;
        let n = (packed >> shift & MASK) as i32 - N;
        *c = n as f64 / (std::f64::consts::SQRT_2 * N as f64);
        sum += *c * *c;
    }
    // the one left out is the largest, so the others' squares sum to 3/4 at most, and a little for rounding
    if sum > 0.751 {
        return None;
    }
    c[left_out] = (1.0 - sum).sqrt();
    let [x, y, z, w] = c;
    Some(Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)))
}

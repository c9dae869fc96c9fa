//! A pose in 20 bytes, with a bound on its error.
//!
//! | | encoding | maximum error |
//! |---|---|---|
//! | position | three i32 in 1/65536 m; positions beyond ±32768 m saturate and are counted | `2⁻¹⁷` m (7.6 µm) per axis |
//! | rotation | the largest component of `x, y, z, w` is made positive and omitted; the others, within ±1/√2, in 20 bits each | 5e-6 rad |
//!
//! A component `c` is encoded as `n = round(√2·c·N)`, `N = 2¹⁹ − 1`. So 0 stays 0, and the error of
//! a component is at most `e = 1/(2√2·N) = 6.75e-7`. The omitted component is `√(1 − Σc²)`, with an
//! error of at most `e·Σ|c|/|largest| ≤ 3e`. The error of the quaternion is at most `e·√(3 + 9)`,
//! that of the angle twice as large: 4.7e-6 rad.
//!
//! The two bits above the three fields of 20 bits hold the index of the omitted component. The two
//! bits above those are zero.

use super::wire::MessageError;
use tumble_collide::{Pose, Quat, Vec3};

/// Bytes of a pose.
pub const POSE_BYTES: usize = 20;
/// Largest error of a position along an axis, m, within [`MAX_POSITION_M`].
#[cfg(feature = "fuzzing")]
pub const POSITION_ERROR_M: f64 = 1.0 / 131_072.0;
/// Largest error of a rotation, rad.
#[cfg(feature = "fuzzing")]
pub const ROTATION_ERROR_RAD: f64 = 5e-6;
/// Maximum position along an axis, m; larger ones saturate.
pub const MAX_POSITION_M: f64 = 32_767.999;

pub(crate) const UNITS_PER_M: f64 = 65_536.0;
const N: i32 = (1 << 19) - 1;
/// Indices of the encoded components, by the index of the omitted one.
const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]];
/// `√2·N`.
const SCALE: f64 = std::f64::consts::SQRT_2 * N as f64;
const MASK: u64 = (1 << 20) - 1;

/// Appends a finite pose. Returns whether its position is within [`MAX_POSITION_M`].
#[inline]
pub fn put_pose(out: &mut Vec<u8>, pose: &Pose) -> bool {
    let position = pose.translation.vector;
    let mut bytes = [0; POSE_BYTES];
    bytes
        .as_chunks_mut()
        .0
        .iter_mut()
        .zip(position.iter())
        .for_each(|(to, x)| *to = nearest(x * UNITS_PER_M).to_le_bytes());
    bytes[12..].copy_from_slice(&pack(&pose.rotation).to_le_bytes());
    out.extend_from_slice(&bytes);
    position.amax() <= MAX_POSITION_M
}

/// Reads a pose.
///
/// # Errors
/// [`MessageError::Malformed`].
#[inline]
pub(crate) fn get_pose(bytes: &[u8; POSE_BYTES]) -> Result<Pose, MessageError> {
    let [x, y, z, low, high] = *bytes.as_chunks().0 else {
        return Err(MessageError::Malformed("a pose of another length"));
    };
    let meters = |units: [u8; 4]| f64::from(i32::from_le_bytes(units)) * (1.0 / UNITS_PER_M);
    let packed = u64::from(u32::from_le_bytes(high)) << 32 | u64::from(u32::from_le_bytes(low));
    let rotation = unpack(packed).ok_or(MessageError::Malformed("an invalid rotation"))?;
    Ok(Pose::from_parts(Vec3::new(meters(x), meters(y), meters(z)).into(), rotation))
}

/// Rounds to the nearest integer (ties to even) and saturates. Adding 1.5·2⁵² leaves no bit for a
/// fraction.
#[inline]
pub(crate) fn nearest(x: f64) -> i32 {
    const ROOM: f64 = 6_755_399_441_055_744.0;
    (x.clamp(i32::MIN as f64, i32::MAX as f64) + ROOM - ROOM) as i32
}

fn pack(rotation: &Quat) -> u64 {
    let c = rotation.coords;
    let (mut left_out, mut largest) = (0, c[0]);
    for k in 1..4 {
        if c[k].abs() > largest.abs() {
            (left_out, largest) = (k, c[k]);
        }
    }
    let scale = if largest < 0.0 { -SCALE } else { SCALE };
    let field = |k: usize| (nearest(scale * c[k & 3]).clamp(-N, N) + N) as u64;
    let [a, b, d] = OTHERS[left_out];
    (left_out as u64) << 60 | field(a) << 40 | field(b) << 20 | field(d)
}

fn unpack(packed: u64) -> Option<Quat> {
    let left_out = packed >> 60;
    let [a, b, d] = [40, 20, 0].map(|shift| ((packed >> shift & MASK) as i32 - N) as f64 * (1.0 / SCALE));
    let rest = 1.0 - (a * a + b * b + d * d);
    // the omitted component is the largest, so its square is at least 1/4 up to rounding
    if rest < 0.249 {
        return None;
    }
    let largest = rest.sqrt();
    // selected instead of stored into a vector: a vector written in parts and then read whole
    // stalls
    let x = if left_out == 0 { largest } else { a };
    let y = if left_out == 0 {
        a
    } else if left_out == 1 {
        largest
    } else {
        b
    };
    let z = if left_out < 2 {
        b
    } else if left_out == 2 {
        largest
    } else {
        d
    };
    let w = if left_out == 3 { largest } else { d };
    (left_out < 4).then(|| Quat::new_unchecked(nalgebra::Quaternion::new(w, x, y, z)))
}

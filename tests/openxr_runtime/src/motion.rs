//! Poses of head and hands.
//!
//! ```text
//! θ = 2π·t/T;   head:  position (r·cos θ, h, −r·sin θ), turned by θ about y
//! ```
//!
//! with t the time in ns since 1970, T = [`PERIOD_NS`], r = [`RADIUS_M`], h = [`HEIGHT_M`]; y is up, and the origin on the
//! floor. Hands and the right hand's ray rest.

use openxr_sys::{Posef, Quaternionf, Vector3f};

/// Time for a circle, ns.
pub const PERIOD_NS: i64 = 20_000_000_000;
/// Radius of the circle, m.
pub const RADIUS_M: f64 = 0.5;
/// Height of the eyes, m.
pub const HEIGHT_M: f64 = 1.625;
/// Left hand: `x y z qx qy qz qw`.
pub const LEFT_HAND: [f32; 7] = [-0.25, 1.0, -1.5, 0.0, 0.0, 0.0, 1.0];
/// Right hand, a half turn about x.
pub const RIGHT_HAND: [f32; 7] = [0.5, 1.25, -0.75, 1.0, 0.0, 0.0, 0.0];
/// Ray of the right hand, whose −z is straight ahead.
pub const AIM: [f32; 7] = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Returns the head at a time.
pub fn head(time_ns: i64) -> [f32; 7] {
    let turned = std::f64::consts::TAU * (time_ns.rem_euclid(PERIOD_NS)) as f64 / PERIOD_NS as f64;
    let (sin, cos) = turned.sin_cos();
    let (half_sin, half_cos) = (0.5 * turned).sin_cos();
    [RADIUS_M * cos, HEIGHT_M, -RADIUS_M * sin, 0.0, half_sin, 0.0, half_cos].map(|x| x as f32)
}

/// Returns the pose with these numbers.
pub fn pose([x, y, z, qx, qy, qz, qw]: [f32; 7]) -> Posef {
    Posef { position: Vector3f { x, y, z }, orientation: Quaternionf { x: qx, y: qy, z: qz, w: qw } }
}

//! Cameras and projectors.
//!
//! Axes of both: x to the right, y down, z ahead. Pixels to the right and down from the upper left corner.
//!
//! ```text
//! pose:       x_lens = R(r) (x_cave − c)                         r rotation vector, c position
//! both:       d = (x / z, y / z),   ρ = |d|²
//! camera:     p = p₀ + f (d (1 + k₁ρ + k₂ρ² + k₃ρ³) + (2 t₁ d_x d_y + t₂ (ρ + 2 d_x²), t₁ (ρ + 2 d_y²) + 2 t₂ d_x d_y))
//! projector:  p = p₀ + f (1 + k₁ρ + k₂ρ²) (d_x, a d_y)
//! ```
//!
//! Source of the distortion: Brown, "Close-range camera calibration" (1971).

use nalgebra::{Point3, Rotation3, Vector3};

/// Numbers of a pose: `r`, `c`.
pub(crate) const POSE: usize = 6;
/// Numbers of a camera: `ln f`, `p₀`, `k₁ k₂ k₃`, `t₁ t₂`.
pub(crate) const CAMERA: usize = 8;
/// Numbers of a projector's lens: `ln f`, `ln a`, `p₀`, `k₁ k₂`.
pub(crate) const LENS: usize = 6;

/// Position and rotation of a camera or projector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pose {
    /// Cave to lens.
    pub rotation: Rotation3<f64>,
    /// Center of the lens, m, cave axes.
    pub position: Point3<f64>,
}

impl Pose {
    pub fn of(x: &[f64]) -> Pose {
        Pose { rotation: Rotation3::new(Vector3::new(x[0], x[1], x[2])), position: Point3::new(x[3], x[4], x[5]) }
    }

    pub fn numbers(&self) -> [f64; POSE] {
        let (r, c) = (self.rotation.scaled_axis(), self.position);
        [r.x, r.y, r.z, c.x, c.y, c.z]
    }

    /// Returns a point in the axes of the lens.
    pub fn local(&self, point: &Point3<f64>) -> Vector3<f64> {
        self.rotation * (point - self.position)
    }

    /// Returns a direction of the lens in the axes of the cave.
    pub fn outward(&self, ray: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.inverse() * ray
    }
}

/// Returns the distorted place of a direction `(x, y, 1)`, in units of the focal length.
fn bent(camera: &[f64], x: f64, y: f64) -> [f64; 2] {
    let (k, t) = (&camera[3..6], &camera[6..8]);
    let rho = x * x + y * y;
    let s = 1.0 + rho * (k[0] + rho * (k[1] + rho * k[2]));
    let dx = 2.0 * t[0] * x * y + t[1] * (rho + 2.0 * x * x);
    let dy = t[0] * (rho + 2.0 * y * y) + 2.0 * t[1] * x * y;
    [x * s + dx, y * s + dy]
}

/// Returns the pixel at which a camera sees a direction; `None` behind it.
pub(crate) fn camera_pixel(camera: &[f64], local: &Vector3<f64>) -> Option<[f64; 2]> {
    if local.z < 1e-9 {
        return None;
    }
    let [x, y] = bent(camera, local.x / local.z, local.y / local.z);
    Some([camera[1] + camera[0].exp() * x, camera[2] + camera[0].exp() * y])
}

/// Returns the ray of a camera's pixel, with z = 1; `None` beyond the range in which the distortion grows.
pub(crate) fn camera_ray(camera: &[f64], [px, py]: [f64; 2]) -> Option<Vector3<f64>> {
    let f = camera[0].exp();
    let wanted = [(px - camera[1]) / f, (py - camera[2]) / f];
    let [mut x, mut y] = wanted;
    for _ in 0..50 {
        let there = bent(camera, x, y);
        let rho = x * x + y * y;
        // the change along the radius; across it is less
        let slope = 1.0 + rho * (3.0 * camera[3] + rho * (5.0 * camera[4] + rho * 7.0 * camera[5]));
        if slope < 0.05 {
            return None;
        }
        let step = [(wanted[0] - there[0]) / slope.max(1.0), (wanted[1] - there[1]) / slope.max(1.0)];
        (x, y) = (x + step[0], y + step[1]);
        if step[0].abs() + step[1].abs() < 1e-13 {
            return Some(Vector3::new(x, y, 1.0));
        }
    }
    // 1e-6 of the focal length is a thousandth of a pixel
    let left = bent(camera, x, y);
    ((left[0] - wanted[0]).hypot(left[1] - wanted[1]) < 1e-6).then(|| Vector3::new(x, y, 1.0))
}

/// Returns the pixel of a projector that lights a direction; `None` behind it.
pub(crate) fn lens_pixel(lens: &[f64], local: &Vector3<f64>) -> Option<[f64; 2]> {
    if local.z < 1e-9 {
        return None;
    }
    let (x, y) = (local.x / local.z, local.y / local.z);
    let rho = x * x + y * y;
    let s = lens[0].exp() * (1.0 + rho * (lens[4] + rho * lens[5]));
    Some([lens[2] + s * x, lens[3] + s * lens[1].exp() * y])
}

/// Returns the direction that a pixel of a projector lights, with z = 1; `None` beyond the range in which the
/// distortion grows.
pub(crate) fn lens_ray(lens: &[f64], [px, py]: [f64; 2]) -> Option<Vector3<f64>> {
    let f = lens[0].exp();
    let (x, y) = ((px - lens[2]) / f, (py - lens[3]) / (f * lens[1].exp()));
    // solves r (1 + k₁ r² + k₂ r⁴) = |d| for r
    let wanted = x.hypot(y);
    let mut r = wanted;
    for _ in 0..30 {
        let rho = r * r;
        let slope = 1.0 + rho * (3.0 * lens[4] + rho * 5.0 * lens[5]);
        if slope < 0.05 {
            return None;
        }
        let step = (r * (1.0 + rho * (lens[4] + rho * lens[5])) - wanted) / slope;
        r -= step;
        if step.abs() < 1e-14 {
            break;
        }
    }
    let share = if wanted > 1e-12 { r / wanted } else { 1.0 };
    (r.is_finite() && r >= 0.0).then(|| Vector3::new(x * share, y * share, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_of_cameras_return_to_their_pixels() {
        let camera = [(520f64).ln(), 408.0, 291.0, -0.11, 0.02, -0.001, 6e-4, -4e-4];
        for pixel in [[0.0, 0.0], [800.0, 600.0], [408.0, 291.0], [13.0, 540.5]] {
            let back = camera_pixel(&camera, &(camera_ray(&camera, pixel).unwrap() * 2.0)).unwrap();
            assert!((0..2).all(|k| (back[k] - pixel[k]).abs() < 1e-9), "{pixel:?} {back:?}");
        }
        // a distortion that folds the picture has no ray
        let folded = [(500f64).ln(), 0.0, 0.0, -0.5, 0.0, 0.0, 0.0, 0.0];
        assert!(camera_ray(&folded, [600.0, 0.0]).is_none());
    }

    #[test]
    fn rays_of_projectors_return_to_their_pixels() {
        let lens = [(900f64).ln(), 0.01, 480.0, 700.0, -0.12, 0.05];
        for pixel in [[0.0, 0.0], [960.0, 0.0], [480.0, 700.0], [13.0, 540.5], [955.0, 1.0]] {
            let back = lens_pixel(&lens, &(lens_ray(&lens, pixel).unwrap() * 3.0)).unwrap();
            assert!((0..2).all(|k| (back[k] - pixel[k]).abs() < 1e-9), "{pixel:?} {back:?}");
        }
    }
}

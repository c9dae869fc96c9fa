//! Cameras: a pinhole, or any view and projection (off-axis walls of a cave).
//!
//! Frames: world is z up, right-handed. View space looks along −z with x right and y up. Clip space
//! is wgpu's: x right, y up, depth 0 at the near plane and 1 at the far plane. (The passes reverse
//! depth internally for precision; callers never see that.)

use crate::RenderError;
use nalgebra::{Matrix4, Point3, RowVector4, Vector3, Vector4};

/// A camera: either a look-at pinhole or raw matrices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Camera {
    /// A symmetric pinhole.
    LookAt {
        /// The eye in the world, m.
        eye: Point3<f32>,
        /// The point in the middle of the picture.
        target: Point3<f32>,
        /// The upward direction in the picture. It need not be perpendicular to the line of sight,
        /// but must not be parallel to it.
        up: Vector3<f32>,
        /// Full opening angle from the bottom to the top of the picture, rad, between 0 and π.
        vertical_fov_rad: f32,
        /// Distance of the near plane, m, above 0.
        near_m: f32,
        /// Distance of the far plane, m, above `near_m`.
        far_m: f32,
    },
    /// View and projection matrices, for off-axis projections; the aspect ratio is part of the
    /// projection.
    Raw {
        /// World to view space: a rigid motion.
        view: Matrix4<f32>,
        /// View to clip space: a frustum (last row `0 0 −1 0`, off-axis allowed) or an orthographic
        /// box (last row `0 0 0 1`).
        projection: Matrix4<f32>,
    },
}

impl Default for Camera {
    fn default() -> Self {
        Camera::look_at(Point3::new(4.0, -4.0, 3.0), Point3::origin())
    }
}

impl Camera {
    /// Returns a pinhole at `eye` that looks at `target`: z up, 40 degrees from bottom to top,
    /// depth range from 5 cm to 500 m.
    pub fn look_at(eye: Point3<f32>, target: Point3<f32>) -> Self {
        Camera::LookAt {
            eye,
            target,
            up: Vector3::z(),
            vertical_fov_rad: 40f32.to_radians(),
            near_m: 0.05,
            far_m: 500.0,
        }
    }

    /// Sets the opening angle from bottom to top, rad. Raw cameras are unchanged.
    #[must_use]
    pub fn with_fov(mut self, fov_rad: f32) -> Self {
        if let Camera::LookAt { vertical_fov_rad, .. } = &mut self {
            *vertical_fov_rad = fov_rad;
        }
        self
    }

    /// Returns a pinhole along `direction` that shows the whole sphere `(center, radius_m)` with
    /// `fill` (0 to 1) of the picture's height.
    pub fn framing(center: Point3<f32>, radius_m: f32, direction: Vector3<f32>, fill: f32) -> Self {
        let fov = 40f32.to_radians();
        let radius = radius_m.max(1e-4);
        let distance = radius / (0.5 * fov * fill.clamp(0.05, 1.0)).sin();
        let away = direction.try_normalize(1e-12).unwrap_or(-Vector3::x());
        let up = if away.z.abs() > 0.999 { Vector3::y() } else { Vector3::z() };
        Camera::LookAt {
            eye: center - away * distance,
            target: center,
            up,
            vertical_fov_rad: fov,
            near_m: (distance * 0.01).max(1e-4),
            far_m: distance * 100.0,
        }
    }

    /// Returns the view and projection matrices for a picture whose width is `aspect` times its
    /// height.
    ///
    /// # Errors
    /// [`RenderError::BadValue`] if the numbers make no camera.
    pub fn matrices(&self, aspect: f32) -> Result<(Matrix4<f32>, Matrix4<f32>), RenderError> {
        match *self {
            Camera::LookAt { eye, target, up, vertical_fov_rad, near_m, far_m } => {
                let forward = target - eye;
                check(
                    forward.norm() > 1e-9 && forward.norm().is_finite(),
                    "target",
                    format!("{target:?}"),
                    "a finite point away from the eye",
                )?;
                check(
                    up.cross(&forward).norm() > 1e-6 * up.norm() * forward.norm(),
                    "up",
                    format!("{up:?}"),
                    "a direction not along the line of sight",
                )?;
                check(
                    vertical_fov_rad > 0.0 && vertical_fov_rad < std::f32::consts::PI,
                    "vertical_fov_rad",
                    vertical_fov_rad.to_string(),
                    "0 < angle < pi",
                )?;
                check(near_m > 0.0 && near_m.is_finite(), "near_m", near_m.to_string(), "above 0")?;
                check(far_m > near_m && far_m.is_finite(), "far_m", far_m.to_string(), "above near_m")?;
                Ok((Matrix4::look_at_rh(&eye, &target, &up), perspective(vertical_fov_rad, aspect, near_m, far_m)))
            }
            Camera::Raw { view, projection } => {
                check(
                    view.iter().chain(projection.iter()).all(|x| x.is_finite()),
                    "raw matrices",
                    "not finite".into(),
                    "finite numbers",
                )?;
                let r = view.fixed_view::<3, 3>(0, 0).into_owned();
                let rigid = (r * r.transpose() - nalgebra::Matrix3::identity()).norm() < 1e-3
                    && view.row(3) == nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0);
                check(rigid, "view", format!("{view:?}"), "a rotation and a translation")?;
                let last = projection.row(3).into_owned();
                let frustum = last == nalgebra::RowVector4::new(0.0, 0.0, -1.0, 0.0);
                let ortho = last == nalgebra::RowVector4::new(0.0, 0.0, 0.0, 1.0);
                check(frustum || ortho, "projection", format!("{projection:?}"), "a last row of 0 0 -1 0 or 0 0 0 1")?;
                check(
                    projection[(0, 0)] != 0.0 && projection[(1, 1)] != 0.0,
                    "projection",
                    format!("{projection:?}"),
                    "a scale other than 0",
                )?;
                Ok((view, projection))
            }
        }
    }

    /// Projects a world point into a `width` x `height` picture: pixels from the top left corner,
    /// and depth 0 (near) to 1 (far). Returns `None` behind the eye, and for an invalid camera.
    pub fn project(&self, point: Point3<f32>, width: u32, height: u32) -> Option<[f32; 3]> {
        let (view, projection) = self.matrices(width as f32 / height as f32).ok()?;
        let clip = projection * view * Vector4::new(point.x, point.y, point.z, 1.0);
        (clip.w > 0.0).then(|| {
            let ndc = clip.xyz() / clip.w;
            [(0.5 + 0.5 * ndc.x) * width as f32, (0.5 - 0.5 * ndc.y) * height as f32, ndc.z]
        })
    }
}

/// Returns a symmetric perspective projection with depth 0 at `near` and 1 at `far`; view space
/// looks along −z.
pub(crate) fn perspective(vertical_fov_rad: f32, aspect: f32, near: f32, far: f32) -> Matrix4<f32> {
    let f = 1.0 / (0.5 * vertical_fov_rad).tan();
    frustum([f / aspect, 0.0], [f, 0.0], near, far)
}

/// Returns a perspective projection with depth 0 at `near` and 1 at `far`. A direction with slope
/// `s` in x or y (from −z) has the coordinate `scale·s − offset` in the picture, by the
/// `[scale, offset]` of its axis.
pub(crate) fn frustum(x: [f32; 2], y: [f32; 2], near: f32, far: f32) -> Matrix4<f32> {
    Matrix4::from_rows(&[
        RowVector4::new(x[0], 0.0, x[1], 0.0),
        RowVector4::new(0.0, y[0], y[1], 0.0),
        RowVector4::new(0.0, 0.0, far / (near - far), near * far / (near - far)),
        RowVector4::new(0.0, 0.0, -1.0, 0.0),
    ])
}

/// Returns an orthographic projection of the box `[min, max]` of view space, with depth 0 at `z =
/// max.z` (nearest) and 1 at `z = min.z`.
pub(crate) fn orthographic(min: Vector3<f32>, max: Vector3<f32>) -> Matrix4<f32> {
    let size = max - min;
    Matrix4::from_rows(&[
        RowVector4::new(2.0 / size.x, 0.0, 0.0, -(max.x + min.x) / size.x),
        RowVector4::new(0.0, 2.0 / size.y, 0.0, -(max.y + min.y) / size.y),
        RowVector4::new(0.0, 0.0, -1.0 / size.z, max.z / size.z),
        RowVector4::new(0.0, 0.0, 0.0, 1.0),
    ])
}

fn check(ok: bool, field: &'static str, value: String, expected: &'static str) -> Result<(), RenderError> {
    if ok { Ok(()) } else { Err(RenderError::BadValue { what: "camera", index: 0, field, value, expected }) }
}

//! Generalized perspective: the view of one eye through one screen at any place (R. Kooima,
//! "Generalized Perspective Projection", 2008, from its geometry; written for parallelograms, so
//! that screens measured slightly out of square still meet at their edges).
//!
//! ```text
//! r = u / |u|      n = u × v / |u × v|      t = n × r              axes of the view: right, towards the viewer, up
//! d = (e − a) · n                                                  distance of the eye, > 0
//! view:  p = R (x − e),   R = rows r, t, n;   s = −p_z            the ray through x meets the screen at p_xy d / s
//! M = | |u|  v·r |        (σ, τ) = M⁻¹ (p_xy d / s − l)           l = R (a − e) in x, y;  σ, τ in 0..1 on the screen
//!     |  0   v·t |
//! ndc = 2 (σ, τ) − 1:     clip_xy = 2 d M⁻¹ p_xy + (2 M⁻¹ l + 1) p_z,    clip_w = −p_z
//! depth: 0 at s = near, 1 at s = far
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | a, u, v | lower left corner, lower edge, left edge of the screen, m |
//! | e | the eye, m |
//! | s | depth along the screen's normal, m |
//!
//! With square corners `v·r = 0`, and this is Kooima's frustum: left = l_x near / d and so on.

use crate::RenderError;
use crate::viewpoint::{Lens, Part, Viewpoint};
use nalgebra::{Matrix2, Matrix4, Point3, RowVector4, Vector2, Vector3};

/// The view of one eye through one screen, in double precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FacetView {
    view: Matrix4<f64>,
    projection: Matrix4<f64>,
    /// Width and height of the screen, m, and the place of its upper left corner in its plane: to
    /// the right and down from the foot of the world's origin.
    plane: [f64; 4],
    part: Option<Part>,
}

impl FacetView {
    /// Returns the view from the eye through the screen with these corners (lower left, lower
    /// right, upper left, as seen by the eye). The depths `near_m` and `far_m` are along the
    /// screen's normal.
    ///
    /// # Errors
    /// [`RenderError::BadValue`] for a screen without area, an eye that is not in front of it,
    /// numbers that are not finite, or depths out of order.
    pub fn new(
        eye: Point3<f64>,
        [a, b, c]: [Point3<f64>; 3],
        near_m: f64,
        far_m: f64,
    ) -> Result<FacetView, RenderError> {
        let finite = eye.iter().chain(a.iter()).chain(b.iter()).chain(c.iter()).all(|x| x.is_finite());
        check(finite, "corners", format!("{a} {b} {c} seen from {eye}"), "finite numbers")?;
        check(
            near_m > 0.0 && far_m > near_m && far_m.is_finite(),
            "near_m",
            format!("{near_m} (far_m {far_m})"),
            "above 0 and less than far_m",
        )?;
        let (u, v) = (b - a, c - a);
        let area = u.cross(&v).norm();
        check(
            area > 1e-9 * u.norm() * v.norm() && area > 0.0,
            "corners",
            format!("{a} {b} {c}"),
            "three corners of a rectangle",
        )?;
        let (right, normal) = (u / u.norm(), u.cross(&v) / area);
        let up = normal.cross(&right);
        let d = (eye - a).dot(&normal);
        check(d > 0.0, "eye", format!("{eye}, {d} m in front of the screen"), "a point in front of the screen")?;
        let view = view_matrix(&right, &up, &normal, &eye);
        let m = Matrix2::new(u.norm(), v.dot(&right), 0.0, v.dot(&up));
        let inverse =
            m.try_inverse().ok_or_else(|| bad("corners", format!("{a} {b} {c}"), "three corners of a rectangle"))?;
        let l = Vector2::new((a - eye).dot(&right), (a - eye).dot(&up));
        let scale = inverse * (2.0 * d);
        let offset = inverse * l * 2.0 + Vector2::repeat(1.0);
        let depth = 1.0 / (near_m - far_m);
        let projection = Matrix4::from_rows(&[
            RowVector4::new(scale[(0, 0)], scale[(0, 1)], offset.x, 0.0),
            RowVector4::new(scale[(1, 0)], scale[(1, 1)], offset.y, 0.0),
            RowVector4::new(0.0, 0.0, far_m * depth, near_m * far_m * depth),
            RowVector4::new(0.0, 0.0, -1.0, 0.0),
        ]);
        let plane = [u.norm(), v.norm(), a.coords.dot(&right), -c.coords.dot(&up)];
        Ok(FacetView { view, projection, plane, part: None })
    }

    /// Makes the view one of several for a picture of this size; see [`Part`]. Screens in one plane
    /// with equal pixels share their dither.
    #[must_use]
    pub fn part(mut self, width: u32, height: u32, rim_px: u32) -> FacetView {
        let [wide, high, right, down] = self.plane;
        // a quarter of a pixel keeps the rounding consistent for screens that start at half pixels
        let number = |at: f64, length: f64, pixels: u32| {
            (at / length * f64::from(pixels) + 0.25).floor().clamp(-1e6, 1e6) as i32
        };
        self.part = Some(Part { first_pixel: [number(right, wide, width), number(down, high, height)], rim_px });
        self
    }

    /// World to view and view to clip.
    pub fn matrices(&self) -> (&Matrix4<f64>, &Matrix4<f64>) {
        (&self.view, &self.projection)
    }

    /// Projects a world point: x and y from −1 to 1 on the screen (right, up), depth 0 near to 1
    /// far. Returns `None` at and behind the eye.
    pub fn project(&self, point: &Point3<f64>) -> Option<Vector3<f64>> {
        let clip = self.projection * (self.view * point.to_homogeneous());
        (clip.w > 0.0).then(|| clip.xyz() / clip.w)
    }

    /// Projects a world point into a picture of this size: pixels from the top left corner. Returns
    /// `None` at and behind the eye.
    pub fn pixel(&self, point: &Point3<f64>, width: u32, height: u32) -> Option<[f64; 2]> {
        self.project(point).map(|ndc| [(0.5 + 0.5 * ndc.x) * f64::from(width), (0.5 - 0.5 * ndc.y) * f64::from(height)])
    }
}

impl Viewpoint for FacetView {
    /// The aspect ratio has no influence, because the screen's is in the matrix.
    fn lens(&self, _aspect: f32) -> Result<Lens, RenderError> {
        Ok(Lens { view: self.view, projection: self.projection, part: self.part })
    }
}

/// `x ↦ R (x − e)`.
fn view_matrix(right: &Vector3<f64>, up: &Vector3<f64>, back: &Vector3<f64>, eye: &Point3<f64>) -> Matrix4<f64> {
    let row = |v: &Vector3<f64>| RowVector4::new(v.x, v.y, v.z, -v.dot(&eye.coords));
    Matrix4::from_rows(&[row(right), row(up), row(back), RowVector4::new(0.0, 0.0, 0.0, 1.0)])
}

fn check(ok: bool, field: &'static str, value: String, expected: &'static str) -> Result<(), RenderError> {
    if ok { Ok(()) } else { Err(bad(field, value, expected)) }
}

fn bad(field: &'static str, value: String, expected: &'static str) -> RenderError {
    RenderError::BadValue { what: "facet", index: 0, field, value, expected }
}

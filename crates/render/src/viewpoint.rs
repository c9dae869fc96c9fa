//! The interface of everything that a picture can be taken with: a look-at camera, raw matrices, a
//! facet of a cave.

use crate::{Camera, RenderError};
use nalgebra::Matrix4;

/// A viewpoint of pictures ([`crate::Renderer::render_from`]).
pub trait Viewpoint {
    /// Returns the matrices, and how the picture is part of a larger one.
    ///
    /// # Errors
    /// [`RenderError::BadValue`] if the numbers make no view.
    fn lens(&self, aspect: f32) -> Result<Lens, RenderError>;
}

/// A view in numbers. World z up; view space looks along −z, x right, y up; clip space has depth 0
/// near and 1 far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// World to view: a rigid motion.
    pub view: Matrix4<f64>,
    /// View to clip: a frustum (last row `0 0 −1 0`) or an orthographic box (last row `0 0 0 1`).
    pub projection: Matrix4<f64>,
    /// `None` for a picture by itself.
    pub part: Option<Part>,
}

/// Marks one of several pictures that show one world side by side and must agree at their edges.
/// Shadows, floor and occlusion are then fitted to the whole world instead of to this view, and the
/// dither continues across the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Index of the first pixel, to the right and down, in the plane that the pictures share.
    pub first_pixel: [i32; 2],
    /// Pixels drawn beyond each edge and cut off again, so that occlusion sees past the edge. It is
    /// also the largest reach of occlusion; 0 turns occlusion off.
    pub rim_px: u32,
}

impl Viewpoint for Camera {
    fn lens(&self, aspect: f32) -> Result<Lens, RenderError> {
        let (view, projection) = self.matrices(aspect)?;
        Ok(Lens { view: view.cast(), projection: projection.cast(), part: None })
    }
}

impl Lens {
    /// Extends the view by `rim` pixels on each side of a picture of this size.
    pub(crate) fn widened(mut self, width: u32, height: u32, rim: u32) -> Lens {
        let share = |side: u32| f64::from(side) / f64::from(side + 2 * rim);
        let across = self.projection.row(0) * share(width);
        let upward = self.projection.row(1) * share(height);
        self.projection.set_row(0, &across);
        self.projection.set_row(1, &upward);
        self
    }
}

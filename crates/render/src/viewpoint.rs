//! What a picture is taken with, whoever it is: a look-at camera, raw matrices, a facet of a cave.

use crate::{Camera, RenderError};
use nalgebra::Matrix4;

/// Something that pictures can be taken with ([`crate::Renderer::render_from`]).
pub trait Viewpoint {
    /// The matrices, and what else a picture of this shape needs to know.
    ///
    /// # Errors
    /// [`RenderError::BadValue`] where the numbers make no view.
    fn lens(&self, aspect: f32) -> Result<Lens, RenderError>;
}

/// A view in numbers. World z up; view space looks along −z, x right, y up; clip space has depth 0 near and 1 far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// World to view: a rigid motion.
    pub view: Matrix4<f64>,
    /// View to clip: a frustum (last row `0 0 −1 0`) or an orthographic box (last row `0 0 0 1`).
    pub projection: Matrix4<f64>,
    /// `None` for a picture by itself.
    pub part: Option<Part>,
}

/// That a picture is one of several that show one world side by side, and must agree at their edges. Shadows, floor and occlusion are
/// then fitted to all there is instead of to what this view sees, and dither runs on across the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The number of the first pixel, to the right and down, in the plane that the picture shares with others.
    pub first_pixel: [i32; 2],
    /// Pixels drawn beyond each edge and cut off again, so that occlusion sees past the edge. It reaches no farther than this: 0 turns it off.
    pub rim_px: u32,
}

impl Viewpoint for Camera {
    fn lens(&self, aspect: f32) -> Result<Lens, RenderError> {
        let (view, projection) = self.matrices(aspect)?;
        Ok(Lens { view: view.cast(), projection: projection.cast(), part: None })
    }
}

impl Lens {
    /// The same view with `rim` pixels more on each side of a picture of this size.
    pub(crate) fn widened(mut self, width: u32, height: u32, rim: u32) -> Lens {
        let share = |side: u32| f64::from(side) / f64::from(side + 2 * rim);
        let across = self.projection.row(0) * share(width);
        let upward = self.projection.row(1) * share(height);
        self.projection.set_row(0, &across);
        self.projection.set_row(1, &upward);
        self
    }
}

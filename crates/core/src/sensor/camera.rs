//! Cameras: images of depth and of parts, by a ray through the middle of every pixel.
//!
//! ```text
//! f = height/(2·tan(½·fov))          d(row, column) = ((column + ½ − ½·width)/f, (row + ½ − ½·height)/f, 1)
//! depth = z of the point that o + s·d enters first, in the axes of the site
//! ```
//!
//! The camera looks along the z axis of its site, x points right in the image and y down: the axes of computer vision. An
//! image is a function of the present poses, so it is computed when it is read, in a fork, a replay or a facet too, and takes
//! no part in the state. The noise of a frame's image is that of its seed and of the number of the frame; the walk of its bias
//! is a number of the state, one for the whole image. A camera with a delay makes its image at the end of every frame and keeps
//! those of the last frames in the state, a number per pixel.
//!
//! | symbol | meaning |
//! |---|---|
//! | `fov` | [`Optics::vertical_fov`] |
//! | `f` | focal length, pixels |
//! | `o`, `d` | origin of the site, direction of a ray |

use nalgebra::ComplexField;
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use tumble_collide::Vec3;

/// Largest number of pixels of an image.
const MAX_PIXELS: u32 = 1 << 24;

/// Resolution and angle of view of a camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Optics {
    /// Pixels in a row and rows, at least 1, at most 2²⁴ pixels in all.
    pub resolution: [u32; 2],
    /// Vertical angle of view, rad, above 0 and below π.
    pub vertical_fov: f64,
}

impl Default for Optics {
    /// Returns 64 × 48 pixels and 45°.
    fn default() -> Optics {
        Optics { resolution: [64, 48], vertical_fov: 0.25 * PI }
    }
}

impl Optics {
    pub(super) fn range_error(&self) -> Option<(&'static str, f64, &'static str)> {
        let [width, height] = self.resolution;
        let pixels = u64::from(width) * u64::from(height);
        if pixels == 0 || pixels > u64::from(MAX_PIXELS) {
            return Some(("the number of pixels", pixels as f64, "1 to 16777216"));
        }
        let fine = self.vertical_fov > 0.0 && self.vertical_fov < PI;
        (!fine).then_some(("the angle of view", self.vertical_fov, "above 0 and below π"))
    }

    /// Returns the directions through the pixels in the axes of the site, by rows from the top, with `z = 1`.
    pub(crate) fn directions(&self) -> impl Iterator<Item = Vec3> + use<> {
        let [width, height] = self.resolution;
        let half = 0.5 * self.vertical_fov;
        let focal = 0.5 * f64::from(height) * <f64 as ComplexField>::cos(half) / <f64 as ComplexField>::sin(half);
        let at = move |k: u32, count: u32| (f64::from(k) + 0.5 - 0.5 * f64::from(count)) / focal;
        (0..height)
            .flat_map(move |row| (0..width).map(move |column| Vec3::new(at(column, width), at(row, height), 1.0)))
    }
}

/// An image.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorImage<T> {
    /// Number of pixels in a row.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// The pixels by rows, the top one first.
    pub pixels: Vec<T>,
}

impl<T> SensorImage<T> {
    pub(crate) fn map<U>(self, change: impl FnMut(T) -> U) -> SensorImage<U> {
        let SensorImage { width, height, pixels } = self;
        SensorImage { width, height, pixels: pixels.into_iter().map(change).collect() }
    }
}

//! A cube of pictures around an eye, from which pictures on curved screens are put together.
//!
//! ```text
//! d = x − e                            from the eye to the point that a pixel shows, cave axes
//! face: the largest of |d_x|, |d_y|, |d_z| and its sign;  (a, b) = the other two over it, right and up of the face
//! place in the face's picture: x = B + (½ + ½ a) N − ½,  y = B + (½ − ½ b) N − ½     pixels, centers at whole numbers
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | N | pixels of a face's side, 90 degrees |
//! | B | pixels beyond each edge, so that no interpolation ends at a seam |
//!
//! The faces are views through flat screens ([`super::FacetView`]), whose shadows, occlusion and sky do not
//! depend on the face. All faces are tiles of one picture, three in a row.

use super::surface::{NOTHING, direction};
use nalgebra::{Point3, Vector3};

/// Pixels of a face beyond 90 degrees on each side.
const BORDER_PX: u32 = 2;
/// Smallest and largest side of a face, pixels.
const SIDE_PX: std::ops::RangeInclusive<u32> = 32..=2304;
/// Pixels between those whose directions choose the faces.
const STRIDE: usize = 4;
/// A direction needs a face if its coordinate towards it is more than this share of the largest.
const NEAR_EDGE: f64 = 0.8;

/// The resolution of a cube of pictures, and its six faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cube {
    /// Pixels of 90 degrees.
    pub side_px: u32,
}

/// Right, up and outward axis of each face, in cave axes; right × up points inward.
const FACES: [[[f64; 3]; 3]; 6] = [
    [[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
    [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
    [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]],
    [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]],
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]],
];

impl Cube {
    /// Chooses the resolution: in the middle of a face, where its pixels are farthest apart, they are
    /// as dense as those of the finished picture where these are densest. A pixel counts by its larger
    /// distance from the next one to the right and below, and one in fifty may be denser.
    pub fn fitting(shown: &[[f32; 4]], [width, height]: [u32; 2], eye: &Point3<f64>) -> Cube {
        let (w, h) = (width as usize, height as usize);
        let unit =
            |x: usize, y: usize| direction(shown[y * w + x], eye).and_then(|d| Vector3::from(d).try_normalize(1e-12));
        let (dx, dy) = ((w / 64).max(1), (h / 64).max(1));
        let mut steps = Vec::new();
        for (x, y) in (0..h - 1).step_by(dy).flat_map(|y| (0..w - 1).step_by(dx).map(move |x| (x, y))) {
            if let (Some(here), Some(right), Some(below)) = (unit(x, y), unit(x + 1, y), unit(x, y + 1)) {
                steps.push((right - here).norm().max((below - here).norm()));
            }
        }
        steps.sort_by(f64::total_cmp);
        let finest = steps.get(steps.len() / 50).copied().unwrap_or(0.01).max(1e-6);
        Cube { side_px: ((2.0 / finest).ceil() as u32).clamp(*SIDE_PX.start(), *SIDE_PX.end()) }
    }

    /// Side of a tile with its border, pixels.
    pub fn tile_px(&self) -> u32 {
        self.side_px + 2 * BORDER_PX
    }

    /// Size of the picture of all tiles.
    pub fn atlas_px(&self) -> [u32; 2] {
        [3 * self.tile_px(), 2 * self.tile_px()]
    }

    /// Upper left corner of a face's tile in the picture of all tiles.
    pub fn corner_px(&self, face: usize) -> [u32; 2] {
        [face as u32 % 3 * self.tile_px(), face as u32 / 3 * self.tile_px()]
    }

    /// Pixels beyond each edge of a face.
    pub fn border_px(&self) -> u32 {
        BORDER_PX
    }

    /// Returns the corners of a face's screen around the eye at a distance of 1 m, with the border:
    /// lower left, lower right, upper left; cave axes.
    pub fn corners(&self, face: usize, eye: &Point3<f64>) -> [Point3<f64>; 3] {
        let [right, up, out] = FACES[face].map(Vector3::from);
        let half = f64::from(self.tile_px()) / f64::from(self.side_px);
        [(-half, -half), (half, -half), (-half, half)].map(|(a, b)| eye + out + right * a + up * b)
    }

    /// Returns which faces the pixels see from the eye.
    pub fn seen(&self, shown: &[[f32; 4]], width: u32, eye: &Point3<f64>) -> [bool; 6] {
        let mut seen = [false; 6];
        for row in shown.chunks(width as usize).step_by(STRIDE) {
            for d in row.iter().step_by(STRIDE).filter_map(|pixel| direction(*pixel, eye)) {
                let most = d.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
                for (k, c) in d.iter().enumerate() {
                    if c.abs() >= NEAR_EDGE * most {
                        seen[2 * k + usize::from(*c < 0.0)] = true;
                    }
                }
            }
        }
        seen
    }

    /// Returns the place of a direction in the picture of all tiles, pixels, centers at whole
    /// numbers.
    pub fn place(&self, d: [f64; 3]) -> [f64; 2] {
        let size = d.map(f64::abs);
        let k = if size[0] >= size[1] && size[0] >= size[2] { 0 } else { 1 + usize::from(size[2] > size[1]) };
        let face = 2 * k + usize::from(d[k] < 0.0);
        let [right, up, _] = FACES[face];
        let along = |axis: [f64; 3]| (0..3).map(|i| axis[i] * d[i]).sum::<f64>() / size[k];
        let (n, b) = (f64::from(self.side_px), f64::from(BORDER_PX));
        let corner = self.corner_px(face).map(f64::from);
        [corner[0] + b + (0.5 + 0.5 * along(right)) * n - 0.5, corner[1] + b + (0.5 - 0.5 * along(up)) * n - 0.5]
    }

    /// Returns for each pixel its place in the picture of all tiles; `None` if it shows nothing.
    pub fn places(&self, shown: &[[f32; 4]], eye: &Point3<f64>) -> Vec<Option<[f64; 2]>> {
        shown
            .iter()
            .map(|pixel| (*pixel != NOTHING).then(|| direction(*pixel, eye)).flatten().map(|d| self.place(d)))
            .collect()
    }
}

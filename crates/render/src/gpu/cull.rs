//! Occlusion culling of spheres for software rasterizers, where a hidden sphere costs as much to
//! draw as a visible one and culling it a tenth of that.
//!
//! The outline of a sphere in a picture is an ellipse (a circle in a parallel view). Let `m_i` be
//! the rows of the map from the world to the pixels `(x, y, w)` of a picture, `n_i` their first
//! three numbers, `C = (c, 1)` the center and `r` the radius. The dual conic is `q_ij =
//! (m_i·C)(m_j·C) - r² n_i·n_j` (Hartley and Zisserman, Multiple View Geometry, §8.3). Its middle
//! is `t = (q_xw, q_yw) / q_ww` and its shape `Σ = t tᵀ - (q_xx, q_xy; q_xy, q_yy) / q_ww`: points
//! `p` with `(p - t)ᵀ Σ⁻¹ (p - t) <= 1`.
//!
//! 1. Each sphere writes the largest depth of its front into the cells of a coarse map that lie
//!    entirely in its outline; nothing behind that depth is visible there.
//! 2. A sphere is hidden if all cells that its outline may touch hold less than the depth at which
//!    it begins.
//!
//! | symbol | meaning |
//! |---|---|
//! | `f`, `e` | direction of view; direction from the sphere to the eye; both of length 1 |
//! | `begin` | view depth of the sphere's nearest point, `(c - eye)·f - r` |
//! | `end` | upper bound of the depth of its front: `(c - eye)·f + r sin α`, `α` between `f` and `-e` (points of the front have a normal `n` with `n·e >= 0`) |
//!
//! **Invariant:** no sphere with a visible pixel is culled (`tests::culled_spheres_have_no_pixel`).
//! Outlines are shrunk where they hide and grown where they are hidden, by more than rounding.

use super::data::Eye;
use nalgebra::{Point3, Vector4};
use std::ops::Range;

/// Center and radius, m.
pub type SphereBounds = (Point3<f32>, f32);

/// Largest number of cells along a side.
const MAX_CELLS: usize = 512;
/// Smallest side of a cell, pixels.
const CELL_PX: usize = 2;

/// A sphere that may have a visible pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visible {
    /// Its index.
    pub number: u32,
    /// All pixels that it may have.
    pub pixels: PixelBox,
}

/// A rectangle of pixels: columns and rows, from the upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelBox {
    pub from: [u32; 2],
    pub to: [u32; 2],
}

impl PixelBox {
    /// A whole picture.
    pub fn whole(eye: &Eye) -> PixelBox {
        PixelBox { from: [0; 2], to: eye.size_px().map(|side| side as u32) }
    }

    /// The smallest box with all pixels of both.
    pub fn with(self, other: PixelBox) -> PixelBox {
        let each = |k: usize| (self.from[k].min(other.from[k]), self.to[k].max(other.to[k]));
        let [(left, right), (top, bottom)] = [each(0), each(1)];
        PixelBox { from: [left, top], to: [right, bottom] }
    }
}

/// Returns the spheres among `ranges` that may have a visible pixel, in their order. `samples` per pixel
/// determine how close to a pixel's edge a sample may be.
pub fn visible(
    spheres: &[SphereBounds],
    ranges: impl Iterator<Item = Range<u32>>,
    eye: &Eye,
    samples: u32,
) -> Vec<Visible> {
    let whole = PixelBox::whole(eye);
    let picture = Picture::of(eye);
    let mut map = Map::new(eye, samples);
    let mut outlines = Vec::with_capacity(spheres.len());
    for number in ranges.flatten() {
        match picture.place(&spheres[number as usize]) {
            Place::Outside => {}
            Place::Around => outlines.push((number, None)),
            Place::Before(outline) => {
                map.write(&outline);
                outlines.push((number, Some(outline)));
            }
        }
    }
    outlines
        .iter()
        .filter(|(_, outline)| outline.as_ref().is_none_or(|o| !map.hides(o)))
        .map(|(number, outline)| Visible {
            number: *number,
            pixels: outline.as_ref().map_or(whole, |o| o.pixels(whole)),
        })
        .collect()
}

/// The parts of a viewpoint that place spheres.
struct Picture<'a> {
    eye: &'a Eye,
    rows: [Vector4<f64>; 3],
    /// `n_i·n_j` for xx, xy, yy, xw, yw, ww.
    products: [f64; 6],
    /// Planes of its sides: signed distance inside, m.
    sides: [Vector4<f64>; 4],
}

enum Place {
    /// No pixel.
    Outside,
    /// The sphere contains the eye or crosses the plane through it, so its outline is no ellipse.
    Around,
    Before(Outline),
}

/// An ellipse in the picture, and the range of depths of the sphere's front.
struct Outline {
    middle: [f64; 2],
    /// `Σ_xx`, `Σ_xy`, `Σ_yy`, squares of pixels.
    shape: [f64; 3],
    begin: f64,
    end: f64,
    /// Pixels by which the device may displace it.
    error: f64,
    /// Whether it lies between the near and the far plane.
    whole: bool,
}

impl Picture<'_> {
    fn of(eye: &Eye) -> Picture<'_> {
        let rows = eye.pixel_rows();
        let product = |i: usize, j: usize| rows[i].xyz().dot(&rows[j].xyz());
        Picture {
            eye,
            rows,
            products: [product(0, 0), product(0, 1), product(1, 1), product(0, 2), product(1, 2), product(2, 2)],
            sides: eye.sides(),
        }
    }

    fn place(&self, (center, radius): &SphereBounds) -> Place {
        let (eye, c, r) = (self.eye, center.coords.cast::<f64>(), f64::from(*radius));
        let depth = eye.view_depth(&c);
        if (eye.perspective && depth + r <= 0.0)
            || self.sides.iter().any(|side| side.xyz().dot(&c) + side.w < -1.001 * r)
        {
            return Place::Outside;
        }
        let [near, far] = [depth - r, depth + r].map(|s| eye.depth_at(s));
        if far.is_some_and(|d| d > 1.0) || near.is_some_and(|d| d < 0.0) {
            return Place::Outside;
        }
        let [x, y, w] = self.rows.map(|m| m.xyz().dot(&c) + m.w);
        let [xx, xy, yy, xw, yw, ww] = self.products.map(|p| r * r * p);
        let q = w * w - ww;
        // the plane through the eye touches the sphere, or nearly
        if w <= 0.0 || q < 0.01 * w * w {
            return Place::Around;
        }
        let per = 1.0 / q;
        let middle = [(x * w - xw) * per, (y * w - yw) * per];
        let shape = [
            middle[0] * middle[0] - (x * x - xx) * per,
            middle[0] * middle[1] - (x * y - xy) * per,
            middle[1] * middle[1] - (y * y - yy) * per,
        ];
        if !middle.iter().chain(&shape).all(|x| x.is_finite()) {
            return Place::Around;
        }
        let error = 4.0 * f64::from(f32::EPSILON) * (c.amax() + eye.reach()) * eye.pixels_per_meter(depth);
        let whole = near.is_some_and(|d| d < 1.0) && far.is_some_and(|d| d > 0.0);
        Place::Before(Outline { middle, shape, begin: depth - r, end: depth + r * eye.sine_beside(&c), error, whole })
    }
}

impl Outline {
    /// Half its width and half its height, pixels.
    fn half_sides(&self) -> [f64; 2] {
        [self.shape[0].max(0.0).sqrt(), self.shape[2].max(0.0).sqrt()]
    }

    /// The pixels of a picture that it may touch, and one more on each side.
    fn pixels(&self, PixelBox { to: [width, height], .. }: PixelBox) -> PixelBox {
        let [across, down] = self.half_sides().map(|half| half + 1.0 + self.error);
        // numbers beyond the range become its ends
        let range = |middle: f64, half: f64, most: u32| {
            [((middle - half).floor() as u32).min(most), ((middle + half).ceil() as u32).min(most)]
        };
        let ([left, right], [top, bottom]) =
            (range(self.middle[0], across, width), range(self.middle[1], down, height));
        PixelBox { from: [left, top], to: [right, bottom] }
    }

    /// An upper bound of the depth of its front, including rounding.
    fn surely_ends(&self) -> f32 {
        (self.end + 1e-5 * self.end.abs() + 1e-3 * (self.end - self.begin)) as f32
    }
}

/// For each cell a depth behind which nothing is visible in it.
struct Map {
    per_cell: f64,
    cell: f64,
    columns: usize,
    rows: usize,
    /// Smallest distance of a sample from the edge of its pixel.
    inset: f64,
    depths: Vec<f32>,
}

impl Map {
    fn new(eye: &Eye, samples: u32) -> Map {
        let [width, height] = eye.size_px();
        let cell = CELL_PX.max(width.max(height).div_ceil(MAX_CELLS));
        let (columns, rows) = (width.div_ceil(cell), height.div_ceil(cell));
        // in the middle, or 1/8 from the edge; the rest is for rounding
        let inset = if samples == 1 { 0.4 } else { 0.1 };
        Map {
            per_cell: 1.0 / cell as f64,
            cell: cell as f64,
            columns,
            rows,
            inset,
            depths: vec![f32::INFINITY; columns * rows],
        }
    }

    /// The cells that may contain a sample between two places, and perhaps one more.
    fn touched(&self, from: f64, to: f64, count: usize) -> Range<usize> {
        // negative numbers become 0
        let first = ((from + self.inset) * self.per_cell) as usize;
        let end = if to < self.inset { 0 } else { ((to - self.inset) * self.per_cell) as usize + 1 };
        first.min(count)..end.clamp(first.min(count), count)
    }

    /// The cells whose samples all lie between two places, or one less.
    fn filled(&self, from: f64, to: f64, count: usize) -> Range<usize> {
        let first = if from <= self.inset { 0 } else { ((from - self.inset) * self.per_cell) as usize + 1 };
        let end = ((to + self.inset) * self.per_cell) as usize;
        first.min(count)..end.clamp(first.min(count), count)
    }

    /// Writes the sphere's depth into the cells that it fills: in each row, those between its edges
    /// at the row's upper and lower side.
    fn write(&mut self, o: &Outline) {
        let [across, down] = o.half_sides();
        let margin = 0.03 + o.error;
        if !o.whole || 2.0 * across.min(down) < self.cell || down <= margin {
            return;
        }
        let depth = o.surely_ends();
        let lean = o.shape[1] / o.shape[2];
        let wide = (o.shape[0] - o.shape[1] * lean).max(0.0).sqrt() - margin;
        let high = down - margin;
        let per_high = 1.0 / high;
        let chord = |y: f64| {
            let dy = y - o.middle[1];
            let half = wide * (1.0 - (dy * per_high) * (dy * per_high)).max(0.0).sqrt();
            let middle = o.middle[0] + lean * dy;
            (middle - half, middle + half)
        };
        for row in self.filled(o.middle[1] - high, o.middle[1] + high, self.rows) {
            let upper = chord(row as f64 * self.cell + self.inset);
            let lower = chord((row + 1) as f64 * self.cell - self.inset);
            let columns = self.filled(upper.0.max(lower.0), upper.1.min(lower.1), self.columns);
            self.depths[row * self.columns..][columns].iter_mut().for_each(|old| *old = old.min(depth));
        }
    }

    fn hides(&self, o: &Outline) -> bool {
        let [across, down] = o.half_sides().map(|half| half + 0.03 + o.error);
        let columns = self.touched(o.middle[0] - across, o.middle[0] + across, self.columns);
        let begin = o.begin as f32;
        let mut rows = self.touched(o.middle[1] - down, o.middle[1] + down, self.rows);
        rows.all(|row| self.depths[row * self.columns..][columns.clone()].iter().all(|depth| *depth < begin))
    }
}

#[cfg(test)]
mod tests;

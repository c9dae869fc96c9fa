//! The octree of a mesh's field: cells with lists of triangles, and a bound of the distance in each.
//!
//! ```text
//! c, h, r   center, half side and half diagonal of a cell       d_c  signed distance of c
//! d(p) ≥ d_c + max(−|p − c|, g·(p − c) − e)                     a cone, and a plane that is as good as the surface is flat
//! d(p) ≥ √(|p − q|² + max(d(q), 0)²)                            outside all cells; q is the closest point of the outermost cell
//! ```
//!
//! The last holds since `p − q` makes no acute angle with the way from `q` to anything in that cell.

use super::ListedTriangle;
use super::blocks::{Block, Blocks};
use super::triangles::Triangles;
use crate::{Mat3, Vec3};

/// Of single precision in a place and in a bound, in half sides of the outermost cell.
const ROUNDING: f64 = 2e-6;
/// The greatest number below 2, and the digits of a number behind the first one.
const BELOW_TWO: f32 = 1.999_999_9;
const MANTISSA: u32 = (1 << 23) - 1;

/// Thirty-two bytes, in single precision, since most of the time of a query goes by waiting for cells.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Cell {
    /// `g`, and `d_c − e` for the plane through the center.
    plane: [f32; 4],
    /// Signed distance at the center, or a little less.
    distance: f32,
    /// Where its list begins if it has one; else the first of eight children, 0 if there are none.
    pub link: u32,
    /// Length of the list; 0 where there is none.
    pub count: u8,
}

impl Cell {
    /// One that knows nothing.
    pub fn empty() -> Cell {
        Cell { plane: [0.0, 0.0, 0.0, f32::NEG_INFINITY], distance: f32::NEG_INFINITY, link: 0, count: 0 }
    }

    pub fn children(&self) -> usize {
        if self.count == 0 { self.link as usize } else { 0 }
    }

    /// Takes `d_c`, which may be rounded down by the caller.
    pub fn set_distance(&mut self, distance: f64) {
        self.distance = distance as f32;
    }

    /// Takes a slope, as it can be kept; returns what is kept.
    pub fn set_slope(&mut self, slope: &Vec3) -> Vec3 {
        let kept: [f32; 3] = std::array::from_fn(|k| slope[k] as f32);
        self.plane[..3].copy_from_slice(&kept);
        Vec3::from(kept.map(f64::from))
    }

    /// Takes `e`, meters, once the distance is known.
    pub fn set_shortfall(&mut self, shortfall: f64) {
        self.plane[3] = (f64::from(self.distance) - shortfall) as f32;
    }
}

/// A place in a cell.
#[derive(Clone, Copy)]
pub(super) struct CellPoint<'a> {
    cell: &'a Cell,
    block: &'a Block,
    /// From the cell's center; the fourth is 1.
    offset: [f32; 4],
}

impl<'a> CellPoint<'a> {
    /// The triangles that can be closest here; none where the cell has no list.
    pub fn list(&self) -> &'a [ListedTriangle] {
        let (link, count) = (self.cell.link as usize, self.cell.count as usize);
        if count == 0 { &[] } else { &self.block.lists[link..][..count] }
    }

    /// At most the signed distance here, but for rounding.
    #[inline(always)]
    fn bound(&self) -> f64 {
        let products: [f32; 4] = std::array::from_fn(|k| self.cell.plane[k] * self.offset[k]);
        let plane = (products[0] + products[1]) + (products[2] + products[3]);
        f64::from(plane.max(self.cell.distance - self.offset_length()))
    }

    /// How far from the cell's center it is, meters.
    pub fn offset_length(&self) -> f32 {
        let squares: [f32; 4] = std::array::from_fn(|k| self.offset[k] * self.offset[k]);
        (squares[0] + squares[1] + squares[2]).sqrt()
    }
}

/// From another frame to places in the outermost cell, told from its lowest corner; in single precision.
pub(crate) struct FrameMap {
    columns: [[f32; 4]; 3],
    offset: [f32; 4],
    /// The side of the outermost cell, meters.
    side: f32,
    /// What single precision may add to a bound, meters.
    rounding: f64,
}

#[cfg(test)]
impl FrameMap {
    pub(super) fn rounding(&self) -> f64 {
        self.rounding
    }
}

fn single(v: &Vec3) -> [f32; 4] {
    [v.x as f32, v.y as f32, v.z as f32, 0.0]
}

/// Cells within a cube.
#[derive(Clone, Debug)]
pub(super) struct Octree {
    pub(super) blocks: Blocks,
    pub center: Vec3,
    /// Half the side.
    half: f64,
    /// How many of the outermost cells go into a meter.
    per_metre: f32,
    /// Half the side of a cell by its depth.
    halves: [f32; 16],
    /// What single precision may add to a bound, meters.
    rounding: f64,
}

impl Octree {
    /// A cube that is divided so often at most.
    pub fn new(center: Vec3, half: f64, max_depth: u32) -> Octree {
        Octree {
            blocks: Blocks::new(center, half, max_depth),
            center,
            half,
            per_metre: (0.5 / half) as f32,
            halves: std::array::from_fn(|depth| (half / f64::from(1_u32 << depth)) as f32),
            rounding: ROUNDING * half,
        }
    }

    /// What single precision may cost, meters.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// The smallest cell that holds `p`; `None` outside all.
    pub fn locate(&self, p: &Vec3, triangles: &Triangles) -> Option<CellPoint<'_>> {
        // written so that what is not a number is outside
        let from_low = (p - self.center).add_scalar(self.half);
        let within = from_low.iter().all(|x| *x >= 0.0 && *x <= 2.0 * self.half);
        within.then(|| self.descend(&single(&from_low), triangles))
    }

    /// At most the signed distance at `p`.
    pub fn bound(&self, p: &Vec3, triangles: &Triangles) -> f64 {
        let from_low = (p - self.center).add_scalar(self.half);
        let side = 2.0 * self.half;
        let inside = from_low.map(|x| if x > 0.0 { if x < side { x } else { side } } else { 0.0 });
        let bound = self.bound_at(&self.descend(&single(&inside), triangles));
        let outside = (from_low - inside).norm_squared();
        if outside == 0.0 { bound } else { (outside + bound.max(0.0).powi(2)).sqrt() }
    }

    /// The way from another frame to this one, for points that are no further from its origin than `reach`.
    pub fn frame_map(&self, rotation: &Mat3, translation: &Vec3, reach: f64) -> FrameMap {
        let offset = (translation - self.center).add_scalar(self.half);
        let columns = [0, 1, 2].map(|k| single(&rotation.column(k).into_owned()));
        FrameMap {
            columns,
            offset: single(&offset),
            side: (2.0 * self.half) as f32,
            rounding: ROUNDING * (offset.norm() + reach + self.half),
        }
    }

    /// [`Octree::bound`] of a point in that other frame, a little less.
    #[inline(always)]
    pub fn bound_mapped(&self, frame_map: &FrameMap, p: &[f32; 3], triangles: &Triangles) -> f64 {
        let [a, b, c] = &frame_map.columns;
        let from_low: [f32; 4] =
            std::array::from_fn(|k| (a[k] * p[0] + b[k] * p[1]) + (c[k] * p[2] + frame_map.offset[k]));
        let inside = from_low.map(|x| if x > 0.0 { if x < frame_map.side { x } else { frame_map.side } } else { 0.0 });
        let bound = self.descend(&inside, triangles).bound();
        let squares: [f32; 4] = std::array::from_fn(|k| (from_low[k] - inside[k]) * (from_low[k] - inside[k]));
        let outside = f64::from((squares[0] + squares[1]) + squares[2]);
        (if outside == 0.0 { bound } else { (outside + bound.max(0.0).powi(2)).sqrt() }) - frame_map.rounding
    }

    /// The same at a place.
    #[inline]
    pub fn bound_at(&self, place: &CellPoint) -> f64 {
        place.bound() - self.rounding
    }

    /// The smallest cell around a place that lies so far from the lowest corner, which is within the outermost cell. One near a face of a cell may be taken
    /// for the neighbor's; then the offset is more than half the side by rounding.
    /// Inlined: on the way through memory four numbers at once wait for each other.
    #[inline(always)]
    fn descend(&self, low: &[f32; 4], triangles: &Triangles) -> CellPoint<'_> {
        let level = self.blocks.top();
        // which cube: the first binary digits of the place, as a part of the side, behind the 1 that is added
        let place: [u32; 4] = std::array::from_fn(|k| {
            let x = low[k] * self.per_metre + 1.0;
            let x = if x < BELOW_TWO { x } else { BELOW_TWO };
            (x.to_bits() & MANTISSA) >> (23 - level)
        });
        let (block, cube) = self.blocks.at(&place, triangles);
        let top = block.top[cube];
        let (mut cell, depth) = (&block.cells[(top >> 4) as usize], top & 15);
        let mut half = self.halves[depth as usize];
        let above = level - depth;
        let mut offset: [f32; 4] = std::array::from_fn(|k| low[k] - ((place[k] >> above) * 2 + 1) as i32 as f32 * half);
        while cell.children() > 0 {
            half *= 0.5;
            let octant: usize = (0..3).map(|k| usize::from(offset[k].is_sign_positive()) << k).sum();
            offset = std::array::from_fn(|k| offset[k] - half.copysign(offset[k]));
            cell = &block.cells[cell.children() + octant];
        }
        offset[3] = 1.0;
        CellPoint { cell, block, offset }
    }
}

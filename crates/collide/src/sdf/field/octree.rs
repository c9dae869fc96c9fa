//! The octree of a mesh's field: cells with lists of triangles, and a bound of the distance in
//! each.
//!
//! ```text
//! c, h, r   center, half side and half diagonal of a cell       d_c  signed distance of c
//! d(p) ≥ d_c + max(−|p − c|, g·(p − c) − e)                     a cone, and a plane that is as good as the surface is flat
//! d(p) ≥ √(|p − q|² + max(d(q), 0)²)                            outside all cells; q is the closest point of the outermost cell
//! ```
//!
//! The last line holds because the angle between `p − q` and the direction from `q` to any point of
//! that cell is not acute.

use super::ListedTriangle;
use super::blocks::{Block, Blocks};
use super::triangles::Triangles;
use crate::{Mat3, Vec3};

/// Single-precision error of a coordinate and of a bound, in half sides of the outermost cell.
const ROUNDING: f64 = 2e-6;
/// The greatest number below 2, and the mantissa bits of a number.
const BELOW_TWO: f32 = 1.999_999_9;
const MANTISSA: u32 = (1 << 23) - 1;

/// A cell of thirty-two bytes, in single precision, since memory access dominates the time of a
/// query.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Cell {
    /// `g`, and `d_c − e` for the plane through the center.
    plane: [f32; 4],
    /// Signed distance at the center, rounded down.
    distance: f32,
    /// Start of its list if it has one; else the first of eight children, 0 if there are none.
    pub link: u32,
    /// Length of the list; 0 without a list.
    pub count: u8,
}

impl Cell {
    /// Returns a cell without bound.
    pub fn empty() -> Cell {
        Cell { plane: [0.0, 0.0, 0.0, f32::NEG_INFINITY], distance: f32::NEG_INFINITY, link: 0, count: 0 }
    }

    pub fn children(&self) -> usize {
        if self.count == 0 { self.link as usize } else { 0 }
    }

    /// Sets `d_c`, which the caller can round down.
    pub fn set_distance(&mut self, distance: f64) {
        self.distance = distance as f32;
    }

    /// Sets the slope and returns it as stored.
    pub fn set_slope(&mut self, slope: &Vec3) -> Vec3 {
        let kept: [f32; 3] = std::array::from_fn(|k| slope[k] as f32);
        self.plane[..3].copy_from_slice(&kept);
        Vec3::from(kept.map(f64::from))
    }

    /// Sets `e`, meters, after the distance.
    pub fn set_shortfall(&mut self, shortfall: f64) {
        self.plane[3] = (f64::from(self.distance) - shortfall) as f32;
    }
}

/// A point in a cell.
#[derive(Clone, Copy)]
pub(super) struct CellPoint<'a> {
    cell: &'a Cell,
    block: &'a Block,
    /// Offset from the cell's center; the fourth entry is 1.
    offset: [f32; 4],
}

impl<'a> CellPoint<'a> {
    /// Returns the triangles that can be closest here; empty for a cell without a list.
    pub fn list(&self) -> &'a [ListedTriangle] {
        let (link, count) = (self.cell.link as usize, self.cell.count as usize);
        if count == 0 { &[] } else { &self.block.lists[link..][..count] }
    }

    /// Returns a lower bound of the signed distance here, up to rounding.
    #[inline(always)]
    fn bound(&self) -> f64 {
        let products: [f32; 4] = std::array::from_fn(|k| self.cell.plane[k] * self.offset[k]);
        let plane = (products[0] + products[1]) + (products[2] + products[3]);
        f64::from(plane.max(self.cell.distance - self.offset_length()))
    }

    /// Returns the distance from the cell's center, meters.
    pub fn offset_length(&self) -> f32 {
        let squares: [f32; 4] = std::array::from_fn(|k| self.offset[k] * self.offset[k]);
        (squares[0] + squares[1] + squares[2]).sqrt()
    }
}

/// Map from another frame to positions relative to the lowest corner of the outermost cell, in
/// single precision.
pub(crate) struct FrameMap {
    columns: [[f32; 4]; 3],
    offset: [f32; 4],
    /// Side of the outermost cell, meters.
    side: f32,
    /// Single-precision error of a bound, meters.
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

/// An octree of cells within a cube.
#[derive(Clone, Debug)]
pub(super) struct Octree {
    pub(super) blocks: Blocks,
    pub center: Vec3,
    /// Half the side.
    half: f64,
    /// Number of outermost cells per meter.
    per_meter: f32,
    /// Half the side of a cell, by depth.
    halves: [f32; 16],
    /// Single-precision error of a bound, meters.
    rounding: f64,
}

impl Octree {
    /// Returns the octree of a cube that is divided at most `max_depth` times.
    pub fn new(center: Vec3, half: f64, max_depth: u32) -> Octree {
        Octree {
            blocks: Blocks::new(center, half, max_depth),
            center,
            half,
            per_meter: (0.5 / half) as f32,
            halves: std::array::from_fn(|depth| (half / f64::from(1_u32 << depth)) as f32),
            rounding: ROUNDING * half,
        }
    }

    /// Returns the single-precision error of a bound, meters.
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// Returns the smallest cell that contains `p`; `None` outside all cells.
    pub fn locate(&self, p: &Vec3, triangles: &Triangles) -> Option<CellPoint<'_>> {
        // written so that values that are not numbers are outside
        let from_low = (p - self.center).add_scalar(self.half);
        let within = from_low.iter().all(|x| *x >= 0.0 && *x <= 2.0 * self.half);
        within.then(|| self.descend(&single(&from_low), triangles))
    }

    /// Returns a lower bound of the signed distance at `p`.
    pub fn bound(&self, p: &Vec3, triangles: &Triangles) -> f64 {
        let from_low = (p - self.center).add_scalar(self.half);
        let side = 2.0 * self.half;
        let inside = from_low.map(|x| if x > 0.0 { if x < side { x } else { side } } else { 0.0 });
        let bound = self.bound_at(&self.descend(&single(&inside), triangles));
        let outside = (from_low - inside).norm_squared();
        if outside == 0.0 { bound } else { (outside + bound.max(0.0).powi(2)).sqrt() }
    }

    /// Returns the map from another frame to this one, for points within `reach` of its origin.
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

    /// Returns a bound like [`Octree::bound`] for a point in the other frame, minus the rounding
    /// error.
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

    /// Returns the bound at a point of a cell.
    #[inline]
    pub fn bound_at(&self, place: &CellPoint) -> f64 {
        place.bound() - self.rounding
    }

    /// Returns the smallest cell around a position relative to the lowest corner, which must be
    /// within the outermost cell. Near a face of a cell it can be the neighboring cell; then the
    /// offset exceeds half the side by a rounding error. Inlined: passing four numbers through
    /// memory would cause store-forwarding stalls.
    #[inline(always)]
    fn descend(&self, low: &[f32; 4], triangles: &Triangles) -> CellPoint<'_> {
        let level = self.blocks.top();
        // the cube: the first binary digits of the position, as a fraction of the side, after
        // adding 1
        let place: [u32; 4] = std::array::from_fn(|k| {
            let x = low[k] * self.per_meter + 1.0;
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

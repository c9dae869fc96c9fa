//! The octree of a mesh's field: cells with lists of triangles, and a bound of the distance in each.
//!
//! ```text
//! c, h, r   centre, half side and half diagonal of a cell       d_c  signed distance of c
//! d(p) ≥ d_c + max(−|p − c|, g·(p − c) − e)                     a cone, and a plane that is as good as the surface is flat
//! d(p) ≥ √(|p − q|² + max(d(q), 0)²)                            outside all cells; q is the closest point of the outermost cell
//! ```
//!
//! The last holds since `p − q` makes no acute angle with the way from `q` to anything in that cell.

use crate::Vec3;

/// Divisions that are passed at once on the way down, at most.
const TOP: usize = 6;
/// `e` is kept in parts of this many half sides.
const MOST_SHORT: f64 = 8.0;

/// Sixteen bytes, since most of the time of a query goes by waiting for cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// Signed distance at the centre, or a little less.
    distance: f32,
    /// Where its list begins if it has one; else the first of eight children, 0 if there are none.
    pub link: u32,
    /// `g`, in parts of 127.
    slope: [i8; 3],
    /// Length of the list; 0 where there is none.
    pub count: u8,
    /// `e` in half sides.
    short: f32,
}

impl Cell {
    /// One that knows nothing.
    pub fn empty() -> Cell {
        Cell { distance: f32::NEG_INFINITY, link: 0, slope: [0; 3], count: 0, short: MOST_SHORT as f32 }
    }

    pub fn children(&self) -> usize {
        if self.count == 0 { self.link as usize } else { 0 }
    }

    /// Takes `d_c`, which may be rounded down by the caller.
    pub fn set_distance(&mut self, distance: f64) {
        self.distance = distance as f32;
    }

    /// Takes a slope, as near as it can be kept; returns what is kept.
    pub fn set_slope(&mut self, slope: &Vec3) -> Vec3 {
        self.slope = std::array::from_fn(|k| (slope[k] * 127.0).round().clamp(-127.0, 127.0) as i8);
        self.kept_slope()
    }

    /// Takes `e`, metres, in a cell of half side `half`.
    pub fn set_short(&mut self, short: f64, half: f64) {
        self.short = (short / half * (1.0 + 1e-6)).min(MOST_SHORT) as f32;
    }

    fn kept_slope(&self) -> Vec3 {
        Vec3::new(f64::from(self.slope[0]), f64::from(self.slope[1]), f64::from(self.slope[2])) * (1.0 / 127.0)
    }
}

/// A place in a cell.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub cell: &'a Cell,
    /// From the cell's centre.
    pub offset: Vec3,
    /// Half the cell's side.
    half: f64,
}

impl Place<'_> {
    /// At most the signed distance here.
    pub fn bound(&self) -> f64 {
        let plane = self.cell.kept_slope().dot(&self.offset) - f64::from(self.cell.short) * self.half;
        let square = self.offset.norm_squared();
        // the cone is above it
        let below = plane < 0.0 && square < plane * plane;
        f64::from(self.cell.distance) + if below { -square.sqrt() } else { plane }
    }
}

/// Cells within a cube.
#[derive(Clone, Debug)]
pub(super) struct Octree {
    pub cells: Vec<Cell>,
    pub center: Vec3,
    /// Half the side.
    pub half: f64,
    /// How often the outermost cell is divided for `top`, and how many of the cubes that makes go into a metre.
    level: usize,
    per_metre: f64,
    /// The cell, times 16, plus its depth, at or above each of these cubes.
    top: Vec<u32>,
    /// Half the side of a cell by its depth.
    halves: [f64; 16],
}

impl Octree {
    /// One cell.
    pub fn new(center: Vec3, half: f64) -> Octree {
        let halves = std::array::from_fn(|depth| half / f64::from(1_u32 << depth));
        Octree { cells: vec![Cell::empty()], center, half, level: 0, per_metre: 0.5 / half, top: Vec::new(), halves }
    }

    /// To be called once all cells are there, and divided so often at most.
    pub fn finish(&mut self, deepest: u32) {
        self.cells.shrink_to_fit();
        self.level = TOP.min(deepest as usize);
        self.per_metre = 0.5 / self.halves[self.level];
        self.top = (0..1 << (3 * self.level)).map(|n| self.cell_above(n)).collect();
    }

    /// The cell at or above a cube of the top.
    fn cell_above(&self, cube: usize) -> u32 {
        let (mut cell, mut depth) = (0, 0);
        while depth < self.level && self.cells[cell].children() > 0 {
            depth += 1;
            let octant: usize = (0..3).map(|k| (cube >> (k * self.level + self.level - depth) & 1) << k).sum();
            cell = self.cells[cell].children() + octant;
        }
        (cell << 4 | depth) as u32
    }

    /// The smallest cell that holds `p`; `None` outside all.
    pub fn locate(&self, p: &Vec3) -> Option<Place<'_>> {
        // written so that what is not a number is outside
        let from_low = (p - self.center).add_scalar(self.half);
        let within = from_low.iter().all(|x| *x >= 0.0 && *x <= 2.0 * self.half);
        within.then(|| self.descend(&from_low))
    }

    /// At most the signed distance at `p`.
    pub fn bound(&self, p: &Vec3) -> f64 {
        let from_low = (p - self.center).add_scalar(self.half);
        let inside = from_low.map(|x| x.clamp(0.0, 2.0 * self.half));
        let bound = self.descend(&inside).bound();
        let outside = (from_low - inside).norm_squared();
        if outside == 0.0 { bound } else { (outside + bound.max(0.0).powi(2)).sqrt() }
    }

    /// The smallest cell around a place that lies so far from the lowest corner.
    fn descend(&self, from_low: &Vec3) -> Place<'_> {
        let (level, most) = (self.level, (1 << self.level) - 1);
        let place: [usize; 3] = std::array::from_fn(|k| ((from_low[k] * self.per_metre) as i32 as usize).min(most));
        let top = self.top[place[0] | place[1] << level | place[2] << (2 * level)];
        let (mut cell, depth) = (&self.cells[(top >> 4) as usize], (top & 15) as usize);
        let mut half = self.halves[depth];
        let mut offset = Vec3::from_fn(|k, _| from_low[k] - ((place[k] >> (level - depth)) as f64 * 2.0 + 1.0) * half);
        while cell.children() > 0 {
            half *= 0.5;
            let octant: usize = (0..3).map(|k| usize::from(offset[k].is_sign_positive()) << k).sum();
            offset = Vec3::from_fn(|k, _| offset[k] - half.copysign(offset[k]));
            cell = &self.cells[cell.children() + octant];
        }
        Place { cell, offset, half }
    }
}

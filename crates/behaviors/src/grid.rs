//! Points sorted by cell: all neighbors of a point within a distance are in its own cell and in the 124 around it
//! (uniform grid).
//!
//! ```text
//! c = ⌊x/s⌋,  s = ½·D·(1 + 1e-6)          |x_j − x_i| < D  ⇒  |c_j − c_i| ≤ 2 along each axis
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `c` | position of a point; its cell |
//! | `D`, `s` | distance; side of a cell |
//!
//! The excess of `s` covers the rounding of `x/s` up to 1e9 cells from the origin. Points beyond share the outermost
//! cells, so none is missed. Points are sorted by cell and then by index, so five cells along z are one run of the
//! list. Runs are found among the cells that have points, in the order of which both of their ends only go forward. No hash, no
//! allocation by extent: the memory is that of the points.

use std::ops::Range;
use tumble_collide::Vec3;

/// Farthest cell along an axis.
const FARTHEST: f64 = 1e9;
/// Cells on either side of a point's own within the distance.
const AROUND: i64 = 2;
/// Columns of cells along z within the distance.
const COLUMNS: usize = 25;
/// Added to a coordinate of a cell, which then takes 31 bits, also two cells farther.
const OFFSET: i64 = 1 << 30;

/// The points sorted by cell.
#[derive(Default)]
pub(crate) struct Grid {
    /// Cell and index of each point, ascending.
    keys: Vec<u128>,
    /// Index of each point.
    order: Vec<u32>,
    /// Each cell with points, ascending: 31 bits per axis; and none behind.
    cells: Vec<u128>,
    /// Place of the first point of each cell, and the number of points.
    firsts: Vec<u32>,
}

impl Grid {
    /// Sorts positions (m) into cells for a distance `reach`, m, above 0.
    pub fn sort(&mut self, positions: impl Iterator<Item = Vec3>, reach: f64) {
        let Grid { keys, order, cells, firsts } = self;
        let side = 0.5 * reach * (1.0 + 1e-6);
        let cell = |x: f64| (x / side).floor().clamp(-FARTHEST, FARTHEST) as i64;
        let key = |p: Vec3, index: u32| key_of([cell(p.x), cell(p.y), cell(p.z)]) << 32 | u128::from(index);
        keys.clear();
        keys.extend(positions.zip(0..).map(|(p, index)| key(p, index)));
        keys.sort_unstable();
        cells.clear();
        firsts.clear();
        for (key, place) in keys.iter().zip(0..) {
            if cells.last() != Some(&(key >> 32)) {
                cells.push(key >> 32);
                firsts.push(place);
            }
        }
        cells.push(u128::MAX);
        firsts.push(keys.len() as u32);
        order.clear();
        order.extend(keys.iter().map(|key| *key as u32));
    }

    /// Returns the index of each point, in the order of the cells.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Calls `work` for each cell of the points at `places` in the order of the cells, with the places of its points there
    /// and with runs of places, ascending, that contain all points within the distance of one of them.
    #[inline(always)]
    pub fn each_cell(&self, places: Range<usize>, mut work: impl FnMut(Range<usize>, &[Range<usize>])) {
        let mut columns: [Range<usize>; COLUMNS] = std::array::from_fn(|_| 0..0);
        let mut runs: [Range<usize>; COLUMNS] = std::array::from_fn(|_| 0..0);
        let first = self.firsts.partition_point(|first| (*first as usize) <= places.start) - 1;
        for own in first..self.cells.len() - 1 {
            let points = self.places(own..own + 1);
            if points.start >= places.end {
                break;
            }
            let [x, y, z] = cell_of(self.cells[own]);
            let beside = (-AROUND..=AROUND).flat_map(|dx| (-AROUND..=AROUND).map(move |dy| (x + dx, y + dy)));
            for (((x, y), column), run) in beside.zip(&mut columns).zip(&mut runs) {
                // cells ascend, and the columns with them: each end moves forward only
                column.start = self.advance(column.start, key_of([x, y, z - AROUND]));
                column.end = self.advance(column.end.max(column.start), key_of([x, y, z + AROUND + 1]));
                *run = self.places(column.clone());
            }
            work(points.start.max(places.start)..points.end.min(places.end), &runs);
        }
    }

    /// Returns the places of the points of some cells.
    fn places(&self, cells: Range<usize>) -> Range<usize> {
        self.firsts[cells.start] as usize..self.firsts[cells.end] as usize
    }

    /// Returns the first cell from a place of the list on whose key is at least `key`, by exponential search.
    #[inline(always)]
    fn advance(&self, place: usize, key: u128) -> usize {
        // most often it is this one or the next one
        if self.cells[place] >= key {
            return place;
        }
        let (mut low, mut step) = (place + 1, 1);
        while low + step <= self.cells.len() && self.cells[low + step - 1] < key {
            low += step;
            step *= 2;
        }
        let high = (low + step - 1).min(self.cells.len());
        low + self.cells[low..high].partition_point(|k| *k < key)
    }
}

/// Returns the key of a cell.
fn key_of(cell: [i64; 3]) -> u128 {
    cell.iter().fold(0, |key, c| key << 31 | (c + OFFSET) as u128)
}

fn cell_of(key: u128) -> [i64; 3] {
    [62, 31, 0].map(|shift| (key >> shift & 0x7fff_ffff) as i64 - OFFSET)
}

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
//! list. No hash, no allocation by extent: the memory is that of the points.

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
pub(crate) struct Grid {
    /// Cell and index of each point, ascending: 31 bits per axis, 32 bits of the index.
    keys: Vec<u128>,
}

impl Grid {
    /// Sorts positions (m) into cells for a distance `reach`, m, above 0.
    pub fn new(positions: impl Iterator<Item = Vec3>, reach: f64) -> Grid {
        let side = 0.5 * reach * (1.0 + 1e-6);
        let cell = |x: f64| (x / side).floor().clamp(-FARTHEST, FARTHEST) as i64;
        let mut keys: Vec<u128> = positions
            .zip(0u32..)
            .map(|(p, index)| first_of([cell(p.x), cell(p.y), cell(p.z)]) | u128::from(index))
            .collect();
        keys.sort_unstable();
        Grid { keys }
    }

    /// Returns the index of each point, in the order of the cells.
    pub fn order(&self) -> impl Iterator<Item = usize> + '_ {
        self.keys.iter().map(|key| *key as u32 as usize)
    }

    /// Calls `work` for each cell of the points at `places` in the order of the cells, with the places of its points there
    /// and with runs of places, ascending, that contain all points within the distance of one of them.
    #[inline(always)]
    pub fn each_cell(&self, places: Range<usize>, mut work: impl FnMut(Range<usize>, &[Range<usize>])) {
        let mut columns: [Range<usize>; COLUMNS] = std::array::from_fn(|_| 0..0);
        let mut own = places.start..places.start;
        while own.start < places.end {
            let cell = cell_of(self.keys[own.start]);
            let [x, y, z] = cell;
            let next = first_of([x, y, z + 1]);
            while own.end < places.end && self.keys[own.end] < next {
                own.end += 1;
            }
            let beside = (-AROUND..=AROUND).flat_map(|dx| (-AROUND..=AROUND).map(move |dy| (x + dx, y + dy)));
            for ((x, y), run) in beside.zip(&mut columns) {
                // cells ascend, and the runs with them: each end moves forward only
                run.start = self.advance(run.start, first_of([x, y, z - AROUND]));
                run.end = self.advance(run.end.max(run.start), first_of([x, y, z + AROUND + 1]));
            }
            work(own.clone(), &columns);
            own.start = own.end;
        }
    }

    /// Returns the first place from `place` on whose key is at least `key`, by exponential search.
    fn advance(&self, place: usize, key: u128) -> usize {
        let (mut low, mut step) = (place, 1);
        while low + step <= self.keys.len() && self.keys[low + step - 1] < key {
            low += step;
            step *= 2;
        }
        let high = (low + step - 1).min(self.keys.len());
        low + self.keys[low..high].partition_point(|k| *k < key)
    }
}

/// Returns the key of a cell with the index 0.
fn first_of(cell: [i64; 3]) -> u128 {
    cell.iter().fold(0, |key, c| key << 31 | (c + OFFSET) as u128) << 32
}

fn cell_of(key: u128) -> [i64; 3] {
    [94, 63, 32].map(|shift| (key >> shift & 0x7fff_ffff) as i64 - OFFSET)
}

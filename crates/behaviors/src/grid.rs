//! Cells of the size of the visibility distance: the neighbors of a boid are in its own cell and in
//! the 26 around it (uniform grid).
//!
//! ```text
//! c = ⌊x/s⌋,  s = D·(1 + 1e-6)          |x_j − x_i| < D  ⇒  |c_j − c_i| ≤ 1 along each axis
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `c` | position of a boid; its cell |
//! | `D`, `s` | visibility distance; side of a cell |
//!
//! The excess of `s` covers the rounding of `x/s` up to 1e9 cells from the origin. Boids beyond share
//! the outermost cells, so none is missed. The boids are sorted by cell, so three cells along z are
//! one run of the list. No hash, no allocation by extent: the memory is that of the boids.

use tumble_collide::Vec3;

/// Farthest cell along an axis.
const FARTHEST: f64 = 1e9;

/// The boids sorted by cell.
pub(crate) struct Grid {
    /// Cell and index of each boid, ascending.
    sorted: Vec<([i64; 3], u32)>,
}

impl Grid {
    /// Sorts positions (m) into cells for a distance `reach`, m, above 0.
    pub fn new(positions: impl Iterator<Item = Vec3>, reach: f64) -> Grid {
        let side = reach * (1.0 + 1e-6);
        let cell = |x: f64| (x / side).floor().clamp(-FARTHEST, FARTHEST) as i64;
        let mut sorted: Vec<_> = positions.zip(0..).map(|(p, i)| ([cell(p.x), cell(p.y), cell(p.z)], i)).collect();
        sorted.sort_unstable();
        Grid { sorted }
    }

    /// Calls `work` for each occupied cell with its boids and with all boids of it and of the 26
    /// around it, both ascending by index.
    pub fn each_cell(&self, mut work: impl FnMut(&[([i64; 3], u32)], &[u32])) {
        let mut near = Vec::new();
        for own in self.sorted.chunk_by(|a, b| a.0 == b.0) {
            let [x, y, z] = own[0].0;
            near.clear();
            for (dx, dy) in (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (dx, dy))) {
                let column = |z: i64| [x + dx, y + dy, z];
                let first = self.sorted.partition_point(|(cell, _)| *cell < column(z - 1));
                let run = self.sorted[first..].iter().take_while(|(cell, _)| *cell <= column(z + 1));
                near.extend(run.map(|(_, index)| *index));
            }
            near.sort_unstable();
            work(own, &near);
        }
    }
}

//! Closed meshes of the filled cells of a grid, whose corners may stand anywhere.

use super::thread::Parts;
use tumble_core::collide::{TriMesh, Vec3};

/// A left-handed grid of cells (row, column, layer): rows × columns points towards lower layers.
pub struct Grid {
    /// Numbers of cells.
    pub counts: [usize; 3],
    /// Whether the last column is beside the first one. The grid has then as many columns of corners as of cells.
    pub wraps: bool,
}

impl Grid {
    /// Returns the boundary of the filled cells, with corners at places of the world, m.
    pub fn mesh(&self, place: impl Fn([usize; 3]) -> Vec3, filled: impl Fn(usize, usize, usize) -> bool) -> TriMesh {
        // the outside of a cell on each side: its corners clockwise, since the grid is left-handed
        const SIDES: [([isize; 3], [[usize; 3]; 4]); 6] = [
            ([-1, 0, 0], [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]),
            ([1, 0, 0], [[1, 0, 0], [1, 0, 1], [1, 1, 1], [1, 1, 0]]),
            ([0, -1, 0], [[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]]),
            ([0, 1, 0], [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]),
            ([0, 0, -1], [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
            ([0, 0, 1], [[0, 0, 1], [0, 1, 1], [1, 1, 1], [1, 0, 1]]),
        ];
        let [rows, columns, layers] = self.counts;
        let across = if self.wraps { columns } else { columns + 1 };
        let mut number = vec![u32::MAX; (rows + 1) * across * (layers + 1)];
        let mut out = Parts::default();
        let mut corner = |out: &mut Parts, [i, j, k]: [usize; 3]| {
            let (j, at) = (j % across, (i * across + j % across) * (layers + 1) + k);
            if number[at] == u32::MAX {
                number[at] = out.vertices.len() as u32;
                out.vertices.push(place([i, j, k]));
            }
            number[at]
        };
        let is_filled = |cell: [isize; 3]| {
            let [i, mut j, k] = cell;
            if self.wraps {
                j = j.rem_euclid(columns as isize);
            }
            let within = [i, j, k].iter().zip(self.counts).all(|(at, count)| *at >= 0 && *at < count as isize);
            within && filled(i as usize, j as usize, k as usize)
        };
        for n in 0..rows * columns * layers {
            let cell = [n / layers / columns, n / layers % columns, n % layers];
            if !is_filled(cell.map(|at| at as isize)) {
                continue;
            }
            for (way, corners) in SIDES {
                if !is_filled([0, 1, 2].map(|d| cell[d] as isize + way[d])) {
                    let [a, b, c, d] = corners.map(|by| corner(&mut out, [0, 1, 2].map(|d| cell[d] + by[d])));
                    out.quad(a, b, c, d);
                }
            }
        }
        out.mesh()
    }
}

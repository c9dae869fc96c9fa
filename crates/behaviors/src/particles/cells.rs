//! Boxes of obstacles by the cells of a uniform grid around them, for many short ways.
//!
//! ```text
//! c = clamp(⌊(x − o)/s⌋, 0, n − 1)        ascending in x: boxes that share a point share a cell
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `x`, `c` | coordinate, and its cell along that axis |
//! | `o`, `s`, `n` | corner of the grid, side and number of cells |

use tumble_collide::{Aabb, Vec3};

/// Cells per box that the grid is made for, and most entries of the lists per box.
const CELLS_PER_BOX: f64 = 64.0;
/// Most cells along an axis.
const ALONG: f64 = 64.0;
/// Most cells of a way that are looked up.
const LOOKED_UP: usize = 27;

/// Lists of the boxes of each cell.
pub(super) struct Cells {
    origin: Vec3,
    per_meter: Vec3,
    count: [usize; 3],
    /// First entry of each cell, and the number of entries at the end.
    first: Vec<u32>,
    boxes: Vec<u32>,
}

impl Cells {
    /// Sorts boxes, all within `bounds` and finite.
    pub fn new(bounds: &Aabb, boxes: &[Aabb]) -> Cells {
        let (size, wanted) = (bounds.max - bounds.min, CELLS_PER_BOX * boxes.len() as f64);
        let volume = size.iter().product::<f64>();
        let side = nalgebra::ComplexField::cbrt(volume / wanted).max(1e-9);
        let mut count = [0, 1, 2].map(|k| (size[k] / side).ceil().clamp(1.0, ALONG) as usize);
        loop {
            let cells = Cells::empty(bounds, count);
            let entries: usize =
                boxes.iter().map(|b| cells.range(b).map(|[low, high]| high - low + 1)).map(product).sum();
            if count == [1; 3] || entries as f64 <= wanted {
                return cells.filled(boxes, entries);
            }
            count = count.map(|n| n.div_ceil(2)); // a large box is in too many
        }
    }

    fn empty(bounds: &Aabb, count: [usize; 3]) -> Cells {
        let size = bounds.max - bounds.min;
        let per_meter = [0, 1, 2].map(|k| if size[k] > 0.0 { count[k] as f64 / size[k] } else { 0.0 });
        let first = vec![0; product(count) + 1];
        Cells { origin: bounds.min, per_meter: per_meter.into(), count, first, boxes: Vec::new() }
    }

    fn filled(mut self, boxes: &[Aabb], entries: usize) -> Cells {
        let mut sorted = Vec::with_capacity(entries);
        for (index, own) in (0u32..).zip(boxes) {
            self.each(own, |cell| sorted.push((cell as u32, index)));
        }
        sorted.sort_unstable();
        sorted.iter().for_each(|(cell, _)| self.first[*cell as usize + 1] += 1);
        (1..self.first.len()).for_each(|cell| self.first[cell] += self.first[cell - 1]);
        self.boxes = sorted.into_iter().map(|(_, index)| index).collect();
        self
    }

    /// Returns the first and the last cell of a box along each axis.
    #[inline(always)]
    fn range(&self, own: &Aabb) -> [[usize; 2]; 3] {
        [0, 1, 2].map(|k| {
            // a cast takes negative numbers for 0
            let cell = |x: f64| (((x - self.origin[k]) * self.per_meter[k]) as usize).min(self.count[k] - 1);
            [cell(own.min[k]), cell(own.max[k])]
        })
    }

    fn each(&self, own: &Aabb, mut work: impl FnMut(usize)) {
        let [x, y, z] = self.range(own);
        for i in x[0]..=x[1] {
            for j in y[0]..=y[1] {
                (z[0]..=z[1]).for_each(|k| work((i * self.count[1] + j) * self.count[2] + k));
            }
        }
    }

    /// Appends the boxes of the cells of a way, ascending; among them are all that it meets. Returns false, and appends
    /// none, if it is in too many cells.
    #[inline]
    pub fn near(&self, way: &Aabb, out: &mut Vec<usize>) -> bool {
        let [x, y, z] = self.range(way);
        let lists = (x[1] - x[0] + 1) * (y[1] - y[0] + 1) * (z[1] - z[0] + 1);
        if lists > LOOKED_UP {
            return false;
        }
        let start = out.len();
        self.each(way, |cell| {
            let own = &self.boxes[self.first[cell] as usize..self.first[cell + 1] as usize];
            out.extend(own.iter().map(|index| *index as usize));
        });
        if lists > 1 && out.len() > start + 1 {
            out[start..].sort_unstable();
            let mut kept = start + 1;
            for k in start + 1..out.len() {
                out[kept] = out[k];
                kept += usize::from(out[kept] != out[kept - 1]);
            }
            out.truncate(kept);
        }
        true
    }
}

fn product(counts: [usize; 3]) -> usize {
    counts.iter().product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_given_all_boxes_that_it_meets() {
        let mut seed = 1u64;
        let mut number = || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let mut vector = |size: f64| size * Vec3::new(number(), number(), number());
        for (count, large) in [(1, 0.0), (5, 0.3), (40, 0.1), (300, 0.05), (60, 9.0)] {
            let mut one = |size: f64| {
                let (center, half) = (vector(10.0), vector(size).abs());
                Aabb { min: center - half, max: center + half }
            };
            let boxes: Vec<Aabb> = (0..count).map(|_| one(large)).collect();
            let cells = Cells::new(&Aabb::around(boxes.iter().flat_map(|b| [b.min, b.max])), &boxes);
            assert!(cells.boxes.len() <= 64 * count);
            let mut met = 0;
            for k in 0..2000 {
                let way = one([0.01, 0.5, 3.0, 20.0][k % 4]);
                let mut near = vec![7, 0]; // what is there stays
                if cells.near(&way, &mut near) {
                    let near = near.strip_prefix(&[7, 0]).unwrap();
                    assert!(near.is_sorted_by(|a, b| a < b));
                    let meets = (0..count).filter(|index| boxes[*index].overlaps(&way));
                    met += meets.inspect(|index| assert!(near.contains(index), "{index}")).count();
                }
            }
            assert!(met > 0, "{count} boxes of {large} m");
        }
    }
}

//! Clipping of a convex polygon by the side planes of a prism, with a feature id for each vertex.
//!
//! Source: Sutherland and Hodgman (1974). Each polygon edge has an id: 0–3 for the edges of the
//! incident face, 4–7 for the sides of the prism. The ids of the two edges at a vertex identify it
//! as long as the same edges meet there.

use crate::Vec3;

/// At most 4 vertices and one more for each of 4 planes.
const CAPACITY: usize = 8;

/// A vertex and the id of the edge that leaves it.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub point: Vec3,
    pub edge: u8,
}

/// A polygon on the stack.
pub(super) struct Polygon {
    corners: [Corner; CAPACITY],
    len: usize,
}

impl Polygon {
    pub fn quad(points: [Vec3; 4]) -> Polygon {
        let mut polygon = Polygon::empty();
        for (k, &point) in points.iter().enumerate() {
            polygon.push(Corner { point, edge: k as u8 });
        }
        polygon
    }

    fn empty() -> Polygon {
        Polygon { corners: [Corner { point: Vec3::zeros(), edge: 0 }; CAPACITY], len: 0 }
    }

    fn push(&mut self, corner: Corner) {
        // a convex polygon gains at most one vertex per plane; rounding must not overrun the array
        if self.len < CAPACITY {
            self.corners[self.len] = corner;
            self.len += 1;
        }
    }

    /// Returns the part with `sign · x_k ≤ bound`; the new edge has the id `edge`.
    pub fn clip(&self, k: usize, sign: f64, bound: f64, edge: u8) -> Polygon {
        let mut kept = Polygon::empty();
        for n in 0..self.len {
            let (here, next) = (self.corners[n], self.corners[(n + 1) % self.len]);
            let (d0, d1) = (sign * here.point[k] - bound, sign * next.point[k] - bound);
            let crossing = || here.point + (next.point - here.point) * (d0 / (d0 - d1));
            if d0 <= 0.0 {
                kept.push(here);
                if d1 > 0.0 {
                    kept.push(Corner { point: crossing(), edge });
                }
            } else if d1 <= 0.0 {
                kept.push(Corner { point: crossing(), edge: here.edge });
            }
        }
        kept
    }

    /// Returns the vertices with their ids (`incoming edge · 8 + outgoing edge`).
    pub fn vertices(&self) -> impl Iterator<Item = (Vec3, u64)> + '_ {
        (0..self.len).map(|n| {
            let before = self.corners[(n + self.len - 1) % self.len].edge;
            (self.corners[n].point, 8 * u64::from(before) + u64::from(self.corners[n].edge))
        })
    }
}

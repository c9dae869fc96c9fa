//! An iterate of Newton's method: multipliers, row velocities, and the bounds that follow normal forces.

use crate::solver::direct::choice::Point;
use crate::solver::direct::island::LocalBlock;

/// Multipliers and row velocities of the island.
#[derive(Clone, Default)]
pub(super) struct Iterate {
    pub lambda: Vec<f64>,
    pub w: Vec<f64>,
    /// Bounds that follow normal forces; negative ones count as 0.
    pub bounds: Vec<f64>,
}

impl Iterate {
    #[inline(always)]
    pub fn point(&self, block: &LocalBlock) -> Point {
        let bound = block.bound.map_or(0.0, |bound| self.bounds[bound as usize].max(0.0));
        let mut point = Point { bound, ..Point::default() };
        point.lambda[..block.rows].copy_from_slice(&self.lambda[block.range()]);
        point.w[..block.rows].copy_from_slice(&self.w[block.range()]);
        point
    }

    /// Returns a block after `t` of a change.
    #[inline(always)]
    pub fn point_along(&self, change: &Iterate, t: f64, block: &LocalBlock) -> Point {
        let along = |bound: u32| self.bounds[bound as usize] + t * change.bounds[bound as usize];
        let bound = block.bound.map_or(0.0, |bound| along(bound).max(0.0));
        let (at, change) = (self.point(block), change.point(block));
        let add = |x: [f64; 3], d: [f64; 3]| [0, 1, 2].map(|k| x[k] + t * d[k]);
        Point { lambda: add(at.lambda, change.lambda), w: add(at.w, change.w), bound }
    }

    pub fn advance(&mut self, change: &Iterate, t: f64) {
        self.lambda.iter_mut().zip(&change.lambda).for_each(|(x, d)| *x += t * d);
        self.w.iter_mut().zip(&change.w).for_each(|(x, d)| *x += t * d);
        self.bounds.iter_mut().zip(&change.bounds).for_each(|(x, d)| *x += t * d);
    }
}

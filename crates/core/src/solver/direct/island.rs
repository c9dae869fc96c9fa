//! One island in compact form: its objects numbered from 0, its multipliers and velocities in a row.

use super::Tolerance;
use super::cone::{length, project};
use crate::constraint::rows::{Block, RowSet, Rows, dot};
use crate::solver::objects::{IslandObject, dof_of, objects_of, place_of};

/// Errors relative to the fastest row: what rounding leaves at best, and what counts as solved.
const ROUNDING: [f64; 2] = [1e-13, 1e-10];

/// The contribution of one object to a block.
#[derive(Clone, Copy, Default)]
pub(super) struct LocalSide {
    pub object: usize,
    pub first: usize,
    pub dof: usize,
    /// First of its responses in [`Rows::y`].
    y: usize,
}

/// The condition of a block; the sets of [`RowSet`] with the special cases apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// No response, or no choice of the multiplier: it stays as it is.
    Held,
    Equality,
    HalfLine,
    /// At least one bound is finite.
    Interval {
        lo: f64,
        hi: f64,
    },
    /// Friction coefficient above 0.
    Cone {
        mu: f64,
    },
}

/// A block of the island.
#[derive(Clone, Copy)]
pub(super) struct LocalBlock<'a> {
    pub kind: Kind,
    /// The bound of the multiplier that follows normal forces (`newton.rs`), in the place of those of `kind`.
    pub bound: Option<u32>,
    /// Number of rows.
    pub rows: usize,
    /// First row in the multipliers of the island.
    pub row: usize,
    pub compliance: f64,
    /// Mean diagonal of its block of `K`.
    pub diagonal: f64,
    sides: [LocalSide; 2],
    side_count: usize,
    block: &'a Block,
}

impl LocalBlock<'_> {
    pub fn sides(&self) -> &[LocalSide] {
        &self.sides[..self.side_count]
    }

    pub fn range(&self) -> std::ops::Range<usize> {
        self.row..self.row + self.rows
    }

    /// Returns the block with a multiplier within ± `bound`.
    pub fn within(self, bound: f64) -> Self {
        LocalBlock { kind: Kind::Interval { lo: -bound, hi: bound }, ..self }
    }
}

/// Returns the largest free value of a block. The normals of contacts and the limits that open do not
/// count: `c` of those contains their gap over the length of the step.
pub(super) fn fastest_row(block: &Block, c: &[f64]) -> f64 {
    let c = &c[block.range()];
    let one_sided = matches!(block.set, RowSet::Cone { .. } | RowSet::HalfLine);
    let first = if one_sided { c[0].min(0.0) } else { c[0] };
    c[1..].iter().fold(first.abs(), |f, c| f.max(c.abs()))
}

impl Kind {
    /// Returns the bounds of the multiplier of a scalar row that has any.
    #[inline(always)]
    pub fn bounds(self) -> Option<(f64, f64)> {
        match self {
            Kind::HalfLine => Some((0.0, f64::INFINITY)),
            Kind::Interval { lo, hi } => Some((lo, hi)),
            Kind::Held | Kind::Equality | Kind::Cone { .. } => None,
        }
    }
}

/// Returns the largest of errors; one that is not a number is the largest, and `max` would drop it.
pub(super) fn largest(errors: impl Iterator<Item = f64>) -> f64 {
    errors.fold(0.0, |max: f64, error| if max.is_nan() || error <= max { max } else { error })
}

/// The rows of an island.
pub(super) struct Island<'a> {
    pub objects: Vec<IslandObject>,
    pub blocks: Vec<LocalBlock<'a>>,
    /// Free values of the rows.
    pub c: Vec<f64>,
    /// Number of velocities.
    pub dof: usize,
    /// Largest [`fastest_row`].
    pub fastest: f64,
    y: &'a [f64],
}

impl<'a> Island<'a> {
    pub fn new(rows: &'a Rows, blocks: &[u32], c: &[f64]) -> Island<'a> {
        let objects = objects_of(rows, blocks);
        let dof = dof_of(&objects);
        let mut island =
            Island { objects, blocks: Vec::with_capacity(blocks.len()), c: Vec::new(), dof, fastest: 0.0, y: &rows.y };
        for &b in blocks {
            let block = &rows.blocks[b as usize];
            let local = island.local(rows, block);
            if local.diagonal > f64::MIN_POSITIVE {
                island.fastest = island.fastest.max(fastest_row(block, c));
            }
            island.blocks.push(local);
            island.c.extend_from_slice(&c[block.range()]);
        }
        island
    }

    fn local(&self, rows: &Rows, block: &'a Block) -> LocalBlock<'a> {
        let count = block.set.rows();
        let mut sides = [LocalSide::default(); 2];
        for (local, side) in sides.iter_mut().zip(block.sides()) {
            let object = place_of(&self.objects, side.u);
            let first = self.objects[object].first;
            *local = LocalSide { object, first, dof: side.dof as usize, y: side.y as usize };
        }
        let own: Vec<f64> = (0..count).map(|k| rows.own(block, k, k)).collect();
        let kind = match block.set {
            _ if own[0] <= f64::MIN_POSITIVE => Kind::Held,
            RowSet::Equality => Kind::Equality,
            RowSet::HalfLine => Kind::HalfLine,
            RowSet::Interval { lo, hi } if lo >= hi => Kind::Held,
            RowSet::Interval { lo, hi } if lo == f64::NEG_INFINITY && hi == f64::INFINITY => Kind::Equality,
            RowSet::Interval { lo, hi } => Kind::Interval { lo, hi },
            RowSet::Cone { mu } if mu > 0.0 => Kind::Cone { mu },
            RowSet::Cone { .. } => Kind::HalfLine,
        };
        LocalBlock {
            kind,
            bound: None,
            rows: count,
            row: self.c.len(),
            compliance: block.compliance,
            diagonal: own.iter().sum::<f64>() / count as f64,
            sides,
            side_count: block.sides().len(),
            block,
        }
    }

    /// Returns the pairs of objects that a block couples.
    pub fn couplings(&self) -> Vec<(usize, usize)> {
        let pair = |b: &LocalBlock| match b.sides() {
            [a, b] => Some((a.object, b.object)),
            _ => None,
        };
        self.blocks.iter().filter_map(pair).collect()
    }

    /// Returns the responses of the first `rows` rows of a block on one side, row-major.
    #[inline(always)]
    pub fn responses(&self, side: &LocalSide, rows: usize) -> &[f64] {
        &self.y[side.y..side.y + rows * side.dof]
    }

    /// Returns `Yᵀu` of a block; 0 beyond its rows.
    #[inline(always)]
    pub fn velocity(&self, block: &LocalBlock, u: &[f64]) -> [f64; 3] {
        let mut v = [0.0; 3];
        for side in block.sides() {
            let u = &u[side.first..side.first + side.dof];
            for (v, y) in v.iter_mut().zip(self.responses(side, block.rows).chunks_exact(side.dof)) {
                *v += dot(y, u);
            }
        }
        v
    }

    /// `u += Y·λ` of one block.
    #[inline(always)]
    pub fn push(&self, block: &LocalBlock, lambda: &[f64], u: &mut [f64]) {
        for side in block.sides() {
            let u = &mut u[side.first..side.first + side.dof];
            for (lambda, y) in lambda.iter().zip(self.responses(side, block.rows).chunks_exact(side.dof)) {
                u.iter_mut().zip(y).for_each(|(u, y)| *u += lambda * y);
            }
        }
    }

    /// Writes `u = Y·λ`.
    pub fn apply(&self, lambda: &[f64], u: &mut Vec<f64>) {
        u.clear();
        u.resize(self.dof, 0.0);
        self.blocks.iter().for_each(|b| self.push(b, &lambda[b.range()], u));
    }

    /// Returns the row velocities of one block, `w = c + Yᵀu + R·λ`.
    #[inline(always)]
    pub fn row_velocity(&self, block: &LocalBlock, u: &[f64], lambda: &[f64]) -> [f64; 3] {
        let mut w = self.velocity(block, u);
        w.iter_mut().zip(&self.c[block.range()]).for_each(|(w, c)| *w += c);
        w[0] += block.compliance * lambda[block.row];
        w
    }

    /// Returns the largest error of any block, m/s: the distance of `λ` from the projection of `λ −
    /// (w + μ·|w_t|·n)/d` onto its set, times `d`. `u` is `Y·λ`.
    pub fn error(&self, u: &[f64], lambda: &[f64]) -> f64 {
        let error = |b: &LocalBlock| self.block_error(b, self.row_velocity(b, u, lambda), &lambda[b.range()]);
        largest(self.blocks.iter().map(error))
    }

    /// Returns the errors to reach for the tolerance of a sweep.
    pub fn tolerance(&self, tolerance: f64) -> Tolerance {
        let [rounding, solved] = ROUNDING.map(|share| share * self.fastest);
        Tolerance { goal: tolerance.max(rounding), solved: (10.0 * tolerance).max(solved) }
    }

    /// The same for multipliers alone.
    pub fn error_of(&self, lambda: &[f64]) -> f64 {
        let mut u = Vec::new();
        self.apply(lambda, &mut u);
        self.error(&u, lambda)
    }

    /// Returns the error of one block with the row velocities `w`.
    pub fn block_error(&self, block: &LocalBlock, w: [f64; 3], lambda: &[f64]) -> f64 {
        let d = block.diagonal;
        let scalar = |lo: f64, hi: f64| (lambda[0] - (lambda[0] - w[0] / d).max(lo).min(hi)).abs() * d;
        match block.kind {
            Kind::Held => 0.0,
            Kind::Equality => w[0].abs(),
            Kind::HalfLine => scalar(0.0, f64::INFINITY),
            Kind::Interval { lo, hi } => scalar(lo, hi),
            Kind::Cone { mu } => {
                let shift = mu * length(w[1], w[2]);
                let onto = project([lambda[0] - (w[0] + shift) / d, lambda[1] - w[1] / d, lambda[2] - w[2] / d], mu).0;
                (0..3).map(|k| (lambda[k] - onto[k]).powi(2)).sum::<f64>().sqrt() * d
            }
        }
    }

    /// Reads the multipliers of the island. Those without a choice are as their set says.
    pub fn read(&self, lambda: &[f64]) -> Vec<f64> {
        let mut own = vec![0.0; self.c.len()];
        for b in &self.blocks {
            let own = &mut own[b.range()];
            match (b.kind, b.block.set) {
                (Kind::Held, RowSet::Interval { hi, .. }) if b.diagonal > f64::MIN_POSITIVE => own[0] = hi,
                (Kind::Held, _) => {}
                (Kind::HalfLine, _) => own[0] = lambda[b.block.row as usize].max(0.0),
                _ => own.copy_from_slice(&lambda[b.block.range()]),
            }
        }
        own
    }

    /// Writes the multipliers of the island.
    pub fn write(&self, own: &[f64], lambda: &mut [f64]) {
        self.blocks.iter().for_each(|b| lambda[b.block.range()].copy_from_slice(&own[b.range()]));
    }
}

#[cfg(test)]
mod tests {
    use super::{Island, RowSet, Rows};

    /// A multiplier that is not a number makes the error of its island no number, also if blocks with a
    /// finite error follow: such a result must never pass for a better one.
    #[test]
    fn what_is_not_a_number_is_no_small_error() {
        let mut rows = Rows::default();
        rows.clear(3);
        for k in 0..3 {
            rows.push_block(RowSet::HalfLine);
            rows.side(k, 1).expect("first side")[0] = 1.0;
        }
        let island = Island::new(&rows, &[0, 1, 2], &[-1.0; 3]);
        assert!(island.error_of(&[1.0, f64::NAN, 0.5]).is_nan());
        assert!((island.error_of(&[1.0, 1.0, 0.5]) - 0.5).abs() < 1e-12);
    }
}

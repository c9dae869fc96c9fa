//! The contact problem as a linear complementarity problem, solved by [`lemke`]: exact on a
//! polygonal friction cone.
//!
//! Sources: thesis §IV.B.3.d and Algorithm 3 (`Kᶠ` with one tangent per contact, after Kokkevis);
//! Stewart and Trinkle 1996, Anitescu and Potra 1997 (the pyramid; they prove that Lemke's method
//! finds a solution, so a ray means contradictory rows). Per contact:
//!
//! ```text
//! w_n = (K·λ + c)_n                ≥ 0  ⟂  f_n ≥ 0
//! w_i = dᵢ·(K·λ + c)_t + s         ≥ 0  ⟂  f_i ≥ 0      λ_t = Σ f_i·dᵢ
//! slack = μ·f_n − Σ f_i            ≥ 0  ⟂  s  ≥ 0       s: the sliding speed
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `f_n`, `f_i`, `s` | normal multiplier, multiplier along direction `i`, multiplier of the friction bound |
//! | `d₁` | `−c_t/|c_t|`, against the free sliding velocity; the first tangent if nothing slides |
//! | `dᵢ` | `d₁` alone (sliding form, 3 unknowns); `±d₁`, `±d₂` with `d₂ ⟂ d₁` (pyramid, 6 unknowns) |
//!
//! The pyramid turns with the sliding velocity, so friction opposes it exactly and at full size.
//! For one contact whose sliding direction the solve does not turn, both forms give the exact cone.
//! If the direction turns, the pyramid is up to 1/√2 of the cone. The sliding form cannot push in
//! any other direction: it does not hold a body that other contacts or rows drive backward or
//! sideways.
//!
//! Other rows: half-lines need no transformation. An interval is `λ = lo + z` with a multiplier for
//! `hi − lo − z ≥ 0`. Equalities are eliminated first ([`Equalities`]). `K` has the compliance of
//! soft rows on its diagonal. A row without response gets no multiplier, and a tangent without
//! response does not contribute to `d₁`.
//!
//! The warm start is not used. [`GaussSeidel`] takes over from it, with `converged` false, if there
//! is no solution: on a secondary ray (`ray` true), at the pivot limit, and above [`MAX_UNKNOWNS`]
//! unknowns (pivoting is O(n³)). Numbers that are not finite give zero multipliers and `converged`
//! false.

use super::equality::{Equalities, RANK};
use super::lemke::{LcpResult, lemke};
use super::{GaussSeidel, RowSolver, SolveReport, SolverSettings};
use crate::constraint::rows::{Block, RowSet, Rows};

/// Maximum number of unknowns for pivoting.
pub const MAX_UNKNOWNS: usize = 3000;
/// A tangent has no response if its diagonal of `K` is below this fraction of the block's largest.
const RESPONSE_TOLERANCE: f64 = 1e-20;
/// Sliding velocity that counts as zero, relative to the largest free value of the island.
const SLIDING_TOLERANCE: f64 = 1e-13;
/// Free value that counts as rounding and becomes 0, relative to the largest free value of the
/// island. Scaled up, it could make rows contradict each other.
const ROUNDING: f64 = 1e-13;
/// Lower bound of "the largest free value", m/s or m/s².
const MIN_SCALE: f64 = 1e-3;
/// Share of the mean diagonal by which rows yield where redundant contacts end the walk of [`on_pyramids`] on a ray.
const YIELDING: f64 = 1e-9;
/// Velocity error of the equality rows that counts as solved, relative to the largest free value.
const ACCEPT: f64 = 1e-9;

/// Lemke's method on the four-sided friction pyramid, `lcp_pyramid`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LcpPyramid;

/// Lemke's method on the thesis's `Kᶠ` with one tangent per contact, `lcp_sliding`.
#[derive(Clone, Copy, Debug, Default)]
pub struct LcpSliding;

impl RowSolver for LcpPyramid {
    fn name(&self) -> &'static str {
        "lcp_pyramid"
    }

    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport {
        solve(Friction::Pyramid, rows, blocks, c, lambda, du, settings)
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

impl RowSolver for LcpSliding {
    fn name(&self) -> &'static str {
        "lcp_sliding"
    }

    fn solve(
        &self,
        rows: &Rows,
        blocks: &[u32],
        c: &[f64],
        lambda: &mut [f64],
        du: &mut [f64],
        settings: SolverSettings,
    ) -> SolveReport {
        solve(Friction::Sliding, rows, blocks, c, lambda, du, settings)
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Friction {
    Pyramid,
    Sliding,
}

fn solve(
    friction: Friction,
    rows: &Rows,
    blocks: &[u32],
    c: &[f64],
    lambda: &mut [f64],
    du: &mut [f64],
    settings: SolverSettings,
) -> SolveReport {
    let fall_back = |lambda: &mut [f64], du: &mut [f64], pivots: u32, ray: bool| {
        let swept = GaussSeidel.solve(rows, blocks, c, lambda, du, settings);
        SolveReport { iterations: pivots + swept.iterations, converged: false, ray, ..swept }
    };
    if unknowns_at_most(friction, rows, blocks) > MAX_UNKNOWNS {
        return fall_back(lambda, du, 0, false);
    }
    if !finite(rows, blocks, c) {
        blocks.iter().for_each(|&b| lambda[rows.blocks[b as usize].range()].fill(0.0));
        return SolveReport { iterations: 0, converged: false, ray: false, relaxations: 0 };
    }
    let problem = Problem::new(friction, rows, blocks, c, None);
    let (m, q) = problem.matrix();
    let (local, pivots, converged) = match lemke(&m, &q) {
        LcpResult::Solution { z, pivots } => {
            let (local, error) = problem.multipliers(&z);
            (local, pivots, error <= ACCEPT * problem.scale)
        }
        LcpResult::Ray { pivots } => return fall_back(lambda, du, pivots, true),
        LcpResult::PivotLimit { pivots } => return fall_back(lambda, du, pivots, false),
        LcpResult::NotFinite => return fall_back(lambda, du, 0, false),
    };
    let mut first = 0;
    for &b in blocks {
        let block = &rows.blocks[b as usize];
        let count = block.set.rows();
        lambda[block.range()].copy_from_slice(&local[first..first + count]);
        rows.apply_block(block, lambda, du);
        first += count;
    }
    SolveReport { iterations: pivots, converged, ray: false, relaxations: 0 }
}

/// Solves an island on friction pyramids whose first edges are the directions of friction `along`, a force per row
/// of the island. Returns the multipliers in the order of the rows, or `None` if pivoting finds no solution, or if the
/// island has more than `most` unknowns.
pub(super) fn on_pyramids(rows: &Rows, blocks: &[u32], c: &[f64], along: Vec<f64>, most: usize) -> Option<Vec<f64>> {
    if unknowns_at_most(Friction::Pyramid, rows, blocks) > most || !finite(rows, blocks, c) {
        return None;
    }
    let problem = Problem::new(Friction::Pyramid, rows, blocks, c, Some(along));
    let (mut m, q) = problem.matrix();
    for yielding in [0.0, YIELDING] {
        problem.soften(&mut m, yielding);
        if let LcpResult::Solution { z, .. } = lemke(&m, &q) {
            return Some(problem.multipliers(&z).0);
        }
    }
    None
}

/// Returns whether all numbers of the island's problem are finite; bounds of an interval may be
/// infinite.
fn finite(rows: &Rows, blocks: &[u32], c: &[f64]) -> bool {
    let responses =
        |block: &Block, k: usize| block.sides().iter().all(|s| rows.response(s, k).iter().all(|y| y.is_finite()));
    let set = |set: &RowSet| match set {
        RowSet::Equality | RowSet::HalfLine => true,
        RowSet::Interval { lo, hi } => !lo.is_nan() && !hi.is_nan(),
        RowSet::Cone { mu } => mu.is_finite(),
    };
    let row = |block: &Block| {
        set(&block.set)
            && block.range().enumerate().all(|(k, i)| c[i].is_finite() && responses(block, k))
            && block.compliance.is_finite()
    };
    blocks.iter().all(|&b| row(&rows.blocks[b as usize]))
}

fn unknowns_at_most(friction: Friction, rows: &Rows, blocks: &[u32]) -> usize {
    let of = |set: &RowSet| match (set, friction) {
        (RowSet::Equality | RowSet::HalfLine, _) => 1,
        (RowSet::Interval { .. }, _) => 2,
        (RowSet::Cone { .. }, Friction::Sliding) => 3,
        (RowSet::Cone { .. }, Friction::Pyramid) => 6,
    };
    blocks.iter().map(|&b| of(&rows.blocks[b as usize].set)).sum()
}

/// An unknown `z ≥ 0` that acts on one or two rows of the island.
struct Column {
    row: [usize; 2],
    weight: [f64; 2],
}

/// `constant + gain·z_normal − Σ_{limited} z ≥ 0`, complementary to its own unknown.
struct Bound {
    constant: f64,
    normal: Option<(usize, f64)>,
    limited: std::ops::Range<usize>,
}

/// The problem of an island. The unknowns are the columns, followed by the bounds.
struct Problem {
    /// `K + R` of the island, dense, row-major.
    k: Vec<f64>,
    /// Free values of the island's rows.
    c: Vec<f64>,
    /// The largest free value, at least [`MIN_SCALE`].
    scale: f64,
    /// Multipliers at `z = 0`: the lower bounds of intervals.
    start: Vec<f64>,
    /// A force per row; its tangential part at a contact has the direction of `d₁`.
    along: Vec<f64>,
    columns: Vec<Column>,
    bounds: Vec<Bound>,
    /// Indices of the equality rows.
    free: Vec<usize>,
    equalities: Equalities,
}

impl Problem {
    /// The directions `d₁` are those of the tangential parts of `along`, a force per row, or against the free sliding velocity.
    fn new(friction: Friction, rows: &Rows, blocks: &[u32], c: &[f64], along: Option<Vec<f64>>) -> Problem {
        let island = || blocks.iter().map(|&b| &rows.blocks[b as usize]);
        let k = rows.dense(blocks);
        let c: Vec<f64> = island().flat_map(|block| c[block.range()].iter().copied()).collect();
        let along = along.unwrap_or_else(|| c.iter().map(|c| -c).collect());
        let scale = c.iter().fold(MIN_SCALE, |a: f64, c| a.max(c.abs()));
        let start = vec![0.0; c.len()];
        let equalities = Equalities::new(&[], 0, RANK);
        let mut problem = Problem {
            k,
            c,
            scale,
            start,
            along,
            columns: Vec::new(),
            bounds: Vec::new(),
            free: Vec::new(),
            equalities,
        };
        let mut first = 0;
        for block in island() {
            if rows.own(block, 0, 0) > f64::MIN_POSITIVE {
                problem.add(friction, block, first);
            }
            first += block.set.rows();
        }
        let free = &problem.free;
        let among: Vec<f64> =
            free.iter().flat_map(|&i| free.iter().map(move |&j| (i, j))).map(|(i, j)| problem.entry(i, j)).collect();
        problem.equalities = Equalities::new(&among, free.len(), RANK);
        problem
    }

    fn add(&mut self, friction: Friction, block: &Block, row: usize) {
        match block.set {
            RowSet::Equality => self.free.push(row),
            RowSet::HalfLine => self.add_column([row, row], [1.0, 0.0]),
            RowSet::Interval { lo, hi } => self.add_interval(row, lo, hi),
            RowSet::Cone { mu } => self.add_contact(friction, row, mu),
        }
    }

    fn add_column(&mut self, row: [usize; 2], weight: [f64; 2]) {
        self.columns.push(Column { row, weight });
    }

    fn add_interval(&mut self, row: usize, lo: f64, hi: f64) {
        match (lo.is_finite(), hi.is_finite()) {
            (false, false) => self.free.push(row),
            (false, true) => {
                self.start[row] = hi;
                self.add_column([row, row], [-1.0, 0.0]);
            }
            (true, false) => {
                self.start[row] = lo;
                self.add_column([row, row], [1.0, 0.0]);
            }
            (true, true) if lo >= hi => self.start[row] = hi,
            (true, true) => {
                self.start[row] = lo;
                let first = self.columns.len();
                self.add_column([row, row], [1.0, 0.0]);
                self.bounds.push(Bound { constant: hi - lo, normal: None, limited: first..first + 1 });
            }
        }
    }

    fn add_contact(&mut self, friction: Friction, row: usize, mu: f64) {
        let normal = self.columns.len();
        self.add_column([row, row], [1.0, 0.0]);
        let Some((along, across)) = self.directions(row).filter(|_| mu > 0.0) else { return };
        let tangents = [row + 1, row + 2];
        self.add_column(tangents, along);
        if friction == Friction::Pyramid {
            self.add_column(tangents, along.map(|x| -x));
            if let Some(across) = across {
                self.add_column(tangents, across);
                self.add_column(tangents, across.map(|x| -x));
            }
        }
        self.bounds.push(Bound { constant: 0.0, normal: Some((normal, mu)), limited: normal + 1..self.columns.len() });
    }

    /// Returns `d₁` against the free sliding velocity and, if both tangents have a response, `d₂`
    /// across it.
    fn directions(&self, row: usize) -> Option<([f64; 2], Option<[f64; 2]>)> {
        let floor = RESPONSE_TOLERANCE * (0..3).map(|r| self.diagonal(row + r)).fold(0.0, f64::max);
        let live = [self.diagonal(row + 1) > floor, self.diagonal(row + 2) > floor];
        match live {
            [false, false] => None,
            [true, false] => Some(([if self.along[row + 1] < 0.0 { -1.0 } else { 1.0 }, 0.0], None)),
            [false, true] => Some(([0.0, if self.along[row + 2] < 0.0 { -1.0 } else { 1.0 }], None)),
            [true, true] => {
                let (x, y) = (self.along[row + 1], self.along[row + 2]);
                let speed = nalgebra::ComplexField::hypot(x, y);
                let along = if speed > SLIDING_TOLERANCE * self.scale { [x / speed, y / speed] } else { [1.0, 0.0] };
                Some((along, Some([-along[1], along[0]])))
            }
        }
    }

    fn entry(&self, i: usize, j: usize) -> f64 {
        self.k[i * self.c.len() + j]
    }

    fn diagonal(&self, i: usize) -> f64 {
        self.entry(i, i)
    }

    /// Returns `K` of a row with the rows of a column.
    fn against(&self, row: usize, column: &Column) -> f64 {
        (0..2).map(|e| column.weight[e] * self.entry(row, column.row[e])).sum()
    }

    /// Returns `M`, row-major, and `q`.
    fn matrix(&self) -> (Vec<f64>, Vec<f64>) {
        let (columns, n) = (self.columns.len(), self.columns.len() + self.bounds.len());
        let c = self.velocities(&self.start);
        let (mut m, mut q) = (vec![0.0; n * n], vec![0.0; n]);
        for (i, a) in self.columns.iter().enumerate() {
            q[i] = (0..2).map(|e| a.weight[e] * c[a.row[e]]).sum();
            for (j, b) in self.columns.iter().enumerate() {
                m[i * n + j] = (0..2).map(|e| a.weight[e] * self.against(a.row[e], b)).sum();
            }
        }
        let coupling: Vec<Vec<f64>> =
            self.columns.iter().map(|z| self.free.iter().map(|&i| self.against(i, z)).collect()).collect();
        let free: Vec<f64> = self.free.iter().map(|&i| c[i]).collect();
        self.equalities.reduce(&coupling, &free, &mut m, n, &mut q[..columns]);
        q.iter_mut().filter(|q| q.abs() <= ROUNDING * self.scale).for_each(|q| *q = 0.0);
        for (i, bound) in self.bounds.iter().enumerate() {
            let own = columns + i;
            q[own] = bound.constant;
            for j in bound.limited.clone() {
                m[own * n + j] = -1.0;
                m[j * n + own] = 1.0;
            }
            if let Some((normal, mu)) = bound.normal {
                m[own * n + normal] = mu;
            }
        }
        (m, q)
    }

    /// Returns `c + (K + R)·λ` of the island's rows.
    fn velocities(&self, lambda: &[f64]) -> Vec<f64> {
        let n = self.c.len();
        (0..n)
            .map(|i| self.c[i] + self.k[i * n..(i + 1) * n].iter().zip(lambda).map(|(k, l)| k * l).sum::<f64>())
            .collect()
    }

    /// Adds a share of the mean diagonal to the diagonal of the columns.
    fn soften(&self, m: &mut [f64], share: f64) {
        let (count, n) = (self.columns.len(), self.columns.len() + self.bounds.len());
        let mean = (0..count).map(|i| m[i * n + i]).sum::<f64>() / count.max(1) as f64;
        (0..count).for_each(|i| m[i * n + i] += share * mean);
    }

    /// Returns the island's multipliers, and the largest remaining velocity of an equality row.
    fn multipliers(&self, z: &[f64]) -> (Vec<f64>, f64) {
        let mut lambda = self.start.clone();
        for (column, z) in self.columns.iter().zip(z) {
            (0..2).for_each(|e| lambda[column.row[e]] += column.weight[e] * z);
        }
        // the second pass is iterative refinement
        for _ in 0..2 {
            let w = self.velocities(&lambda);
            let wrong: Vec<f64> = self.free.iter().map(|&i| w[i]).collect();
            self.free.iter().zip(self.equalities.solve(&wrong)).for_each(|(&i, x)| lambda[i] -= x);
        }
        let w = self.velocities(&lambda);
        (lambda, self.free.iter().map(|&i| w[i].abs()).fold(0.0, f64::max))
    }
}

//! Scalar rows along one direction, solved together as one block of the sweeps.
//!
//! A joint with two limits, dry friction and a drive has up to four rows with the same response `Y`, up
//! to sign. Solved one after the other they pass load between each other by as little as their
//! velocities differ: a limit at its stop and the friction of its joint would take millions of sweeps.
//! Together they are one monotone equation for the velocity `v`:
//!
//! ```text
//! v = Yᵀu = v₀ + k·Λ,   Λ = F(v) = Σ s_m·λ_m(v)          F falls in ramps and steps
//! w_m = s_m·v + c_m + R_m·λ_m                             λ_m in its set, by w_m
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `v`, `v₀` | velocity along the direction, and the part of it that is due to other blocks |
//! | `k` | response of the direction, without compliance |
//! | `Λ` | sum of the multipliers along the direction |
//! | `s_m` | sign of a row, ±1 |
//! | `c_m`, `R_m` | free value and compliance of a row |
//!
//! Rigid limits bound `v`. Within the bounds `v − v₀ − k·F(v)` increases, so the root is found by
//! visiting the points at which a row changes its regime, in ascending order.

use super::local::extrapolate_value;
use crate::constraint::rows::{Block, RowSet, Rows};
use smallvec::SmallVec;

/// Maximum number of rows of a group.
const MEMBERS: usize = 8;

/// A row of a group.
#[derive(Clone, Copy, Debug)]
struct Member {
    /// Index of its row.
    row: u32,
    /// `s`, relative to the first row of the group.
    sign: f64,
    c: f64,
    compliance: f64,
    lo: f64,
    hi: f64,
    lambda: f64,
    last: f64,
}

/// A regime of `v`: beside a point, from below or above.
#[derive(Clone, Copy, PartialEq)]
enum Beside {
    Below,
    Above,
}

/// The rows of a group.
#[derive(Debug)]
pub(super) struct JointRow {
    members: SmallVec<[Member; 4]>,
    /// `k`.
    pub k: f64,
    /// Least and greatest `v` that rigid limits allow.
    bounds: [f64; 2],
    /// Values of `v` at which a row changes its regime, ascending.
    points: SmallVec<[f64; 8]>,
}

/// Change by a relaxation.
pub(super) struct Moved {
    /// Change of `Λ`.
    pub total: f64,
    /// `Σ δλ·(λ − λ_last)`.
    pub along: f64,
}

/// Returns the groups of parallel rows among scalar `blocks`, each in the order of its blocks: indices
/// of blocks with the sign of their row. Rows without a parallel are left out.
pub(super) fn parallel_rows(rows: &Rows, blocks: &[u32], mergeable: impl Fn(&Block) -> bool) -> Vec<Vec<(u32, f64)>> {
    let single = |b: &u32| rows.blocks[*b as usize].set.rows() == 1 && mergeable(&rows.blocks[*b as usize]);
    let mut keys: Vec<([u32; 2], u64, u32)> = Vec::new();
    for &b in blocks.iter().filter(|b| single(b)) {
        let block = &rows.blocks[b as usize];
        let own = rows.own(block, 0, 0);
        if let [first, others @ ..] = block.sides()
            && own > f64::MIN_POSITIVE
        {
            let second = others.first().map_or(u32::MAX, |side| side.u);
            // equal for opposite rows too
            keys.push(([first.u, second], own.to_bits(), b));
        }
    }
    keys.sort_unstable();
    let mut groups: Vec<Vec<(u32, f64)>> = Vec::new();
    for same in keys.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|same| same.len() > 1) {
        let mut left: Vec<u32> = same.iter().map(|(_, _, b)| *b).collect();
        while let [first, ..] = left[..] {
            let sign = |b: &u32| relative_sign(rows, &rows.blocks[first as usize], &rows.blocks[*b as usize]);
            let group: Vec<(u32, f64)> = left.iter().filter_map(|b| Some((*b, sign(b)?))).take(MEMBERS).collect();
            left.retain(|b| !group.iter().any(|(member, _)| member == b));
            if group.len() > 1 {
                groups.push(group);
            }
        }
    }
    groups
}

/// Returns 1 if two scalar rows have the same responses, −1 if they have the opposite ones.
fn relative_sign(rows: &Rows, a: &Block, b: &Block) -> Option<f64> {
    let pairs = || {
        let sides = a.sides().iter().zip(b.sides());
        sides.flat_map(|(x, y)| rows.response(x, 0).iter().zip(rows.response(y, 0)))
    };
    let same_sides = a.sides().iter().map(|s| (s.u, s.dof)).eq(b.sides().iter().map(|s| (s.u, s.dof)));
    let is = |sign: f64| pairs().all(|(x, y)| *x == sign * y);
    [1.0, -1.0].into_iter().find(|sign| same_sides && is(*sign))
}

impl JointRow {
    /// Makes the group with the response `k` of its first row.
    pub fn new(rows: &Rows, group: &[(u32, f64)], k: f64, c: &[f64], lambda: &[f64]) -> JointRow {
        let member = |&(b, sign): &(u32, f64)| {
            let block = &rows.blocks[b as usize];
            let (lo, hi) = match block.set {
                RowSet::Interval { lo, hi } => (lo, hi),
                RowSet::Equality => (f64::NEG_INFINITY, f64::INFINITY),
                RowSet::HalfLine | RowSet::Cone { .. } => (0.0, f64::INFINITY),
            };
            let start = lambda[block.row as usize];
            Member {
                row: block.row,
                sign,
                c: c[block.row as usize],
                compliance: block.compliance,
                lo,
                hi,
                lambda: start,
                last: start,
            }
        };
        let members: SmallVec<[Member; 4]> = group.iter().map(member).collect();
        let mut bounds = [f64::NEG_INFINITY, f64::INFINITY];
        let mut points = SmallVec::new();
        for m in &members {
            if m.is_limit() {
                // the velocity may not pass −s·c against the direction of the multiplier
                let end = -m.sign * m.c;
                bounds = if m.sign > 0.0 { [bounds[0].max(end), bounds[1]] } else { [bounds[0], bounds[1].min(end)] };
            } else {
                let ends = [m.lo, m.hi].into_iter().filter(|end| end.is_finite());
                points.extend(ends.map(|end| m.velocity_at(end)));
            }
        }
        points.sort_unstable_by(f64::total_cmp);
        points.dedup();
        JointRow { members, k, bounds, points }
    }

    /// Returns `Λ`.
    pub fn total(&self) -> f64 {
        self.members.iter().map(|m| m.sign * m.lambda).sum()
    }

    pub fn write(&self, lambda: &mut [f64]) {
        self.members.iter().for_each(|m| lambda[m.row as usize] = m.lambda);
    }

    pub fn read(&mut self, lambda: &[f64]) {
        self.members.iter_mut().for_each(|m| m.lambda = lambda[m.row as usize]);
    }

    pub fn scale(&mut self, factor: f64) {
        self.members.iter_mut().for_each(|m| m.lambda *= factor);
    }

    pub fn extrapolate(&mut self, beta: f64) {
        self.members.iter_mut().for_each(|m| extrapolate_value(&mut m.lambda, &mut m.last, beta));
    }

    /// Solves the rows at the velocity `velocity`, of which `k·Λ` is due to their own multipliers, and
    /// moves by `factor` times the difference.
    pub fn relax(&mut self, velocity: f64, factor: f64) -> Moved {
        let base = velocity - self.k * self.total();
        let v = self.root(base).max(self.bounds[0]).min(self.bounds[1]);
        // what rows with a step at `v` share
        let single: f64 = self.members.iter().filter_map(|m| Some(m.sign * m.multiplier_at(v)?)).sum();
        let mut left = (v - base) / self.k - single;
        let mut moved = Moved { total: 0.0, along: 0.0 };
        for limits in [false, true] {
            for m in self.members.iter_mut().filter(|m| m.is_limit() == limits) {
                let next = m.multiplier_at(v).unwrap_or_else(|| {
                    let share = (m.sign * left).max(m.lo).min(m.hi);
                    left -= m.sign * share;
                    share
                });
                let change = factor * (next - m.lambda);
                m.lambda = if factor < 1.0 { m.lambda + change } else { next };
                moved.total += m.sign * change;
                moved.along += change * (m.lambda - m.last);
            }
        }
        moved
    }

    /// Returns the root of `v − base − k·F(v)` without the rigid limits.
    fn root(&self, base: f64) -> f64 {
        let value = |v: f64, beside: Beside| v - base - self.k * self.sum(v, beside).0;
        let slope = |v: f64, beside: Beside| 1.0 - self.k * self.sum(v, beside).1;
        for &point in &self.points {
            let below = value(point, Beside::Below);
            if below >= 0.0 {
                return point - below / slope(point, Beside::Below);
            }
            if value(point, Beside::Above) >= 0.0 {
                return point;
            }
        }
        let from = self.points.last().copied().unwrap_or(base);
        from - value(from, Beside::Above) / slope(from, Beside::Above)
    }

    /// Returns `F` and its slope beside `v`, without the rigid limits.
    fn sum(&self, v: f64, beside: Beside) -> (f64, f64) {
        let parts = self.members.iter().filter(|m| !m.is_limit()).map(|m| m.regime(v, beside));
        parts.fold((0.0, 0.0), |(f, slope), (g, more)| (f + g, slope + more))
    }
}

impl Member {
    /// Returns whether the row bounds the velocity.
    fn is_limit(&self) -> bool {
        self.compliance == 0.0 && self.lo == 0.0 && self.hi == f64::INFINITY
    }

    /// Returns the velocity at which the multiplier reaches one of its ends.
    fn velocity_at(&self, end: f64) -> f64 {
        -self.sign * (self.c + self.compliance * end)
    }

    /// Returns `s·λ` and its slope beside `v`.
    fn regime(&self, v: f64, beside: Beside) -> (f64, f64) {
        // along the direction the multiplier falls from one end to the other
        let (upper, lower) = if self.sign > 0.0 { (self.hi, self.lo) } else { (self.lo, self.hi) };
        let (from, to) = (self.velocity_at(upper), self.velocity_at(lower));
        let before = |point: f64| v < point || v == point && beside == Beside::Below;
        if before(from) {
            (self.sign * upper, 0.0)
        } else if before(to) {
            let w = self.sign * v + self.c;
            (-self.sign * w / self.compliance, -1.0 / self.compliance)
        } else {
            (self.sign * lower, 0.0)
        }
    }

    /// Returns the multiplier at `v`; `None` at a step, where it may have any value of its set.
    fn multiplier_at(&self, v: f64) -> Option<f64> {
        if self.compliance > 0.0 {
            let w = self.sign * v + self.c;
            return Some((-w / self.compliance).max(self.lo).min(self.hi));
        }
        let step = -self.sign * self.c;
        if v == step {
            return None;
        }
        Some(if self.is_limit() || (v > step) == (self.sign > 0.0) { self.lo } else { self.hi })
    }
}

//! Newton's method on the function of Alart and Curnier: small islands, from multipliers that need not be
//! near.
//!
//! ```text
//! normal      f_n = w_n                     if n = λ_n − ρ·w_n > 0,      else f = λ/ρ (open)
//! tangents    f_t = w_t                     if |x| ≤ μ·n,  x = λ_t − ρ·w_t        (stick)
//!             f_t = (λ_t − μ·n·x/|x|)/ρ     else                                  (slide)
//! scalar      f   = (λ − clamp(λ − ρ·w, lo, hi))/ρ
//!
//! f(λ) = 0,   w = c + Yᵀu + R·λ,   u = Y·λ                  f' = A + B·(K + R)
//! C = A + B·R + ε·d,   G = C⁻¹·B
//! (1 + Σ Y·G·Yᵀ)·δu = −Σ Y·C⁻¹·f,       δλ = −C⁻¹·(f + B·Yᵀδu)
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `ρ` | `1/d`, with `d` the mean diagonal of the block of `K` |
//! | `A`, `B` | derivatives of `f` of a block by its own `λ` and its own `w` |
//! | `ε` | keeps redundant contacts regular; grows after a step along which `|f|` does not fall |
//!
//! With the right choice of open, sticking and sliding contacts a step is exact except for the curve of sliding
//! friction. Where the choices go in circles, a second attempt after ten sweeps often succeeds; other methods solve
//! the rest. Source: Alart and Curnier, *A mixed formulation for frictional contact problems prone to Newton like solution methods*, 1991.

use super::cone::{M3, V3, length, times};
use super::island::{Island, Kind, LocalBlock};
use super::{System, Tolerance};

/// Maximum number of factorizations.
const STEPS: u32 = 12;
/// `ε`: least, first after a step that failed, growth and bound.
const REGULAR: [f64; 4] = [1e-10, 1e-6, 100.0, 0.1];
/// A step is accepted if `|f|` falls below the largest of this number of last iterates: the way to the right choice
/// of open, sticking and sliding contacts leads uphill now and then (Grippo, Lampariello and Lucidi, *A nonmonotone
/// line search technique for Newton's method*, 1986).
const MEMORY: usize = 6;
/// Number of lengths of a step that are tried, each half of the last.
const LENGTHS: u32 = 6;

/// A block at an iterate.
#[derive(Clone, Copy, Default)]
struct Point {
    lambda: V3,
    w: V3,
}

impl Point {
    /// Returns `λ − ρ·w`.
    #[inline(always)]
    fn moved(&self, block: &LocalBlock) -> V3 {
        [0, 1, 2].map(|k| self.lambda[k] - self.w[k] / block.diagonal)
    }
}

/// The function of a block and its derivatives, `f' = A + B·(K + R)`.
struct Linear {
    f: V3,
    a: M3,
    b: M3,
}

/// Improves `lambda`, whose error is `error`. Returns the error of the best multipliers found, which it leaves
/// in `lambda`, and the number of factorizations.
pub(super) fn solve(system: &mut System, lambda: &mut [f64], mut error: f64, tolerance: Tolerance) -> (f64, u32) {
    let System { island, structure, factor } = system;
    let (mut u, mut work, mut next) = (Vec::new(), Vec::new(), lambda.to_vec());
    let mut points = Vec::with_capacity(island.blocks.len());
    let (mut gains, mut halves) = (vec![[[0.0; 3]; 3]; island.blocks.len()], Vec::new());
    let (mut epsilon, mut taken) = (REGULAR[0], 0);
    island.apply(lambda, &mut u);
    read_points(island, lambda, &u, &mut points);
    let mut sizes = vec![size_of(island, &points)];
    while taken < STEPS && error > tolerance.goal && sizes.iter().all(|size| size.is_finite()) {
        let mut step = vec![0.0; island.dof];
        halves.clear();
        for (block, (point, gain)) in island.blocks.iter().zip(points.iter().zip(&mut gains)) {
            let (inverse, linear) = Linear::new(block, point).condensed(block, epsilon);
            *gain = product(&inverse, &linear.b);
            let force = times(&inverse, linear.f).map(|x| -x);
            island.push(block, &force[..block.rows], &mut step);
            halves.push(force);
        }
        if !factor.factor(structure, island, &gains) {
            break;
        }
        taken += 1;
        factor.solve(structure, island, &mut step, &mut work);
        let change = |(i, block): (usize, &LocalBlock)| {
            let v = island.velocity(block, &step);
            let reaction = times(&gains[i], v);
            let lambda = [0, 1, 2].map(|k| halves[i][k] - reaction[k]);
            Point { lambda, w: [v[0] + block.compliance * lambda[0], v[1], v[2]] }
        };
        let changes: Vec<Point> = island.blocks.iter().enumerate().map(change).collect();
        let largest = sizes.iter().rev().take(MEMORY).fold(0.0, |a: f64, size| a.max(*size));
        let shorter = (0..LENGTHS)
            .map(|k| 0.5_f64.powi(k as i32))
            .find(|&t| size_along(island, &points, &changes, t) < (1.0 - 1e-4 * t) * largest);
        let length = match shorter {
            Some(length) => {
                if length == 1.0 {
                    epsilon = (0.1 * epsilon).max(REGULAR[0]);
                }
                length
            }
            None if epsilon < REGULAR[3] => {
                epsilon = (REGULAR[2] * epsilon).max(REGULAR[1]);
                continue;
            }
            None => {
                epsilon = REGULAR[0];
                1.0
            }
        };
        for (block, (point, change)) in island.blocks.iter().zip(points.iter().zip(&changes)) {
            let moved = along(point, change, length);
            let onto = target(block, &moved);
            next[block.range()].copy_from_slice(&onto[..block.rows]);
        }
        island.apply(&next, &mut u);
        let reached = island.error(&u, &next);
        if reached < error {
            error = reached;
            lambda.copy_from_slice(&next);
        }
        points.iter_mut().zip(&changes).for_each(|(point, change)| *point = along(point, change, length));
        sizes.push(size_of(island, &points));
    }
    (error, taken)
}

fn read_points(island: &Island, lambda: &[f64], u: &[f64], points: &mut Vec<Point>) {
    points.clear();
    points.extend(island.blocks.iter().map(|block| {
        let mut own = [0.0; 3];
        own[..block.rows].copy_from_slice(&lambda[block.range()]);
        Point { lambda: own, w: island.row_velocity(block, u, lambda) }
    }));
}

fn along(point: &Point, change: &Point, t: f64) -> Point {
    let add = |x: V3, d: V3| [0, 1, 2].map(|k| x[k] + t * d[k]);
    Point { lambda: add(point.lambda, change.lambda), w: add(point.w, change.w) }
}

fn size_of(island: &Island, points: &[Point]) -> f64 {
    let square = |(block, point): (&LocalBlock, &Point)| square(function(block, point));
    island.blocks.iter().zip(points).map(square).sum::<f64>().sqrt()
}

fn size_along(island: &Island, points: &[Point], changes: &[Point], t: f64) -> f64 {
    let pairs = points.iter().zip(changes);
    let square = |(block, (point, change)): (&LocalBlock, _)| square(function(block, &along(point, change, t)));
    island.blocks.iter().zip(pairs).map(square).sum::<f64>().sqrt()
}

fn square(x: V3) -> f64 {
    x[0] * x[0] + x[1] * x[1] + x[2] * x[2]
}

/// Returns the multipliers that the choice of open, sticking and sliding at a point asks for: in the set of
/// the block.
#[inline(always)]
fn target(block: &LocalBlock, point: &Point) -> V3 {
    let moved = point.moved(block);
    match block.kind {
        Kind::Held => point.lambda,
        Kind::Equality => [point.lambda[0], 0.0, 0.0],
        Kind::HalfLine => [moved[0].max(0.0), 0.0, 0.0],
        Kind::Interval { lo, hi } => [moved[0].max(lo).min(hi), 0.0, 0.0],
        Kind::Cone { .. } if moved[0] <= 0.0 => [0.0; 3],
        Kind::Cone { mu } => {
            let (size, radius) = (length(moved[1], moved[2]), mu * moved[0]);
            let share = if size <= radius { 1.0 } else { radius / size };
            [moved[0], share * moved[1], share * moved[2]]
        }
    }
}

/// Returns `f` of a block.
#[inline(always)]
fn function(block: &LocalBlock, point: &Point) -> V3 {
    let Point { lambda, w } = point;
    let d = block.diagonal;
    match block.kind {
        Kind::Held => [0.0; 3],
        Kind::Equality => [w[0], 0.0, 0.0],
        Kind::HalfLine | Kind::Interval { .. } => {
            let onto = target(block, point)[0];
            [if onto == point.moved(block)[0] { w[0] } else { d * (lambda[0] - onto) }, 0.0, 0.0]
        }
        Kind::Cone { mu } => {
            let moved = point.moved(block);
            let size = length(moved[1], moved[2]);
            if moved[0] <= 0.0 {
                lambda.map(|x| d * x)
            } else if size <= mu * moved[0] {
                *w
            } else {
                let share = mu * moved[0] / size;
                [w[0], d * (lambda[1] - share * moved[1]), d * (lambda[2] - share * moved[2])]
            }
        }
    }
}

impl Linear {
    #[inline(always)]
    fn new(block: &LocalBlock, point: &Point) -> Linear {
        let d = block.diagonal;
        let mut linear = Linear { f: function(block, point), a: [[0.0; 3]; 3], b: [[0.0; 3]; 3] };
        match block.kind {
            Kind::Held => linear.a[0][0] = 1.0,
            Kind::Equality => linear.b[0][0] = 1.0,
            Kind::HalfLine | Kind::Interval { .. } => {
                let free = target(block, point)[0] == point.moved(block)[0];
                (linear.a[0][0], linear.b[0][0]) = if free { (0.0, 1.0) } else { (d, 0.0) };
            }
            Kind::Cone { mu } => {
                let moved = point.moved(block);
                let size = length(moved[1], moved[2]);
                if moved[0] <= 0.0 {
                    (0..3).for_each(|k| linear.a[k][k] = d);
                } else if size <= mu * moved[0] {
                    (0..3).for_each(|k| linear.b[k][k] = 1.0);
                } else {
                    let (t, share) = ([moved[1] / size, moved[2] / size], mu * moved[0] / size);
                    linear.b[0][0] = 1.0;
                    for i in 0..2 {
                        linear.a[1 + i][0] = -d * mu * t[i];
                        linear.b[1 + i][0] = mu * t[i];
                        for j in 0..2 {
                            let same = f64::from(u8::from(i == j));
                            let turn = share * (same - t[i] * t[j]);
                            linear.a[1 + i][1 + j] = d * (same - turn);
                            linear.b[1 + i][1 + j] = turn;
                        }
                    }
                }
            }
        }
        linear
    }

    /// Returns `C⁻¹` with the function.
    #[inline(always)]
    fn condensed(self, block: &LocalBlock, epsilon: f64) -> (M3, Linear) {
        let mut c = self.a;
        let regular = (epsilon * block.diagonal).max(f64::MIN_POSITIVE);
        (0..3).for_each(|k| c[k][k] += regular);
        c[0][0] += self.b[0][0] * block.compliance;
        if !matches!(block.kind, Kind::Cone { .. }) {
            return ([[1.0 / c[0][0], 0.0, 0.0], [0.0; 3], [0.0; 3]], self);
        }
        // the normal row has no tangents in it
        let normal = 1.0 / c[0][0];
        let tangents = 1.0 / (c[1][1] * c[2][2] - c[1][2] * c[2][1]);
        let [xx, xy, yx, yy] = [c[2][2], -c[1][2], -c[2][1], c[1][1]].map(|entry| entry * tangents);
        let column = [-normal * (xx * c[1][0] + xy * c[2][0]), -normal * (yx * c[1][0] + yy * c[2][0])];
        ([[normal, 0.0, 0.0], [column[0], xx, xy], [column[1], yx, yy]], self)
    }
}

#[inline(always)]
fn product(a: &M3, b: &M3) -> M3 {
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
}

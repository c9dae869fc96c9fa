//! Semismooth Newton with a proximal term: the last digits, from a start that is near.
//!
//! ```text
//! outer   find u:  F(u) = u − Y·Π(λ − ρ·(w + s)) = 0,   w = c + Yᵀu,  s = μ·|w_t|·n        λ ← Π(…)
//! inner   (1 + Σ Y·(ρ·Π'·(1 + s'))·Yᵀ)·δu = F,   u ← u − α·δu                            ρ = a/d
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `Π`, `Π'` | projection onto the set of a block, and its derivative |
//! | `s` | shift of De Saxcé, with which Coulomb's law is complementarity on the cone |
//! | `d` | mean diagonal of the block of `K` |
//! | `a` | grows tenfold if an outer step leaves more than a tenth of the error |
//!
//! The outer iteration is the method of multipliers: its error falls by about `1/a` per step, and
//! of redundant multipliers it keeps the nearest to those at the start. With the right choice of
//! open, stick and slide an inner step is exact. Sources: Alart and Curnier, *A mixed formulation
//! for frictional contact problems prone to Newton like solution methods*, 1991; De Saxcé and Feng,
//! *The bipotential method*, 1998.

use super::cone::{M3, V3, length, project};
use super::island::{Island, Kind, LocalBlock};
use super::{System, Tolerance};

/// `a` of the first outer step, its growth and its bound.
const PENALTY: (f64, f64, f64) = (1e3, 10.0, 1e9);
/// Maximum number of outer steps, and of inner steps in one.
const STEPS: (u32, u32) = (30, 25);
/// An inner iteration ends at this fraction of the last error.
const INNER: f64 = 0.002;
/// Number of halvings of a step that looks for a smaller `F`, and for a smaller potential.
const HALVINGS: (u32, u32) = (8, 20);
/// Number of inner steps that may fail to make `F` smaller.
const FAILURES: u32 = 3;
/// An expensive step must reduce `F`, and an outer step the error, to this fraction.
const PROGRESS: f64 = 0.5;
/// An outer step that multiplies the error by more has diverged; the next starts again with a smaller
/// penalty.
const DIVERGED: f64 = 10.0;
/// Number of outer steps that may diverge.
const DIVERGENCES: u32 = 2;
/// Speed below which the direction of sliding has no meaning, relative to the fastest row.
const STILL: f64 = 1e-14;

/// Improves `lambda`, whose error is `error`, with at most `factors` factorizations; expensive ones
/// end as soon as they gain little. Returns the error of the best multipliers found, which it leaves
/// in `lambda`, and the number of factorizations.
pub(super) fn solve(
    system: &mut System,
    lambda: &mut [f64],
    mut error: f64,
    tolerance: Tolerance,
    (factors, cheap): (u32, bool),
) -> (f64, u32) {
    let mut p = Proximal::new(system, lambda);
    let (mut taken, mut last, mut diverged) = (0, error, 0);
    for _ in 0..STEPS.0 {
        if error <= tolerance.goal || taken >= factors {
            break;
        }
        taken += p.inner(INNER * last, factors - taken, cheap);
        let reached = p.accept();
        let slow = reached.is_nan() || reached > 0.1 * error;
        if reached < error {
            error = reached;
            lambda.copy_from_slice(&p.center);
        } else if reached.is_nan() || reached > DIVERGED * error {
            diverged += 1;
            if diverged > DIVERGENCES {
                break;
            }
            p.restart(lambda);
            p.penalty = (p.penalty / PENALTY.1).max(PENALTY.0);
            continue;
        }
        if slow && error <= tolerance.solved || !cheap && reached > PROGRESS * last {
            break;
        }
        if reached.is_nan() || reached > 0.1 * last {
            p.raise_penalty();
        }
        last = reached;
    }
    (error, taken)
}

pub(super) struct Proximal<'s, 'a> {
    pub system: &'s mut System<'a>,
    pub penalty: f64,
    /// The shifts of all blocks, if they are held.
    pub held_shift: Option<Vec<f64>>,
    u: Vec<f64>,
    /// The proximal center `λ`.
    pub center: Vec<f64>,
    /// `Π(…)` at the last `u` that was tried.
    projected: Vec<f64>,
    /// `F` there.
    f: Vec<f64>,
    /// With a held shift the convex function of `u` whose gradient is `F`; else NaN.
    potential: f64,
    /// `ρ·Π'·(1 + s')` of each block.
    gains: Vec<M3>,
    /// Square root of the largest diagonal of `K`.
    largest: f64,
}

impl<'s, 'a> Proximal<'s, 'a> {
    pub fn new(system: &'s mut System<'a>, lambda: &[f64]) -> Proximal<'s, 'a> {
        let island = &system.island;
        let largest = island.blocks.iter().fold(0.0, |d: f64, b| d.max(b.diagonal)).sqrt();
        let mut u = Vec::new();
        island.apply(lambda, &mut u);
        let (center, projected) = (lambda.to_vec(), lambda.to_vec());
        Proximal {
            system,
            penalty: PENALTY.0,
            held_shift: None,
            u,
            center,
            projected,
            f: Vec::new(),
            potential: f64::NAN,
            gains: Vec::new(),
            largest,
        }
    }

    /// Makes the projection the center. Returns its error.
    pub fn accept(&mut self) -> f64 {
        std::mem::swap(&mut self.center, &mut self.projected);
        self.system.island.apply(&self.center, &mut self.u);
        self.system.island.error(&self.u, &self.center)
    }

    /// Makes `lambda` the center.
    pub fn restart(&mut self, lambda: &[f64]) {
        self.center.copy_from_slice(lambda);
        self.system.island.apply(&self.center, &mut self.u);
    }

    pub fn raise_penalty(&mut self) {
        self.penalty = (self.penalty * PENALTY.1).min(PENALTY.2);
    }

    /// Holds the shifts that the center has.
    pub fn hold_shift(&mut self) {
        let island = &self.system.island;
        let shift = |b: &LocalBlock| match b.kind {
            Kind::Cone { mu } => {
                let w = free(island, b, &self.u);
                mu * length(w[1], w[2])
            }
            _ => 0.0,
        };
        self.held_shift = Some(island.blocks.iter().map(shift).collect());
    }

    /// Solves `F(u) = 0` to row velocities of about `tolerance`. Returns the number of
    /// factorizations.
    pub fn inner(&mut self, tolerance: f64, factors: u32, cheap: bool) -> u32 {
        let (mut taken, mut failures, mut tried, mut work) = (0, 0, Vec::new(), Vec::new());
        let mut size = self.evaluate::<true>();
        while taken < factors.min(STEPS.1) && size * self.largest > tolerance {
            let System { island, structure, factor, .. } = &mut *self.system;
            if !factor.factor(structure, island, &self.gains) {
                break;
            }
            taken += 1;
            let mut step = self.f.clone();
            factor.solve(structure, island, &mut step, &mut work);
            tried.clone_from(&self.u);
            let potential = self.potential;
            let lengths = |count: u32| (0..count).map(|k| 0.5_f64.powi(k as i32));
            let mut size_at = |t: f64| {
                self.u.iter_mut().zip(tried.iter().zip(&step)).for_each(|(u, (from, s))| *u = from - t * s);
                (self.evaluate::<false>(), self.potential)
            };
            let mut shorter = lengths(HALVINGS.0).find(|&t| size_at(t).0 < (1.0 - 1e-4 * t) * size);
            if shorter.is_none() && potential.is_finite() {
                shorter = lengths(HALVINGS.1).find(|&t| size_at(t).1 < potential);
            }
            if shorter.is_none() {
                self.u.iter_mut().zip(tried.iter().zip(&step)).for_each(|(u, (from, s))| *u = from - s);
                failures += 1;
            }
            let before = std::mem::replace(&mut size, self.evaluate::<true>());
            if failures > FAILURES || size.is_nan() || !cheap && size > PROGRESS * before {
                break;
            }
        }
        taken
    }

    /// Writes `Π(…)`, `F`, the potential and, if asked for, the gains at `u`; returns the size of `F`.
    fn evaluate<const GAINS: bool>(&mut self) -> f64 {
        let island = &self.system.island;
        let still = STILL * island.fastest;
        self.gains.clear();
        self.f.clone_from(&self.u);
        let mut potential = if self.held_shift.is_some() { 0.5 * square(&self.u) } else { f64::NAN };
        for (i, b) in island.blocks.iter().enumerate() {
            let held = self.held_shift.as_ref().map(|shift| shift[i]);
            let w = free(island, b, &self.u);
            let (next, gain) = trial(b, &self.center[b.range()], self.penalty, (w, held), still);
            self.projected[b.range()].copy_from_slice(&next[..b.rows]);
            island.push(b, &next.map(|x| -x)[..b.rows], &mut self.f);
            if GAINS {
                self.gains.push(gain);
            }
            if held.is_some() {
                potential += potential_of(b, &self.center[b.range()], self.penalty, w, next);
            }
        }
        self.potential = potential;
        square(&self.f).sqrt()
    }
}

fn square(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// Returns the share of a block in the potential, `max over y of −yᵀ(w + s) − |y − λ|²/2ρ − ½R·y²`, at
/// which `y` is `next`. That of a cone is without `|λ|²/2ρ`.
fn potential_of(b: &LocalBlock, lambda: &[f64], penalty: f64, w: V3, next: V3) -> f64 {
    let rho = penalty / b.diagonal;
    match b.kind {
        Kind::Held => -lambda[0] * w[0],
        Kind::Cone { .. } => square(&next) / (2.0 * rho),
        _ => -next[0] * w[0] - (next[0] - lambda[0]).powi(2) / (2.0 * rho) - 0.5 * b.compliance * next[0] * next[0],
    }
}

/// Returns `c + Yᵀu` of a block.
#[inline(always)]
fn free(island: &Island, b: &LocalBlock, u: &[f64]) -> V3 {
    let mut w = island.velocity(b, u);
    w.iter_mut().zip(&island.c[b.range()]).for_each(|(w, c)| *w += c);
    w
}

/// Returns `Π(λ − ρ·(w + s))` of one block and `ρ·Π'·(1 + s')`, with `w` without compliance: a soft
/// row divides by `1 + ρ·R`. A shift that is held has no derivative.
#[inline(always)]
fn trial(b: &LocalBlock, lambda: &[f64], penalty: f64, (w, held): (V3, Option<f64>), still: f64) -> (V3, M3) {
    let rho = penalty / b.diagonal;
    let mut gain = [[0.0; 3]; 3];
    let mut scalar = |lo: f64, hi: f64| {
        let soft = 1.0 + rho * b.compliance;
        let moved = (lambda[0] - rho * w[0]) / soft;
        if moved > lo && moved < hi {
            gain[0][0] = rho / soft;
        }
        [moved.max(lo).min(hi), 0.0, 0.0]
    };
    let next = match b.kind {
        Kind::Held => [lambda[0], 0.0, 0.0],
        Kind::Equality => scalar(f64::NEG_INFINITY, f64::INFINITY),
        Kind::HalfLine => scalar(0.0, f64::INFINITY),
        Kind::Interval { lo, hi } => scalar(lo, hi),
        Kind::Cone { mu } => {
            let speed = length(w[1], w[2]);
            let shift = held.unwrap_or(mu * speed);
            let moved = [lambda[0] - rho * (w[0] + shift), lambda[1] - rho * w[1], lambda[2] - rho * w[2]];
            let (onto, derivative) = project(moved, mu);
            let turn = if held.is_some() { 0.0 } else { mu / length(speed, still).max(f64::MIN_POSITIVE) };
            for (gain, d) in gain.iter_mut().zip(&derivative) {
                *gain = [d[0], d[1] + d[0] * turn * w[1], d[2] + d[0] * turn * w[2]].map(|x| rho * x);
            }
            onto
        }
    };
    (next, gain)
}

//! Interior point method for Coulomb friction: from any start to about six digits in about ten
//! factorizations, whatever the size of the island and however redundant its contacts.
//!
//! A contact is a pair of points in the second-order cone. With `T = diag(1/μ, 1, 1)`:
//!
//! ```text
//! λ = T·l,   z = T·w + |w_t|·e,   w = c + Yᵀu + R·λ,   u = Y·λ,   l∘z = 0,   l, z in the cone
//! ```
//!
//! The shift `|w_t|·e` (De Saxcé) makes this Coulomb's law and not its convex relaxation. Each
//! iteration linearizes all of it, the shift included, and aims at `l∘z = σ·m·e`, with `m` the mean
//! of `l·z`, first with `σ = 0` (predictor), then with the `σ` and the second-order term that this
//! step suggests (corrector; Mehrotra 1992):
//!
//! ```text
//! W·δl + W⁻¹·δz = q          v∘q = σ·m·e − v∘v − (W·δl)∘(W⁻¹·δz)          v = W·l = W⁻¹·z
//! δz = D·Yᵀδu − r_z          D = T + e·(w_t/|w_t|)ᵀ
//! δλ = a − G·Yᵀδu            a = T·(W⁻¹q + W⁻²r_z),   G = T·W⁻²·D
//! (1 + Σ Y·G·Yᵀ)·δu = Σ Y·a − r_u
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `l`, `z` | scaled multiplier and its complement, both inside the cone |
//! | `W` | scaling of Nesterov and Todd, of each contact (`cone.rs`) |
//! | `r_u`, `r_z` | `u − Yλ` and `z − (T·w + |w_t|·e)`: errors that a full step removes |
//!
//! A half-line is the same in one dimension. An interval has a `z ≥ 0` for each of its bounds, `w =
//! z_lo − z_hi`. An equality takes `δλ = −(w + Yᵀδu)/(R + ε)`; the small `ε` keeps redundant rows
//! regular and its error goes with the iterations.
//!
//! Without the shift `D = T`, and what is solved is convex: from any start the iteration ends in the one `u` that there is. If
//! nothing slides there, as in a house of cards, the shift is 0, so it is Coulomb's solution too.
//!
//! Multipliers of redundant contacts end in the middle of what is possible, so four equal corners of
//! a box carry equal loads. Source of the shift within the iteration: Acary, Brémond and Huber, *On
//! solving contact problems with Coulomb friction*, 2018; of the scaling: `cone.rs`.

use super::System;
use super::cone::{M3, Scaling, V3, divide, dot, largest_step, length, product, times};
use super::island::{Island, Kind, LocalBlock};

/// Maximum number of iterations, and the number after which [`super::ENOUGH`] is enough.
const ITERATIONS: (u32, u32) = (40, 15);
/// Maximum number of iterations of the convex problem.
const CONVEX: u32 = 25;
/// Number of iterations that must lower the error, or the mean of `l·z`, and by which factor: of cheap
/// factorizations, and of expensive ones, where the method converges fast or not at all.
const PROGRESS: [(usize, f64); 2] = [(5, 0.8), (2, 0.03)];
/// Number of iterations before progress is judged.
const FIRST: usize = 3;
/// Multipliers at the start, relative to what stops one object and to the root of the number of
/// objects: the loads of a tower add up, and larger multipliers are found sooner from above.
const LOAD: f64 = 3.0;
/// Fraction of the way to the boundary of the cones.
const TO_BOUNDARY: f64 = 0.99;
/// `ε` as a fraction of a block's diagonal of `K`.
const REGULAR: f64 = 1e-9;
/// A step shorter than this is replaced by one towards the middle of the cones, if that is longer.
const SHORT: f64 = 0.3;
/// `σ` of such steps, the first that is long enough.
const CENTERING: [f64; 2] = [0.5, 1.0];
/// Sliding speed below which the shift is smoothed, relative to the fastest row.
const STILL: f64 = 1e-8;

/// The variables of a block besides `u`.
#[derive(Clone, Copy, Default)]
struct Point {
    /// Scaled multiplier of a cone; else the multiplier.
    l: V3,
    /// Complement; of an interval those of its lower and its upper bound.
    z: V3,
}

/// The linearization of a block at a point: `δλ = a − G·Yᵀδu`.
#[derive(Clone, Copy, Default)]
struct Linear {
    scaling: Scaling,
    response: M3,
    gain: M3,
    /// `D` without `T`: direction of sliding.
    slide: [f64; 2],
    /// `r_z`; of an equality its row velocity.
    rest: V3,
    epsilon: f64,
}

fn epsilon_of(b: &LocalBlock) -> f64 {
    REGULAR * b.diagonal
}

/// Writes multipliers into `lambda`, with at most `most` factorizations. Returns their error and the
/// number of factorizations.
pub(super) fn solve(
    system: &mut System,
    lambda: &mut [f64],
    tolerances: (f64, f64),
    cheap: bool,
    most: u32,
) -> (f64, u32) {
    run(system, lambda, false, tolerances, cheap, most)
}

/// As [`solve`], of the convex problem without the shift. The error is that of Coulomb's law all the same.
pub(super) fn solve_convex(system: &mut System, lambda: &mut [f64], tolerance: f64, most: u32) -> (f64, u32) {
    run(system, lambda, true, (tolerance, 0.0), true, most.min(CONVEX))
}

/// Iterates from the middle of the cones, without the shift if `convex`.
fn run(
    system: &mut System,
    lambda: &mut [f64],
    convex: bool,
    (tolerance, enough): (f64, f64),
    cheap: bool,
    most: u32,
) -> (f64, u32) {
    let (mut best, mut taken, mut history) = (f64::INFINITY, 0, Vec::new());
    let mut state = Interior::new(&system.island);
    state.convex = convex;
    loop {
        let error = state.linearize(&system.island);
        let (span, progress) = PROGRESS[usize::from(!cheap)];
        let slow = |before: &(f64, f64)| error > progress * before.0 && state.mean > progress * before.1;
        let stalled = history.len() >= FIRST.max(span) && slow(&history[history.len() - span]);
        let (e, m) = history.last().copied().unwrap_or((f64::INFINITY, f64::INFINITY));
        history.push((error.min(e), state.mean.min(m)));
        if error < best {
            best = error;
            lambda.copy_from_slice(&state.lambda);
        }
        let finished = best <= tolerance || taken >= ITERATIONS.1 && best <= enough;
        if finished || stalled || taken == ITERATIONS.0.min(most) || error.is_nan() {
            return (best, taken);
        }
        let System { island, structure, factor } = &mut *system;
        if !factor.factor(structure, island, &state.gains) {
            return (best, taken);
        }
        taken += 1;
        state.step(island, |rhs, work| factor.solve(structure, island, rhs, work));
    }
}

struct Interior {
    u: Vec<f64>,
    lambda: Vec<f64>,
    points: Vec<Point>,
    linear: Vec<Linear>,
    gains: Vec<M3>,
    /// `r_u`.
    rest: Vec<f64>,
    /// Whether the shift is left out.
    convex: bool,
    /// Mean of `l·z`.
    mean: f64,
    /// Number of complementarity conditions.
    conditions: f64,
    work: Vec<f64>,
    applied: Vec<f64>,
}

/// Change of a block in a step.
#[derive(Clone, Copy, Default)]
struct Change {
    lambda: V3,
    l: V3,
    z: V3,
}

impl Interior {
    /// Starts well inside all cones.
    fn new(island: &Island) -> Interior {
        let speed = island.fastest.max(f64::MIN_POSITIVE);
        let live = || island.blocks.iter().filter(|b| b.kind != Kind::Held);
        let diagonal = live().map(|b| b.diagonal).sum::<f64>() / live().count().max(1) as f64;
        let impulse = LOAD * (island.objects.len() as f64).sqrt() * speed / diagonal.max(f64::MIN_POSITIVE);
        let start = |b: &LocalBlock| match b.kind {
            Kind::Held | Kind::Equality => Point::default(),
            Kind::HalfLine | Kind::Cone { .. } => {
                // open rows start open, with the same product
                let z = speed.max(island.c[b.row]);
                Point { l: [impulse * speed / z, 0.0, 0.0], z: [z, 0.0, 0.0] }
            }
            Kind::Interval { lo, hi } => {
                let middle = match (lo.is_finite(), hi.is_finite()) {
                    (true, true) => 0.5 * (lo + hi),
                    (true, false) => lo + impulse,
                    _ => hi - impulse,
                };
                let z = [lo, hi].map(|bound| if bound.is_finite() { speed } else { 0.0 });
                Point { l: [middle, 0.0, 0.0], z: [z[0], z[1], 0.0] }
            }
        };
        let conditions = |b: &LocalBlock| match b.kind {
            Kind::Held | Kind::Equality => 0.0,
            Kind::HalfLine | Kind::Cone { .. } => 1.0,
            Kind::Interval { lo, hi } => lo.is_finite() as u32 as f64 + hi.is_finite() as u32 as f64,
        };
        Interior {
            u: vec![0.0; island.dof],
            lambda: vec![0.0; island.c.len()],
            points: island.blocks.iter().map(start).collect(),
            linear: vec![Linear::default(); island.blocks.len()],
            gains: vec![[[0.0; 3]; 3]; island.blocks.len()],
            rest: Vec::new(),
            convex: false,
            mean: 0.0,
            conditions: live().map(conditions).sum::<f64>().max(1.0),
            work: Vec::new(),
            applied: Vec::new(),
        }
    }

    /// Linearizes all blocks. Returns the error of the present multipliers.
    fn linearize(&mut self, island: &Island) -> f64 {
        for (b, point) in island.blocks.iter().zip(&self.points) {
            let lambda = &mut self.lambda[b.range()];
            match b.kind {
                Kind::Cone { mu } => lambda.copy_from_slice(&[point.l[0] / mu, point.l[1], point.l[2]]),
                _ => lambda[0] = point.l[0],
            }
        }
        island.apply(&self.lambda, &mut self.applied);
        self.rest.clear();
        self.rest.extend(self.u.iter().zip(&self.applied).map(|(u, y)| u - y));
        let still = STILL * island.fastest;
        let mut sum = 0.0;
        for (i, b) in island.blocks.iter().enumerate() {
            let w = island.row_velocity(b, &self.u, &self.lambda);
            sum += complementarity(b, &self.points[i]);
            self.linear[i] = Linear::new(b, &self.points[i], w, still, self.convex);
            self.gains[i] = self.linear[i].gain;
        }
        self.mean = sum / self.conditions;
        island.error(&self.applied, &self.lambda)
    }

    /// Takes a step by predictor and corrector.
    fn step(&mut self, island: &Island, mut solve: impl FnMut(&mut [f64], &mut Vec<f64>)) {
        let none = vec![Change::default(); self.points.len()];
        let (_, affine) = self.direction(island, 0.0, &none, &mut solve);
        let reach = self.reach(island, &affine).min(1.0);
        let ahead = |(b, (point, change)): (&LocalBlock, (&Point, &Change))| {
            let add = |x: V3, d: V3| [0, 1, 2].map(|k| x[k] + reach * d[k]);
            complementarity(b, &Point { l: add(point.l, change.l), z: add(point.z, change.z) })
        };
        let expected: f64 = island.blocks.iter().zip(self.points.iter().zip(&affine)).map(ahead).sum();
        let left = (expected / self.conditions / self.mean).clamp(0.0, 1.0);
        let aim = if left.is_nan() { 0.0 } else { left.powi(3) * self.mean };
        let (mut du, mut changes) = self.direction(island, aim, &affine, &mut solve);
        let mut share = (TO_BOUNDARY * self.reach(island, &changes)).min(1.0);
        for aim in CENTERING {
            if share >= SHORT {
                break;
            }
            let central = self.direction(island, aim * self.mean, &none, &mut solve);
            let reach = (TO_BOUNDARY * self.reach(island, &central.1)).min(1.0);
            if reach > share {
                (share, (du, changes)) = (reach, central);
            }
        }
        self.u.iter_mut().zip(&du).for_each(|(u, d)| *u += share * d);
        for (point, change) in self.points.iter_mut().zip(&changes) {
            for k in 0..3 {
                point.l[k] += share * change.l[k];
                point.z[k] += share * change.z[k];
            }
        }
    }

    /// Returns the step that aims at `l∘z = aim·e`, with the second-order term of `affine`.
    fn direction(
        &mut self,
        island: &Island,
        aim: f64,
        affine: &[Change],
        solve: &mut impl FnMut(&mut [f64], &mut Vec<f64>),
    ) -> (Vec<f64>, Vec<Change>) {
        let mut du: Vec<f64> = self.rest.iter().map(|r| -r).collect();
        let mut changes = Vec::with_capacity(island.blocks.len());
        for (i, b) in island.blocks.iter().enumerate() {
            let free = self.linear[i].free_change(b, &self.points[i], aim, &affine[i]);
            island.push(b, &free[..b.rows], &mut du);
            changes.push(Change { lambda: free, ..Change::default() });
        }
        solve(&mut du, &mut self.work);
        for (i, b) in island.blocks.iter().enumerate() {
            let v = island.velocity(b, &du);
            self.linear[i].complete(b, &self.points[i], aim, &affine[i], v, &mut changes[i]);
        }
        (du, changes)
    }

    /// Returns how far all points stay in their cones.
    fn reach(&self, island: &Island, changes: &[Change]) -> f64 {
        let line = |x: f64, d: f64| if d < 0.0 { -x / d } else { f64::INFINITY };
        let reach = |(b, (p, d)): (&LocalBlock, (&Point, &Change))| match b.kind {
            Kind::Held | Kind::Equality => f64::INFINITY,
            Kind::HalfLine => line(p.l[0], d.l[0]).min(line(p.z[0], d.z[0])),
            Kind::Cone { .. } => largest_step(p.l, d.l).min(largest_step(p.z, d.z)),
            Kind::Interval { lo, hi } => {
                let bounds = line(p.l[0] - lo, d.l[0]).min(line(hi - p.l[0], -d.l[0]));
                bounds.min(line(p.z[0], d.z[0])).min(line(p.z[1], d.z[1]))
            }
        };
        island.blocks.iter().zip(self.points.iter().zip(changes)).map(reach).fold(f64::INFINITY, f64::min)
    }
}

/// Returns `l·z` of a block; of an interval the sum over its bounds.
fn complementarity(b: &LocalBlock, p: &Point) -> f64 {
    match b.kind {
        Kind::Held | Kind::Equality => 0.0,
        Kind::HalfLine | Kind::Cone { .. } => dot(p.l, p.z),
        Kind::Interval { lo, hi } => {
            let part = |distance: f64, z: f64| if distance.is_finite() { distance * z } else { 0.0 };
            part(p.l[0] - lo, p.z[0]) + part(hi - p.l[0], p.z[1])
        }
    }
}

/// Distances of the multiplier from its finite bounds, with their `z`; the sign of `δλ` in each.
fn bounds(b: &LocalBlock, p: &Point) -> impl Iterator<Item = (usize, f64, f64, f64)> {
    let Kind::Interval { lo, hi } = b.kind else { return [None, None].into_iter().flatten() };
    let at = |k: usize, distance: f64, sign: f64| distance.is_finite().then_some((k, distance, p.z[k], sign));
    [at(0, p.l[0] - lo, 1.0), at(1, hi - p.l[0], -1.0)].into_iter().flatten()
}

impl Linear {
    fn new(b: &LocalBlock, p: &Point, w: V3, still: f64, convex: bool) -> Linear {
        let mut linear = Linear { epsilon: epsilon_of(b), ..Linear::default() };
        let epsilon = linear.epsilon;
        match b.kind {
            Kind::Held => {}
            Kind::Equality => {
                linear.rest[0] = w[0];
                linear.gain[0][0] = 1.0 / (b.compliance + epsilon);
            }
            Kind::HalfLine => {
                linear.rest[0] = p.z[0] - w[0];
                linear.gain[0][0] = 1.0 / (p.z[0] / p.l[0] + b.compliance + epsilon);
            }
            Kind::Interval { .. } => {
                linear.rest[0] = p.z[0] - p.z[1] - w[0];
                let stiffness: f64 = bounds(b, p).map(|(_, distance, z, _)| z / distance).sum();
                linear.gain[0][0] = 1.0 / (b.compliance + epsilon + stiffness);
            }
            Kind::Cone { mu } => {
                let speed = length(w[1], w[2]);
                let soft = length(speed, still).max(f64::MIN_POSITIVE);
                if !convex {
                    linear.slide = [w[1] / soft, w[2] / soft];
                }
                let shift = if convex { 0.0 } else { speed };
                linear.rest = [p.z[0] - (w[0] / mu + shift), p.z[1] - w[1], p.z[2] - w[2]];
                linear.scaling = Scaling::new(p.l, p.z);
                linear.response = linear.scaling.regular_inverse(epsilon);
                let g = &linear.response;
                for (k, row) in linear.gain.iter_mut().enumerate() {
                    let turned =
                        [g[k][0] / mu, g[k][1] + g[k][0] * linear.slide[0], g[k][2] + g[k][0] * linear.slide[1]];
                    *row = if k == 0 { turned.map(|x| x / mu) } else { turned };
                }
            }
        }
        linear
    }

    /// Returns `a`: the change of the multiplier if no velocity changes.
    fn free_change(&self, b: &LocalBlock, p: &Point, aim: f64, affine: &Change) -> V3 {
        match b.kind {
            Kind::Held => [0.0; 3],
            Kind::Equality => [-self.rest[0] * self.gain[0][0], 0.0, 0.0],
            Kind::HalfLine => {
                let target = (aim - affine.l[0] * affine.z[0]) / p.l[0] - p.z[0];
                [(target + self.rest[0]) * self.gain[0][0], 0.0, 0.0]
            }
            Kind::Interval { .. } => {
                let target: f64 = bounds(b, p)
                    .map(|(k, distance, z, sign)| sign * ((aim - sign * affine.l[0] * affine.z[k]) / distance - z))
                    .sum();
                [(target + self.rest[0]) * self.gain[0][0], 0.0, 0.0]
            }
            Kind::Cone { mu } => {
                let scaled = times(&self.scaling.w, self.target(aim, affine));
                let [n, x, y] = times(&self.response, [0, 1, 2].map(|k| scaled[k] + self.rest[k]));
                [n / mu, x, y]
            }
        }
    }

    /// Returns `q` of a cone.
    fn target(&self, aim: f64, affine: &Change) -> V3 {
        let s = &self.scaling;
        let (square, second) = (product(s.v, s.v), product(times(&s.w, affine.l), times(&s.inverse, affine.z)));
        divide(s.v, [0, 1, 2].map(|k| if k == 0 { aim } else { 0.0 } - square[k] - second[k]))
    }

    /// Completes the change of a block for the change `v = Yᵀδu`.
    fn complete(&self, b: &LocalBlock, p: &Point, aim: f64, affine: &Change, v: V3, change: &mut Change) {
        let reaction = times(&self.gain, v);
        (0..3).for_each(|k| change.lambda[k] -= reaction[k]);
        match b.kind {
            Kind::Held => *change = Change::default(),
            Kind::Equality => change.l[0] = change.lambda[0],
            Kind::HalfLine => {
                change.l[0] = change.lambda[0];
                change.z[0] = v[0] + (b.compliance + self.epsilon) * change.l[0] - self.rest[0];
            }
            Kind::Interval { .. } => {
                change.l[0] = change.lambda[0];
                for (k, distance, z, sign) in bounds(b, p) {
                    change.z[k] = (aim - sign * affine.l[0] * affine.z[k] - sign * z * change.l[0]) / distance - z;
                }
            }
            Kind::Cone { mu } => {
                change.l = [change.lambda[0] * mu, change.lambda[1], change.lambda[2]];
                let turned = [v[0] / mu + self.slide[0] * v[1] + self.slide[1] * v[2], v[1], v[2]];
                change.z = [0, 1, 2].map(|k| turned[k] + self.epsilon * change.l[k] - self.rest[k]);
            }
        }
    }
}

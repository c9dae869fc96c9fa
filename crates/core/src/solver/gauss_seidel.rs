//! Block Gauss–Seidel on the friction cone.
//!
//! For each block in turn, with everything else held: `w = c + Yᵀ(Yλ)`, then
//!
//! - equality, half-line, interval: `λ ← clamp(λ − w/k)` with `k` the row's diagonal of `K`;
//! - contact: its own three-row problem with `b = w − K·λ`, exactly: open (`b_n ≥ 0`, `λ = 0`), else sticking (`λ = −K⁻¹b` where that
//!   lies in the cone), else sliding along `d`: `λ_t = −μ·λ_n·d` with `w_t` along `d` and `w_n = 0`.
//!
//! Its fixed points are the exact Coulomb solutions: `λ_n ⟂ w_n` without the dilation that a convex cone brings, and
//! friction against the sliding velocity.
//!
//! Between sweeps the iterate is extrapolated, `y = λ_k + β_k(λ_k − λ_{k−1})`, with Nesterov's weights `β_k = (θ_k − 1)/θ_{k+1}`,
//! `θ_{k+1} = ½(1 + √(1 + 4θ_k²))`, and a restart whenever the sweep goes against the last move, `(y − λ_{k+1})·(λ_{k+1} − λ_k) > 0`
//! (O'Donoghue and Candès, *Adaptive restart for accelerated gradient schemes*, 2015). Plain sweeps carry a load down a stack one
//! body at a time; a tower of ten boxes wants thousands of them and this about a hundred. With friction the problem is not convex and the
//! extrapolation can go in circles, so after [`ACCELERATED`] sweeps it is plain. High mass ratios stay slow; the residual says how far.

use super::{Accuracy, Outcome, RowSolver};
use crate::rows::{Block, RowSet, Rows, Side};

/// Steps of Newton's method on the sliding direction.
const SLIDE_STEPS: u32 = 12;
/// Sweeps with extrapolation between them.
const ACCELERATED: u32 = 200;

/// The block Gauss–Seidel solver, `gauss_seidel`.
#[derive(Clone, Copy, Debug, Default)]
pub struct GaussSeidel;

impl RowSolver for GaussSeidel {
    fn name(&self) -> &'static str {
        "gauss_seidel"
    }

    fn solve(&self, rows: &Rows, blocks: &[u32], c: &[f64], lambda: &mut [f64], du: &mut [f64], accuracy: Accuracy) -> Outcome {
        let mut locals: Vec<Local> = blocks.iter().map(|&b| Local::new(rows, &rows.blocks[b as usize])).collect();
        for local in &mut locals {
            local.warm_start(rows, lambda, du);
        }
        let sweeps = accuracy.sweeps_of(blocks.len());
        let mut momentum = Momentum::new(&locals, du);
        for sweep in 1..=sweeps {
            let mut against = 0.0;
            let mut change = 0.0f64;
            for local in &mut locals {
                change = change.max(local.relax(rows, c, lambda, du, &mut against));
            }
            if change <= accuracy.tolerance {
                return Outcome { iterations: sweep, converged: true, ray: false };
            }
            if sweep < sweeps.min(ACCELERATED) {
                momentum.extrapolate(&mut locals, against > 0.0, lambda, du);
            }
        }
        Outcome { iterations: sweeps, converged: false, ray: false }
    }

    fn fork(&self) -> Box<dyn RowSolver> {
        Box::new(*self)
    }
}

/// A block with what its own diagonal block of `K` gives, and its multipliers of the sweep before.
struct Local {
    block: Block,
    step: Step,
    last: [f64; 3],
}

/// The extrapolation between sweeps, over the multipliers of the island and the stretches of `du` that they act on.
struct Momentum {
    theta: f64,
    /// First index and length of each object's stretch, and where its last value is kept.
    stretches: Vec<(u32, u32)>,
    last: Vec<f64>,
}

impl Momentum {
    fn new(locals: &[Local], du: &[f64]) -> Momentum {
        let mut stretches: Vec<(u32, u32)> = locals.iter().flat_map(|l| l.block.sides()).map(|s| (s.u, s.dof)).collect();
        stretches.sort_unstable();
        stretches.dedup();
        let last = stretches.iter().flat_map(|&(u, dof)| &du[u as usize..(u + dof) as usize]).copied().collect();
        Momentum { theta: 1.0, stretches, last }
    }

    fn extrapolate(&mut self, locals: &mut [Local], restart: bool, lambda: &mut [f64], du: &mut [f64]) {
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.theta * self.theta).sqrt());
        let beta = if restart { 0.0 } else { (self.theta - 1.0) / next };
        self.theta = if restart { 1.0 } else { next };
        for local in locals {
            for (row, last) in local.block.range().zip(&mut local.last) {
                let now = lambda[row];
                lambda[row] += beta * (now - *last);
                *last = now;
            }
        }
        let mut last = self.last.iter_mut();
        for &(u, dof) in &self.stretches {
            for (du, last) in du[u as usize..(u + dof) as usize].iter_mut().zip(&mut last) {
                let now = *du;
                *du += beta * (now - *last);
                *last = now;
            }
        }
    }
}

enum Step {
    /// No response: no impulse.
    Dead,
    Scalar { k: f64, lo: f64, hi: f64 },
    Contact(Contact),
}

struct Contact {
    mu: f64,
    k: [[f64; 3]; 3],
    /// `K⁻¹`, absent where a direction has no response.
    inverse: Option<[[f64; 3]; 3]>,
    /// `1/λ_max(K_tt)`; 0 where no tangent has a response.
    rho: f64,
}

impl Local {
    fn new(rows: &Rows, block: &Block) -> Local {
        let diagonal = rows.coupling(block, 0, block, 0);
        let step = match block.set {
            _ if diagonal <= f64::MIN_POSITIVE => Step::Dead,
            RowSet::Equality => Step::Scalar { k: diagonal, lo: f64::NEG_INFINITY, hi: f64::INFINITY },
            RowSet::HalfLine => Step::Scalar { k: diagonal, lo: 0.0, hi: f64::INFINITY },
            RowSet::Interval { lo, hi } => Step::Scalar { k: diagonal, lo, hi },
            RowSet::Cone { mu } => Step::Contact(Contact::new(rows, block, mu)),
        };
        Local { block: *block, step, last: [0.0; 3] }
    }

    fn warm_start(&mut self, rows: &Rows, lambda: &mut [f64], du: &mut [f64]) {
        if let Step::Dead = self.step {
            lambda[self.block.range()].fill(0.0);
        } else {
            rows.apply_block(&self.block, lambda, du);
        }
        self.last[..self.block.set.rows()].copy_from_slice(&lambda[self.block.range()]);
    }

    /// Solves this block with the others held; the largest change of its own row velocities. Adds to `against` how far the change
    /// from the extrapolated multipliers goes against the move since the last sweep.
    fn relax(&mut self, rows: &Rows, c: &[f64], lambda: &mut [f64], du: &mut [f64], against: &mut f64) -> f64 {
        let i = self.block.row as usize;
        match &self.step {
            Step::Dead => 0.0,
            Step::Scalar { k, lo, hi } => {
                let w = c[i] + rows.row_velocity(&self.block, 0, du);
                // Not `clamp`, which panics where `lo > hi`.
                let next = (lambda[i] - w / k).max(*lo).min(*hi);
                let delta = next - lambda[i];
                *against -= delta * (next - self.last[0]);
                lambda[i] = next;
                for side in self.block.sides() {
                    let u = &mut du[side.u as usize..(side.u + side.dof) as usize];
                    u.iter_mut().zip(rows.response(side, 0)).for_each(|(u, y)| *u += y * delta);
                }
                (delta * k).abs()
            }
            Step::Contact(contact) => {
                let mut w = [c[i], c[i + 1], c[i + 2]];
                self.block.sides().iter().for_each(|s| add_velocity(rows, s, du, &mut w));
                let old = [lambda[i], lambda[i + 1], lambda[i + 2]];
                let next = contact.solve(old, w);
                let delta = [next[0] - old[0], next[1] - old[1], next[2] - old[2]];
                if delta == [0.0; 3] {
                    return 0.0;
                }
                *against -= (0..3).map(|r| delta[r] * (next[r] - self.last[r])).sum::<f64>();
                lambda[i..i + 3].copy_from_slice(&next);
                self.block.sides().iter().for_each(|s| add_impulse(rows, s, delta, du));
                (0..3).map(|r| (delta[r] * contact.k[r][r]).abs()).fold(0.0, f64::max)
            }
        }
    }
}

impl Contact {
    fn new(rows: &Rows, block: &Block, mu: f64) -> Contact {
        let mut k = [[0.0; 3]; 3];
        for (i, j) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
            k[i][j] = rows.coupling(block, i, block, j);
            k[j][i] = k[i][j];
        }
        let mean = 0.5 * (k[1][1] + k[2][2]);
        let half = 0.5 * (k[1][1] - k[2][2]);
        let largest = mean + (half * half + k[1][2] * k[1][2]).sqrt();
        let rho = if mu > 0.0 && largest > f64::MIN_POSITIVE { 1.0 / largest } else { 0.0 };
        Contact { mu, k, inverse: if mu > 0.0 { invert(&k) } else { None }, rho }
    }

    /// The multipliers that answer row velocities `w` found with multipliers `old`: the problem of this contact alone, with `b = w − K·old`.
    fn solve(&self, old: [f64; 3], w: [f64; 3]) -> [f64; 3] {
        let k = &self.k;
        let b: [f64; 3] = std::array::from_fn(|i| w[i] - (k[i][0] * old[0] + k[i][1] * old[1] + k[i][2] * old[2]));
        if b[0] >= 0.0 {
            return [0.0; 3];
        }
        if let Some(inverse) = &self.inverse {
            let full: [f64; 3] = std::array::from_fn(|i| -(inverse[i][0] * b[0] + inverse[i][1] * b[1] + inverse[i][2] * b[2]));
            let bound = self.mu * full[0];
            if bound >= 0.0 && full[1] * full[1] + full[2] * full[2] <= bound * bound {
                return full;
            }
        }
        self.slide(old, b).unwrap_or_else(|| self.descend(old, w))
    }

    /// Sliding: the direction `d` of `w_t` by Newton's method on its angle, from the direction of the multipliers so far or else of `b_t`.
    fn slide(&self, old: [f64; 3], b: [f64; 3]) -> Option<[f64; 3]> {
        let starts = [[-old[1], -old[2]], [b[1], b[2]], [-b[2], b[1]], [b[2], -b[1]]];
        starts.into_iter().find_map(|start| self.slide_from(unit(start)?, b))
    }

    /// `g(φ) = d × w_t = 0` with `d·w_t > 0`, where `λ_n = −b_n / r`, `r = k_nn − μ·k_nt·d`, `w_t = b_t + λ_n·(k_tn − μ·K_tt·d)`.
    /// `None` where Newton's method ends elsewhere, or `r ≤ 0`: there friction alone would press the bodies together (Painlevé).
    fn slide_from(&self, mut d: [f64; 2], b: [f64; 3]) -> Option<[f64; 3]> {
        let (k, mu) = (&self.k, self.mu);
        let row = |r: usize, v: [f64; 2]| k[r][1] * v[0] + k[r][2] * v[1];
        for _ in 0..SLIDE_STEPS {
            let across = [-d[1], d[0]];
            let resistance = k[0][0] - mu * row(0, d);
            if resistance <= 1e-6 * k[0][0] {
                return None;
            }
            let normal = -b[0] / resistance;
            let turn = normal * mu * row(0, across) / resistance;
            let pull = [1, 2].map(|r| k[r][0] - mu * row(r, d));
            let w: [f64; 2] = std::array::from_fn(|i| b[i + 1] + normal * pull[i]);
            let rate: [f64; 2] = std::array::from_fn(|i| turn * pull[i] - normal * mu * row(i + 1, across));
            let (along, g) = (d[0] * w[0] + d[1] * w[1], d[0] * w[1] - d[1] * w[0]);
            if g.abs() <= 1e-14 * (b[1].abs() + b[2].abs() + normal * k[1][1]) {
                return (along > 0.0).then_some([normal, -mu * normal * d[0], -mu * normal * d[1]]);
            }
            let slope = -along + d[0] * rate[1] - d[1] * rate[0];
            let step = (-g / slope).clamp(-1.0, 1.0);
            d = unit([d[0] + step * across[0], d[1] + step * across[1]]).filter(|_| slope != 0.0)?;
        }
        None
    }

    /// One projected step, where the contact's own problem has no sliding answer: `λ_n ← max(0, λ_n − w_n/k_nn)`, then
    /// `λ_t ← Π(λ_t − ρ·w_t)` onto the disc of radius `μ·λ_n`.
    fn descend(&self, old: [f64; 3], w: [f64; 3]) -> [f64; 3] {
        let normal = (old[0] - w[0] / self.k[0][0]).max(0.0);
        let dn = normal - old[0];
        let t = [1, 2].map(|r| old[r] - self.rho * (w[r] + self.k[r][0] * dn));
        let (size, bound) = ((t[0] * t[0] + t[1] * t[1]).sqrt(), self.mu * normal);
        let scale = if size > bound { bound / size } else { 1.0 };
        [normal, scale * t[0], scale * t[1]]
    }
}

/// `w += Yᵀu` of one side of a contact.
#[inline]
fn add_velocity(rows: &Rows, side: &Side, u: &[f64], w: &mut [f64; 3]) {
    let (d, y) = (side.dof as usize, &rows.y[side.y as usize..]);
    if let (6, Some((y, _)), Some((u, _))) = (d, y.split_first_chunk::<18>(), u[side.u as usize..].split_first_chunk::<6>()) {
        for r in 0..3 {
            let y = &y[6 * r..6 * r + 6];
            w[r] += (y[0] * u[0] + y[1] * u[1] + y[2] * u[2]) + (y[3] * u[3] + y[4] * u[4] + y[5] * u[5]);
        }
        return;
    }
    let u = &u[side.u as usize..side.u as usize + d];
    for r in 0..3 {
        w[r] += y[r * d..(r + 1) * d].iter().zip(u).map(|(y, u)| y * u).sum::<f64>();
    }
}

/// `u += Y·δ` of one side of a contact.
#[inline]
fn add_impulse(rows: &Rows, side: &Side, delta: [f64; 3], u: &mut [f64]) {
    let (d, y) = (side.dof as usize, &rows.y[side.y as usize..]);
    let u = &mut u[side.u as usize..side.u as usize + d];
    if let (6, Some((y, _))) = (d, y.split_first_chunk::<18>()) {
        for k in 0..6 {
            u[k] += y[k] * delta[0] + y[6 + k] * delta[1] + y[12 + k] * delta[2];
        }
        return;
    }
    for k in 0..d {
        u[k] += y[k] * delta[0] + y[d + k] * delta[1] + y[2 * d + k] * delta[2];
    }
}

fn unit(v: [f64; 2]) -> Option<[f64; 2]> {
    let size = (v[0] * v[0] + v[1] * v[1]).sqrt();
    (size > f64::MIN_POSITIVE).then(|| [v[0] / size, v[1] / size])
}

/// Inverse of a symmetric 3×3 matrix, `None` where it is singular to working precision.
fn invert(k: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let cofactor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        k[a][c] * k[b][d] - k[a][d] * k[b][c]
    };
    let determinant: f64 = (0..3).map(|j| k[0][j] * cofactor(0, j)).sum();
    let scale = k[0][0].max(k[1][1]).max(k[2][2]);
    (determinant > 1e-12 * scale.powi(3)).then(|| std::array::from_fn(|i| std::array::from_fn(|j| cofactor(j, i) / determinant)))
}

//! The problem of a single contact: three rows, `w = b + K·λ`.
//!
//! ```text
//! stick     −K⁻¹b in the cone                                 λ = −K⁻¹b
//! open      b_n ≥ 0                                           λ = 0
//! slide     w_n = 0, w_t along the unit direction d           λ_t = −μ·λ_n·d,  λ_n = −b_n / r,  r = k_nn − μ·k_nt·d
//! ```
//!
//! Sticking is tried first: if two solutions exist, this keeps piles from alternating between them. A robot that moves
//! in a plane has no response across it. `K` is then inverted in the plane, and the contact sticks if it is still across.
//! Sliding takes one projected step, normal first, which suffices if normal and tangents hardly
//! couple. If `μ·|k_nt|` comes near `k_nn` (a leaning rod on rough ground) that step diverges and
//! sliding is solved exactly. The direction is then the root of `g(φ) = d × w_t` with `d·w_t > 0`,
//! found by Newton's method on the angle `φ` of `d`. Both have the Coulomb solutions as their fixed
//! points.

use crate::constraint::rows::{Block, Rows, dot, dot6};

/// Fraction of `k_nn` at which `μ·|k_nt|` makes the projected step too large.
const COUPLED: f64 = 0.5;
/// A tangent has no response below this fraction of the other, and no velocity below this fraction of the free one.
const PLANE: f64 = 1e-12;
/// Maximum number of Newton steps for the sliding direction.
const SLIDE_STEPS: u32 = 12;

/// A contact with its diagonal block of `K`.
pub(super) struct ContactBlock {
    pub mu: f64,
    /// Its diagonal block of `K`.
    pub k: Symmetric3,
    /// `K⁻¹`, absent if a direction has no response.
    inverse: Option<Symmetric3>,
    /// The same of a contact that responds in a plane.
    in_plane: Option<Box<InPlane>>,
    /// `1/λ_max(K_tt)`; 0 if no tangent has a response.
    rho: f64,
    /// Whether `μ·|k_nt|` is close to `k_nn`.
    coupled: bool,
}

/// A contact of bodies that move in a plane.
struct InPlane {
    /// Inverse of `K` in the plane, 0 across it.
    inverse: Symmetric3,
    /// The tangent along the plane.
    along: [f64; 2],
}

/// A symmetric 3×3 matrix; 0 is the normal, 1 and 2 are the tangents.
#[derive(Clone, Copy, Default)]
pub(super) struct Symmetric3 {
    pub m00: f64,
    pub m10: f64,
    pub m20: f64,
    pub m11: f64,
    pub m21: f64,
    pub m22: f64,
}

impl ContactBlock {
    /// Makes the contact with the diagonal block `k` of `K`.
    pub fn new(k: Symmetric3, mu: f64) -> ContactBlock {
        let mean = 0.5 * (k.m11 + k.m22);
        let half = 0.5 * (k.m11 - k.m22);
        let largest = mean + (half * half + k.m21 * k.m21).sqrt();
        let rho = if mu > 0.0 && largest > f64::MIN_POSITIVE { 1.0 / largest } else { 0.0 };
        let coupled = mu * mu * (k.m10 * k.m10 + k.m20 * k.m20) > COUPLED * COUPLED * k.m00 * k.m00;
        let inverse = if mu > 0.0 { k.inverse() } else { None };
        let in_plane = if inverse.is_none() && rho > 0.0 { InPlane::new(&k, largest).map(Box::new) } else { None };
        ContactBlock { mu, k, inverse, in_plane, rho, coupled }
    }

    /// Returns whether a contact without multipliers stays open at normal velocity `w_n`, whatever
    /// the tangents do. If `μ·|k_nt| ≤ k_nn/2`, sticking would require `w_n ≤ −λ_n·k_nn/2`.
    #[inline(always)]
    pub fn stays_open(&self, old: [f64; 3], normal: f64) -> bool {
        normal >= 0.0 && !self.coupled && old == [0.0; 3]
    }

    /// Returns the multipliers for row velocities `w` that were found with multipliers `old` (`b =
    /// w − K·old`), and their difference from `old`.
    #[inline(always)]
    pub fn solve(&self, old: [f64; 3], w: [f64; 3]) -> ([f64; 3], [f64; 3]) {
        if let Some(inverse) = &self.inverse {
            let delta = inverse.times(w).map(|x| -x);
            let full = [old[0] + delta[0], old[1] + delta[1], old[2] + delta[2]];
            if full[0] >= 0.0 && full[1] * full[1] + full[2] * full[2] <= (self.mu * full[0]) * (self.mu * full[0]) {
                return (full, delta);
            }
        }
        let stuck = self.in_plane.as_deref().and_then(|plane| plane.stick(&self.k, old, w));
        let within = |full: &[f64; 3]| {
            full[0] >= 0.0 && full[1] * full[1] + full[2] * full[2] <= (self.mu * full[0]) * (self.mu * full[0])
        };
        let next = stuck.filter(within).unwrap_or_else(|| self.open_or_slide(old, w));
        (next, [next[0] - old[0], next[1] - old[1], next[2] - old[2]])
    }

    /// Returns the solution without sticking, the rarer case in a pile.
    #[inline(always)]
    fn open_or_slide(&self, old: [f64; 3], w: [f64; 3]) -> [f64; 3] {
        if !self.coupled {
            return self.projected_step(old, w);
        }
        let own = self.k.times(old);
        let b = [w[0] - own[0], w[1] - own[1], w[2] - own[2]];
        if b[0] >= 0.0 {
            return [0.0; 3];
        }
        self.slide(old, b).unwrap_or_else(|| self.projected_step(old, w))
    }

    /// Returns the sliding solution. The search starts from the direction of the present
    /// multipliers, from that of `b_t`, and from the directions across it.
    fn slide(&self, old: [f64; 3], b: [f64; 3]) -> Option<[f64; 3]> {
        let starts = [[-old[1], -old[2]], [b[1], b[2]], [-b[2], b[1]], [b[2], -b[1]]];
        starts.into_iter().find_map(|start| self.slide_from(unit(start)?, b))
    }

    /// Returns `None` if Newton's method ends elsewhere, or if `r ≤ 0`: friction alone would then
    /// press the bodies together (Painlevé).
    fn slide_from(&self, mut d: [f64; 2], b: [f64; 3]) -> Option<[f64; 3]> {
        let (k, mu) = (&self.k, self.mu);
        let along_normal = |v: [f64; 2]| k.m10 * v[0] + k.m20 * v[1];
        let tangents = |v: [f64; 2]| [k.m11 * v[0] + k.m21 * v[1], k.m21 * v[0] + k.m22 * v[1]];
        for _ in 0..SLIDE_STEPS {
            let across = [-d[1], d[0]];
            let resistance = k.m00 - mu * along_normal(d);
            if resistance <= 1e-6 * k.m00 {
                return None;
            }
            let normal = -b[0] / resistance;
            // dλ_n/dφ, then w_t and dw_t/dφ
            let turn = normal * mu * along_normal(across) / resistance;
            let (kd, ka) = (tangents(d), tangents(across));
            let pull = [k.m10 - mu * kd[0], k.m20 - mu * kd[1]];
            let w = [b[1] + normal * pull[0], b[2] + normal * pull[1]];
            let rate = [turn * pull[0] - normal * mu * ka[0], turn * pull[1] - normal * mu * ka[1]];
            let (along, g) = (d[0] * w[0] + d[1] * w[1], d[0] * w[1] - d[1] * w[0]);
            if g.abs() <= 1e-14 * (b[1].abs() + b[2].abs() + normal * k.m11) {
                return (along > 0.0).then_some([normal, -mu * normal * d[0], -mu * normal * d[1]]);
            }
            let slope = -along + d[0] * rate[1] - d[1] * rate[0];
            let step = (-g / slope).clamp(-1.0, 1.0);
            d = unit([d[0] + step * across[0], d[1] + step * across[1]]).filter(|_| slope != 0.0)?;
        }
        None
    }

    /// Returns one projected step: `λ_n ← max(0, λ_n − w_n/k_nn)`, then `λ_t ← Π(λ_t − ρ·w_t)` onto
    /// the disk of radius `μ·λ_n`.
    #[inline(always)]
    fn projected_step(&self, old: [f64; 3], w: [f64; 3]) -> [f64; 3] {
        let normal = (old[0] - w[0] / self.k.m00).max(0.0);
        let dn = normal - old[0];
        self.bounded([
            normal,
            old[1] - self.rho * (w[1] + self.k.m10 * dn),
            old[2] - self.rho * (w[2] + self.k.m20 * dn),
        ])
    }

    /// Returns the multipliers projected: the normal at least 0, the tangents within the disk of
    /// radius `μ` times the normal.
    #[inline(always)]
    pub fn bounded(&self, [n, t1, t2]: [f64; 3]) -> [f64; 3] {
        let n = n.max(0.0);
        let (square, bound) = (t1 * t1 + t2 * t2, self.mu * n);
        let scale = if square > bound * bound { bound / square.sqrt() } else { 1.0 };
        [n, scale * t1, scale * t2]
    }
}

impl InPlane {
    /// Returns `None` if both tangents respond, or one in the plane has no response of its own. `largest` is `λ_max(K_tt)`.
    fn new(k: &Symmetric3, largest: f64) -> Option<InPlane> {
        if k.m11 + k.m22 - largest > PLANE * largest {
            return None;
        }
        // the longer of the two columns of a matrix of rank 1
        let along = unit(if k.m11 >= k.m22 { [k.m11, k.m21] } else { [k.m21, k.m22] })?;
        let coupling = k.m10 * along[0] + k.m20 * along[1];
        let determinant = k.m00 * largest - coupling * coupling;
        if determinant <= PLANE * k.m00.max(largest).powi(2) {
            return None;
        }
        let (normal, mixed, own) = (largest / determinant, -coupling / determinant, k.m00 / determinant);
        let inverse = Symmetric3 {
            m00: normal,
            m10: mixed * along[0],
            m20: mixed * along[1],
            m11: own * along[0] * along[0],
            m21: own * along[0] * along[1],
            m22: own * along[1] * along[1],
        };
        Some(InPlane { inverse, along })
    }

    /// Returns the sticking solution, `None` if the contact moves across the plane, where nothing stops it.
    fn stick(&self, k: &Symmetric3, old: [f64; 3], w: [f64; 3]) -> Option<[f64; 3]> {
        let (own, [a, b]) = (k.times(old), self.along);
        let across = (a * w[2] - b * w[1]).abs();
        let free = (w[0] - own[0]).abs() + (a * (w[1] - own[1]) + b * (w[2] - own[2])).abs();
        if across > PLANE * free {
            return None;
        }
        // a force across the plane moves nothing
        let (delta, kept) = (self.inverse.times(w), a * old[1] + b * old[2]);
        Some([old[0] - delta[0], kept * a - delta[1], kept * b - delta[2]])
    }
}

fn unit(v: [f64; 2]) -> Option<[f64; 2]> {
    let size = (v[0] * v[0] + v[1] * v[1]).sqrt();
    (size > f64::MIN_POSITIVE).then(|| [v[0] / size, v[1] / size])
}

impl Symmetric3 {
    /// Returns the diagonal block of `K` of a block of three rows.
    pub fn own(rows: &Rows, block: &Block) -> Symmetric3 {
        let mut k = Symmetric3::default();
        for side in block.sides() {
            let dof = side.dof as usize;
            let y = &rows.y[side.y as usize..][..3 * dof];
            match y.as_chunks::<6>().0 {
                [n, t1, t2] if dof == 6 => k.add([n, t1, t2], dot6),
                _ => k.add([&y[..dof], &y[dof..2 * dof], &y[2 * dof..]], dot),
            }
        }
        k
    }

    #[inline(always)]
    fn add<Y: Copy>(&mut self, [n, t1, t2]: [Y; 3], dot: impl Fn(Y, Y) -> f64) {
        self.m00 += dot(n, n);
        self.m10 += dot(t1, n);
        self.m20 += dot(t2, n);
        self.m11 += dot(t1, t1);
        self.m21 += dot(t2, t1);
        self.m22 += dot(t2, t2);
    }

    #[inline(always)]
    pub fn times(&self, v: [f64; 3]) -> [f64; 3] {
        [
            self.m00 * v[0] + self.m10 * v[1] + self.m20 * v[2],
            self.m10 * v[0] + self.m11 * v[1] + self.m21 * v[2],
            self.m20 * v[0] + self.m21 * v[1] + self.m22 * v[2],
        ]
    }

    /// Returns `None` if the matrix is singular to working precision.
    fn inverse(&self) -> Option<Symmetric3> {
        let Symmetric3 { m00, m10, m20, m11, m21, m22 } = *self;
        let cofactors = Symmetric3 {
            m00: m11 * m22 - m21 * m21,
            m10: m20 * m21 - m10 * m22,
            m20: m10 * m21 - m20 * m11,
            m11: m00 * m22 - m20 * m20,
            m21: m10 * m20 - m00 * m21,
            m22: m00 * m11 - m10 * m10,
        };
        let determinant = m00 * cofactors.m00 + m10 * cofactors.m10 + m20 * cofactors.m20;
        let scale = m00.max(m11).max(m22);
        (determinant > 1e-12 * scale.powi(3)).then(|| cofactors.scaled(1.0 / determinant))
    }

    fn scaled(self, s: f64) -> Symmetric3 {
        Symmetric3 {
            m00: s * self.m00,
            m10: s * self.m10,
            m20: s * self.m20,
            m11: s * self.m11,
            m21: s * self.m21,
            m22: s * self.m22,
        }
    }
}

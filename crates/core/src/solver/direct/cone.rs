//! Algebra of the second-order (Lorentz) cone `{ x₀ ≥ |(x₁, x₂)| }` in three dimensions.
//!
//! | symbol | meaning |
//! |---|---|
//! | `x∘y` | Jordan product `(x·y, x₀y₁ + y₀x₁, x₀y₂ + y₀x₂)`; its identity is `e = (1, 0, 0)` |
//! | `det x` | `x₀² − x₁² − x₂²`, above 0 inside the cone |
//! | `W` | symmetric scaling of Nesterov and Todd with `W·l = W⁻¹·z = v` |
//!
//! Source: Vandenberghe, *The CVXOPT linear and quadratic cone program solvers*, 2010, section 5.

/// A vector of the cone's space.
pub(super) type V3 = [f64; 3];
/// A 3×3 matrix, row-major.
pub(super) type M3 = [[f64; 3]; 3];

/// The scaling of a pair of interior points.
#[derive(Clone, Copy, Default)]
pub(super) struct Scaling {
    pub w: M3,
    pub inverse: M3,
    /// `W·l`.
    pub v: V3,
}

impl Scaling {
    /// Returns the scaling of `l` and `z`, both inside the cone.
    pub fn new(l: V3, z: V3) -> Scaling {
        let (root_l, root_z) = (root_det(l), root_det(z));
        let (l_unit, z_unit) = (l.map(|x| x / root_l), z.map(|x| x / root_z));
        let half = (0.5 * (1.0 + dot(l_unit, z_unit))).sqrt();
        let p = [
            (z_unit[0] + l_unit[0]) / (2.0 * half),
            (z_unit[1] - l_unit[1]) / (2.0 * half),
            (z_unit[2] - l_unit[2]) / (2.0 * half),
        ];
        let size = (root_z / root_l).sqrt();
        let a = 1.0 / (1.0 + p[0]);
        let (xx, xy, yy) = (1.0 + a * p[1] * p[1], a * p[1] * p[2], 1.0 + a * p[2] * p[2]);
        let w = [[p[0], p[1], p[2]], [p[1], xx, xy], [p[2], xy, yy]].map(|row| row.map(|x| x * size));
        let inverse = [[p[0], -p[1], -p[2]], [-p[1], xx, xy], [-p[2], xy, yy]].map(|row| row.map(|x| x / size));
        Scaling { w, inverse, v: times(&w, l) }
    }

    /// Returns `(W² + ε)⁻¹`.
    pub fn regular_inverse(&self, epsilon: f64) -> M3 {
        let m = &self.w;
        let entry = |i: usize, j: usize| dot(m[i], m[j]) + if i == j { epsilon } else { 0.0 };
        let (a, b, c, d, e, f) = (entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2));
        let (ca, cb, cc) = (d * f - e * e, c * e - b * f, b * e - c * d);
        let scale = 1.0 / (a * ca + b * cb + c * cc);
        let (cd, ce, cf) = (a * f - c * c, b * c - a * e, a * d - b * b);
        [[ca, cb, cc], [cb, cd, ce], [cc, ce, cf]].map(|row| row.map(|x| x * scale))
    }
}

fn root_det(x: V3) -> f64 {
    det(x).max(f64::MIN_POSITIVE).sqrt()
}

fn det(x: V3) -> f64 {
    // the product is exact to rounding near the boundary, the difference of squares is not
    let t = length(x[1], x[2]);
    (x[0] - t) * (x[0] + t)
}

/// Returns `√(x² + y²)` with the same bits on every machine.
pub(super) fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

pub(super) fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn times(m: &M3, x: V3) -> V3 {
    [dot(m[0], x), dot(m[1], x), dot(m[2], x)]
}

/// Returns `x∘y`.
pub(super) fn product(x: V3, y: V3) -> V3 {
    [dot(x, y), x[0] * y[1] + y[0] * x[1], x[0] * y[2] + y[0] * x[2]]
}

/// Returns `y` with `x∘y = r`, for `x` inside the cone.
pub(super) fn divide(x: V3, r: V3) -> V3 {
    let first = (x[0] * r[0] - x[1] * r[1] - x[2] * r[2]) / det(x).max(f64::MIN_POSITIVE);
    [first, (r[1] - first * x[1]) / x[0], (r[2] - first * x[2]) / x[0]]
}

/// Returns the largest `t` at which `x + t·d` is in the cone, for `x` inside it.
pub(super) fn largest_step(x: V3, d: V3) -> f64 {
    let apex = if d[0] < 0.0 { -x[0] / d[0] } else { f64::INFINITY };
    // a·t² + 2b·t + c = 0 on the boundary
    let (a, b, c) = (det(d), x[0] * d[0] - x[1] * d[1] - x[2] * d[2], det(x));
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        return apex;
    }
    let q = -(b + discriminant.sqrt().copysign(b));
    let roots = [if a != 0.0 { q / a } else { f64::INFINITY }, if q != 0.0 { c / q } else { f64::INFINITY }];
    roots.into_iter().filter(|t| *t > 0.0).fold(apex, f64::min)
}

/// Returns the Euclidean projection of `x` onto the friction cone `{ |x_t| ≤ μ·x_n }`, and its
/// derivative.
#[inline(always)]
pub(super) fn project(x: V3, mu: f64) -> (V3, M3) {
    let t = length(x[1], x[2]);
    if t <= mu * x[0] {
        return (x, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
    if mu * t <= -x[0] {
        return ([0.0; 3], [[0.0; 3]; 3]);
    }
    let share = 1.0 / (1.0 + mu * mu);
    let normal = share * (x[0] + mu * t);
    let (d, turn) = ([x[1] / t, x[2] / t], mu * normal / t);
    let along = share * mu * mu - turn;
    let derivative = [
        [share, share * mu * d[0], share * mu * d[1]],
        [share * mu * d[0], turn + along * d[0] * d[0], along * d[0] * d[1]],
        [share * mu * d[1], along * d[0] * d[1], turn + along * d[1] * d[1]],
    ];
    ([normal, turn * x[1], turn * x[2]], derivative)
}

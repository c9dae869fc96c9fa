//! Ellipsoids about the origin: closest points, support points, curvature.
//!
//! Source of the closest point: Eberly, *Distance from a point to an ellipse, an ellipsoid, or a
//! hyperellipsoid* (2013). Departure: the root is found by Hebden's iteration (Moré, *The
//! Levenberg–Marquardt algorithm*, 1978) instead of bisection.
//!
//! ```text
//! closest    x_i = e_i² y_i/(τ + g_i),   |s| = 1   with   s_i = e_i y_i/(τ + g_i),   g_i = e_i² − e_min²
//! iteration  τ += (|s| − 1)·|s|²/Σ s_i²/(τ + g_i)
//! distance   (τ − e_min²)·|m|,  m_i = x_i/e_i²,   normal m/|m|
//! support    h(n) = |E n|,  S(n) = ∇h = E² n/h,   ∇²h = (E² − S Sᵀ)/h
//! ```
//!
//! `|s|` decreases in `τ` and `1/|s|` is concave, so from a start with `|s| ≥ 1` the iteration
//! rises to the root and never passes it. Such a start is `max(e_i y_i − g_i)`, where one term alone
//! is 1. The root is at most `√3` times as far, so a handful of steps reach rounding.
//!
//! | symbol | meaning |
//! |---|---|
//! | `e`, `E` | half axes, as a vector and as a diagonal matrix; `e_min` the smallest |
//! | `y` | absolute values of the point's coordinates |
//! | `h`, `S` | support function and support point along a unit normal `n` |

use crate::{Mat3, Vec3};

/// Maximum number of steps; about six are taken.
const MAX_STEPS: usize = 64;

/// The closest point of an ellipsoid's surface.
pub(crate) struct ClosestOnEllipsoid {
    pub point: Vec3,
    /// Signed distance, negative inside, meters.
    pub distance: f64,
    /// Outward unit normal of the surface there.
    pub normal: Vec3,
}

/// Returns the closest point of the surface. On the axes inside, several points are equally close;
/// it is one of them.
pub(crate) fn closest(half: &Vec3, p: &Vec3) -> ClosestOnEllipsoid {
    let y = p.abs();
    let smallest = half.imin();
    let least = half[smallest] * half[smallest];
    // (e_i − e_min)(e_i + e_min), which keeps its digits for nearly equal axes
    let g = half.map(|e| (e - half[smallest]) * (e + half[smallest]));
    let products = half.component_mul(&y);
    let term = |k: usize, tau: f64| if products[k] == 0.0 { 0.0 } else { products[k] / (tau + g[k]) };
    let mut tau = (products - g).max().max(0.0);
    for _ in 0..MAX_STEPS {
        let s = Vec3::from_fn(|k, _| term(k, tau));
        let (square, length) = (s.norm_squared(), s.norm());
        if length <= 1.0 {
            break;
        }
        let slope: f64 = (0..3).filter(|k| s[*k] != 0.0).map(|k| s[k] * s[k] / (tau + g[k])).sum();
        let next = tau + (length - 1.0) * square / slope;
        if next <= tau {
            break;
        }
        tau = next;
    }
    // with the sign of the point
    let mut m = Vec3::from_fn(|k, _| (term(k, tau) / half[k]).copysign(p[k]));
    // inside on the plane across the smallest axis no term of that axis is left
    let missing = 1.0 - m.component_mul(half).norm_squared();
    if tau == 0.0 && missing > 0.0 {
        m[smallest] = (missing.sqrt() / half[smallest]).copysign(p[smallest]);
    }
    let length = m.norm();
    let normal = m / length;
    ClosestOnEllipsoid { point: m.component_mul(half).component_mul(half), distance: (tau - least) * length, normal }
}

/// Returns the point that is farthest along a direction of any length above 0.
pub(crate) fn support_point(half: &Vec3, n: &Vec3) -> Vec3 {
    let turned = half.component_mul(n);
    let length = turned.norm();
    if length > 0.0 { turned.component_mul(half) / length } else { Vec3::zeros() }
}

/// Returns the matrix of the radii of curvature where the outward unit normal is `n`, meters: the rate
/// of the support point as `n` turns. It maps `n` to 0.
pub(crate) fn curvature_radii(half: &Vec3, n: &Vec3) -> Mat3 {
    let support = half.component_mul(n).norm();
    let point = support_point(half, n);
    (Mat3::from_diagonal(&half.component_mul(half)) - point * point.transpose()) / support
}

/// Returns the mean of the two radii of curvature there, meters.
pub(crate) fn mean_radius(half: &Vec3, n: &Vec3) -> f64 {
    let support = half.component_mul(n).norm();
    ((half.norm_squared() - support_point(half, n).norm_squared()) / (2.0 * support)).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points are made from surface points and normals, so their distances are known.
    #[test]
    fn points_along_a_normal_are_as_far_as_they_were_moved() {
        for half in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.01, 5.0, 5.0), Vec3::repeat(0.7), Vec3::new(3.0, 1e-4, 2.0)]
        {
            for k in 0..4000 {
                let (u, v) = (f64::from(k) * 0.618_034 % 1.0, f64::from(k) / 4000.0);
                let n = match k {
                    0..3 => Vec3::ith(k as usize, 1.0),
                    _ => {
                        let (z, angle) = (2.0 * v - 1.0, std::f64::consts::TAU * u);
                        let r = (1.0 - z * z).sqrt();
                        Vec3::new(r * angle.cos(), r * angle.sin(), z)
                    }
                };
                let point = support_point(&half, &n);
                // inward as far as the smaller radius of curvature, beyond which others are closer
                let radii = curvature_radii(&half, &n);
                let mean = 0.5 * radii.trace();
                let spread = (mean * mean - 0.5 * (radii.trace().powi(2) - radii.norm_squared())).max(0.0).sqrt();
                let limit = half.min().powi(2) / half.max();
                assert!(mean - spread >= 0.999 * limit, "{half:?} {n:?}: {mean} {spread}");
                for distance in [-0.9 * limit, -1e-3 * limit, 0.0, 1e-6, 0.3, 50.0] {
                    let found = closest(&half, &(point + n * distance));
                    let scale = half.max() + distance.abs();
                    assert!(
                        (found.distance - distance).abs() < 1e-13 * scale,
                        "{half:?} {n:?} {distance}: {}",
                        found.distance
                    );
                    assert!((found.point - point).norm() < 1e-7 * scale, "{half:?} {n:?} {distance}");
                }
            }
        }
    }

    #[test]
    fn the_center_is_as_deep_as_the_smallest_half_axis() {
        for half in [Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 2.0, 0.5), Vec3::repeat(1.5)] {
            let found = closest(&half, &Vec3::zeros());
            assert_eq!(found.distance, -half.min());
            assert!((found.point.norm() - half.min()).abs() < 1e-15 && found.normal.dot(&found.point) > 0.0);
        }
    }
}

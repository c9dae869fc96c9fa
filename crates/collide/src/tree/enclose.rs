//! The exact smallest sphere around spheres.
//!
//! The smallest enclosing sphere is determined by at most four of the spheres, its basis, which
//! touch it from within: `|c − cᵢ| = R − rᵢ`. With `x = c − c₁` and `dᵢ = cᵢ − c₁`, subtracting the
//! first equation from the others gives
//!
//! ```text
//! dᵢ · x = (|dᵢ|² + r₁² − rᵢ²)/2 + R (rᵢ − r₁)      x = u + R v in the span of the dᵢ
//! (v·v − 1) R² + 2 (u·v + r₁) R + u·u − r₁² = 0
//! ```
//!
//! The basis is found as in a simplex method. While some sphere is not contained, the farthest one
//! joins the basis; the next basis is the subset of these five whose tangent sphere is the smallest
//! that contains all five. The radius grows in each step, so no basis repeats. Source for spheres
//! instead of points: Fischer and Gärtner, *The smallest enclosing ball of balls: combinatorial
//! structure and algorithms* (2003).

use super::sphere::Sphere;
use crate::Vec3;

/// Maximum number of basis changes; a dozen are typical.
const MAX_CHANGES: usize = 200;
/// A sphere is not contained if it exceeds the radius by more than this fraction.
const TOLERANCE: f64 = 1e-12;

/// Returns the smallest sphere around the spheres; of radius zero for no spheres.
pub(super) fn smallest_around(spheres: &[Sphere]) -> Sphere {
    let Some(&first) = spheres.iter().max_by(|a, b| a.radius.total_cmp(&b.radius)) else {
        return Sphere { center: Vec3::zeros(), radius: 0.0 };
    };
    let (mut sphere, mut basis) = (first, vec![first]);
    for _ in 0..MAX_CHANGES {
        let farthest = spheres.iter().max_by(|a, b| reach(&sphere.center, a).total_cmp(&reach(&sphere.center, b)));
        let Some(far) = farthest.filter(|far| reach(&sphere.center, far) > sphere.radius * (1.0 + TOLERANCE)) else {
            break;
        };
        basis.push(*far);
        let Some((next, its_basis)) = enclosing_subset(&basis).filter(|(next, _)| next.radius > sphere.radius) else {
            break;
        };
        (sphere, basis) = (next, its_basis);
    }
    // what rounding left, and one rounding error more
    let radius = spheres.iter().map(|b| reach(&sphere.center, b)).fold(0.0, f64::max) * (1.0 + 1e-12);
    Sphere { radius, ..sphere }
}

/// Returns the largest distance of a point of the sphere from `c`.
fn reach(c: &Vec3, sphere: &Sphere) -> f64 {
    (sphere.center - c).norm() + sphere.radius
}

/// Returns the smallest sphere around at most five spheres, and the spheres that touch it.
fn enclosing_subset(spheres: &[Sphere]) -> Option<(Sphere, Vec<Sphere>)> {
    let mut best: Option<(Sphere, Vec<Sphere>)> = None;
    for set in 1..1_u32 << spheres.len() {
        if set.count_ones() > 4 {
            continue;
        }
        let touched: Vec<Sphere> = (0..spheres.len()).filter(|n| set >> n & 1 == 1).map(|n| spheres[n]).collect();
        let Some(sphere) = tangent_sphere(&touched) else { continue };
        let holds = spheres.iter().all(|b| reach(&sphere.center, b) <= sphere.radius * (1.0 + 1e-9));
        if holds && best.as_ref().is_none_or(|b| sphere.radius < b.0.radius) {
            best = Some((sphere, touched));
        }
    }
    best
}

/// Returns the smallest sphere that one to four spheres all touch from within, with its center in
/// the span of theirs.
fn tangent_sphere(spheres: &[Sphere]) -> Option<Sphere> {
    let first = spheres[0];
    // orthonormal axes of the span, and along them u and v
    let mut axes: Vec<Vec3> = Vec::new();
    let (mut u, mut v) = (Vec3::zeros(), Vec3::zeros());
    for b in &spheres[1..] {
        let d = b.center - first.center;
        let across = axes.iter().fold(d, |d, e| d - e * e.dot(&d));
        let length = across.norm();
        if length <= 1e-10 * d.norm() {
            return None;
        }
        let e = across / length;
        let fixed = 0.5 * (d.norm_squared() + first.radius * first.radius - b.radius * b.radius);
        u += e * ((fixed - d.dot(&u)) / length);
        v += e * ((b.radius - first.radius - d.dot(&v)) / length);
        axes.push(e);
    }
    let least = spheres.iter().map(|b| b.radius).fold(0.0, f64::max);
    let (a, half_b, c) = (v.dot(&v) - 1.0, u.dot(&v) + first.radius, u.dot(&u) - first.radius * first.radius);
    let radius = roots(a, half_b, c).into_iter().filter(|r| *r >= least * (1.0 - 1e-9)).fold(f64::INFINITY, f64::min);
    radius.is_finite().then(|| Sphere { center: first.center + u + v * radius, radius })
}

/// Returns the roots of `a x² + 2 h x + c = 0`; not numbers if there are none.
fn roots(a: f64, h: f64, c: f64) -> [f64; 2] {
    let root = (h * h - a * c).max(0.0).sqrt();
    // the sum that does not cancel
    let q = -(h + if h < 0.0 { -root } else { root });
    [q / a, c / q]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a generator of deterministic numbers in [0, 1).
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    /// The radius is a convex function of the center, so it is minimal iff no direction lowers it:
    /// in every direction some touching sphere gets farther (or, up to rounding, no nearer).
    fn is_minimal(sphere: &Sphere, spheres: &[Sphere], next: &mut impl FnMut() -> f64) -> bool {
        let touched: Vec<Vec3> = spheres
            .iter()
            .filter(|b| reach(&sphere.center, b) > sphere.radius * (1.0 - 1e-9))
            .map(|b| (b.center - sphere.center).try_normalize(1e-9).unwrap_or_default())
            .collect();
        (0..500).all(|_| {
            let direction = Vec3::from_fn(|_, _| 2.0 * next() - 1.0).normalize();
            touched.iter().any(|to| to.dot(&direction) <= 1e-6)
        })
    }

    #[test]
    fn no_smaller_sphere_holds_the_spheres() {
        for seed in 1..60 {
            let mut next = numbers(seed);
            let count = 1 + (seed as usize % 12);
            let flat = seed % 5 == 0;
            let spheres: Vec<Sphere> = (0..count)
                .map(|_| {
                    let center = Vec3::new(next(), next(), if flat { 0.5 } else { next() });
                    Sphere { center, radius: 0.5 * next() * next() }
                })
                .collect();
            let sphere = smallest_around(&spheres);
            assert!(spheres.iter().all(|b| reach(&sphere.center, b) <= sphere.radius), "{seed}");
            assert!(is_minimal(&sphere, &spheres, &mut next), "{seed}");
            // none of a thousand random centers gives a smaller radius
            let any = (0..1000).map(|_| {
                let c = Vec3::from_fn(|_, _| next());
                spheres.iter().map(|b| reach(&c, b)).fold(0.0, f64::max)
            });
            assert!(any.fold(f64::INFINITY, f64::min) >= sphere.radius * (1.0 - 1e-9), "{seed}");
        }
    }

    #[test]
    fn equal_spheres_and_spheres_within_spheres_are_one() {
        let sphere = |x: f64, radius: f64| Sphere { center: Vec3::new(x, 0.0, 0.0), radius };
        let within = smallest_around(&[sphere(0.0, 2.0), sphere(0.5, 1.0), sphere(0.0, 2.0), sphere(-1.0, 1.0)]);
        assert!(within.center.norm() < 1e-12 && (within.radius - 2.0).abs() < 1e-9, "{within:?}");
        // two of radius 1, three apart: from -1 to 4
        let two = smallest_around(&[sphere(0.0, 1.0), sphere(3.0, 1.0), sphere(0.0, 1.0), sphere(1.5, 0.5)]);
        assert!((two.center.x - 1.5).abs() < 1e-9 && (two.radius - 2.5).abs() < 1e-9, "{two:?}");
    }
}

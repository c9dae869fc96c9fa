//! The pose of a lens from points and the pixels at which it sees or lights them.
//!
//! Three points give up to four poses (Grunert 1841, as in Haralick et al. 1994). With rays `j_i`, distances
//! `s_i` and `s₂ = u s₁`, `s₃ = v s₁`:
//!
//! ```text
//! a = |P₂ − P₃|, b = |P₁ − P₃|, c = |P₁ − P₂|;   cos α = j₂·j₃, cos β = j₁·j₃, cos γ = j₁·j₂
//! A₄ v⁴ + A₃ v³ + A₂ v² + A₁ v + A₀ = 0,   s₁² = b² / (1 + v² − 2 v cos β)
//! ```
//!
//! Of many triples and trial lenses the pose counts that fits most of the other points.

use super::lens::Pose;
use nalgebra::{Matrix3, Matrix4, Point3, Rotation3, Vector3};

/// Largest number of triples that are tried.
const MAX_TRIPLES: usize = 40;

/// Returns the poses from which three points lie in the directions of three unit vectors.
fn poses_of_three(points: [Point3<f64>; 3], rays: [Vector3<f64>; 3]) -> Vec<Pose> {
    let [p1, p2, p3] = points;
    let (a2, b2, c2) = ((p2 - p3).norm_squared(), (p1 - p3).norm_squared(), (p1 - p2).norm_squared());
    if a2.min(b2).min(c2) < 1e-12 {
        return Vec::new();
    }
    let (ca, cb, cg) = (rays[1].dot(&rays[2]), rays[0].dot(&rays[2]), rays[0].dot(&rays[1]));
    let (m, p) = ((a2 - c2) / b2, (a2 + c2) / b2);
    let coefficients = [
        (1.0 + m).powi(2) - 4.0 * a2 / b2 * cg * cg,
        4.0 * (-m * (1.0 + m) * cb + 2.0 * a2 / b2 * cg * cg * cb - (1.0 - p) * ca * cg),
        2.0 * (m * m - 1.0 + 2.0 * m * m * cb * cb + 2.0 * (b2 - c2) / b2 * ca * ca - 4.0 * p * ca * cb * cg
            + 2.0 * (b2 - a2) / b2 * cg * cg),
        4.0 * (m * (1.0 - m) * cb - (1.0 - p) * ca * cg + 2.0 * c2 / b2 * ca * ca * cb),
        (m - 1.0).powi(2) - 4.0 * c2 / b2 * ca * ca,
    ];
    let mut out = Vec::new();
    for v in positive_roots(coefficients) {
        let under = 2.0 * (cg - v * ca);
        if under.abs() < 1e-12 {
            continue;
        }
        let u = ((m - 1.0) * v * v - 2.0 * m * cb * v + 1.0 + m) / under;
        let s1 = (b2 / (1.0 + v * v - 2.0 * v * cb)).sqrt();
        if u > 0.0 && s1.is_finite() {
            out.extend(between(points, [rays[0] * s1, rays[1] * (u * s1), rays[2] * (v * s1)]));
        }
    }
    out
}

/// Returns the positive real roots of a polynomial of degree 4, coefficients from the lowest.
fn positive_roots(c: [f64; 5]) -> Vec<f64> {
    if c.iter().any(|x| !x.is_finite()) || c[4].abs() < 1e-14 {
        return Vec::new();
    }
    let mut companion = Matrix4::zeros();
    for i in 0..4 {
        companion[(i, 3)] = -c[i] / c[4];
        if i > 0 {
            companion[(i, i - 1)] = 1.0;
        }
    }
    let value = |v: f64| c.iter().rev().fold(0.0, |sum, c| sum * v + c);
    let slope = |v: f64| c[1] + v * (2.0 * c[2] + v * (3.0 * c[3] + v * 4.0 * c[4]));
    let polished = |v: f64| (0..3).fold(v, |v, _| if slope(v).abs() > 1e-14 { v - value(v) / slope(v) } else { v });
    let roots = companion.complex_eigenvalues();
    roots
        .iter()
        // noise splits a double root into a pair with small imaginary parts
        .filter(|z| z.im.abs() < 1e-2 * z.norm().max(1.0) && z.re > 0.0)
        .map(|z| polished(z.re))
        .filter(|v| *v > 0.0 && v.is_finite())
        .collect()
}

/// Returns the pose that turns points of the cave into points of the lens (Kabsch 1976).
fn between(points: [Point3<f64>; 3], local: [Vector3<f64>; 3]) -> Option<Pose> {
    let middle = points.iter().map(|p| p.coords).sum::<Vector3<f64>>() / 3.0;
    let local_middle = local.iter().sum::<Vector3<f64>>() / 3.0;
    let spread: Matrix3<f64> =
        points.iter().zip(&local).map(|(p, q)| (q - local_middle) * (p.coords - middle).transpose()).sum();
    let svd = spread.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    let sign = (u * vt).determinant().signum();
    let rotation = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * vt;
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    let position = Point3::from(middle - rotation.inverse() * local_middle);
    (rotation.matrix().iter().all(|x| x.is_finite())).then_some(Pose { rotation, position })
}

/// Returns the pose that fits best, and the mean square of the distances in units of the focal length, each at
/// most `cap`. `rays` have z = 1.
pub(crate) fn pose_of(points: &[Point3<f64>], rays: &[Vector3<f64>], cap: f64) -> Option<(Pose, f64)> {
    let mut best: Option<(Pose, f64)> = None;
    for triple in triples(points.len()) {
        let unit = triple.map(|i| rays[i].normalize());
        for pose in poses_of_three(triple.map(|i| points[i]), unit) {
            let miss = |(point, ray): (&Point3<f64>, &Vector3<f64>)| {
                let local = pose.local(point);
                if local.z < 1e-9 {
                    return cap * cap;
                }
                let d = (local / local.z - ray).norm_squared();
                // where rays are steep, the same angle is a longer way
                (d / (1.0 + ray.xy().norm_squared())).min(cap * cap)
            };
            let cost = points.iter().zip(rays).map(miss).sum::<f64>() / points.len() as f64;
            if best.is_none_or(|(_, least)| cost < least) {
                best = Some((pose, cost));
            }
        }
    }
    best
}

/// Returns triples of indices below `n`: all, or a fixed choice of many.
fn triples(n: usize) -> Vec<[usize; 3]> {
    if n <= 7 {
        return (0..n).flat_map(|i| (i + 1..n).flat_map(move |j| (j + 1..n).map(move |k| [i, j, k]))).collect();
    }
    let mut seed = 1u64;
    let mut next = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % n
    };
    (0..MAX_TRIPLES).map(|_| [next(), next(), next()]).filter(|[i, j, k]| i != j && j != k && i != k).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_points_give_the_pose_among_their_solutions() {
        let points = [[-1.5, 1.5, 0.0], [1.5, 1.4, 0.2], [-1.2, 1.5, 3.0], [1.1, 0.5, 2.5], [0.3, 1.5, 1.1]];
        let points: Vec<Point3<f64>> = points.into_iter().map(Point3::from).collect();
        for i in 0..50 {
            let t = f64::from(i);
            let pose = Pose {
                rotation: Rotation3::new(Vector3::new(
                    1.5 + 0.3 * t.sin(),
                    0.4 * (2.0 * t).cos(),
                    0.3 * (0.7 * t).sin(),
                )),
                position: Point3::new((1.3 * t).sin(), -1.5 + 0.5 * t.cos(), 1.5 + 0.4 * (2.1 * t).sin()),
            };
            let rays: Vec<Vector3<f64>> = points.iter().map(|p| pose.local(p)).map(|q| q / q.z).collect();
            assert!(rays.iter().all(|r| r.iter().all(|x| x.is_finite())));
            let (found, cost) = pose_of(&points, &rays, 0.1).unwrap();
            assert!(cost < 1e-12, "{i}: {cost}");
            assert!((found.position - pose.position).norm() < 1e-5, "{i}: {found:?} {pose:?}");
        }
    }
}

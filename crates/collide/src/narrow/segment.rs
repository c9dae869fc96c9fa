//! Closest points of segments. A segment is `c + s·u`, `s ∈ [−1, 1]` (`u` is half its length).
//!
//! Segment–segment: Ericson, *Real-Time Collision Detection* (2005), §5.1.9, in centered form.
//! Segment–box: `f(s) = |p(s) − clamp(p(s))|²` is convex and quadratic between the at most six
//! values of `s` at which a coordinate crosses a face plane, so `f'` is linear there and its root
//! is exact.

use crate::Vec3;

/// Threshold for parallel directions, relative to the squared lengths.
const PARALLEL: f64 = 1e-14;

/// Returns the parameter of the point of `s·u` closest to `p`.
pub(super) fn closest_on_segment(p: &Vec3, u: &Vec3) -> f64 {
    let uu = u.norm_squared();
    if uu > 0.0 { (p.dot(u) / uu).clamp(-1.0, 1.0) } else { 0.0 }
}

/// Returns the parameters of the closest points of `c1 + s·u1` and `c2 + t·u2`.
pub(super) fn segment_segment(c1: &Vec3, u1: &Vec3, c2: &Vec3, u2: &Vec3) -> (f64, f64) {
    let r = c1 - c2;
    let (a, b, e) = (u1.norm_squared(), u1.dot(u2), u2.norm_squared());
    let (c, f) = (u1.dot(&r), u2.dot(&r));
    let det = a * e - b * b;
    // unclamped optimum of s, or the middle if parallel; then t for s; then s for the clamped t
    let s = if det > PARALLEL * a * e { ((b * f - c * e) / det).clamp(-1.0, 1.0) } else { 0.0 };
    let t = closest_on_segment(&(c1 + u1 * s - c2), u2);
    (closest_on_segment(&(c2 + u2 * t - c1), u1), t)
}

/// Returns the parameter of the point of `c + s·u` closest to the box `|x| ≤ half`; the first of
/// several.
pub(super) fn segment_box(c: &Vec3, u: &Vec3, half: &Vec3) -> f64 {
    let slope = |s: f64| -> f64 {
        (0..3)
            .map(|k| {
                let x = c[k] + s * u[k];
                u[k] * (x - x.clamp(-half[k], half[k]))
            })
            .sum()
    };
    let mut breaks = [1.0; 8];
    let mut count = 0;
    for k in 0..3 {
        for side in [-half[k], half[k]] {
            let s = (side - c[k]) / u[k];
            if s > -1.0 && s < 1.0 {
                breaks[count] = s;
                count += 1;
            }
        }
    }
    breaks[..count].sort_unstable_by(f64::total_cmp);
    breaks[count] = 1.0;
    let (mut low, mut slope_low) = (-1.0, slope(-1.0));
    if slope_low >= 0.0 {
        return low;
    }
    for &high in &breaks[..=count] {
        let slope_high = slope(high);
        if slope_high >= 0.0 {
            return low + (high - low) * (slope_low / (slope_low - slope_high)).clamp(0.0, 1.0);
        }
        (low, slope_low) = (high, slope_high);
    }
    1.0
}

/// Returns the part of `c + s·u`, `s ∈ [−1, 1]`, with `|x_k| ≤ half_k` on the two axes other than
/// `skip`.
pub(super) fn clip_to_prism(c: &Vec3, u: &Vec3, half: &Vec3, skip: usize) -> Option<(f64, f64)> {
    let (mut low, mut high) = (-1.0_f64, 1.0_f64);
    for k in [(skip + 1) % 3, (skip + 2) % 3] {
        if u[k].abs() < 1e-300 {
            if c[k].abs() > half[k] {
                return None;
            }
            continue;
        }
        let (a, b) = ((-half[k] - c[k]) / u[k], (half[k] - c[k]) / u[k]);
        low = low.max(a.min(b));
        high = high.min(a.max(b));
    }
    (low <= high).then_some((low, high))
}

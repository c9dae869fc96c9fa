//! Manifold reduction: few points that keep the deepest one and the area.
//!
//! All points of one manifold share a normal. Kept, in this order: the deepest; the furthest from it; the one that makes
//! the greatest triangle; the one furthest out on the other side of it. Ties go to the earlier point.

use crate::{Contact, Vec3};

/// Keeps at most four of `out[start..]`, in the order they were found.
pub(super) fn to_four(out: &mut Vec<Contact>, start: usize) {
    if out.len() - start <= 4 {
        return;
    }
    let points = &out[start..];
    let normal = points[0].normal;
    let p = |n: usize| points[n].point;
    let first = best(points.len(), |n| -points[n].gap);
    let second = best(points.len(), |n| (p(n) - p(first)).norm_squared());
    let area = |n: usize| (p(second) - p(first)).cross(&(p(n) - p(first))).dot(&normal);
    let third = best(points.len(), |n| area(n).abs());
    let side = if area(third) < 0.0 { -1.0 } else { 1.0 };
    let outside = |n: usize| outside_triangle([p(first), p(second), p(third)], side, &normal, p(n));
    let fourth = best(points.len(), outside);
    let mut keep = [first, second, third, fourth];
    keep.sort_unstable();
    let mut length = start;
    for (n, &index) in keep.iter().enumerate() {
        if n == 0 || index != keep[n - 1] {
            out[length] = out[start + index];
            length += 1;
        }
    }
    out.truncate(length);
}

/// Index of the greatest score; the first one wins unless a later one is greater by more than rounding.
fn best(count: usize, score: impl Fn(usize) -> f64) -> usize {
    let mut found = (0, score(0));
    for n in 1..count {
        let s = score(n);
        if s > found.1 + 1e-9 * found.1.abs() {
            found = (n, s);
        }
    }
    found.0
}

/// The greatest area that `p` adds to a triangle beyond one of its sides.
fn outside_triangle([a, b, c]: [Vec3; 3], side: f64, normal: &Vec3, p: Vec3) -> f64 {
    [(a, b), (b, c), (c, a)].iter().map(|(u, v)| -side * (v - u).cross(&(p - u)).dot(normal)).fold(f64::NEG_INFINITY, f64::max)
}

//! Ear clipping: triangulates a polygon.
//!
//! The polygon is projected onto the plane perpendicular to its area vector `Σ (pₖ − p₀) × (pₖ₊₁ −
//! p₀)`. An ear is a corner that turns left and whose triangle contains no other point. The ear of
//! the best quality is cut off, until three points are left. Points that coincide with a corner of
//! an ear are ignored, so polygons that touch themselves, as those of faces with holes do, are
//! triangulated correctly. A polygon that crosses itself can lack an ear; then the corner of the
//! best quality is cut off anyway.

use crate::Vec3;
use std::collections::BinaryHeap;

/// Triangulates a polygon of at least three points; the triangles keep its orientation. Tests at
/// most `max_tries` corners for each ear, and compares points with ears at most `work` times. The
/// remaining work is stored in `work`.
pub(super) fn clip_ears(points: &[Vec3], max_tries: usize, work: &mut u64) -> Vec<[usize; 3]> {
    let mut clipper = EarClipper::new(points, max_tries, *work);
    let mut triangles = Vec::with_capacity(points.len() - 2);
    for _ in 3..points.len() {
        triangles.push(clipper.clip());
    }
    let last = clipper.heap.iter().map(|e| e.1).find(|&j| clipper.remaining[j]).unwrap_or(0);
    triangles.push([clipper.before[last], last, clipper.after[last]]);
    *work = clipper.work;
    triangles
}

/// A polygon in the plane; the remaining points form a ring.
struct EarClipper {
    flat: Vec<[f64; 2]>,
    before: Vec<usize>,
    after: Vec<usize>,
    remaining: Vec<bool>,
    /// Quality (as ordered bits), point, and the number of changes of its ear; entries with an
    /// older number are skipped.
    heap: BinaryHeap<(i64, usize, u32)>,
    changes: Vec<u32>,
    max_tries: usize,
    work: u64,
}

impl EarClipper {
    fn new(points: &[Vec3], max_tries: usize, work: u64) -> EarClipper {
        let n = points.len();
        let spanned = (1..n - 1).map(|k| (points[k] - points[0]).cross(&(points[k + 1] - points[0])));
        let normal = spanned.sum::<Vec3>().try_normalize(0.0).unwrap_or_else(Vec3::z);
        let u = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
        let v = normal.cross(&u);
        let mut clipper = EarClipper {
            flat: points.iter().map(|p| [p.dot(&u), p.dot(&v)]).collect(),
            before: (0..n).map(|k| (k + n - 1) % n).collect(),
            after: (0..n).map(|k| (k + 1) % n).collect(),
            remaining: vec![true; n],
            heap: BinaryHeap::new(),
            changes: vec![0; n],
            max_tries,
            work,
        };
        (0..n).for_each(|j| clipper.push(j));
        clipper
    }

    fn push(&mut self, j: usize) {
        let quality = self.quality(j).to_bits() as i64;
        // ordered like the numbers, as in `f64::total_cmp`
        let ordered = quality ^ (((quality >> 63) as u64) >> 1) as i64;
        self.heap.push((ordered, j, self.changes[j]));
    }

    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let ([ax, ay], [bx, by], [cx, cy]) = (self.flat[a], self.flat[b], self.flat[c]);
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    }

    /// Returns twice the area over the square of the longest side; negative for a corner that turns
    /// the wrong way.
    fn quality(&self, j: usize) -> f64 {
        let (i, k) = (self.before[j], self.after[j]);
        let square = |a: usize, b: usize| (0..2).map(|n| (self.flat[a][n] - self.flat[b][n]).powi(2)).sum::<f64>();
        let longest = square(i, j).max(square(j, k)).max(square(k, i));
        if longest > 0.0 { self.turn(i, j, k) / longest } else { 0.0 }
    }

    /// Returns whether the corner turns left and no other point lies in its triangle.
    fn is_ear(&mut self, j: usize) -> bool {
        if self.quality(j) <= 0.0 {
            return false;
        }
        let (i, k) = (self.before[j], self.after[j]);
        let mut p = self.after[k];
        while p != i {
            if self.work == 0 {
                return false;
            }
            self.work -= 1;
            let within = self.turn(i, j, p) >= 0.0 && self.turn(j, k, p) >= 0.0 && self.turn(k, i, p) >= 0.0;
            if within && ![i, j, k].iter().any(|&corner| self.flat[corner] == self.flat[p]) {
                return false;
            }
            p = self.after[p];
        }
        true
    }

    fn clip(&mut self) -> [usize; 3] {
        let mut passed = Vec::new();
        let mut chosen = None;
        while let Some(entry) = self.heap.pop() {
            let (_, j, change) = entry;
            if !self.remaining[j] || change != self.changes[j] {
                continue;
            }
            passed.push(entry);
            if self.is_ear(j) {
                chosen = Some(j);
            }
            if chosen.is_some() || passed.len() == self.max_tries {
                break;
            }
        }
        let j = chosen.unwrap_or_else(|| passed.first().map_or(0, |e| e.1));
        self.heap.extend(passed.into_iter().filter(|e| e.1 != j));
        let (i, k) = (self.before[j], self.after[j]);
        self.remaining[j] = false;
        (self.after[i], self.before[k]) = (k, i);
        for n in [i, k] {
            self.changes[n] += 1;
            self.push(n);
        }
        [i, j, k]
    }
}

//! Triangles across a hole.
//!
//! Short rims: of all triangulations of the rim the one whose sharpest fold, against each other and
//! against the faces around, is least; of equal ones that of least area. By dynamic programming over the rim's
//! sub-chains `i … k`:
//!
//! ```text
//! W(i, k) = min over m of  max-and-sum( W(i, m), W(m, k), weight of triangle (i, m, k) )
//! ```
//!
//! Longer rims: projected onto the plane across their area vector and clipped ear by ear, the ear of the best shape
//! first; a rim that crosses itself there is filled all the same.
//!
//! Sources: Barequet and Sharir, *Filling gaps in the boundary of a polyhedron* (1995), for the programme; Liepa,
//! *Filling holes in meshes* (2003), for the weight.

use crate::Vec3;
use std::collections::BinaryHeap;

/// Rims of up to so many edges are filled by weight: time grows as the cube.
const BY_WEIGHT: usize = 200;
/// Edges times the square of the limit, over all rims of a mesh: many rims are kept from taking long.
const MOST_WORK: f64 = 1.5e9;
/// The fold of a triangle that has no area, worse than any other.
const WORST: f64 = 4.0;
/// Of one that names a vertex twice.
const IMPOSSIBLE: f64 = 8.0;

/// Fills a rim with triangles of indices into it. `normals[n]` is that of the face at the edge from point n to n+1,
/// unit length or zero. The triangles go round as the points do.
pub(super) fn fill(points: &[Vec3], normals: &[Vec3], by_weight_up_to: usize) -> Vec<[usize; 3]> {
    if points.len() <= by_weight_up_to { by_weight(points, normals) } else { by_ears(points) }
}

/// The longest rim to be filled by weight where all rims of the mesh together have so many edges.
pub(super) fn longest_by_weight(edges: usize) -> usize {
    BY_WEIGHT.min((MOST_WORK / edges.max(1) as f64).sqrt() as usize).max(4)
}

/// Sharpest fold as 1 − cos of the angle between normals, and area (twice).
#[derive(Clone, Copy, Debug, PartialEq)]
struct Weight(f64, f64);

impl Weight {
    fn and(self, other: Weight) -> Weight {
        Weight(self.0.max(other.0), self.1 + other.1)
    }

    fn less(self, other: Weight) -> bool {
        // folds that differ by rounding alone are equal
        if (self.0 - other.0).abs() > 1e-9 { self.0 < other.0 } else { self.1 < other.1 }
    }
}

fn by_weight(points: &[Vec3], rim: &[Vec3]) -> Vec<[usize; 3]> {
    let n = points.len();
    let at = |i: usize, k: usize| i * n + k;
    let mut best = vec![Weight(0.0, 0.0); n * n];
    let mut apex = vec![0; n * n];
    let mut normal = vec![Vec3::zeros(); n * n];
    for i in 0..n - 1 {
        normal[at(i, i + 1)] = rim[i];
    }
    for length in 2..n {
        for i in 0..n - length {
            let k = i + length;
            let mut least = Weight(f64::INFINITY, f64::INFINITY);
            for m in i + 1..k {
                let before = best[at(i, m)].and(best[at(m, k)]);
                if before.0 > least.0 + 1e-9 {
                    continue;
                }
                let (own, area) = normal_and_area(&points[i], &points[m], &points[k]);
                let mut fold = own.map_or(WORST, |n| bend(&n, &normal[at(i, m)]).max(bend(&n, &normal[at(m, k)])));
                if let (Some(n), true) = (own, length + 1 == points.len()) {
                    fold = fold.max(bend(&n, &rim[points.len() - 1]));
                }
                if points[i] == points[m] || points[m] == points[k] || points[k] == points[i] {
                    fold = IMPOSSIBLE;
                }
                let weight = before.and(Weight(fold, area));
                if weight.less(least) {
                    least = weight;
                    apex[at(i, k)] = m;
                    normal[at(i, k)] = own.unwrap_or_default();
                }
            }
            best[at(i, k)] = least;
        }
    }
    let mut triangles = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, k)) = open.pop() {
        if k > i + 1 {
            let m = apex[at(i, k)];
            triangles.push([i, m, k]);
            open.extend([(m, k), (i, m)]);
        }
    }
    triangles
}

/// 1 − cos of the angle between two faces' normals; none against nothing.
fn bend(a: &Vec3, b: &Vec3) -> f64 {
    if *b == Vec3::zeros() { 0.0 } else { 1.0 - a.dot(b) }
}

fn normal_and_area(a: &Vec3, b: &Vec3, c: &Vec3) -> (Option<Vec3>, f64) {
    let (u, v) = (b - a, c - a);
    let n = u.cross(&v);
    let area = n.norm();
    let flat = area <= 1e-12 * u.norm_squared().max(v.norm_squared());
    (if flat { None } else { Some(n / area) }, area)
}

fn by_ears(points: &[Vec3]) -> Vec<[usize; 3]> {
    let mut ears = Ears::new(points);
    let mut triangles = Vec::with_capacity(points.len() - 2);
    for _ in 3..points.len() {
        triangles.push(ears.clip());
    }
    let last = ears.heap.iter().map(|e| e.1).find(|&j| ears.left[j]).unwrap_or(0);
    triangles.push([ears.before[last], last, ears.after[last]]);
    triangles
}

/// A polygon in the plane, whose points that are left form a ring.
struct Ears {
    flat: Vec<[f64; 2]>,
    before: Vec<usize>,
    after: Vec<usize>,
    left: Vec<bool>,
    /// Shape (as ordered bits), point, and how often that point's ear had changed: stale entries are passed over.
    heap: BinaryHeap<(i64, usize, u32)>,
    changes: Vec<u32>,
}

/// Ears that are looked at before the one of the best shape is taken all the same.
const MOST_TRIES: usize = 64;

impl Ears {
    fn new(points: &[Vec3]) -> Ears {
        let n = points.len();
        let spanned = (1..n - 1).map(|k| (points[k] - points[0]).cross(&(points[k + 1] - points[0])));
        let normal = spanned.sum::<Vec3>().try_normalize(0.0).unwrap_or_else(Vec3::z);
        let u = normal.cross(&Vec3::ith(normal.iamin(), 1.0)).normalize();
        let v = normal.cross(&u);
        let mut ears = Ears {
            flat: points.iter().map(|p| [p.dot(&u), p.dot(&v)]).collect(),
            before: (0..n).map(|k| (k + n - 1) % n).collect(),
            after: (0..n).map(|k| (k + 1) % n).collect(),
            left: vec![true; n],
            heap: BinaryHeap::new(),
            changes: vec![0; n],
        };
        (0..n).for_each(|j| ears.push(j));
        ears
    }

    fn push(&mut self, j: usize) {
        let shape = self.shape(j).to_bits() as i64;
        // ordered as the numbers are, as in `f64::total_cmp`
        let ordered = shape ^ (((shape >> 63) as u64) >> 1) as i64;
        self.heap.push((ordered, j, self.changes[j]));
    }

    fn turn(&self, a: usize, b: usize, c: usize) -> f64 {
        let ([ax, ay], [bx, by], [cx, cy]) = (self.flat[a], self.flat[b], self.flat[c]);
        (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    }

    /// Twice the area over the square of the longest side; negative for a corner that turns the wrong way.
    fn shape(&self, j: usize) -> f64 {
        let (i, k) = (self.before[j], self.after[j]);
        let square = |a: usize, b: usize| (0..2).map(|n| (self.flat[a][n] - self.flat[b][n]).powi(2)).sum::<f64>();
        let longest = square(i, j).max(square(j, k)).max(square(k, i));
        if longest > 0.0 { self.turn(i, j, k) / longest } else { 0.0 }
    }

    /// Whether no other point lies in the ear.
    fn free(&self, j: usize) -> bool {
        let (i, k) = (self.before[j], self.after[j]);
        let mut p = self.after[k];
        while p != i {
            if self.turn(i, j, p) >= 0.0 && self.turn(j, k, p) >= 0.0 && self.turn(k, i, p) >= 0.0 {
                return false;
            }
            p = self.after[p];
        }
        self.shape(j) > 0.0
    }

    fn clip(&mut self) -> [usize; 3] {
        let mut passed = Vec::new();
        let mut chosen = None;
        while let Some(entry) = self.heap.pop() {
            let (_, j, change) = entry;
            if !self.left[j] || change != self.changes[j] {
                continue;
            }
            passed.push(entry);
            if self.free(j) {
                chosen = Some(j);
            }
            if chosen.is_some() || passed.len() == MOST_TRIES {
                break;
            }
        }
        let j = chosen.unwrap_or_else(|| passed.first().map_or(0, |e| e.1));
        self.heap.extend(passed.into_iter().filter(|e| e.1 != j));
        let (i, k) = (self.before[j], self.after[j]);
        self.left[j] = false;
        (self.after[i], self.before[k]) = (k, i);
        for n in [i, k] {
            self.changes[n] += 1;
            self.push(n);
        }
        [i, j, k]
    }
}

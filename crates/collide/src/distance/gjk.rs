//! The distance of two convex bodies.
//!
//! ```text
//! d      = min |x|,  x ∈ A − B                          the set of all differences of their points
//! w(v)   = s_A(−v) − s_B(v)                             the point of A − B that is farthest along −v
//! d     ≥ v·w(v)/|v|                                    for every v: a plane across v separates the bodies
//! v      = argmin |x|,  x ∈ hull(w₁ … w_k),  k ≤ 4      the next direction, and an upper bound of d
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `s_A(n)` | the point of A that is farthest along `n` (support point), meters |
//! | `w₁ … w_k` | the simplex: support points whose hull has the closest point so far inside |
//! | `λ₁ … λ_k` | weights of that point, at least 0, sum 1; they give the points of A and of B as well |
//!
//! The algorithm is that of Gilbert, Johnson and Keerthi (*A fast procedure for computing the distance
//! between complex objects in three-dimensional space*, 1988). Both bounds are kept, so that the
//! result states its own error. Bodies with flat faces take a few iterations. The error of curved
//! ones falls by a factor in each, to 2e-9 of their size where they all but touch: there the simplex is
//! so thin that rounding ends the iteration.

use crate::Vec3;
use arrayvec::ArrayVec;

/// Maximum number of iterations.
const MAX_ITERATIONS: usize = 128;
/// Difference of the bounds at which the iteration ends, in units of the largest difference of points.
const CLOSE: f64 = 1e-14;
/// Number of times that weights are solved for; once if the bounds may differ.
const REFINEMENTS: usize = 3;

/// A bounded convex body.
pub(crate) trait Convex {
    /// Returns the point that is farthest along `n`, of any length above 0.
    fn support(&self, n: &Vec3) -> Vec3;
}

impl Convex for [Vec3; 3] {
    fn support(&self, n: &Vec3) -> Vec3 {
        let [a, b, c] = self;
        let [x, y, z] = [a.dot(n), b.dot(n), c.dot(n)];
        if x >= y && x >= z {
            *a
        } else if y >= z {
            *b
        } else {
            *c
        }
    }
}

/// The distance of two convex bodies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Separation {
    /// A point of A, and one of B, meters.
    pub points: [Vec3; 2],
    /// Their distance, meters: an upper bound. It is 0 if the bodies overlap.
    pub distance: f64,
    /// A lower bound, meters; at most 0 if the bodies overlap.
    pub least: f64,
    /// The unit direction, from B to A, of the plane that gives the lower bound.
    pub normal: Vec3,
}

/// A difference of two support points.
#[derive(Clone, Copy)]
struct Vertex {
    w: Vec3,
    points: [Vec3; 2],
}

/// A point of the hull of a simplex: the vertices that carry it, and their weights.
struct Nearest {
    v: Vec3,
    vertices: ArrayVec<(Vertex, f64), 4>,
}

/// Returns the distance of two convex bodies. The search ends early where the lower bound exceeds
/// `enough` meters. `start` is a guess of the vector from B to A.
pub(crate) fn separation(a: &impl Convex, b: &impl Convex, start: &Vec3, enough: f64) -> Separation {
    separation_within(a, b, start, enough, 0.0)
}

/// The same, with bounds that may differ by `close` meters.
pub(crate) fn separation_within(a: &impl Convex, b: &impl Convex, start: &Vec3, enough: f64, close: f64) -> Separation {
    let mut v = if start.norm() > 0.0 { *start } else { Vec3::x() };
    let mut nearest: Option<Nearest> = None;
    let (mut least, mut normal, mut scale) = (f64::NEG_INFINITY, v / v.norm(), 0.0f64);
    for _ in 0..MAX_ITERATIONS {
        let points = [a.support(&-v), b.support(&v)];
        let w = points[0] - points[1];
        let length = v.norm();
        scale = scale.max(w.norm());
        if v.dot(&w) / length > least {
            (least, normal) = (v.dot(&w) / length, v / length);
        }
        if least > enough || nearest.is_some() && length - least <= close.max(CLOSE * scale) {
            break;
        }
        let mut simplex: ArrayVec<Vertex, 4> =
            nearest.iter().flat_map(|nearest| nearest.vertices.iter().map(|(vertex, _)| *vertex)).collect();
        if simplex.is_full() {
            break; // the origin is inside, except for rounding
        }
        simplex.push(Vertex { w, points });
        let next = nearest_of(&simplex, if close > 0.0 { 1 } else { REFINEMENTS });
        if nearest.as_ref().is_some_and(|before| next.v.norm() >= before.v.norm()) {
            break;
        }
        v = next.v;
        nearest = Some(next);
        if v.norm() <= CLOSE * scale {
            break;
        }
    }
    let Some(nearest) = nearest else {
        // the first plane separates them far enough
        let points = [a.support(&-v), b.support(&v)];
        return Separation { points, distance: (points[0] - points[1]).norm(), least, normal };
    };
    let of = |side: usize| nearest.vertices.iter().map(|(vertex, weight)| vertex.points[side] * *weight).sum::<Vec3>();
    let length = nearest.v.norm();
    let apart = length > CLOSE * scale;
    Separation {
        points: [of(0), of(1)],
        distance: if apart { length } else { 0.0 },
        least: if apart { least } else { least.min(0.0) },
        normal,
    }
}

/// Returns the point of the simplex that is closest to the origin. It lies on the hull of the last
/// vertex and some of the others, since without the last one the previous point was the closest.
fn nearest_of(simplex: &ArrayVec<Vertex, 4>, refinements: usize) -> Nearest {
    let last = simplex[simplex.len() - 1];
    let others = &simplex[..simplex.len() - 1];
    let alone = || Nearest { v: last.w, vertices: [(last, 1.0)].into_iter().collect() };
    let mut best = alone();
    for subset in 1..1_usize << others.len() {
        let chosen: ArrayVec<Vertex, 3> =
            (0..others.len()).filter(|k| subset >> k & 1 == 1).map(|k| others[k]).collect();
        let edges: ArrayVec<Vec3, 3> = chosen.iter().map(|vertex| vertex.w - last.w).collect();
        let Some(weights) = weights(&edges, &-last.w, refinements) else { continue };
        let v = edges.iter().zip(&weights).fold(last.w, |sum, (edge, weight)| sum + edge * *weight);
        if v.norm_squared() < best.v.norm_squared() {
            let rest = 1.0 - weights.iter().sum::<f64>();
            let all = chosen.into_iter().zip(weights).chain([(last, rest)]);
            best = Nearest { v, vertices: all.collect() };
        }
    }
    best
}

/// Returns the weights of edges whose sum is closest to `p`; `None` if one is not above 0, their sum
/// is not below 1, or the edges are dependent. Edges of a thin simplex leave a residual, which is
/// solved for again, `refinements` times in all.
fn weights(edges: &[Vec3], p: &Vec3, refinements: usize) -> Option<ArrayVec<f64, 3>> {
    let mut found: ArrayVec<f64, 3> = edges.iter().map(|_| 0.0).collect();
    for _ in 0..refinements {
        let rest = edges.iter().zip(&found).fold(*p, |rest, (edge, weight)| rest - edge * *weight);
        for (weight, more) in found.iter_mut().zip(weights_of_projection(edges, &rest)) {
            *weight += more;
        }
    }
    let inside = found.iter().all(|weight| *weight > 0.0) && found.iter().sum::<f64>() < 1.0;
    inside.then_some(found)
}

/// Returns the weights of up to three edges whose sum is the projection of `p` onto their span.
fn weights_of_projection(edges: &[Vec3], p: &Vec3) -> [f64; 3] {
    match *edges {
        [e] => [p.dot(&e) / e.norm_squared(), 0.0, 0.0],
        [e, f] => {
            let n = e.cross(&f);
            let square = n.norm_squared();
            [p.cross(&f).dot(&n) / square, e.cross(p).dot(&n) / square, 0.0]
        }
        [e, f, g] => {
            let volume = e.dot(&f.cross(&g));
            [p.dot(&f.cross(&g)), e.dot(&p.cross(&g)), e.dot(&f.cross(p))].map(|x| x / volume)
        }
        _ => [0.0; 3],
    }
}

//! The depth of two polytopes that overlap: the least translation of all that separate them.
//!
//! The translations that leave A and B apart are those out of the polytope `B − A`. The least one leads to the
//! nearest of its faces, and each of these is a face of A, a face of B, or the parallelogram of an edge of each. An
//! edge of each makes a face only if the arcs between the normals of its two faces, one of them turned around, cross
//! on the sphere of directions. A radius around a core adds to each of these translations alike.

use super::ClosestPair;
use super::gjk::separation;
use super::solid::Core;
use crate::Vec3;

/// Maximum number of pairs of edges that are compared.
const MAX_PAIRS: usize = 1 << 16;
/// Distance at which the bodies are compared beside each other, as a fraction of the smaller radius.
const CLEARANCE: f64 = 1e-2;
/// Depth of bodies that only touch, as a fraction of the smaller radius.
const TOUCH: f64 = 1e-12;
/// Sine of the angle between edges that are parallel.
const PARALLEL: f64 = 1e-9;
/// Rounding of the side on which an end of an arc lies: pairs of edges within it are compared too.
const ON_ARC: f64 = 1e-12;

/// The directions that decide how deep a polytope is in another one, world axes.
#[derive(Default)]
pub(super) struct Faces {
    /// Unit normals; of boxes one of each two.
    pub normals: Vec<Vec3>,
    pub edges: Vec<EdgeArc>,
}

/// An edge of a polytope.
pub(super) struct EdgeArc {
    /// Along the edge, of any length but zero.
    pub direction: Vec3,
    /// Outward normals of its two faces; `None` compares it with all edges of the other body.
    pub normals: Option<[Vec3; 2]>,
}

impl EdgeArc {
    /// Returns whether this edge and one of the other body may make a face of the sum of the one and the other turned around.
    fn meets(&self, other: &EdgeArc) -> bool {
        let (Some([a, b]), Some([c, d])) = (self.normals, other.normals.map(|ends| ends.map(|n| -n))) else {
            return true;
        };
        let (along, across) = (a.cross(&b), c.cross(&d));
        let (c_side, d_side, a_side, b_side) = (along.dot(&c), along.dot(&d), across.dot(&a), across.dot(&b));
        // the arcs cross, and on the same half of the sphere
        c_side * d_side <= ON_ARC && a_side * b_side <= ON_ARC && c_side * b_side >= -ON_ARC
    }
}

/// Returns the pair of two convex bodies whose cores are polytopes that overlap, with the least translation of all that
/// separate them; `None` if a core is curved, if the polytopes have too many edges, and if they have no direction at all.
/// `touch` is the pair if the bodies only touch, where the cores may be apart, at a corner too.
pub(super) fn polytopes(a: &Core<'_>, b: &Core<'_>, touch: &ClosestPair, size: f64) -> Option<ClosestPair> {
    let (of_a, of_b) = (a.faces()?, b.faces()?);
    let overlap = a.overlap(b, &touch.normal);
    if overlap <= TOUCH * size {
        return Some(ClosestPair { distance: -overlap.max(0.0), ..*touch });
    }
    if of_a.edges.len() * of_b.edges.len() > MAX_PAIRS {
        return None;
    }
    let mut least: Option<(f64, Vec3)> = None;
    let mut compare = |n: Vec3| {
        for normal in [n, -n] {
            let overlap = a.overlap(b, &normal);
            if least.is_none_or(|(known, _)| overlap < known) {
                least = Some((overlap, normal));
            }
        }
    };
    of_a.normals.iter().chain(&of_b.normals).for_each(|n| compare(*n));
    for x in &of_a.edges {
        for y in of_b.edges.iter().filter(|y| x.meets(y)) {
            let n = x.direction.cross(&y.direction);
            if let Some(n) = n.try_normalize(PARALLEL * x.direction.norm() * y.direction.norm()) {
                compare(n);
            }
        }
    }
    let (overlap, normal) = least?;
    let overlap = overlap.max(0.0);
    // beside each other the closest points have this normal: any other one would be that of a shorter translation
    let by = normal * (overlap + CLEARANCE * size);
    let found = separation(&a.moved(&by), b, &by, f64::INFINITY);
    let on_b = found.points[1] + normal * b.radius;
    Some(ClosestPair { distance: -overlap, points: [on_b - normal * overlap, on_b], normal, shapes: [0; 2] })
}

//! Planes that bound two polytopes, between which most of their elements need no query of a field.
//!
//! ```text
//! height(x) = n·x − max over y in B of n·y  ≤  d_B(x)          for every unit vector n, if B is convex
//! gap       ≥ min over x in A of n·x − max over y in B of n·y   no contact if this is above the margin
//! ```
//!
//! | symbol | meaning |
//! |---|---|
//! | `n` | direction from B to A; the best is that of the distance of the two bodies ([`separation_within`]) |
//! | `d_B` | signed distance from B |
//!
//! Any `n` is valid: a poor one leaves more elements to the fields. An element is left out if it is higher than the
//! margin, and an edge if both of its ends are. No contact is lost. In deep overlaps an edge may have one more, because
//! the slope of the distance at an end that is left out does not exclude it (2 of 2000 random poses).

use super::{Body, BodyElements};
use crate::distance::gjk::{Convex, separation_within};
use crate::{Mat3, Pose, Vec3};

/// Rounding of heights, in radii of the smaller body.
const ROUNDING: f64 = 1e-9;
/// Error of the distance that decides the direction, in the same unit.
const CLOSE: f64 = 1e-3;

/// A plane that bounds one body, in the frame of the other.
pub(super) struct SupportPlane {
    /// Unit normal, away from the bounded body.
    normal: Vec3,
    /// Height of the origin above the plane, less rounding, meters.
    origin: f64,
    /// Whether all of the other body is above the plane by more than the margin.
    pub is_beyond: bool,
}

impl SupportPlane {
    /// Returns a plane that bounds B, in the frame of A, and one that bounds A, in the frame of B, for contacts
    /// within `margin` meters. `None` unless both are convex polytopes and at least one is a mesh.
    pub fn pair([a, b]: [&Body; 2], a_in_b: &Pose, size: f64, margin: f64) -> [Option<SupportPlane>; 2] {
        if !(is_polytope(a) && is_polytope(b) && (a.mesh.is_some() || b.mesh.is_some())) {
            return [None, None];
        }
        let (rotation, offset) = (*a_in_b.rotation.to_rotation_matrix().matrix(), a_in_b.translation.vector);
        let of_a = Placed { elements: &a.elements, rotation, offset };
        let of_b = Placed { elements: &b.elements, rotation: Mat3::identity(), offset: Vec3::zeros() };
        let slack = ROUNDING * size;
        let found = separation_within(&of_a, &of_b, &offset, margin + 2.0 * slack, CLOSE * size);
        let n = found.normal;
        let (lowest, highest) = (n.dot(&offset) - a.elements.support(&-rotation.tr_mul(&n)), b.elements.support(&n));
        let is_beyond = lowest - highest > margin + slack;
        let above_b = SupportPlane { normal: rotation.tr_mul(&n), origin: n.dot(&offset) - highest - slack, is_beyond };
        [Some(above_b), Some(SupportPlane { normal: -n, origin: lowest - slack, is_beyond })]
    }

    /// Returns the height of a point above the plane, less rounding, meters.
    #[inline]
    pub fn height(&self, p: &Vec3) -> f64 {
        self.normal.dot(p) + self.origin
    }
}

fn is_polytope(body: &Body) -> bool {
    matches!(body.elements, BodyElements::Mesh(_) | BodyElements::Box(_)) && body.field.is_convex()
}

/// A body at a pose.
pub(super) struct Placed<'a> {
    pub elements: &'a BodyElements<'a>,
    pub rotation: Mat3,
    pub offset: Vec3,
}

impl Convex for Placed<'_> {
    fn support(&self, n: &Vec3) -> Vec3 {
        self.rotation * self.elements.support_point(&self.rotation.tr_mul(n)) + self.offset
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::narrow::reduce::Collector;
    use crate::narrow::sdf_contact::elements_beside;
    use crate::narrow::sdf_contact::tolerances::DEEP_OVERLAP;
    use crate::narrow::with_body;
    use crate::{Contact, Quat, Shape};

    /// A generator of numbers from -1 to 1: Knuth's linear congruence.
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        fn vector(&mut self) -> Vec3 {
            Vec3::from_fn(|_, _| self.next())
        }
    }

    /// Returns all contacts of two bodies, ordered by their features, with or without the planes.
    fn contacts_of(a: &Body, b: &Body, pose: &Pose, margin: f64, planes: bool) -> Vec<Contact> {
        let (size, mut out) = (a.radius.min(b.radius), Vec::new());
        let mut found = Collector::new(margin, size, &mut out);
        let planes = if planes { SupportPlane::pair([a, b], pose, size, margin) } else { [None, None] };
        elements_beside(planes, [a, b], pose, size, &mut found);
        out.sort_by_key(|contact| contact.feature);
        out
    }

    /// Hulls and boxes at 2000 random poses, in part overlapping and in part apart, at margins from nothing to half of their
    /// size: all contacts are there with planes too, and none where the planes exclude all. In a few deep overlaps an edge
    /// has one more.
    #[test]
    fn planes_leave_out_no_contact() {
        let mut random = Numbers(7);
        let mut hull = |count: usize| {
            let points: Vec<Vec3> = (0..count).map(|_| random.vector()).collect();
            Shape::convex_hull(&points).unwrap()
        };
        let shapes = [hull(8), hull(32), hull(100), Shape::cuboid(Vec3::new(1.0, 0.6, 1.4)).unwrap()];
        let (mut touching, mut excluded, mut more) = (0, 0, 0);
        for n in 0..2000 {
            let (a, b) = (&shapes[n % 3], &shapes[n / 3 % 4]);
            let direction = random.vector().normalize();
            let pose = Pose::from_parts(
                (direction * (1.4 + 0.8 * random.next())).into(),
                Quat::from_scaled_axis(3.0 * random.vector()),
            );
            let margin = [0.0, 1e-4, 0.02, 0.5][n % 4];
            with_body(a, 0, &mut |a| {
                with_body(b, 0, &mut |b| {
                    let [with, without] = [true, false].map(|planes| contacts_of(a, b, &pose, margin, planes));
                    let size = a.radius.min(b.radius);
                    for y in &without {
                        let Some(x) = with.iter().find(|x| x.feature == y.feature) else {
                            panic!("pose {n} lacks {y:?}")
                        };
                        let apart = (x.point - y.point).norm() + (x.normal - y.normal).norm() + (x.gap - y.gap).abs();
                        assert!(apart < 1e-9, "pose {n}: {x:?} and {y:?}");
                    }
                    let deepest = without.iter().map(|y| y.gap).fold(0.0, f64::min);
                    if with.len() > without.len() {
                        more += 1;
                        assert!(deepest < -DEEP_OVERLAP * size, "pose {n} has more contacts at a depth of {deepest} m");
                    }
                    let [plane, _] = SupportPlane::pair([a, b], &pose, size, margin);
                    let is_beyond = plane.is_some_and(|plane| plane.is_beyond);
                    assert!(!is_beyond || without.is_empty(), "pose {n} excludes {without:?}");
                    touching += usize::from(!without.is_empty());
                    excluded += usize::from(is_beyond);
                });
            });
        }
        assert!(touching > 1000 && excluded > 300, "{touching} touch, {excluded} are excluded");
        assert!(more <= 4, "{more} have more contacts");
    }
}

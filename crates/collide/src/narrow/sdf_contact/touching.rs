//! Convex bodies that all but touch: the direction of their distance decides, whatever their gap.
//!
//! Fields are those of extended faces near the surface, so that bodies that are flush keep their contacts. Where an edge or a
//! rim crosses another one there, its lowest sample has the normal of a face of either side. A direction is right if
//! the two bodies are as far apart along it as the contact says:
//!
//! ```text
//! D(n)                                        translation along n after which the two touch; below 0 apart
//! gap = −D(n)                                 for a pair of support points: nothing is to be done
//! n ← normal of the distance of A + n·(D(n) + c) from B     else, until D(n) falls no further
//! ```
//!
//! After the translation the two are apart by about `c`, at which the direction of their distance is exact. It is that of
//! bodies at any gap, because a convex body that moves along the direction of its distance keeps it. A fixed point
//! of the iteration is the closest pair of bodies that are apart, and the least translation nearby of others.

use super::super::reduce::Collector;
use super::support_plane::Placed;
use super::{Body, BodyElements};
use crate::distance::gjk::separation;
use crate::sdf::OVERHANG;
use crate::{Contact, Mat3, NormalFrom, Pose, Vec3};

/// Depth of the deepest contact up to which two bodies all but touch, in radii of the smaller body.
const SHALLOW: f64 = 1e-2;
/// Distance at which the direction is found, in the same unit.
const CLEARANCE: f64 = 0.1;
/// Rounding of gaps, in the same unit.
const ROUNDING: f64 = 1e-10;
/// Sine of the angle between normals that are the same.
const SAME_NORMAL: f64 = 1e-5;
/// Difference of gaps that are the same, in radii of the smaller body.
const SAME_GAP: f64 = 1e-8;
/// Distance of two contacts at the same place, in radii of the smaller body.
const SAME_PLACE: f64 = 1e-3;
/// Cosine of the angle to the direction of the distance up to which another contact at the same gap belongs to the same surface.
const ALIGNED: f64 = 0.9998;
/// Maximum number of directions.
const MAX_DIRECTIONS: usize = 16;

/// Gives two convex bodies that all but touch the contact of their distance, if no element has it, and drops those at
/// the same gap with another normal.
pub(super) fn settle([a, b]: [&Body; 2], a_in_b: &Pose, size: f64, found: &mut Collector) {
    let above = 4.0 * OVERHANG * a.radius.max(b.radius);
    let least = found.min_gap();
    if !(least > -SHALLOW * size && least < above && a.field.is_convex() && b.field.is_convex())
        || a.field.is_linear()
        || b.field.is_linear()
    {
        return;
    }
    let (rotation, offset) = (*a_in_b.rotation.to_rotation_matrix().matrix(), a_in_b.translation.vector);
    let pair = Touching { of: [a, b], pose: a_in_b, rotation, offset, size };
    let Some((mut best, gap)) = pair.furthest_apart(found.contacts(), least + above) else { return };
    let rounding = ROUNDING * size;
    if (best.gap - gap).abs() > rounding || pair.is_beside(&best) || pair.is_deepest_point(&best) {
        let exact = pair.contact_of_distance(&best);
        let is_same = |c: &&Contact| {
            c.normal.cross(&exact.normal).norm() < SAME_NORMAL && (c.gap - exact.gap).abs() < SAME_GAP * size
        };
        match found.contacts().iter().find(is_same) {
            Some(same) => best = *same,
            None => {
                best = exact;
                found.push(exact);
            }
        }
    }
    let is_false = |c: &Contact| {
        let in_place = (c.point - best.point).norm() < SAME_PLACE * size;
        let aligned = if in_place { 1.0 - 0.5 * SAME_NORMAL * SAME_NORMAL } else { ALIGNED };
        c.gap < best.gap - SAME_GAP * size
            || c.gap < best.gap + above
                && c.normal.dot(&best.normal) < aligned
                && -pair.overlap_along(&c.normal) < best.gap - rounding
    };
    if found.contains_like(is_false) {
        found.map_and_retain(found.limit(), |c| !is_false(c));
    }
}

/// Two convex bodies in the frame of B.
struct Touching<'a> {
    of: [&'a Body<'a>; 2],
    pose: &'a Pose,
    rotation: Mat3,
    offset: Vec3,
    size: f64,
}

impl Touching<'_> {
    /// Returns `D(n)`, meters; `n` points from B to A.
    fn overlap_along(&self, n: &Vec3) -> f64 {
        let [a, b] = self.of;
        b.elements.support(n) + a.elements.support(&-self.rotation.tr_mul(n)) - n.dot(&self.offset)
    }

    /// Returns the contact along whose normal the bodies are furthest apart, or overlap the least, and by how much; of
    /// those up to a gap.
    fn furthest_apart(&self, contacts: &[Contact], limit: f64) -> Option<(Contact, f64)> {
        let mut best: Option<(Contact, f64)> = None;
        for c in contacts.iter().filter(|c| c.gap <= limit) {
            let gap = match &best {
                Some((known, gap)) if known.normal == c.normal => *gap,
                _ => -self.overlap_along(&c.normal),
            };
            if best.as_ref().is_none_or(|(known, least)| gap > *least || gap == *least && c.gap < known.gap) {
                best = Some((*c, gap));
            }
        }
        best
    }

    /// Returns whether the contact is beside the face that it is with.
    fn is_beside(&self, c: &Contact) -> bool {
        let [a, b] = self.of;
        let half = 0.5 * c.gap * c.normal;
        let outside = match c.normal_from {
            NormalFrom::FaceOfA => a.field.bound(&self.pose.inverse_transform_point(&(c.point + half).into()).coords),
            NormalFrom::FaceOfB => b.field.bound(&(c.point - half)),
            _ => return false,
        };
        outside > ROUNDING * self.size
    }

    /// Returns whether the contact may be the deepest point of a rim, of a straight side or in one: the normal there is that
    /// of the least translation up to the depth, in radii of curvature.
    fn is_deepest_point(&self, c: &Contact) -> bool {
        let is_face = matches!(c.normal_from, NormalFrom::FaceOfA | NormalFrom::FaceOfB);
        let is_round = |body: &Body| matches!(body.elements, BodyElements::Round { .. });
        let is_curved = self.of.iter().any(|body| body.field.is_curved()) && !self.of.iter().any(|body| is_round(body));
        c.gap < 0.0 && is_curved && !is_face && (c.core_a == 0.0 || c.core_b == 0.0)
    }

    /// Returns the contact of the direction of the distance, from that of a contact nearby.
    fn contact_of_distance(&self, from: &Contact) -> Contact {
        let [a, b] = self.of;
        let of_b = Placed { elements: &b.elements, rotation: Mat3::identity(), offset: Vec3::zeros() };
        let (mut normal, mut overlap) = (from.normal, self.overlap_along(&from.normal));
        let mut on_b = from.point - from.normal * (0.5 * from.gap);
        for _ in 0..MAX_DIRECTIONS {
            let shift = normal * (overlap + CLEARANCE * self.size);
            let of_a = Placed { elements: &a.elements, rotation: self.rotation, offset: self.offset + shift };
            let apart = separation(&of_a, &of_b, &shift, f64::INFINITY);
            let Some(next) = (apart.points[0] - apart.points[1]).try_normalize(0.0) else { break };
            let there = self.overlap_along(&next);
            if there > overlap {
                break;
            }
            let gain = overlap - there;
            (normal, overlap, on_b) = (next, there, apart.points[1]);
            if gain < 1e-2 * ROUNDING * self.size {
                break;
            }
        }
        let exact = Contact { point: on_b - normal * (0.5 * overlap), normal, gap: -overlap, ..*from };
        let is_kept = normal.dot(&from.normal) > ALIGNED && (exact.point - from.point).norm() < SAME_PLACE * self.size;
        match is_kept && !matches!(from.normal_from, NormalFrom::FaceOfA | NormalFrom::FaceOfB) {
            true => exact,
            false => Contact { core_a: 0.0, core_b: 0.0, normal_from: NormalFrom::Edges, ..exact },
        }
    }
}

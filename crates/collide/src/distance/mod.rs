//! Distances: from a point to a shape, and between two shapes.

mod apart;
mod depth;
pub(crate) mod gjk;
mod point;
mod solid;

use crate::{Aabb, Contact, Pose, Shape, Vec3, contacts};
pub(crate) use apart::surfaces_apart;
use apart::{above_plane, apart, least_translation};
use solid::Core;

/// Depth of a point that counts as inside, and margin of contacts, as fractions of the smaller radius.
const ROUNDING: f64 = 1e-9;
/// Depth of a contact that can be that of a corner beside a face, in sizes of the smaller body.
const BESIDE: f64 = 0.02;

/// The point of a shape's surface that is closest to a given point, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point of the surface, meters.
    pub point: Vec3,
    /// Signed distance of the given point from the surface, meters; negative inside.
    pub distance: f64,
    /// Outward unit normal: from the surface to a point outside, from a point inside to the surface.
    pub normal: Vec3,
    /// The shape: the index of a compound's part; 0 for all other shapes.
    pub shape: u32,
}

/// The closest points of two shapes, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPair {
    /// Distance, meters; minus the depth if they overlap ([`closest_points`]).
    pub distance: f64,
    /// A point of the surface of A, and one of B, meters.
    pub points: [Vec3; 2],
    /// Unit normal from B towards A.
    pub normal: Vec3,
    /// The shapes that the points are of, of A and of B: the index of a compound's part; 0 for all others.
    pub shapes: [u32; 2],
}

/// Returns the closest points of two shapes; `None` for two half-spaces, and for a pose that is not
/// finite.
///
/// The distance of shapes that are apart is exact: that of their surfaces, or of the closest parts of
/// compounds. Shapes that overlap are as deep as the least translation that separates them if they are spheres, capsules, boxes,
/// rounded boxes or convex hulls (whose numbers of edges have a product of at most 65,536); other convex ones as the least near the
/// normal of one of their contacts ([`contacts`]), all others as the deepest contact.
pub fn closest_points(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> Option<ClosestPair> {
    let finite = |pose: &Pose| (pose.translation.vector.sum() + pose.rotation.coords.sum()).is_finite();
    if !finite(pose_a) || !finite(pose_b) || matches!((a, b), (Shape::HalfSpace, Shape::HalfSpace)) {
        return None;
    }
    if !matches!(a, Shape::Compound(_)) && !matches!(b, Shape::Compound(_)) {
        return Some(closest_of_single(a, pose_a, b, pose_b));
    }
    let parts = [parts(a, pose_a), parts(b, pose_b)];
    let mut best: Option<ClosestPair> = None;
    let may_be_closer =
        |least: f64, best: &Option<ClosestPair>| least <= 0.0 || best.is_none_or(|best| least < best.distance);
    let bounds = parts[1].iter().map(|part| part.bounds).reduce(|a, b| a.merged(&b))?;
    for x in &parts[0] {
        if !may_be_closer(x.bounds.distance(&bounds), &best) {
            continue;
        }
        for y in &parts[1] {
            if !may_be_closer(x.bounds.distance(&y.bounds), &best) {
                continue;
            }
            let pair = closest_of_single(x.shape, &x.pose, y.shape, &y.pose);
            if best.is_none_or(|best| pair.distance < best.distance) {
                best = Some(ClosestPair { shapes: [x.number, y.number], ..pair });
            }
        }
    }
    best
}

/// A part of a compound, or any other shape as its only part.
struct Part<'a> {
    shape: &'a Shape,
    pose: Pose,
    number: u32,
    bounds: Aabb,
}

fn parts<'a>(shape: &'a Shape, pose: &Pose) -> Vec<Part<'a>> {
    let part = |shape: &'a Shape, pose: Pose, number| Part { shape, pose, number, bounds: shape.tight_aabb(&pose) };
    match shape {
        Shape::Compound(compound) => {
            compound.active_parts().map(|(n, shape, own)| part(shape, pose * own, n as u32)).collect()
        }
        _ => vec![part(shape, *pose, 0)],
    }
}

/// Returns the closest points of two shapes that are no compounds.
fn closest_of_single(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose) -> ClosestPair {
    match (a, b) {
        (Shape::HalfSpace, _) => above_plane(pose_a, b, pose_b),
        (_, Shape::HalfSpace) => above_plane(pose_b, a, pose_a).swapped(),
        _ => apart(a, pose_a, b, pose_b).unwrap_or_else(|touch| overlapping(a, pose_a, b, pose_b, touch)),
    }
}

/// Returns the pair of two shapes that overlap; `touch` if it has a depth, or they have no contact.
///
/// Polytopes are as deep as the least translation that separates them, other convex shapes as the least near the normal
/// of a contact, all others as their deepest contact. A corner that is slightly beside a face has a contact with
/// that face, but is not below it: such contacts count only if there is no other.
fn overlapping(a: &Shape, pose_a: &Pose, b: &Shape, pose_b: &Pose, touch: ClosestPair) -> ClosestPair {
    if touch.distance < 0.0 {
        return touch;
    }
    let size = a.bounding_radius().min(b.bounding_radius());
    let cores = [Core::of(a, pose_a), Core::of(b, pose_b)];
    if let [Some(core_a), Some(core_b)] = &cores
        && let Some(pair) = depth::polytopes(core_a, core_b, &touch, size)
    {
        return pair;
    }
    let mut found = Vec::new();
    contacts(a, pose_a, b, pose_b, ROUNDING * size, &mut found);
    let least = |x: &&Contact, y: &&Contact| x.gap.total_cmp(&y.gap);
    if let [Some(core_a), Some(core_b)] = &cores {
        for contact in &mut found {
            contact.gap = -core_a.overlap(core_b, &contact.normal).max(0.0);
        }
        let least = found.iter().max_by(least);
        return least.map_or(touch, |contact| least_translation(core_a, core_b, &ClosestPair::of(contact), size));
    }
    let inside = |p: &Vec3| {
        let within = |(shape, pose): (&Shape, &Pose)| shape.closest_point(pose, p).distance <= ROUNDING * size;
        within((a, pose_a)) && within((b, pose_b))
    };
    let below = |c: &&Contact| c.gap < -BESIDE * size || ClosestPair::of(c).points.iter().any(inside);
    found.retain(|contact| contact.gap <= 0.0);
    let deepest = found.iter().filter(below).min_by(least).or_else(|| found.iter().min_by(least));
    deepest.map_or(touch, ClosestPair::of)
}

impl ClosestPair {
    fn swapped(self) -> ClosestPair {
        let ([on_a, on_b], [a, b]) = (self.points, self.shapes);
        ClosestPair { points: [on_b, on_a], normal: -self.normal, shapes: [b, a], ..self }
    }

    fn of(contact: &Contact) -> ClosestPair {
        let half = contact.normal * (0.5 * contact.gap);
        ClosestPair {
            distance: contact.gap,
            points: [contact.point + half, contact.point - half],
            normal: contact.normal,
            shapes: contact.shapes,
        }
    }
}

//! Overlaps and distances of shapes and points to all bodies of a world.

use super::{Part, QueryFilter};
use crate::world::view::ObjectId;
use crate::world::{World, WorldError};
use tumble_collide::{Aabb, Contact, Pose, Shape, Vec3, closest_points, contacts_in_mode};

/// Maximum number of advances of a shape that is cast.
const MAX_ADVANCES: usize = 1000;
/// Gap at which a cast shape has met a body, as a fraction of the shape's size.
const MET: f64 = 1e-9;

/// A part that overlaps a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeOverlap {
    /// The object.
    pub id: ObjectId,
    /// Its part.
    pub part: usize,
    /// The shape of the part: the index of a compound's part; 0 for all other shapes.
    pub shape: usize,
    /// Depth of the deepest contact, meters, above 0.
    pub depth: f64,
}

/// The closest points of a shape or a body and a part of another body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyDistance {
    /// The objects and their parts; `None` for a shape that is no body.
    pub a: Option<(ObjectId, usize)>,
    /// The other one.
    pub b: (ObjectId, usize),
    /// The shapes that the points are of, of A and of B: the index of a compound's part; 0 for all others.
    pub shapes: [usize; 2],
    /// Distance, meters; minus the depth of the deepest contact if they overlap.
    pub distance: f64,
    /// A point of the surface of A, and one of B, world axes, meters.
    pub points: [Vec3; 2],
    /// Unit normal from B towards A, world axes.
    pub normal: Vec3,
}

/// The place of a point relative to the nearest body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointDepth {
    /// The object.
    pub id: ObjectId,
    /// Its part.
    pub part: usize,
    /// The shape of the part: the index of a compound's part; 0 for all other shapes.
    pub shape: usize,
    /// Depth below its surface, meters; negative outside: minus the distance.
    pub depth: f64,
    /// Closest point of its surface, world axes, meters.
    pub point: Vec3,
    /// Outward unit normal, world axes.
    pub normal: Vec3,
}

/// The first body that a moved shape touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeCastHit {
    /// The object.
    pub id: ObjectId,
    /// Its part.
    pub part: usize,
    /// The shape of the part: the index of a compound's part; 0 for all other shapes.
    pub shape: usize,
    /// Distance that the shape moves until it touches, meters.
    pub distance: f64,
    /// Point of the touch, world axes, meters.
    pub point: Vec3,
    /// Unit normal from the body towards the shape, world axes.
    pub normal: Vec3,
}

impl World {
    /// Returns the parts that overlap a shape at a pose, in the order in which they were added.
    pub fn overlaps(&self, shape: &Shape, pose: &Pose, filter: &QueryFilter) -> Vec<ShapeOverlap> {
        let bounds = shape.tight_aabb(pose);
        let mut found: Vec<Contact> = Vec::new();
        let overlap = |part: Part<'_>| {
            if !part.shape.tight_aabb(&part.pose).overlaps(&bounds) {
                return None;
            }
            found.clear();
            contacts_in_mode(part.mode, shape, pose, &part.shape, &part.pose, 0.0, &mut found);
            let deepest = found.iter().min_by(|x, y| x.gap.total_cmp(&y.gap)).filter(|deepest| deepest.gap < 0.0)?;
            let shape = deepest.shapes[1] as usize;
            Some(ShapeOverlap { id: part.id, part: part.part, shape, depth: -deepest.gap })
        };
        self.parts_by(filter).filter_map(overlap).collect()
    }

    /// Returns the closest points of two objects, over all their parts; `None` if one of them has no
    /// shape or is disabled, and for two half-spaces. Collision groups do not matter here.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if an object was removed.
    pub fn closest_points(&self, a: ObjectId, b: ObjectId) -> Result<Option<BodyDistance>, WorldError> {
        self.closest_points_of((a, None), (b, None))
    }

    /// Returns the closest points of some parts of two objects, such as [those of a link](crate::ArticulatedBody::parts_of_link); all
    /// parts of an object for `None`. The objects may be the same: two links of one body. `None` if a side has no shape or is disabled.
    ///
    /// # Errors
    /// [`WorldError::Stale`] if an object was removed.
    ///
    /// ```
    /// use tumble_core::{ArticulationBuilder, LinkBuilder, prelude::*};
    /// let mut world = World::default();
    /// let part = |x: f64| Collider::new(Shape::sphere(0.5).unwrap(), Pose::translation(x, 0.0, 0.0));
    /// let upper = LinkBuilder::new("upper", Joint::revolute(Vec3::z())).with_mass(1.0).with_collider(part(0.0));
    /// let lower = LinkBuilder::new("lower", Joint::revolute(Vec3::z())).with_parent("upper").with_mass(1.0).with_collider(part(3.0));
    /// let id = world.add(ArticulationBuilder::new("arm").link(upper).link(lower).build()?)?;
    /// let arm = world.get::<ArticulatedBody>(id).expect("it was not removed");
    /// let (a, b) = (arm.parts_of_link("upper")?, arm.parts_of_link("lower")?);
    /// assert_eq!(world.closest_points_of((id, Some(&a)), (id, Some(&b)))?.map(|pair| pair.distance), Some(2.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn closest_points_of(
        &self,
        (a, parts_a): (ObjectId, Option<&[usize]>),
        (b, parts_b): (ObjectId, Option<&[usize]>),
    ) -> Result<Option<BodyDistance>, WorldError> {
        for id in [a, b] {
            self.core.table.get(id).ok_or(WorldError::Stale)?;
        }
        let of = |id: ObjectId, parts: Option<&[usize]>, part: &Part<'_>| {
            part.id == id && parts.is_none_or(|parts| parts.contains(&part.part))
        };
        let others: Vec<Part<'_>> = self.parts().filter(|part| of(b, parts_b, part)).collect();
        let mut best: Option<BodyDistance> = None;
        for part in self.parts().filter(|part| of(a, parts_a, part)) {
            nearest(Some((a, part.part)), &part.shape, &part.pose, others.iter().cloned(), &mut best);
        }
        Ok(best)
    }

    /// Returns the closest points of a shape at a pose and the nearest part within `max_distance`
    /// meters (may be infinite).
    pub fn closest_to_shape(
        &self,
        shape: &Shape,
        pose: &Pose,
        max_distance: f64,
        filter: &QueryFilter,
    ) -> Option<BodyDistance> {
        let mut best = None;
        nearest(None, shape, pose, self.parts_by(filter), &mut best);
        best.filter(|best| best.distance <= max_distance)
    }

    /// Returns the parts whose solid contains a world point, in the order in which they were added.
    /// The surface belongs to the solid.
    pub fn contains(&self, point: &Vec3, filter: &QueryFilter) -> Vec<(ObjectId, usize)> {
        let inside = |part: &Part<'_>| {
            distance_to_box(&part.shape.tight_aabb(&part.pose), point) <= 0.0
                && part.shape.closest_point(&part.pose, point).distance <= 0.0
        };
        self.parts_by(filter).filter(inside).map(|part| (part.id, part.part)).collect()
    }

    /// Returns the part in which a world point is deepest, or the nearest part if it is in none;
    /// `None` if there are no parts, or the point is not finite.
    pub fn point_depth(&self, point: &Vec3, filter: &QueryFilter) -> Option<PointDepth> {
        let mut best: Option<PointDepth> = None;
        for part in self.parts_by(filter) {
            let least = distance_to_box(&part.shape.tight_aabb(&part.pose), point);
            if least > 0.0 && best.is_some_and(|best| -least < best.depth) {
                continue;
            }
            let closest = part.shape.closest_point(&part.pose, point);
            let depth = -closest.distance;
            if depth.is_finite() && best.is_none_or(|best| depth > best.depth) {
                let (point, normal, shape) = (closest.point, closest.normal, closest.shape as usize);
                best = Some(PointDepth { id: part.id, part: part.part, shape, depth, point, normal });
            }
        }
        best
    }

    /// Returns the first part that a shape touches if it moves from a pose along `direction` (any
    /// length above 0, world axes) by at most `max_distance` meters, without rotation. A part that
    /// it overlaps at the start is hit at distance 0. `max_distance` is finite.
    ///
    /// The shape advances by conservative steps until the gap is below 1e-9 of the smaller bounding
    /// radius. A shape that passes a mesh with concave edges, or a compound, at less than a thousandth of its way
    /// counts as touching.
    pub fn cast_shape(
        &self,
        shape: &Shape,
        pose: &Pose,
        direction: &Vec3,
        max_distance: f64,
        filter: &QueryFilter,
    ) -> Option<ShapeCastHit> {
        let direction = direction.try_normalize(0.0)?;
        let (start, end) = (shape.tight_aabb(pose), shape.tight_aabb(&moved(pose, &(direction * max_distance))));
        let swept = Aabb { min: start.min.inf(&end.min), max: start.max.sup(&end.max) };
        let (mut limit, mut best) = (max_distance, None::<ShapeCastHit>);
        for part in self.parts_by(filter).filter(|part| part.shape.tight_aabb(&part.pose).overlaps(&swept)) {
            if let Some(hit) = cast(shape, pose, &direction, limit, &part)
                && (best.is_none() || hit.distance < limit)
            {
                limit = hit.distance;
                best = Some(hit);
            }
        }
        best
    }
}

/// Advances a shape along a unit direction until it touches a part. The distance of convex shapes
/// closes along the normal of their closest points at most; that of others along
/// the direction. A step that went too far by the error of a distance is halved.
fn cast(shape: &Shape, pose: &Pose, direction: &Vec3, max: f64, part: &Part<'_>) -> Option<ShapeCastHit> {
    let convex = |shape: &Shape| shape.has_convex_parts() && !matches!(shape, Shape::Compound(_));
    let plane = matches!(shape, Shape::HalfSpace) || matches!(&*part.shape, Shape::HalfSpace);
    let by_normal = plane || convex(shape) && convex(&part.shape);
    let met = MET * shape.bounding_radius().min(part.shape.bounding_radius()).min(1e9);
    let (mut clear, mut distance) = (0.0, 0.0);
    for advance in 1.. {
        let pair = closest_points(shape, &moved(pose, &(direction * distance)), &part.shape, &part.pose)?;
        if pair.distance < -met && distance - clear > met {
            distance = 0.5 * (clear + distance);
            continue;
        }
        if pair.distance <= met || advance >= MAX_ADVANCES {
            let point = 0.5 * (pair.points[0] + pair.points[1]);
            let shape = pair.shapes[1] as usize;
            return Some(ShapeCastHit { id: part.id, part: part.part, shape, distance, point, normal: pair.normal });
        }
        let closing = -direction.dot(&pair.normal);
        let speed = if by_normal { closing } else { 1.0 };
        if speed <= 0.0 {
            return None; // a plane between the two is not approached
        }
        clear = distance;
        // half of the tolerance remains, so that the shape does not stop just short of it
        distance += (pair.distance - 0.5 * met) / speed;
        if distance > max {
            return None;
        }
    }
    None
}

/// Replaces `best` by the closest pair of a shape and the parts, if that is closer.
fn nearest<'w>(
    a: Option<(ObjectId, usize)>,
    shape: &Shape,
    pose: &Pose,
    parts: impl Iterator<Item = Part<'w>>,
    best: &mut Option<BodyDistance>,
) {
    let bounds = shape.tight_aabb(pose);
    for part in parts {
        let least = bounds.distance(&part.shape.tight_aabb(&part.pose));
        if least > 0.0 && best.is_some_and(|best| least > best.distance) {
            continue;
        }
        let Some(pair) = closest_points(shape, pose, &part.shape, &part.pose) else { continue };
        if best.is_none_or(|best| pair.distance < best.distance) {
            let b = (part.id, part.part);
            let (shapes, distance) = (pair.shapes.map(|shape| shape as usize), pair.distance);
            *best = Some(BodyDistance { a, b, shapes, distance, points: pair.points, normal: pair.normal });
        }
    }
}

fn moved(pose: &Pose, by: &Vec3) -> Pose {
    nalgebra::Translation3::from(*by) * pose
}

fn distance_to_box(b: &Aabb, point: &Vec3) -> f64 {
    (b.min - point).sup(&(point - b.max)).sup(&Vec3::zeros()).norm()
}

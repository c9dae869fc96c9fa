//! Queries of the geometry of a world in its present state: rays, overlaps, distances. They change
//! nothing, need no step before, and work on the world of a facet or a replay too.

mod pairs;
mod rays;
mod shapes;

pub use pairs::Overlap;
pub use rays::{Ray, RayCastHit};
pub use shapes::{BodyDistance, PointDepth, ShapeCastHit, ShapeOverlap};

use super::{Core, World};
use crate::object::collidable::CollisionGroup;
use crate::world::view::{Entry, ObjectId};
use tumble_collide::{ContactMode, Pose, Shape};

/// Selects the parts that a query finds. Like a part of a body, a query has a group and a mask: a
/// part is found if its group is in the mask of the query and the query's group in its mask.
/// Sensors, and objects that are disabled or do not collide, are never found.
///
/// ```
/// use tumble_core::prelude::*;
/// use tumble_core::{QueryFilter, Ray};
/// let mut world = World::default();
/// let ball = world.add(RigidBody::new(Shape::sphere(0.5)?).with_pose(Pose::translation(0.0, 0.0, 2.0)))?;
/// let down = Ray { origin: Vec3::new(0.0, 0.0, 5.0), direction: -Vec3::z(), max_distance: f64::INFINITY };
/// let hit = world.cast_ray(&down, &QueryFilter::default()).expect("the ball is below");
/// assert_eq!((hit.id, hit.distance), (ball, 2.5));
/// assert!(world.cast_ray(&down, &QueryFilter::default().ignoring(ball)).is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct QueryFilter {
    /// The group of the query; 0 by default.
    pub group: CollisionGroup,
    /// Groups that it finds, one bit each; all by default.
    pub mask: u64,
    /// Objects that it does not find; none by default.
    pub ignored: Vec<ObjectId>,
}

impl Default for QueryFilter {
    fn default() -> QueryFilter {
        QueryFilter { group: CollisionGroup::default(), mask: u64::MAX, ignored: Vec::new() }
    }
}

impl QueryFilter {
    /// Returns the filter with one more ignored object.
    #[must_use]
    pub fn ignoring(mut self, id: ObjectId) -> QueryFilter {
        self.ignored.push(id);
        self
    }
}

/// A part with a shape.
#[derive(Clone, Copy)]
struct Part<'w> {
    entry: Entry<'w>,
    id: ObjectId,
    part: usize,
    shape: &'w Shape,
    mode: ContactMode,
    pose: Pose,
}

impl Core {
    /// Returns the parts that collide, in the order of the part table.
    fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let entries = self.objects().all().filter(|e| e.status.enabled && e.status.collidable);
        entries.filter_map(|entry| Some((entry, entry.object.collidable()?))).flat_map(move |(entry, body)| {
            let id = self.table.order[entry.place];
            entry.state_range.parts.clone().enumerate().filter_map(move |(part, part_state)| {
                let pose = self.derived.part_states[part_state].pose;
                Some(Part { entry, id, part, shape: body.shape(part)?, mode: body.contact_mode(part), pose })
            })
        })
    }
}

impl World {
    /// Returns the parts that collide, in the order of the part table.
    fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        self.core.parts()
    }

    /// Returns the parts that a filter selects, in the order of the part table.
    fn parts_by(&self, filter: &QueryFilter) -> impl Iterator<Item = Part<'_>> {
        self.parts().filter(|part| {
            part.entry.object.collidable().is_some_and(|body| {
                !body.is_sensor(part.part)
                    && filter.mask & body.collision_group(part.part).bit() != 0
                    && body.collides_with(part.part, filter.group)
                    && !filter.ignored.contains(&part.id)
            })
        })
    }
}

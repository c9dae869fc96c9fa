//! Queries of the geometry of a world in its present state: rays, overlaps, distances. They change
//! nothing, need no step before, and work on the world of a facet or a replay too.

mod pairs;
mod rays;
mod shapes;

pub use pairs::Overlap;
pub use rays::{Ray, RayCastHit};
pub use shapes::{BodyDistance, PointDepth, ShapeCastHit, ShapeOverlap};

use super::{Core, World};
use crate::object::FilteredPart;
use crate::object::collidable::CollisionGroup;
use crate::world::view::{Entry, ObjectId};
use std::borrow::Cow;
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
    /// Parts that it does not find, such as [those of a link](crate::ArticulatedBody::parts_of_link); none by default.
    pub ignored_parts: Vec<(ObjectId, usize)>,
    /// The object, and the parts of it, as which the query acts: it then finds only parts that could have contacts with it. Groups and
    /// masks of both, [ignored pairs](crate::PairMaterial::collides) and excluded links count as for contacts, whether or not anything
    /// moves; `None` stands for all parts of the object. Group and mask of the filter count too. None by default.
    pub acting_as: Option<(ObjectId, Option<Vec<usize>>)>,
}

impl Default for QueryFilter {
    fn default() -> QueryFilter {
        QueryFilter {
            group: CollisionGroup::default(),
            mask: u64::MAX,
            ignored: Vec::new(),
            ignored_parts: Vec::new(),
            acting_as: None,
        }
    }
}

impl QueryFilter {
    /// Returns the filter with one more ignored object.
    #[must_use]
    pub fn ignoring(mut self, id: ObjectId) -> QueryFilter {
        self.ignored.push(id);
        self
    }

    /// Returns the filter with more ignored parts of an object.
    #[must_use]
    pub fn ignoring_parts(mut self, id: ObjectId, parts: impl IntoIterator<Item = usize>) -> QueryFilter {
        self.ignored_parts.extend(parts.into_iter().map(|part| (id, part)));
        self
    }

    /// Returns the filter that finds what could have contacts with an object.
    #[must_use]
    pub fn acting_as(mut self, id: ObjectId) -> QueryFilter {
        self.acting_as = Some((id, None));
        self
    }

    /// Returns the filter that finds what could have contacts with one of some parts of an object.
    #[must_use]
    pub fn acting_as_parts(mut self, id: ObjectId, parts: impl IntoIterator<Item = usize>) -> QueryFilter {
        self.acting_as = Some((id, Some(parts.into_iter().collect())));
        self
    }
}

/// A part with a shape.
#[derive(Clone)]
struct Part<'w> {
    entry: Entry<'w>,
    id: ObjectId,
    part: usize,
    shape: Cow<'w, Shape>,
    mode: ContactMode,
    pose: Pose,
}

impl<'w> Part<'w> {
    /// Returns the part with those of its shapes that are no sensors, if there are any.
    fn solid(self) -> Option<Part<'w>> {
        let shape = FilteredPart::of(self.entry.object.collidable()?, self.part)?.solid()?;
        Some(Part { shape, ..self })
    }
}

impl Core {
    /// Returns the parts that collide, in the order of the part table.
    fn parts(&self) -> impl Iterator<Item = Part<'_>> {
        let entries = self.objects().all().filter(|e| e.status.enabled && e.status.collidable);
        entries.filter_map(|entry| Some((entry, entry.object.collidable()?))).flat_map(move |(entry, body)| {
            let id = self.table.order[entry.place];
            entry.state_range.parts.clone().enumerate().filter_map(move |(part, part_state)| {
                let pose = self.derived.part_states[part_state].pose;
                let shape = Cow::Borrowed(body.shape(part)?);
                Some(Part { entry, id, part, shape, mode: body.contact_mode(part), pose })
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
        let found = self
            .parts()
            .filter(|part| !filter.ignored.contains(&part.id) && !filter.ignored_parts.contains(&(part.id, part.part)));
        let actors = self.actors(filter);
        found.filter_map(move |part| {
            let own = FilteredPart::of(part.entry.object.collidable()?, part.part)?;
            let own = own.named(part.id, &self.core.pair_materials);
            let shape = match &actors {
                None => own.meeting(filter.group, filter.mask)?,
                Some(actors) => {
                    let meet = actors
                        .iter()
                        .filter(|(id, actor)| *id != part.id || own.body.parts_collide(actor.part, part.part));
                    let meet: Vec<FilteredPart<'_>> = meet.map(|(_, actor)| *actor).collect();
                    own.met_by(&meet, filter.group, filter.mask)?
                }
            };
            Some(Part { shape, ..part })
        })
    }

    /// Returns the parts as which a query acts, if it acts as any.
    fn actors(&self, filter: &QueryFilter) -> Option<Vec<(ObjectId, FilteredPart<'_>)>> {
        let (id, parts_of) = filter.acting_as.as_ref()?;
        let id = *id;
        let body = self.object(id).and_then(|object| object.collidable());
        let parts = body.into_iter().flat_map(|body| (0..body.parts()).filter_map(|k| FilteredPart::of(body, k)));
        Some(
            parts
                .filter(|own| parts_of.as_ref().is_none_or(|parts| parts.contains(&own.part)))
                .map(|own| (id, own.named(id, &self.core.pair_materials)))
                .collect(),
        )
    }
}

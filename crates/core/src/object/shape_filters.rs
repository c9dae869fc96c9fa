//! Collision groups, masks and sensors of single shapes of a part.

use super::collidable::{Collidable, CollisionGroup};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use tumble_collide::{CompoundShape, Contact, Pose, Shape};

/// Group, mask and sensor of one shape of a compound, instead of those of its body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ShapeFilter {
    /// Its collision group.
    pub group: CollisionGroup,
    /// Groups that it collides with, one bit each.
    pub mask: u64,
    /// Whether it is a sensor: it has no contacts, and the world reports the parts of other objects that overlap it.
    pub sensor: bool,
}

impl Default for ShapeFilter {
    /// Group 0, all groups, no sensor.
    fn default() -> ShapeFilter {
        ShapeFilter { group: CollisionGroup::default(), mask: u64::MAX, sensor: false }
    }
}

/// Filters of those parts of a compound that have their own, by the index of the part.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ShapeFilters(Vec<(usize, ShapeFilter)>);

impl ShapeFilters {
    /// Sets the filter of one shape, or removes it.
    pub fn set(&mut self, shape: usize, filter: Option<ShapeFilter>) {
        self.0.retain(|(own, _)| *own != shape);
        self.0.extend(filter.map(|filter| (shape, filter)));
        self.0.sort_unstable_by_key(|(own, _)| *own);
    }

    /// Returns the filter of a shape that has its own.
    pub fn get(&self, shape: usize) -> Option<ShapeFilter> {
        self.0.iter().find(|(own, _)| *own == shape).map(|(_, filter)| *filter)
    }

    /// Returns all, ascending by the index of the shape.
    pub fn as_slice(&self) -> &[(usize, ShapeFilter)] {
        &self.0
    }
}

/// The shapes of a part that have one filter: those of the body for `None`.
pub(crate) struct FilterClass {
    filter: Option<ShapeFilter>,
    /// Indices of the parts of the compound, ascending.
    parts: Vec<u32>,
}

impl FilterClass {
    /// Returns the classes of a part with a compound whose shapes have filters, in the order of their first shapes.
    fn of(body: &dyn Collidable, part: usize, compound: &CompoundShape) -> Vec<FilterClass> {
        let own = body.shape_filters(part);
        let mut classes: Vec<FilterClass> = Vec::new();
        for n in 0..compound.parts().len() {
            let filter = own.iter().find(|(shape, _)| *shape == n).map(|(_, filter)| *filter);
            match classes.iter_mut().find(|class| class.filter == filter) {
                Some(class) => class.parts.push(n as u32),
                None => classes.push(FilterClass { filter, parts: vec![n as u32] }),
            }
        }
        classes
    }

    fn is_sensor(&self, body: &dyn Collidable, part: usize) -> bool {
        self.filter.map_or_else(|| body.is_sensor(part), |filter| filter.sensor)
    }

    fn group(&self, body: &dyn Collidable, part: usize) -> CollisionGroup {
        self.filter.map_or_else(|| body.collision_group(part), |filter| filter.group)
    }

    fn collides_with(&self, body: &dyn Collidable, part: usize, group: CollisionGroup) -> bool {
        self.filter.map_or_else(|| body.collides_with(part, group), |filter| filter.mask & group.bit() != 0)
    }
}

/// A part of an object in a search for pairs.
#[derive(Clone, Copy)]
pub(crate) struct FilteredPart<'a> {
    pub body: &'a dyn Collidable,
    pub part: usize,
    pub shape: &'a Shape,
}

impl<'a> FilteredPart<'a> {
    /// Returns the part; `None` without a shape.
    pub fn of(body: &'a dyn Collidable, part: usize) -> Option<FilteredPart<'a>> {
        Some(FilteredPart { body, part, shape: body.shape(part)? })
    }

    /// Returns the classes of its shapes; `None` if all have the filter of the body.
    fn classes(&self) -> Option<(&'a CompoundShape, Vec<FilterClass>)> {
        let Shape::Compound(compound) = self.shape else { return None };
        let filtered = !self.body.shape_filters(self.part).is_empty();
        filtered.then(|| (&**compound, FilterClass::of(self.body, self.part, compound)))
    }

    /// Returns two parts if a shape of one of them has a filter of its own; `None` for nearly all pairs.
    pub fn pair(sides: [(&'a dyn Collidable, usize); 2]) -> Option<[FilteredPart<'a>; 2]> {
        let filtered = sides.iter().any(|(body, part)| !body.shape_filters(*part).is_empty());
        let [a, b] = sides.map(|(body, part)| filtered.then(|| FilteredPart::of(body, part)).flatten());
        Some([a?, b?])
    }

    /// Returns the filter of one shape; `None` for that of the body.
    pub fn filter_of(&self, shape: u32) -> Option<ShapeFilter> {
        let own = self.body.shape_filters(self.part);
        own.iter().find(|(n, _)| *n == shape as usize).map(|(_, filter)| *filter)
    }

    fn whole(&self) -> FilterClass {
        FilterClass { filter: None, parts: Vec::new() }
    }

    /// Returns the shapes that `admits` selects by whether they are sensors, their group, and the groups that they collide with;
    /// `None` if there are none.
    fn shape_if(&self, admits: impl Fn(&FilterClass) -> bool) -> Option<Cow<'a, Shape>> {
        let Some((compound, classes)) = self.classes() else {
            return admits(&self.whole()).then_some(Cow::Borrowed(self.shape));
        };
        let mut parts: Vec<u32> =
            classes.iter().filter(|class| admits(class)).flat_map(|class| class.parts.iter().copied()).collect();
        parts.sort_unstable();
        match parts.len() {
            0 => None,
            n if n == compound.parts().len() => Some(Cow::Borrowed(self.shape)),
            _ => Some(Cow::Owned(Shape::Compound(compound.subset(&parts)))),
        }
    }

    /// Returns its shapes that are no sensors.
    pub fn solid(&self) -> Option<Cow<'a, Shape>> {
        self.shape_if(|class| !class.is_sensor(self.body, self.part))
    }

    /// Returns its shapes that are no sensors and that collide with group `group` while their own group is in `mask`.
    pub fn meeting(&self, group: CollisionGroup, mask: u64) -> Option<Cow<'a, Shape>> {
        self.shape_if(|class| {
            !class.is_sensor(self.body, self.part)
                && mask & class.group(self.body, self.part).bit() != 0
                && class.collides_with(self.body, self.part, group)
        })
    }

    /// Returns its shapes that could have contacts with one of several parts, and that a query of a group with a mask finds.
    pub fn met_by(&self, actors: &[FilteredPart<'_>], group: CollisionGroup, mask: u64) -> Option<Cow<'a, Shape>> {
        let actors: Vec<(&FilteredPart<'_>, Vec<FilterClass>)> = actors
            .iter()
            .map(|actor| (actor, actor.classes().map_or_else(|| vec![actor.whole()], |(_, classes)| classes)))
            .collect();
        self.shape_if(|own| {
            let of = own.group(self.body, self.part);
            let meets = |(actor, classes): &(&FilteredPart<'_>, Vec<FilterClass>)| {
                classes.iter().any(|class| {
                    !class.is_sensor(actor.body, actor.part)
                        && class.collides_with(actor.body, actor.part, of)
                        && own.collides_with(self.body, self.part, class.group(actor.body, actor.part))
                })
            };
            !own.is_sensor(self.body, self.part)
                && mask & of.bit() != 0
                && own.collides_with(self.body, self.part, group)
                && actors.iter().any(meets)
        })
    }

    /// Returns its sensors: each with its filter as a class, the index of the shape, and the shape.
    pub fn sensors(&self) -> Vec<(FilterClass, u32, Cow<'a, Shape>)> {
        let Some((compound, classes)) = self.classes() else {
            let sensor = self.body.is_sensor(self.part).then(|| (self.whole(), 0, Cow::Borrowed(self.shape)));
            return sensor.into_iter().collect();
        };
        let sensors = classes.into_iter().filter(|class| class.is_sensor(self.body, self.part));
        let single = |class: FilterClass| {
            class.parts.into_iter().map(move |n| (FilterClass { filter: class.filter, parts: vec![n] }, n))
        };
        sensors
            .flat_map(single)
            .map(|(class, n)| (class, n, Cow::Owned(Shape::Compound(compound.subset(&[n])))))
            .collect()
    }

    /// Returns its solid shapes that collide with those of a class of another part: what a sensor of it reports.
    pub fn sensed_by(&self, sensor: &FilteredPart<'_>, class: &FilterClass) -> Option<Cow<'a, Shape>> {
        let group = class.group(sensor.body, sensor.part);
        self.shape_if(|own| {
            !own.is_sensor(self.body, self.part)
                && own.collides_with(self.body, self.part, group)
                && class.collides_with(sensor.body, sensor.part, own.group(self.body, self.part))
        })
    }

    /// Returns its shapes that have contacts with one shape of another part.
    pub fn meeting_shape(&self, other: &FilteredPart<'_>, shape: u32) -> Option<Cow<'a, Shape>> {
        if self.body.shape_filters(self.part).is_empty() && other.body.shape_filters(other.part).is_empty() {
            return Some(Cow::Borrowed(self.shape));
        }
        self.sensed_by(other, &FilterClass { filter: other.filter_of(shape), parts: Vec::new() })
    }

    /// Returns the shapes of this part and another that have contacts with each other: one pair for nearly all parts, several if both
    /// have shapes with filters of their own. In each pair all shapes of this part meet all of the other one.
    pub fn contact_pairs(&self, other: &FilteredPart<'a>) -> Vec<[Cow<'a, Shape>; 2]> {
        let classes =
            |side: &FilteredPart<'a>| side.classes().map_or_else(|| vec![side.whole()], |(_, classes)| classes);
        let (own, theirs) = (classes(self), classes(other));
        // shapes of this part that meet the same shapes of the other one are one pair
        type Filters = Vec<Option<ShapeFilter>>;
        let mut found: Vec<[Filters; 2]> = Vec::new();
        for class in own.iter().filter(|class| !class.is_sensor(self.body, self.part)) {
            let group = class.group(self.body, self.part);
            let meets = |of: &&FilterClass| {
                !of.is_sensor(other.body, other.part)
                    && of.collides_with(other.body, other.part, group)
                    && class.collides_with(self.body, self.part, of.group(other.body, other.part))
            };
            let met: Filters = theirs.iter().filter(meets).map(|of| of.filter).collect();
            match found.iter_mut().find(|[_, known]| *known == met) {
                Some([own, _]) => own.push(class.filter),
                None if met.is_empty() => {}
                None => found.push([vec![class.filter], met]),
            }
        }
        let pair = |[own, met]: [Filters; 2]| {
            let own = self.shape_if(|class| own.contains(&class.filter))?;
            Some([own, other.shape_if(|class| met.contains(&class.filter))?])
        };
        found.into_iter().filter_map(pair).collect()
    }

    /// Drops contacts of several [`contact_pairs`](Self::contact_pairs) with another part that lie inside a shape of this part of
    /// another pair, if that meets the touched shape too. The deepest one stays where nothing else overlaps.
    pub fn drop_buried(&self, other: &FilteredPart<'a>, pose: &Pose, found: &mut Vec<Contact>) {
        let is_buried = |contact: &Contact| {
            let Some(met) = self.meeting_shape(other, contact.shapes[1]) else { return false };
            let Shape::Compound(compound) = &*met else { return false };
            let at = contact.point + contact.normal * (0.5 * contact.gap);
            let (at, outward) =
                (pose.inverse_transform_point(&at.into()).coords, pose.rotation.inverse() * -contact.normal);
            compound.has_no_contact(contact.shapes[0] as usize, &at, &outward)
        };
        let mut deepest: Option<Contact> = None;
        found.retain(|contact| {
            let stays = !is_buried(contact);
            if !stays && deepest.is_none_or(|deepest| contact.gap < deepest.gap) {
                deepest = Some(*contact);
            }
            stays
        });
        if found.iter().all(|contact| contact.gap >= 0.0) {
            found.extend(deepest.filter(|deepest| deepest.gap < 0.0));
        }
    }
}

/// Returns the shapes of a part that are no sensors and that collide with group `group` while their own group is in `mask`: the whole
/// shape, some parts of a compound, or `None`.
pub fn shape_meeting(body: &dyn Collidable, part: usize, group: CollisionGroup, mask: u64) -> Option<Cow<'_, Shape>> {
    FilteredPart::of(body, part)?.meeting(group, mask)
}

/// Returns whether an object has a sensor: a part, or a shape of a part.
pub(crate) fn has_sensor(body: &dyn Collidable) -> bool {
    (0..body.parts())
        .any(|part| body.is_sensor(part) || body.shape_filters(part).iter().any(|(_, filter)| filter.sensor))
}

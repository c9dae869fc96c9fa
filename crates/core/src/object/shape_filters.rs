//! Collision groups, masks and sensors of single shapes of a part, and which shapes of two parts meet: by these, and by the
//! pairs of parts and materials that ignore each other.

use super::collidable::{Collidable, CollisionGroup};
use crate::contact::pair_material::PairMaterials;
use crate::world::view::ObjectId;
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

/// Properties that decide which shapes of other parts a shape meets.
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct ShapeClass {
    /// `None` for the filter of the body.
    filter: Option<ShapeFilter>,
    /// [`Material::id`](crate::Material::id) of the shape, where materials decide.
    material: u32,
}

/// The shapes of a part that have one class.
pub(crate) struct FilterClass {
    class: ShapeClass,
    /// Indices of the parts of the compound, ascending.
    parts: Vec<u32>,
}

/// A part of an object in a search for pairs.
#[derive(Clone, Copy)]
pub(crate) struct FilteredPart<'a> {
    pub body: &'a dyn Collidable,
    pub part: usize,
    pub shape: &'a Shape,
    /// The object, and the pairs of its world that ignore each other; `None` to leave these out.
    pairs: Option<(ObjectId, &'a PairMaterials)>,
}

impl<'a> FilteredPart<'a> {
    /// Returns the part; `None` without a shape.
    pub fn of(body: &'a dyn Collidable, part: usize) -> Option<FilteredPart<'a>> {
        Some(FilteredPart { body, part, shape: body.shape(part)?, pairs: None })
    }

    /// Returns the part as one of an object of a world with chosen pairs.
    pub fn named(self, id: ObjectId, pairs: &'a PairMaterials) -> FilteredPart<'a> {
        FilteredPart { pairs: Some((id, pairs)), ..self }
    }

    /// Returns whether its shapes may differ in what they meet.
    pub fn differs(&self) -> bool {
        let by_material = || self.by_material() && !self.body.shape_materials(self.part).is_empty();
        !self.body.shape_filters(self.part).is_empty() || by_material()
    }

    fn by_material(&self) -> bool {
        self.pairs.is_some_and(|(_, pairs)| pairs.select_by_material())
    }

    /// Returns two parts if shapes of one of them may differ in what they meet; `None` for nearly all pairs.
    pub fn pair(sides: [FilteredPart<'a>; 2]) -> Option<[FilteredPart<'a>; 2]> {
        sides.iter().any(FilteredPart::differs).then_some(sides)
    }

    /// Returns the classes of its shapes, in the order of their first shapes; `None` if they do not differ.
    fn classes(&self) -> Option<(&'a CompoundShape, Vec<FilterClass>)> {
        let Shape::Compound(compound) = self.shape else { return None };
        if !self.differs() {
            return None;
        }
        let mut classes: Vec<FilterClass> = Vec::new();
        for n in 0..compound.parts().len() as u32 {
            let class = self.class_of(n);
            match classes.iter_mut().find(|known| known.class == class) {
                Some(known) => known.parts.push(n),
                None => classes.push(FilterClass { class, parts: vec![n] }),
            }
        }
        Some((compound, classes))
    }

    /// Returns the class of one of its shapes.
    pub fn class_of(&self, shape: u32) -> ShapeClass {
        let filters = self.body.shape_filters(self.part);
        let filter = filters.iter().find(|(n, _)| *n == shape as usize).map(|(_, filter)| *filter);
        let materials = self.body.shape_materials(self.part);
        let own = materials.iter().find(|(n, _)| self.by_material() && *n == shape as usize);
        ShapeClass { filter, material: own.map_or_else(|| self.body.material(self.part).id, |(_, own)| own.id) }
    }

    fn whole(&self) -> FilterClass {
        let class = ShapeClass { filter: None, material: self.body.material(self.part).id };
        FilterClass { class, parts: Vec::new() }
    }

    fn is_sensor(&self, class: &FilterClass) -> bool {
        class.class.filter.map_or_else(|| self.body.is_sensor(self.part), |filter| filter.sensor)
    }

    fn group(&self, class: &FilterClass) -> CollisionGroup {
        class.class.filter.map_or_else(|| self.body.collision_group(self.part), |filter| filter.group)
    }

    fn collides_with(&self, class: &FilterClass, group: CollisionGroup) -> bool {
        let own = class.class.filter;
        own.map_or_else(|| self.body.collides_with(self.part, group), |filter| filter.mask & group.bit() != 0)
    }

    /// Returns whether shapes of a class meet those of a class of another part, sensors or not: by their groups and
    /// masks, and by the pairs that ignore each other.
    fn meets(&self, class: &FilterClass, other: &FilteredPart<'_>, theirs: &FilterClass) -> bool {
        let ignores = || {
            let ((id, pairs), (other_id, _)) = self.pairs.zip(other.pairs)?;
            let own = (id, self.part, class.class.material);
            Some(pairs.ignores(own, (other_id, other.part, theirs.class.material)))
        };
        self.collides_with(class, other.group(theirs))
            && other.collides_with(theirs, self.group(class))
            && ignores() != Some(true)
    }

    /// Returns the shapes that `admits` selects; `None` if there are none.
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
        self.shape_if(|class| !self.is_sensor(class))
    }

    /// Returns its shapes that are no sensors and that collide with group `group` while their own group is in `mask`.
    pub fn meeting(&self, group: CollisionGroup, mask: u64) -> Option<Cow<'a, Shape>> {
        self.shape_if(|class| {
            !self.is_sensor(class) && mask & self.group(class).bit() != 0 && self.collides_with(class, group)
        })
    }

    /// Returns its shapes that could have contacts with one of several parts, and that a query of a group with a mask finds.
    pub fn met_by(&self, actors: &[FilteredPart<'_>], group: CollisionGroup, mask: u64) -> Option<Cow<'a, Shape>> {
        let actors: Vec<(&FilteredPart<'_>, Vec<FilterClass>)> =
            actors.iter().map(|actor| (actor, actor.all_classes())).collect();
        self.shape_if(|own| {
            let meets = |(actor, classes): &(&FilteredPart<'_>, Vec<FilterClass>)| {
                classes.iter().any(|class| !actor.is_sensor(class) && self.meets(own, actor, class))
            };
            !self.is_sensor(own)
                && mask & self.group(own).bit() != 0
                && self.collides_with(own, group)
                && actors.iter().any(meets)
        })
    }

    /// Returns its sensors: each with its class, the index of the shape, and the shape.
    pub fn sensors(&self) -> Vec<(FilterClass, u32, Cow<'a, Shape>)> {
        let Some((compound, classes)) = self.classes() else {
            let whole = self.whole();
            let sensor = self.is_sensor(&whole).then_some((whole, 0, Cow::Borrowed(self.shape)));
            return sensor.into_iter().collect();
        };
        let sensors = classes.into_iter().filter(|class| self.is_sensor(class));
        let single =
            |of: FilterClass| of.parts.into_iter().map(move |n| (FilterClass { class: of.class, parts: vec![n] }, n));
        sensors
            .flat_map(single)
            .map(|(class, n)| (class, n, Cow::Owned(Shape::Compound(compound.subset(&[n])))))
            .collect()
    }

    /// Returns its solid shapes that meet those of a class of another part: what a sensor of it reports.
    pub fn sensed_by(&self, sensor: &FilteredPart<'_>, class: &FilterClass) -> Option<Cow<'a, Shape>> {
        self.shape_if(|own| !self.is_sensor(own) && self.meets(own, sensor, class))
    }

    /// Returns its shapes that have contacts with one shape of another part.
    fn meeting_shape(&self, other: &FilteredPart<'_>, shape: u32) -> Option<Cow<'a, Shape>> {
        self.sensed_by(other, &FilterClass { class: other.class_of(shape), parts: Vec::new() })
    }

    fn all_classes(&self) -> Vec<FilterClass> {
        self.classes().map_or_else(|| vec![self.whole()], |(_, classes)| classes)
    }

    /// Returns the shapes of this part and another that have contacts with each other: one pair for nearly all parts, several if
    /// shapes of both differ. In each pair all shapes of this part meet all of the other one.
    pub fn contact_pairs(&self, other: &FilteredPart<'a>) -> Vec<[Cow<'a, Shape>; 2]> {
        let (own, theirs) = (self.all_classes(), other.all_classes());
        // shapes of this part that meet the same shapes of the other one are one pair
        let mut found: Vec<[Vec<ShapeClass>; 2]> = Vec::new();
        for class in own.iter().filter(|class| !self.is_sensor(class)) {
            let meets = |of: &&FilterClass| !other.is_sensor(of) && self.meets(class, other, of);
            let met: Vec<ShapeClass> = theirs.iter().filter(meets).map(|of| of.class).collect();
            match found.iter_mut().find(|[_, known]| *known == met) {
                Some([own, _]) => own.push(class.class),
                None if met.is_empty() => {}
                None => found.push([vec![class.class], met]),
            }
        }
        let pair = |[own, met]: [Vec<ShapeClass>; 2]| {
            let own = self.shape_if(|class| own.contains(&class.class))?;
            Some([own, other.shape_if(|class| met.contains(&class.class))?])
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

//! Events in a STATE message, for programs that read them in a facet.
//!
//! ```text
//! count u32 | count times: kind u8, side a, side b, impulse 3 f32, point 3 f32
//! side: object u32, then part u32, shape u32 of an object of the table, or the name of another object, or nothing
//! ```
//!
//! A kind is the index in [`EventKind::NAMES`]. An object is an index of the object table; `0xffff_ffff` is a side without one,
//! and `0xffff_fffe` an object of the scene that has no place in the table, such as a joint: its name follows. Impulse (on a, N·s)
//! and point (m) are in world axes. Events of other objects that the scene file does not have are left out.
//!
//! A frame has the events of all its steps, in their order. They are of this frame alone: a facet that misses a frame misses its
//! events, like its poses.

use super::wire::{ByteReader, MessageError, put_name};
use std::collections::BTreeMap;
use tumble_collide::Vec3;
use tumble_core::{Event, EventKind, ObjectId, World};

/// Maximum number of events in a message. If there are more, contacts that persist are left out first, those with the smallest
/// impulses.
pub const MAX_FRAME_EVENTS: usize = 1024;

const NONE: u32 = u32::MAX;
const NAMED: u32 = u32::MAX - 1;

/// The last step whose events were taken: its frame number and time.
#[derive(Default)]
pub(crate) struct LastStep(Option<(u64, u64)>);

impl LastStep {
    /// Returns whether the world has made a step since the last call.
    pub fn is_new(&mut self, world: &World) -> bool {
        let now = Some((world.frame(), world.time().to_bits()));
        std::mem::replace(&mut self.0, now) != now
    }
}

/// The events of the steps since the last frame.
#[derive(Default)]
pub(crate) struct StepEvents {
    last: LastStep,
    events: Vec<Event>,
}

impl StepEvents {
    /// Takes the events of the world's last step, unless they were taken before. At most `max` events are kept.
    pub fn step(&mut self, world: &World, max: usize) {
        if self.last.is_new(world) {
            self.events.extend(world.events());
            keep_largest(&mut self.events, max);
        }
    }

    /// Returns the events and forgets them.
    pub fn take(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.events)
    }
}

/// Leaves at most `max` events, in their order.
fn keep_largest(events: &mut Vec<Event>, max: usize) {
    if events.len() <= max {
        return;
    }
    let size = |event: &Event| match event.kind {
        EventKind::ContactPersist => event.impulse.norm(),
        _ => f64::INFINITY,
    };
    let mut order: Vec<usize> = (0..events.len()).collect();
    order.sort_by(|a, b| size(&events[*b]).total_cmp(&size(&events[*a])));
    order.truncate(max);
    order.sort_unstable();
    *events = order.into_iter().map(|k| events[k]).collect();
}

/// Appends these events. `index` has the place of each object in the table.
pub(crate) fn put_events(out: &mut Vec<u8>, events: &[Event], index: &BTreeMap<ObjectId, u32>, world: &World) {
    out.extend((events.len() as u32).to_le_bytes());
    for event in events {
        let kind = EventKind::NAMES.iter().position(|(_, kind)| *kind == event.kind).unwrap_or_default();
        out.push(kind as u8);
        put_side(out, Some(event.a), event.part_a, event.shape_a, index, world);
        put_side(out, event.b, event.part_b, event.shape_b, index, world);
        let numbers = event.impulse.iter().chain(&event.point);
        out.extend(numbers.flat_map(|x| (x.clamp(f32::MIN.into(), f32::MAX.into()) as f32).to_le_bytes()));
    }
}

fn put_side(
    out: &mut Vec<u8>,
    id: Option<ObjectId>,
    part: usize,
    shape: usize,
    index: &BTreeMap<ObjectId, u32>,
    world: &World,
) {
    match (id, id.and_then(|id| index.get(&id))) {
        (None, _) => out.extend(NONE.to_le_bytes()),
        (_, Some(object)) => out.extend([*object, part as u32, shape as u32].iter().flat_map(|i| i.to_le_bytes())),
        (Some(id), None) => {
            out.extend(NAMED.to_le_bytes());
            put_name(out, world.name(id).unwrap_or_default());
        }
    }
}

/// Reads the events of a message. `ids` are the objects of the table; the viewer has none.
///
/// # Errors
/// [`MessageError::Malformed`], [`MessageError::Unfit`].
pub(crate) fn get_events(
    rest: &mut ByteReader<'_>,
    ids: &[Option<ObjectId>],
    world: &World,
) -> Result<Vec<Event>, MessageError> {
    let count = rest.u32()? as usize;
    if count > MAX_FRAME_EVENTS {
        return Err(MessageError::Malformed("more than 1024 events"));
    }
    let mut events = Vec::with_capacity(count);
    for _ in 0..count {
        let (_, kind) =
            *EventKind::NAMES.get(rest.u8()? as usize).ok_or(MessageError::Malformed("an unknown kind of event"))?;
        let a = side(rest, ids, world)?.ok_or(MessageError::Malformed("an event of nothing"))?;
        let b = side(rest, ids, world)?;
        let (b, part_b, shape_b) = b.map_or((None, 0, 0), |(id, part, shape)| (Some(id), part, shape));
        let (impulse, point) = (vector(rest)?, vector(rest)?);
        let event = Event { kind, a: a.0, part_a: a.1, shape_a: a.2, b, part_b, shape_b, impulse, point };
        let there = |(id, part)| world.part_state(id, part).is_some();
        if event.is_of_parts() && !(there((event.a, event.part_a)) && b.is_some_and(|b| there((b, part_b)))) {
            return Err(MessageError::Malformed("an event of an unknown part"));
        }
        events.push(event);
    }
    Ok(events)
}

/// Reads one side: object, part and shape.
fn side(
    rest: &mut ByteReader<'_>,
    ids: &[Option<ObjectId>],
    world: &World,
) -> Result<Option<(ObjectId, usize, usize)>, MessageError> {
    match rest.u32()? {
        NONE => Ok(None),
        NAMED => {
            let name = rest.name()?;
            let id = world.find(name).ok_or_else(|| MessageError::Unfit(format!("'{name}' is not in this scene")))?;
            // an object of the table has one form only
            if ids.contains(&Some(id)) {
                return Err(MessageError::Malformed("an event that names an object of the table"));
            }
            Ok(Some((id, 0, 0)))
        }
        object => {
            let id = ids.get(object as usize).copied().flatten();
            let id = id.ok_or(MessageError::Malformed("an event of an unknown object"))?;
            Ok(Some((id, rest.u32()? as usize, rest.u32()? as usize)))
        }
    }
}

fn vector(rest: &mut ByteReader<'_>) -> Result<Vec3, MessageError> {
    let mut out = Vec3::zeros();
    for x in out.iter_mut() {
        *x = f32::from_le_bytes(rest.array()?).into();
        if !x.is_finite() {
            return Err(MessageError::Malformed("a number that is not finite"));
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contacts that persist go first, the smallest first; the others keep their order.
    #[test]
    fn of_too_many_events_the_smallest_that_persist_are_left_out() {
        let mut world = World::default();
        let shape = tumble_collide::Shape::sphere(0.1).unwrap();
        let id = world.add(tumble_core::RigidBody::new(shape).with_mass(1.0)).unwrap();
        let event = |kind, impulse: f64| Event {
            kind,
            a: id,
            part_a: 0,
            shape_a: 0,
            b: Some(id),
            part_b: 0,
            shape_b: 0,
            impulse: Vec3::z() * impulse,
            point: Vec3::zeros(),
        };
        let all = [
            event(EventKind::ContactEnd, 0.0),
            event(EventKind::ContactPersist, 1.0),
            event(EventKind::ContactPersist, 3.0),
            event(EventKind::ContactPersist, 2.0),
            event(EventKind::Asleep, 0.0),
        ];
        let mut kept = all.to_vec();
        keep_largest(&mut kept, 4);
        assert_eq!(kept, [all[0], all[2], all[3], all[4]]);
        keep_largest(&mut kept, 1);
        assert_eq!(kept, [all[0]]);
        keep_largest(&mut kept, 0);
        assert!(kept.is_empty());
    }
}

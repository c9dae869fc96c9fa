//! Events of a frame: contacts that begin, persist and end, sensors, joints that break, sleep.
//!
//! Two parts are in contact in a frame if their surfaces touch, or an impulse acts between them, in
//! any of its sub-steps. The pairs in contact are part of the state, so a restored world, a fork
//! and an archive have the same events in the next frame. A pair with a sleeping side stays in
//! contact without events.
//!
//! Sensors are compared with the parts of other objects at the end of the frame. An object that
//! passes through a sensor within one frame is not seen.

use super::{ContactPoint, Core, World, WorldState};
use crate::contact::detect::ContactConstraint;
use crate::contact::own_tests::OwnTests;
use crate::object::{FilterClass, FilteredPart, has_sensor};
use crate::world::view::{Entry, Mode, ObjectId};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use tumble_collide::{Aabb, Contact, Pose, Shape, Vec3};

/// Kind of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum EventKind {
    /// Two parts came into contact.
    ContactBegin,
    /// Two parts were in contact in this frame and the one before.
    ContactPersist,
    /// Two parts parted, or one of them stopped colliding.
    ContactEnd,
    /// A part of another object entered a sensor.
    SensorBegin,
    /// It left the sensor.
    SensorEnd,
    /// An object fell asleep.
    Asleep,
    /// An object woke.
    Awake,
    /// A loop joint broke.
    JointBroken,
    /// A scripted event fired: `a` is the event, `b` the body that made it fire.
    Fired,
}

impl EventKind {
    /// All kinds with their names in Python.
    pub const NAMES: &[(&str, EventKind)] = &[
        ("contact_begin", EventKind::ContactBegin),
        ("contact_persist", EventKind::ContactPersist),
        ("contact_end", EventKind::ContactEnd),
        ("sensor_begin", EventKind::SensorBegin),
        ("sensor_end", EventKind::SensorEnd),
        ("asleep", EventKind::Asleep),
        ("awake", EventKind::Awake),
        ("joint_broken", EventKind::JointBroken),
        ("fired", EventKind::Fired),
    ];
}

/// An event of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// Kind of the event.
    pub kind: EventKind,
    /// The object that was added first; the sensor; the object that fell asleep or woke; the joint that
    /// broke.
    pub a: ObjectId,
    /// Part of `a`.
    pub part_a: usize,
    /// Shape of that part at the contact point with the largest impulse, as in [`ContactPoint`]; 0 for all but contacts
    /// that begin or persist.
    pub shape_a: usize,
    /// The other object; `None` for sleep and joints.
    pub b: Option<ObjectId>,
    /// Part of `b`.
    pub part_b: usize,
    /// Shape of that part.
    pub shape_b: usize,
    /// Impulse on `a` over the frame, N·s, world axes; zero for all but contacts that begin or
    /// persist.
    pub impulse: Vec3,
    /// The contact point with the largest impulse, world axes, meters; zero like the impulse.
    pub point: Vec3,
}

impl Event {
    /// Returns an event of the first parts of two objects, without an impulse.
    pub(crate) fn of(kind: EventKind, a: ObjectId, b: Option<ObjectId>) -> Event {
        let zero = Vec3::zeros();
        Event { kind, a, part_a: 0, shape_a: 0, b, part_b: 0, shape_b: 0, impulse: zero, point: zero }
    }

    /// Returns whether it is of two parts: a contact, or a part in a sensor.
    pub fn is_of_parts(&self) -> bool {
        use EventKind::{ContactBegin, ContactEnd, ContactPersist, SensorBegin, SensorEnd};
        matches!(self.kind, ContactBegin | ContactPersist | ContactEnd | SensorBegin | SensorEnd)
    }

    /// Returns whether it knows the shapes that touch: a contact that begins or persists.
    pub fn has_shapes(&self) -> bool {
        matches!(self.kind, EventKind::ContactBegin | EventKind::ContactPersist)
    }

    /// Returns whether an object takes part.
    pub(crate) fn names(&self, id: ObjectId) -> bool {
        self.a == id || self.b == Some(id)
    }
}

/// A pair of parts that touch, or a sensor and a part in it. Sorted by sensors, then by the order of
/// addition.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) struct Touching {
    /// 0 for a contact. 1 if the first side is a sensor; 1 plus the index of the shape if only that shape is one.
    sensor: u32,
    /// Serial and part of either side.
    pair: [u32; 4],
}

impl Touching {
    /// Returns the pair of these serials and parts.
    pub fn of(pair: [u32; 4], sensor: bool) -> Touching {
        Touching { sensor: u32::from(sensor), pair }
    }

    /// Returns whether an object with this serial takes part.
    pub fn names(&self, serial: u32) -> bool {
        self.pair[0] == serial || self.pair[2] == serial
    }
}

/// Two parts that touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TouchingPair {
    /// Object and part of either side; the sensor first.
    pub sides: [(ObjectId, usize); 2],
    /// Whether the first side, or a shape of it, is a sensor that the second one is in.
    pub sensor: bool,
}

/// A contact of a sub-step.
#[derive(Clone, Copy, Debug)]
struct Touch {
    pair: [u32; 4],
    ids: [ObjectId; 2],
    /// On the first side, N·s.
    impulse: Vec3,
    point: Vec3,
    shapes: [u32; 2],
}

/// The contacts of the sub-steps of a frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Touches {
    list: Vec<Touch>,
    /// Number of those of sub-steps that are done, and of impacts. Those behind are of the present
    /// sub-step; their impulses are forces in `backtracking`, N.
    done: usize,
}

impl Touches {
    /// Forgets all.
    pub fn clear(&mut self) {
        self.list.clear();
        self.done = 0;
    }
}

/// A pair that touched in a frame.
struct Pair {
    pair: [u32; 4],
    ids: [ObjectId; 2],
    impulse: Vec3,
    point: Vec3,
    /// Shapes that touch at the point.
    shapes: [u32; 2],
    /// Norm of the impulse at the point.
    most: f64,
}

impl World {
    /// Returns the events of the last frame: contacts that ended, began or persisted, by the order
    /// in which their objects were added, then sensors, joints that broke, and sleep. Objects that were removed since
    /// have none.
    ///
    /// ```
    /// use tumble_core::EventKind;
    /// use tumble_core::prelude::*;
    /// let mut world = World::default();
    /// world.add(RigidBody::fixed(Shape::half_space()))?;
    /// let ball = world.add(RigidBody::new(Shape::sphere(0.1)?).with_pose(Pose::translation(0.0, 0.0, 0.2)))?;
    /// while world.events().is_empty() {
    ///     world.step()?;
    /// }
    /// let event = world.events()[0];
    /// assert_eq!((event.kind, event.b), (EventKind::ContactBegin, Some(ball)));
    /// assert!(event.impulse.z < 0.0); // on the ground
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn events(&self) -> &[Event] {
        &self.core.events
    }

    /// Returns whether the pairs that touch are known. In a facet they are those that its server sends: with the events, if the run has
    /// them, and otherwise not at all. Everywhere else they are always known.
    pub fn knows_touching(&self) -> bool {
        self.core.knows_touching
    }

    /// Returns the pairs of parts that touch after the last frame, each once: sensors last.
    pub fn touching_pairs(&self) -> Vec<TouchingPair> {
        let side = |serial, part: u32| Some((self.core.table.order[self.core.by_serial(serial)?], part as usize));
        let pair = |touching: &Touching| {
            let [a, part_a, b, part_b] = touching.pair;
            Some(TouchingPair { sides: [side(a, part_a)?, side(b, part_b)?], sensor: touching.sensor > 0 })
        };
        let mut pairs: Vec<TouchingPair> = self.core.state.touching.iter().filter_map(pair).collect();
        let place = |(id, part): (ObjectId, usize)| (self.core.table.place(id), part);
        pairs.sort_by_key(|pair| (pair.sensor, pair.sides.map(place)));
        pairs.dedup();
        pairs
    }

    /// Returns the objects and parts in contact with an object after the last frame, or in it if it
    /// is a sensor; each once, in the order of addition. Empty in a facet that does not [know](Self::knows_touching) them.
    pub fn touching(&self, id: ObjectId) -> Vec<(ObjectId, usize)> {
        let Some(serial) = self.core.table.place(id).map(|place| self.core.state.objects[place].serial) else {
            return Vec::new();
        };
        let others = self.core.state.touching.iter().filter_map(|touching| {
            let [a, part_a, b, part_b] = touching.pair;
            let other = match (a == serial, b == serial) {
                (true, _) => (b, part_b),
                (_, true) if touching.sensor == 0 => (a, part_a),
                _ => return None,
            };
            Some((self.core.table.order[self.core.by_serial(other.0)?], other.1 as usize))
        });
        let mut others: Vec<(ObjectId, usize)> = others.collect();
        others.sort_by_key(|(id, part)| (self.core.table.place(*id), *part));
        others.dedup();
        others
    }
}

impl Core {
    /// Adds the published contacts of a sub-step that touch; those that were added before in the same
    /// sub-step are dropped.
    pub(crate) fn touch_contacts(&mut self, constraints: &[ContactConstraint]) {
        let Touches { list, done } = &mut self.touches;
        list.truncate(*done);
        // `backtracking` ends a sub-step at an event that is not known yet
        let impulse = |c: &ContactPoint| if self.by_impulses { c.impulse } else { c.force };
        let touching = constraints.iter().zip(&self.contacts).filter(|(_, contact)| contact.is_touching());
        list.extend(touching.map(|(constraint, c)| Touch {
            pair: constraint.key.pair,
            ids: [c.a, c.b],
            impulse: impulse(c),
            point: c.point,
            shapes: constraint.contact.shapes,
        }));
    }

    /// Ends a sub-step of `h` seconds.
    pub(crate) fn keep_touches(&mut self, h: f64) {
        let Touches { list, done } = &mut self.touches;
        if !self.by_impulses {
            list[*done..].iter_mut().for_each(|touch| touch.impulse *= h);
        }
        *done = list.len();
    }

    /// Adds impacts with their impulses, N·s, on A.
    pub(crate) fn touch_impacts(&mut self, constraints: &[ContactConstraint], impulses: impl Iterator<Item = Vec3>) {
        let (owners, touches) = (&self.owners, &mut self.touches);
        touches.list.truncate(touches.done);
        let struck = constraints.iter().zip(impulses).filter(|(_, impulse)| *impulse != Vec3::zeros());
        touches.list.extend(struck.map(|(constraint, impulse)| Touch {
            pair: constraint.key.pair,
            ids: [constraint.a, constraint.b].map(|part| owners[part as usize].id),
            impulse,
            point: constraint.contact.point,
            shapes: constraint.contact.shapes,
        }));
        touches.done = touches.list.len();
    }

    /// After a frame: compares what touches with the frame before, whose state is `before`, and
    /// writes the events.
    pub(crate) fn collect_events(&mut self, before: &WorldState) {
        self.events.clear();
        let pairs = self.touched_pairs();
        let known = self.open_touching();
        let contact = |pair: [u32; 4]| Touching { sensor: 0, pair };
        let mut touching: Vec<Touching> = pairs.iter().map(|p| contact(p.pair)).collect();
        let mut later = pairs.iter().map(|p| p.pair).peekable();
        for &old in known.iter().filter(|t| t.sensor == 0) {
            while later.next_if(|pair| *pair < old.pair).is_some() {}
            if later.peek() != Some(&old.pair) {
                match self.sleeps(&old) {
                    true => touching.push(old),
                    false => self.add_event(EventKind::ContactEnd, &old),
                }
            }
        }
        let mut earlier = known.iter().peekable();
        for p in &pairs {
            let now = contact(p.pair);
            while earlier.next_if(|old| **old < now).is_some() {}
            let kind = match earlier.next_if(|old| **old == now) {
                Some(_) => EventKind::ContactPersist,
                None => EventKind::ContactBegin,
            };
            let ([a, b], [_, part_a, _, part_b], [shape_a, shape_b]) = (p.ids, p.pair, p.shapes);
            self.events.push(Event {
                kind,
                a,
                part_a: part_a as usize,
                shape_a: shape_a as usize,
                b: Some(b),
                part_b: part_b as usize,
                shape_b: shape_b as usize,
                impulse: p.impulse,
                point: p.point,
            });
        }
        let sensed = self.sensed_pairs();
        for &old in known.iter().filter(|t| t.sensor != 0 && sensed.binary_search(t).is_err()) {
            self.add_event(EventKind::SensorEnd, &old);
        }
        for &new in sensed.iter().filter(|t| known.binary_search(t).is_err()) {
            self.add_event(EventKind::SensorBegin, &new);
        }
        touching.extend(sensed);
        touching.sort_unstable();
        if touching != known {
            self.state.touching.retain(|t| known.binary_search(t).is_err());
            self.state.touching.extend_from_slice(&touching);
            self.state.touching.sort_unstable();
        }
        self.open_touching = touching;
        let broken = self.broken.iter().filter_map(|serial| self.by_serial(*serial));
        let broken: Vec<Event> = broken.map(|place| self.event_of_one(EventKind::JointBroken, place)).collect();
        self.events.extend(broken);
        self.add_sleep_events(before);
    }

    /// Returns the pairs known from the frame before that this frame may change: all but those of settled bodies.
    fn open_touching(&mut self) -> Vec<Touching> {
        let changes = Some(self.table.walk.changes);
        if self.open_touching_of == changes {
            return std::mem::take(&mut self.open_touching);
        }
        self.open_touching_of = changes;
        let settled = |serial: u32| self.by_serial(serial).is_some_and(|place| self.table.walk.is_settled(place));
        let closed = |t: &Touching| t.sensor == 0 && settled(t.pair[0]) && settled(t.pair[2]) && self.sleeps(t);
        self.state.touching.iter().filter(|t| !closed(t)).copied().collect()
    }

    /// Returns the pairs that touched in the frame, sorted, with their impulses.
    fn touched_pairs(&mut self) -> Vec<Pair> {
        let touches = &mut self.touches.list;
        // the order of addition, whatever the order of the sides in a contact
        for touch in touches.iter_mut().filter(|t| (t.pair[2], t.pair[3]) < (t.pair[0], t.pair[1])) {
            let [a, part_a, b, part_b] = touch.pair;
            (touch.pair, touch.impulse) = ([b, part_b, a, part_a], -touch.impulse);
            touch.ids.swap(0, 1);
            touch.shapes.swap(0, 1);
        }
        touches.sort_by_key(|touch| touch.pair);
        let mut pairs: Vec<Pair> = Vec::new();
        for touch in touches.iter() {
            let norm = touch.impulse.norm();
            match pairs.last_mut().filter(|last| last.pair == touch.pair) {
                Some(last) => {
                    last.impulse += touch.impulse;
                    if norm > last.most {
                        (last.most, last.point, last.shapes) = (norm, touch.point, touch.shapes);
                    }
                }
                None => {
                    let Touch { pair, ids, impulse, point, shapes } = *touch;
                    pairs.push(Pair { pair, ids, impulse, point, shapes, most: norm });
                }
            }
        }
        let least = self.settings.event_impulse;
        if least > 0.0 {
            pairs.retain(|pair| pair.impulse.norm() >= least);
        }
        pairs
    }

    fn sleeps(&self, touching: &Touching) -> bool {
        let asleep = |serial: u32| {
            self.by_serial(serial).map(|place| &self.state.objects[place]).is_some_and(|o| o.asleep && o.status.enabled)
        };
        let there = |serial: u32| {
            self.by_serial(serial).is_some_and(|place| {
                let status = self.state.objects[place].status;
                status.enabled && status.collidable
            })
        };
        let [a, _, b, _] = touching.pair;
        (asleep(a) || asleep(b)) && there(a) && there(b)
    }

    /// Adds an event without an impulse.
    fn add_event(&mut self, kind: EventKind, touching: &Touching) {
        let [a, part_a, b, part_b] = touching.pair;
        let (Some(a), Some(b)) = (self.by_serial(a), self.by_serial(b)) else { return };
        let (a, b) = (self.table.order[a], Some(self.table.order[b]));
        let (part_a, part_b) = (part_a as usize, part_b as usize);
        let shape_a = touching.sensor.saturating_sub(1) as usize;
        self.events.push(Event { part_a, shape_a, part_b, ..Event::of(kind, a, b) });
    }

    fn add_sleep_events(&mut self, before: &WorldState) {
        for place in self.table.walk.places.iter().map(|&place| place as usize) {
            let (was, is) = (&before.objects[place], &self.state.objects[place]);
            if was.asleep != is.asleep {
                let kind = if is.asleep { EventKind::Asleep } else { EventKind::Awake };
                let event = self.event_of_one(kind, place);
                self.events.push(event);
            }
        }
    }

    /// Returns an event of one object.
    fn event_of_one(&self, kind: EventKind, place: usize) -> Event {
        Event::of(kind, self.table.order[place], None)
    }

    /// Returns the pairs of a sensor and a part that overlaps it, sorted.
    fn sensed_pairs(&self) -> Vec<Touching> {
        let sensing = |e: Entry| e.status.enabled && e.object.collidable().is_some_and(has_sensor);
        if !self.objects().iter().any(sensing) {
            return Vec::new();
        }
        let parts = |sensors: bool| {
            let walked = sensors.then(|| self.objects().iter()).into_iter().flatten(); // no sensor is settled
            let all = (!sensors).then(|| self.objects().all()).into_iter().flatten();
            let entries = walked.chain(all).filter(|e| e.status.enabled && e.status.collidable);
            entries.filter_map(|e| Some((e, e.object.collidable()?))).flat_map(move |(entry, body)| {
                let parts = entry.state_range.parts.clone().enumerate();
                parts.filter_map(move |(part, row)| {
                    let pose = self.derived.part_states[row].pose;
                    let id = self.table.order[entry.place];
                    let side = FilteredPart::of(body, part)?.named(id, &self.pair_materials);
                    Some(SensedPart { entry, side, pose })
                })
            })
        };
        let sensors: Vec<Trigger<'_>> = parts(true)
            .flat_map(|part| {
                let own = part.side.sensors().into_iter();
                own.map(move |(class, number, shape)| Trigger {
                    around: shape.aabb(&part.pose),
                    part,
                    class,
                    number,
                    shape,
                })
            })
            .collect();
        let mut found = Vec::new();
        if sensors.is_empty() {
            return found;
        }
        let mut contacts = Vec::new();
        for part in parts(false) {
            if part.side.solid().is_none() {
                continue;
            }
            let bounds = part.side.shape.aabb(&part.pose);
            for trigger in &sensors {
                if trigger.around.overlaps(&bounds) && self.senses(trigger, &part, &mut contacts) {
                    let (sensor, other) = (trigger.part.entry.serial, part.entry.serial);
                    let pair = [sensor, trigger.part.side.part as u32, other, part.side.part as u32];
                    found.push(Touching { sensor: 1 + trigger.number, pair });
                }
            }
        }
        found.sort_unstable();
        found
    }

    fn senses(&self, trigger: &Trigger<'_>, other: &SensedPart<'_>, contacts: &mut Vec<Contact>) -> bool {
        let sensor = &trigger.part;
        let fixed = |entry: &Entry<'_>| entry.status.mode == Mode::Static;
        if fixed(&sensor.entry) && fixed(&other.entry) || sensor.entry.serial == other.entry.serial {
            return false;
        }
        let (FilteredPart { body: a, part: part_a, .. }, FilteredPart { body: b, part: part_b, .. }) =
            (sensor.side, other.side);
        let Some(shape) = other.side.sensed_by(&sensor.side, &trigger.class) else { return false };
        contacts.clear();
        let mode = a.contact_mode(part_a).of_pair(b.contact_mode(part_b));
        let tests = OwnTests::of([(sensor.entry.object, part_a), (other.entry.object, part_b)]);
        tests.contacts(mode, [&trigger.shape, &shape], [&sensor.pose, &other.pose], 0.0, contacts);
        !contacts.is_empty()
    }
}

/// A part of the search for sensors.
#[derive(Clone, Copy)]
struct SensedPart<'a> {
    entry: Entry<'a>,
    side: FilteredPart<'a>,
    pose: Pose,
}

/// A sensor: a whole part, or a shape of one.
struct Trigger<'a> {
    part: SensedPart<'a>,
    class: FilterClass,
    /// Index of the shape; 0 for a whole part.
    number: u32,
    shape: Cow<'a, Shape>,
    around: Aabb,
}

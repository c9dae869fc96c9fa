//! Triggers of a scripted event.

use crate::world::view::ObjectId;
use crate::world::{Event, EventKind};
use serde::{Deserialize, Serialize};

/// Longest name of a key, bytes.
pub const MAX_KEY_BYTES: usize = 32;

/// The cause that makes a [`ScriptedEvent`](super::ScriptedEvent) fire. `B` names an object: an id, or its index in
/// an archive. An empty list of bodies means every body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Trigger<B = ObjectId> {
    /// Once, at the end of the first frame that reaches a time.
    Time {
        /// Simulated time, s, above 0.
        at: f64,
    },
    /// Again and again, at most once in a frame.
    Every {
        /// Time between two firings, s, above 0.
        period: f64,
        /// Time of the first one, s, above 0.
        first: f64,
    },
    /// A body of `a` and one of `b` come into contact. With a threshold above 0: whenever the impulse
    /// between two parts in a frame reaches it, in a lasting contact too.
    Contact {
        /// Bodies of one side.
        a: Vec<B>,
        /// Bodies of the other side: the *other* body of the event.
        b: Vec<B>,
        /// Threshold of the impulse over a frame, N·s, at least 0.
        impulse: f64,
    },
    /// A body of `a` and one of `b` are in contact, in every frame after the one in which they came into contact.
    Touching {
        /// Bodies of one side.
        a: Vec<B>,
        /// Bodies of the other side: the *other* body of the event.
        b: Vec<B>,
    },
    /// A body of `a` and one of `b` part.
    Parting {
        /// Bodies of one side.
        a: Vec<B>,
        /// Bodies of the other side: the *other* body of the event.
        b: Vec<B>,
    },
    /// A body enters a sensor: the *other* body of the event.
    Enters {
        /// The sensor.
        sensor: B,
        /// The bodies that count.
        bodies: Vec<B>,
    },
    /// A body leaves a sensor: the *other* body of the event.
    Leaves {
        /// The sensor.
        sensor: B,
        /// The bodies that count.
        bodies: Vec<B>,
    },
    /// A body falls asleep: the *other* body of the event.
    Asleep {
        /// The bodies that count.
        bodies: Vec<B>,
    },
    /// A body wakes in a frame: the *other* body of the event.
    Awake {
        /// The bodies that count.
        bodies: Vec<B>,
    },
    /// A loop joint breaks.
    Breaks {
        /// The joint.
        joint: B,
    },
    /// A user presses a key: [`World::press`](crate::World::press).
    Key {
        /// Name of the key.
        key: String,
    },
    /// Another event fires; the *other* body is that of it.
    Fired {
        /// The event, which was added before.
        event: B,
    },
}

impl<B> Trigger<B> {
    /// Returns the same trigger with other names of objects.
    pub fn map<C>(&self, f: &mut dyn FnMut(&B) -> C) -> Trigger<C> {
        let mut all = |list: &[B]| list.iter().map(&mut *f).collect::<Vec<C>>();
        match self {
            Trigger::Time { at } => Trigger::Time { at: *at },
            Trigger::Every { period, first } => Trigger::Every { period: *period, first: *first },
            Trigger::Contact { a, b, impulse } => Trigger::Contact { a: all(a), b: all(b), impulse: *impulse },
            Trigger::Touching { a, b } => Trigger::Touching { a: all(a), b: all(b) },
            Trigger::Parting { a, b } => Trigger::Parting { a: all(a), b: all(b) },
            Trigger::Enters { sensor, bodies } => Trigger::Enters { bodies: all(bodies), sensor: f(sensor) },
            Trigger::Leaves { sensor, bodies } => Trigger::Leaves { bodies: all(bodies), sensor: f(sensor) },
            Trigger::Asleep { bodies } => Trigger::Asleep { bodies: all(bodies) },
            Trigger::Awake { bodies } => Trigger::Awake { bodies: all(bodies) },
            Trigger::Breaks { joint } => Trigger::Breaks { joint: f(joint) },
            Trigger::Key { key } => Trigger::Key { key: key.clone() },
            Trigger::Fired { event } => Trigger::Fired { event: f(event) },
        }
    }

    /// Returns the bodies that can be the *other* one; empty for every body, or none.
    pub fn others(&self) -> &[B] {
        match self {
            Trigger::Contact { b, .. } | Trigger::Touching { b, .. } | Trigger::Parting { b, .. } => b,
            Trigger::Enters { bodies, .. } | Trigger::Leaves { bodies, .. } => bodies,
            Trigger::Asleep { bodies } | Trigger::Awake { bodies } => bodies,
            _ => &[],
        }
    }

    /// Returns whether a firing has an *other* body.
    pub fn has_other(&self) -> bool {
        use Trigger::{Asleep, Awake, Contact, Enters, Fired, Leaves, Parting, Touching};
        let pair = matches!(self, Contact { .. } | Touching { .. } | Parting { .. } | Enters { .. } | Leaves { .. });
        pair || matches!(self, Asleep { .. } | Awake { .. } | Fired { .. })
    }
}

impl Trigger {
    /// Returns the other body, `None` in it without one, if what happened in the frame meets the trigger. Times, keys
    /// and other events are never met by what happened.
    pub fn met(&self, happened: &Event) -> Option<Option<ObjectId>> {
        let in_list = |list: &[ObjectId], id: ObjectId| list.is_empty() || list.contains(&id);
        let pair = |a: &[ObjectId], b: &[ObjectId]| {
            let (first, second) = (happened.a, happened.b?);
            if in_list(a, first) && in_list(b, second) {
                Some(Some(second))
            } else {
                (in_list(a, second) && in_list(b, first)).then_some(Some(first))
            }
        };
        let visitor = |sensor: ObjectId, bodies: &[ObjectId]| {
            let visitor = happened.b.filter(|visitor| happened.a == sensor && in_list(bodies, *visitor))?;
            Some(Some(visitor))
        };
        match (self, happened.kind) {
            (Trigger::Contact { a, b, impulse }, EventKind::ContactBegin) if happened.impulse.norm() >= *impulse => {
                pair(a, b)
            }
            (Trigger::Contact { a, b, impulse }, EventKind::ContactPersist)
                if *impulse > 0.0 && happened.impulse.norm() >= *impulse =>
            {
                pair(a, b)
            }
            (Trigger::Touching { a, b }, EventKind::ContactPersist) => pair(a, b),
            (Trigger::Parting { a, b }, EventKind::ContactEnd) => pair(a, b),
            (Trigger::Asleep { bodies }, EventKind::Asleep) | (Trigger::Awake { bodies }, EventKind::Awake) => {
                in_list(bodies, happened.a).then_some(Some(happened.a))
            }
            (Trigger::Enters { sensor, bodies }, EventKind::SensorBegin)
            | (Trigger::Leaves { sensor, bodies }, EventKind::SensorEnd) => visitor(*sensor, bodies),
            (Trigger::Breaks { joint }, EventKind::JointBroken) => (happened.a == *joint).then_some(None),
            _ => None,
        }
    }
}

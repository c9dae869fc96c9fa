//! `[[template]]`: bodies that events spawn. `[[event]]`: what happens, and when.

use std::collections::BTreeMap;

use tumble_core::{Action, MAX_KEY_BYTES, MAX_SPAWNED, Mode, Trigger};

use crate::parse::body::{BodySpec, Library, read_name};
use crate::parse::bound::Bound;
use crate::parse::event_actions::read_action;
use crate::parse::fields::{Fields, Value};

/// Largest number of actions of an event.
const MAX_ACTIONS: usize = 1_000;

/// Bodies that events spawn.
#[derive(Clone, Debug, PartialEq)]
pub struct TemplateSpec {
    /// The body; its name is that of the template.
    pub body: BodySpec,
    /// Largest number of bodies that are there at a time, 1 to 10,000.
    pub count: usize,
    /// Whether the oldest one is spawned again when all are there. Default false.
    pub reuse: bool,
}

impl TemplateSpec {
    /// Reads a template. `room` is the number of bodies that the scene may still have.
    pub(crate) fn read(mut f: Fields<'_>, library: &Library<'_>, room: &mut usize) -> Option<TemplateSpec> {
        let body = BodySpec::read(&mut f, library);
        let most = MAX_SPAWNED.min(*room) as u32;
        let count = match f.required("max", "the largest number of bodies that are there at a time, such as 20") {
            Some(value) => f.as_integer("max", value, 1..=most.max(1)) as usize,
            None => 1,
        };
        *room = room.saturating_sub(count);
        let reuse = f.flag_or("reuse", false);
        if let Some(value) = f.value("mode").filter(|_| body.as_ref().is_some_and(|body| body.mode != Mode::Dynamic)) {
            f.wrong("mode", value, "no `mode`: only dynamic bodies are spawned");
        }
        f.finish();
        Some(TemplateSpec { body: body?, count, reuse })
    }

    /// Returns the names of its bodies.
    pub fn names(&self) -> impl Iterator<Item = String> {
        body_names(&self.body.name, self.count)
    }
}

fn body_names(template: &str, count: usize) -> impl Iterator<Item = String> {
    (1..=count).map(move |number| format!("{template} {number}"))
}

/// A scripted event; objects by name, links as `OBJECT/LINK`.
#[derive(Clone, Debug, PartialEq)]
pub struct EventSpec {
    /// Unique in the scene, bodies included.
    pub name: String,
    /// `when`.
    pub when: Trigger<String>,
    /// Time from the trigger to the actions, s. Default 0.
    pub delay_s: f64,
    /// How often it fires at most. Default as often as its trigger is met.
    pub times: u32,
    /// `do`, in its order.
    pub actions: Vec<Action<String>>,
    /// Whether it can fire and has an effect. Default true.
    pub enabled: bool,
}

/// The kind of object that a name stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ObjectKind {
    /// A rigid body.
    Body { mode: Mode, sensor: bool },
    /// An articulated body, and whether a link of it has a sensor.
    Articulated { sensor: bool },
    /// One of its links: the number of degrees of freedom of its joint; of each whether it has a drive with a target, and whether it
    /// is an angle.
    Link { count: usize, driven: [bool; 3], turns: [bool; 3] },
    /// A loop joint, likewise.
    Joint { count: usize, driven: [bool; 3], turns: [bool; 3] },
    /// A coupling of two joints.
    Mimic,
    /// A template, and the number of its bodies.
    Template(usize),
    /// An event.
    Event,
    /// A measuring sensor, a soft body, particles, a flock, a boid or a field.
    Other,
}

impl ObjectKind {
    pub(crate) fn is_body(self) -> bool {
        matches!(self, ObjectKind::Body { .. } | ObjectKind::Articulated { .. } | ObjectKind::Link { .. })
    }

    /// Returns whether it is an object of its own, and not a part of one.
    pub(crate) fn is_object(self) -> bool {
        !matches!(self, ObjectKind::Link { .. } | ObjectKind::Template(_))
    }
}

/// The objects that events can name.
#[derive(Debug, Default)]
pub(crate) struct ObjectNames(BTreeMap<String, ObjectKind>);

impl ObjectNames {
    pub(crate) fn add(&mut self, name: &str, kind: ObjectKind) {
        self.0.insert(name.to_owned(), kind);
    }

    /// Adds a template and its bodies.
    pub(crate) fn add_template(&mut self, name: &str, count: usize) {
        self.add(name, ObjectKind::Template(count));
        for body in body_names(name, count) {
            self.add(&body, ObjectKind::Body { mode: Mode::Dynamic, sensor: false });
        }
    }

    /// Returns `name` if it is one of the right kind; reports it otherwise.
    pub(crate) fn check(
        &self,
        f: &Fields<'_>,
        key: &str,
        value: &Value<'_>,
        name: &str,
        right: impl Fn(ObjectKind) -> bool,
        expected: &str,
    ) -> Option<String> {
        match self.0.get(name) {
            Some(kind) if right(*kind) => return Some(name.to_owned()),
            Some(_) => f.wrong(key, value, expected),
            None => {
                let known: Vec<&str> = self.0.iter().filter(|(_, k)| right(**k)).map(|(n, _)| n.as_str()).collect();
                match known.is_empty() {
                    true => f.wrong(key, value, format!("{expected}; there is none")),
                    false => f.unknown_name(key, value, name, known),
                }
            }
        }
        None
    }

    /// Reads the name of an object of a kind.
    pub(crate) fn read(
        &self,
        f: &mut Fields<'_>,
        key: &'static str,
        right: impl Fn(ObjectKind) -> bool,
        expected: &str,
    ) -> Option<String> {
        let (name, value) = f.text(key, expected)?;
        self.check(f, key, value, name, right, expected)
    }

    /// Returns the bodies of one side: a name or a list of names; a template stands for all its bodies.
    fn side(&self, f: &Fields<'_>, key: &str, value: &Value<'_>) -> Vec<String> {
        const EXPECTED: &str = "the name of a body or template, or a list of names";
        let one = |value: &Value<'_>| -> Vec<String> {
            let Some(name) = value.get_ref().as_str() else {
                f.wrong(key, value, EXPECTED);
                return Vec::new();
            };
            if let Some(ObjectKind::Template(count)) = self.0.get(name) {
                return body_names(name, *count).collect();
            }
            let right = |kind| {
                matches!(kind, ObjectKind::Body { .. } | ObjectKind::Articulated { .. } | ObjectKind::Template(_))
            };
            self.check(f, key, value, name, right, EXPECTED).into_iter().collect()
        };
        match value.get_ref().as_array() {
            Some(items) if !items.is_empty() => items.iter().flat_map(one).collect(),
            Some(_) => {
                f.wrong(key, value, EXPECTED);
                Vec::new()
            }
            None => one(value),
        }
    }
}

/// The keys that say when, of which an event has one.
const WHEN: [&str; 12] = [
    "time_s", "every_s", "contact", "touching", "parting", "enters", "leaves", "asleep", "awake", "broken", "key",
    "after",
];

impl EventSpec {
    /// Reads an event. `lights` is the number of lights of the scene.
    pub(crate) fn read(mut f: Fields<'_>, names: &ObjectNames, lights: usize) -> Option<EventSpec> {
        let name = read_name(&mut f).unwrap_or_default();
        let (log, what) = (f.log, f.what.clone());
        let example = "{ time_s = 1.0 }";
        let when = f.required("when", &format!("what makes it fire, such as {example}"));
        let when = when.and_then(|value| Fields::of(log, value, format!("`when` of {what}"), example));
        let when = when.and_then(|fields| read_trigger(fields, names));
        let delay_s = f.number_or("delay_s", Bound::NOT_NEGATIVE, 0.0);
        let times = f.integer_or("times", 1..=u32::MAX, u32::MAX);
        let enabled = f.flag_or("enabled", true);
        let others = when.as_ref().map(|when| (when.has_other(), !when.others().is_empty()));
        let mut actions = Vec::new();
        for fields in f.tables("do", MAX_ACTIONS) {
            actions.extend(read_action(fields, names, others.unwrap_or((true, true)), lights));
        }
        if f.value("do").is_none() {
            f.missing("do", "a list of what is done, such as [{ push = \"ball\", impulse_n_s = [0, 0, 1] }]");
        }
        f.finish();
        Some(EventSpec { name, when: when?, delay_s, times, actions, enabled })
    }
}

fn read_trigger(mut f: Fields<'_>, names: &ObjectNames) -> Option<Trigger<String>> {
    let given: Vec<&'static str> = WHEN.into_iter().filter(|key| f.value(key).is_some()).collect();
    let &[key] = given.as_slice() else {
        let message = match given.is_empty() {
            true => format!("{} does not say when", f.what),
            false => format!("{} has {} conditions", f.what, given.len()),
        };
        f.log.report(
            f.span.clone(),
            message,
            format!("expected one of {}", WHEN.map(|key| format!("`{key}`")).join(", ")),
        );
        return None;
    };
    let problems = f.log.count();
    let trigger = match key {
        "time_s" => Some(Trigger::Time { at: f.number("time_s", Bound::POSITIVE) }),
        "every_s" => {
            let period = f.number("every_s", Bound::POSITIVE);
            Some(Trigger::Every { period, first: f.number_or("first_s", Bound::POSITIVE, period) })
        }
        "contact" => {
            let [a, b] = read_sides(&mut f, "contact", names);
            Some(Trigger::Contact { a, b, impulse: f.number_or("impulse_n_s", Bound::NOT_NEGATIVE, 0.0) })
        }
        "touching" => {
            let [a, b] = read_sides(&mut f, "touching", names);
            Some(Trigger::Touching { a, b })
        }
        "parting" => {
            let [a, b] = read_sides(&mut f, "parting", names);
            Some(Trigger::Parting { a, b })
        }
        "asleep" | "awake" => {
            let some = |value: &&Value<'_>| value.get_ref().as_array().is_none_or(|items| !items.is_empty());
            let bodies = f.value(key).filter(some).map_or(Vec::new(), |value| names.side(&f, key, value));
            Some(if key == "asleep" { Trigger::Asleep { bodies } } else { Trigger::Awake { bodies } })
        }
        "enters" | "leaves" => {
            let sensor =
                |kind| matches!(kind, ObjectKind::Body { sensor: true, .. } | ObjectKind::Articulated { sensor: true });
            let expected = "the name of a body, or of an articulated body with a shape, that has `sensor = true`";
            let sensor = names.read(&mut f, key, sensor, expected);
            let bodies = f.value("bodies").map_or(Vec::new(), |value| names.side(&f, "bodies", value));
            sensor.map(|sensor| match key {
                "enters" => Trigger::Enters { sensor, bodies },
                _ => Trigger::Leaves { sensor, bodies },
            })
        }
        "broken" => {
            let joint = names.read(
                &mut f,
                "broken",
                |kind| matches!(kind, ObjectKind::Joint { .. }),
                "the name of a loop joint",
            );
            joint.map(|joint| Trigger::Breaks { joint })
        }
        "key" => f.text("key", "the name of a key, such as \"k\"").and_then(|(key, value)| {
            if (1..=MAX_KEY_BYTES).contains(&key.len()) {
                return Some(Trigger::Key { key: key.into() });
            }
            f.wrong("key", value, format!("the name of a key of 1 to {MAX_KEY_BYTES} bytes"));
            None
        }),
        _ => {
            let expected = "the name of an event above this one";
            let event = names.read(&mut f, "after", |kind| kind == ObjectKind::Event, expected);
            event.map(|event| Trigger::Fired { event })
        }
    };
    let log = f.log;
    f.finish();
    trigger.filter(|_| log.count() == problems)
}

/// Reads the two sides of a contact: one entry for any other body, or two.
fn read_sides(f: &mut Fields<'_>, key: &'static str, names: &ObjectNames) -> [Vec<String>; 2] {
    let Some(value) = f.value(key) else { return Default::default() };
    match value.get_ref().as_array() {
        Some(items) if items.len() == 2 => [0, 1].map(|k| names.side(f, key, &items[k])),
        Some(items) if items.len() != 1 => {
            f.wrong(key, value, "the two sides, such as [\"ball\", \"floor\"] or [\"ball\", [\"floor\", \"wall\"]]");
            Default::default()
        }
        Some(items) => [names.side(f, key, &items[0]), Vec::new()],
        None => [names.side(f, key, value), Vec::new()],
    }
}

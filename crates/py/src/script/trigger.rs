//! Triggers of events in Python.

use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::script::{Given, part_of, several};
use crate::world::shared::Shared;
use pyo3::prelude::*;
use std::sync::Arc;
use tumble::dynamics::{ObjectId, Template, Trigger as Law, World as Core};

/// The cause that makes an event of ``World.add_event`` fire; made by one of its static methods.
///
/// Bodies are handles or names; a template stands for all its bodies. Where several are accepted, a list of them is.
#[pyclass(frozen, module = "tumble")]
pub struct Trigger {
    law: Law<Given>,
}

#[pymethods]
impl Trigger {
    /// Once, at the end of the first frame that reaches a time. at: s.
    #[staticmethod]
    #[pyo3(signature = (at, **unknown), text_signature = "(at)")]
    fn time(at: f64, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.time")?;
        Ok(Trigger { law: Law::Time { at } })
    }

    /// Again and again. period: s. first: time of the first firing, s, by default the period.
    #[staticmethod]
    #[pyo3(signature = (period, *, first=None, **unknown), text_signature = "(period, *, first=None)")]
    fn every(period: f64, first: Option<f64>, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.every")?;
        Ok(Trigger { law: Law::Every { period, first: first.unwrap_or(period) } })
    }

    /// A body of a and one of b come into contact; without b any body counts. With an impulse, N·s, above 0: whenever the impulse between
    /// two parts in a frame reaches it, in a lasting contact too. The body of b is the *other* one of the event.
    #[staticmethod]
    #[pyo3(signature = (a, b=None, *, impulse=0.0, **unknown), text_signature = "(a, b=None, *, impulse=0.0)")]
    fn contact(
        a: &Bound<'_, PyAny>,
        b: Option<&Bound<'_, PyAny>>,
        impulse: f64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.contact")?;
        Ok(Trigger { law: Law::Contact { a: several(Some(a))?, b: several(b)?, impulse } })
    }

    /// A body of a and one of b are in contact, in every step after the one in which they came into contact; not while they sleep.
    #[staticmethod]
    #[pyo3(signature = (a, b=None, **unknown), text_signature = "(a, b=None)")]
    fn touching(
        a: &Bound<'_, PyAny>,
        b: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.touching")?;
        Ok(Trigger { law: Law::Touching { a: several(Some(a))?, b: several(b)? } })
    }

    /// A body of a and one of b part.
    #[staticmethod]
    #[pyo3(signature = (a, b=None, **unknown), text_signature = "(a, b=None)")]
    fn parting(
        a: &Bound<'_, PyAny>,
        b: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.parting")?;
        Ok(Trigger { law: Law::Parting { a: several(Some(a))?, b: several(b)? } })
    }

    /// A body enters a sensor (``sensor=True`` of ``add_rigid`` and ``add_static``); without bodies any one counts. It is the *other* body of the event.
    #[staticmethod]
    #[pyo3(signature = (sensor, bodies=None, **unknown), text_signature = "(sensor, bodies=None)")]
    fn enters(sensor: Given, bodies: Option<&Bound<'_, PyAny>>, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.enters")?;
        Ok(Trigger { law: Law::Enters { sensor, bodies: several(bodies)? } })
    }

    /// A body leaves a sensor.
    #[staticmethod]
    #[pyo3(signature = (sensor, bodies=None, **unknown), text_signature = "(sensor, bodies=None)")]
    fn leaves(sensor: Given, bodies: Option<&Bound<'_, PyAny>>, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.leaves")?;
        Ok(Trigger { law: Law::Leaves { sensor, bodies: several(bodies)? } })
    }

    /// A body falls asleep; without bodies any one counts. It is the *other* body of the event.
    #[staticmethod]
    #[pyo3(signature = (bodies=None, **unknown), text_signature = "(bodies=None)")]
    fn asleep(bodies: Option<&Bound<'_, PyAny>>, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.asleep")?;
        Ok(Trigger { law: Law::Asleep { bodies: several(bodies)? } })
    }

    /// A body wakes in a step, not between two steps; without bodies any one counts. It is the *other* body of the event.
    #[staticmethod]
    #[pyo3(signature = (bodies=None, **unknown), text_signature = "(bodies=None)")]
    fn awake(bodies: Option<&Bound<'_, PyAny>>, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.awake")?;
        Ok(Trigger { law: Law::Awake { bodies: several(bodies)? } })
    }

    /// A joint of ``World.add_joint`` breaks.
    #[staticmethod]
    #[pyo3(signature = (joint, **unknown), text_signature = "(joint)")]
    fn broken(joint: Given, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.broken")?;
        Ok(Trigger { law: Law::Breaks { joint } })
    }

    /// A user presses a key in a window or in a cave, or a program calls ``World.press``.
    #[staticmethod]
    #[pyo3(signature = (key, **unknown), text_signature = "(key)")]
    fn key(key: String, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.key")?;
        Ok(Trigger { law: Law::Key { key } })
    }

    /// An event that was added before fires. The *other* body is that of it.
    #[staticmethod]
    #[pyo3(signature = (event, **unknown), text_signature = "(event)")]
    fn after(event: Given, unknown: Option<Unknown<'_, '_>>) -> Result<Trigger> {
        keywords::check(unknown, "Trigger.after")?;
        Ok(Trigger { law: Law::Fired { event } })
    }

    fn __repr__(&self) -> &'static str {
        match self.law {
            Law::Time { .. } => "<tumble.Trigger: time>",
            Law::Every { .. } => "<tumble.Trigger: every>",
            Law::Contact { .. } => "<tumble.Trigger: contact>",
            Law::Touching { .. } => "<tumble.Trigger: touching>",
            Law::Asleep { .. } => "<tumble.Trigger: asleep>",
            Law::Awake { .. } => "<tumble.Trigger: awake>",
            Law::Parting { .. } => "<tumble.Trigger: parting>",
            Law::Enters { .. } => "<tumble.Trigger: enters>",
            Law::Leaves { .. } => "<tumble.Trigger: leaves>",
            Law::Breaks { .. } => "<tumble.Trigger: broken>",
            Law::Key { .. } => "<tumble.Trigger: key>",
            Law::Fired { .. } => "<tumble.Trigger: after>",
        }
    }
}

impl Trigger {
    /// Returns the trigger of a world.
    pub fn resolved(&self, py: Python<'_>, world: &Core, shared: &Arc<Shared>) -> Result<Law> {
        let one = |given: &Given| part_of(world, Some(shared), given.bind(py)).map(|(id, _)| id);
        let all = |list: &[Given]| -> Result<Vec<ObjectId>> {
            let mut ids = Vec::with_capacity(list.len());
            for given in list {
                let id = one(given)?;
                match world.get::<Template>(id) {
                    Some(template) => ids.extend_from_slice(template.bodies()),
                    None => ids.push(id),
                }
            }
            Ok(ids)
        };
        let side = |list: &[Given]| match list.is_empty() {
            true => Err(Error::value("a: expected a body or a list of bodies")),
            false => all(list),
        };
        Ok(match &self.law {
            Law::Time { at } => Law::Time { at: *at },
            Law::Every { period, first } => Law::Every { period: *period, first: *first },
            Law::Contact { a, b, impulse } => Law::Contact { a: side(a)?, b: all(b)?, impulse: *impulse },
            Law::Touching { a, b } => Law::Touching { a: side(a)?, b: all(b)? },
            Law::Asleep { bodies } => Law::Asleep { bodies: all(bodies)? },
            Law::Awake { bodies } => Law::Awake { bodies: all(bodies)? },
            Law::Parting { a, b } => Law::Parting { a: side(a)?, b: all(b)? },
            Law::Enters { sensor, bodies } => Law::Enters { sensor: one(sensor)?, bodies: all(bodies)? },
            Law::Leaves { sensor, bodies } => Law::Leaves { sensor: one(sensor)?, bodies: all(bodies)? },
            Law::Breaks { joint } => Law::Breaks { joint: one(joint)? },
            Law::Key { key } => Law::Key { key: key.clone() },
            Law::Fired { event } => Law::Fired { event: one(event)? },
        })
    }
}

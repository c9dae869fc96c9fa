//! The methods of `World` that add events and templates, and press keys.

use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::appearance::looking;
use crate::objects::place::Place;
use crate::objects::shapes::Shape;
use crate::script::action::Action;
use crate::script::handles::{ScriptedEvent, Template};
use crate::script::trigger::Trigger;
use crate::world::add::rigid;
use crate::world::class::World;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyList;
use tumble::dynamics::{Material, ScriptedEvent as Core, Template as Store};

#[pymethods]
impl World {
    /// Adds a scripted event and returns its handle.
    ///
    /// when: a ``Trigger``. do: a list of ``Action`` and callables, done in this order, callables last. A callable is called after the
    /// frame, as ``f(view, firing)`` with a ``View`` and a ``Firing``, and returns None or a list of actions that are done at once.
    /// delay: from the trigger to the actions, s. times: how often it fires at most, None for any number. Objects that it names must be
    /// in the world.
    #[pyo3(signature = (name, when, r#do, *, delay=0.0, times=None, **unknown), text_signature = "($self, name, when, do, *, delay=0.0, times=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_event(
        &self,
        py: Python<'_>,
        name: &str,
        when: &Bound<'_, Trigger>,
        r#do: &Bound<'_, PyAny>,
        delay: f64,
        #[pyo3(from_py_with = whole::times)] times: Option<u32>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<ScriptedEvent> {
        keywords::check(unknown, "World.add_event")?;
        let given: Vec<Bound<'_, PyAny>> = match r#do.cast::<PyList>() {
            Ok(list) => list.iter().collect(),
            Err(_) => vec![r#do.clone()],
        };
        let (mut actions, mut calls) = (Vec::new(), Vec::new());
        for deed in given {
            match deed.cast::<Action>() {
                Ok(action) => actions.push(action.clone().unbind()),
                Err(_) if deed.is_callable() => calls.push(deed),
                Err(_) => return Err(PyTypeError::new_err("do: expected actions and callables").into()),
            }
        }
        let place = self.shared.extend(py, |inner| {
            let trigger = when.get().resolved(py, &inner.world, &self.shared)?;
            let event = Core::new(name, trigger).with_delay(delay).with_times(times.unwrap_or(u32::MAX));
            let event = actions.iter().try_fold(event, |event, action| {
                Ok::<_, Error>(event.with_action(action.get().resolved(py, &inner.world, Some(&self.shared))?))
            })?;
            let id = inner.world.add(event)?;
            inner.add_calls(id, &calls);
            Ok(Place { shared: self.shared.clone(), id, name: inner.world.name(id).unwrap_or_default().into() })
        })?;
        ScriptedEvent::new(py, place)
    }

    /// Adds equal rigid bodies for events to spawn, and returns their template.
    ///
    /// max: the largest number that is there at a time, 1 to 10,000. reuse: whether the oldest one is spawned again when all are there.
    /// mass, density, restitution, friction: as in ``add_rigid``. color: sRGB, each 0 to 1.
    #[pyo3(signature = (name, shape, max, *, mass=None, density=None, restitution=0.0, friction=0.5, reuse=false, color=None, **unknown), text_signature = "($self, name, shape, max, *, mass=None, density=None, restitution=0.0, friction=0.5, reuse=False, color=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn add_template(
        &self,
        py: Python<'_>,
        name: &str,
        shape: PyRef<'_, Shape>,
        #[pyo3(from_py_with = whole::max)] max: usize,
        mass: Option<f64>,
        density: Option<f64>,
        restitution: f64,
        friction: f64,
        reuse: bool,
        color: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Template> {
        keywords::check(unknown, "World.add_template")?;
        let body = rigid(name, &shape, mass, density, false)?.with_pose(shape.placement).with_material(Material {
            restitution,
            friction,
            ..Material::default()
        });
        let place = self.shared.write(py, |inner| {
            let look = crate::behaviors::appearance(color, inner.world.ids().len())?;
            let body = looking(body, look);
            let id = Store::add(&mut inner.world, name, &body, max, reuse)?;
            Ok(Place { shared: self.shared.clone(), id, name: inner.world.name(id).unwrap_or_default().into() })
        })?;
        Template::new(py, place)
    }

    /// Presses a key for the events that wait for it; they fire at the end of the next step. Returns whether there are any.
    #[pyo3(signature = (key, **unknown), text_signature = "($self, key)")]
    fn press(&self, py: Python<'_>, key: &str, unknown: Option<Unknown<'_, '_>>) -> Result<bool> {
        keywords::check(unknown, "World.press")?;
        self.shared.write(py, |inner| Ok(inner.world.press(key)))
    }
}

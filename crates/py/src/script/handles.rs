//! Handles of events and templates.

use crate::errors::Result;
use crate::objects::body::RigidBody;
use crate::objects::place::{Place, hash};
use crate::world::gc::{Anchor, anchor};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use tumble::dynamics::{ScriptedEvent as Core, Template as Store};

/// An event of a world, made by ``World.add_event`` or ``[[event]]``.
#[pyclass(frozen, module = "tumble")]
pub struct ScriptedEvent {
    pub place: Place,
    anchor: Py<Anchor>,
}

impl ScriptedEvent {
    /// Returns a handle.
    pub fn new(py: Python<'_>, place: Place) -> Result<ScriptedEvent> {
        Ok(ScriptedEvent { anchor: anchor(py, &place.shared)?, place })
    }
}

#[pymethods]
impl ScriptedEvent {
    /// Name, unique in its world.
    #[getter]
    fn name(&self) -> &str {
        &self.place.name
    }

    /// Whether its world still has it.
    #[getter]
    fn exists(&self) -> Result<bool> {
        self.place.shared.read(|inner| Ok(inner.world.status(self.place.id).is_some()))
    }

    /// How often it has fired.
    #[getter]
    fn fired(&self) -> Result<u64> {
        self.place.read(|inner| Core::fired(&inner.world, self.place.id))
    }

    /// Whether it can fire, and has effects.
    #[getter]
    fn enabled(&self) -> Result<bool> {
        Ok(self.place.status()?.enabled)
    }

    #[setter]
    fn set_enabled(&self, py: Python<'_>, value: bool) -> Result<()> {
        self.place.write(py, |inner| Ok(inner.world.set_enabled(self.place.id, value)?))
    }

    fn __repr__(&self) -> String {
        match self.fired() {
            Ok(fired) => format!("<ScriptedEvent '{}': fired {fired} times>", self.place.name),
            Err(_) => format!("<ScriptedEvent '{}', removed>", self.place.name),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<ScriptedEvent>().is_ok_and(|other| self.place.same(&other.get().place))
    }

    fn __hash__(&self) -> u64 {
        hash(&self.place)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }
}

/// Equal bodies that events spawn, made by ``World.add_template`` or ``[[template]]``.
///
/// They are in the world from the start, disabled, under the names ``"NAME 1"``, ``"NAME 2"`` and so on.
#[pyclass(frozen, module = "tumble")]
pub struct Template {
    pub place: Place,
    anchor: Py<Anchor>,
}

impl Template {
    /// Returns a handle.
    pub fn new(py: Python<'_>, place: Place) -> Result<Template> {
        Ok(Template { anchor: anchor(py, &place.shared)?, place })
    }

    fn counts(&self) -> Result<[u64; 2]> {
        self.place.read(|inner| Store::counts(&inner.world, self.place.id))
    }
}

#[pymethods]
impl Template {
    /// Name, unique in its world.
    #[getter]
    fn name(&self) -> &str {
        &self.place.name
    }

    /// Whether its world still has it.
    #[getter]
    fn exists(&self) -> Result<bool> {
        self.place.shared.read(|inner| Ok(inner.world.status(self.place.id).is_some()))
    }

    /// How often it has spawned a body.
    #[getter]
    fn spawned(&self) -> Result<u64> {
        Ok(self.counts()?[0])
    }

    /// How often it could not spawn one, because all were in use.
    #[getter]
    fn refused(&self) -> Result<u64> {
        Ok(self.counts()?[1])
    }

    /// Its bodies, disabled ones too.
    #[getter]
    fn bodies(&self, py: Python<'_>) -> Result<Vec<RigidBody>> {
        let places: Vec<Place> = self.place.read(|inner| {
            let ids = inner.world.get::<Store>(self.place.id)?.bodies();
            let name = |id| inner.world.name(id).unwrap_or_default().into();
            Some(ids.iter().map(|&id| Place { shared: self.place.shared.clone(), id, name: name(id) }).collect())
        })?;
        places.into_iter().map(|place| RigidBody::new(py, place)).collect()
    }

    fn __repr__(&self) -> String {
        match self.counts() {
            Ok([spawned, _]) => format!("<Template '{}': spawned {spawned} times>", self.place.name),
            Err(_) => format!("<Template '{}', removed>", self.place.name),
        }
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Template>().is_ok_and(|other| self.place.same(&other.get().place))
    }

    fn __hash__(&self) -> u64 {
        hash(&self.place)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> std::result::Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }
}

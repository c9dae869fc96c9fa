//! Handles of events and templates.

use crate::errors::Result;
use crate::objects::body::RigidBody;
use crate::objects::handle::handle;
use crate::objects::place::Place;
use crate::world::gc::Anchor;
use pyo3::prelude::*;
use tumble::dynamics::{ScriptedEvent as Core, Template as Store};

/// An event of a world, made by ``World.add_event`` or ``[[event]]``.
#[pyclass(frozen, module = "tumble")]
pub struct ScriptedEvent {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(ScriptedEvent, "ScriptedEvent", |event| event.fired().ok().map(|fired| format!(": fired {fired} times")));

#[pymethods]
impl ScriptedEvent {
    /// How often it has fired.
    #[getter]
    fn fired(&self) -> Result<u64> {
        self.place.read(|inner| Core::fired(&inner.world, self.place.id))
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

handle!(Template, "Template", |template| template
    .counts()
    .ok()
    .map(|[spawned, _]| format!(": spawned {spawned} times")));

impl Template {
    fn counts(&self) -> Result<[u64; 2]> {
        self.place.read(|inner| Store::counts(&inner.world, self.place.id))
    }
}

#[pymethods]
impl Template {
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
}

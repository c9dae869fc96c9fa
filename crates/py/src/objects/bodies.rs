//! The bodies of a world by number and by name.

use crate::errors::{Error, Result};
use crate::objects::articulation::Articulation;
use crate::objects::body::RigidBody;
use crate::objects::joint::Joint;
use crate::objects::place::{Found, Place, body_ids, by_name, found};
use crate::world::gc::{Anchor, anchor};
use crate::world::shared::Shared;
use pyo3::exceptions::{PyIndexError, PyTypeError};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyInt, PyIterator, PyList};
use std::sync::Arc;

/// The bodies of a world in the order in which they were added: a sequence that also takes names,
/// ``world.bodies["ball"]``.
///
/// It follows the world. Constraints and forces are not bodies.
#[pyclass(frozen, sequence, module = "tumble")]
pub struct Bodies {
    shared: Arc<Shared>,
    anchor: Py<Anchor>,
}

/// Returns the handle of an object.
pub fn handle(py: Python<'_>, shared: &Arc<Shared>, found: Found) -> Result<Py<PyAny>> {
    let place = Place { shared: shared.clone(), id: found.id, name: found.name };
    Ok(match found.robot {
        Some(robot) => Py::new(py, Articulation::placed(py, place, robot)?)?.into_any(),
        None if found.joint => Py::new(py, Joint::new(py, place)?)?.into_any(),
        None => Py::new(py, RigidBody::new(py, place)?)?.into_any(),
    })
}

impl Bodies {
    /// Returns the bodies of a world.
    pub fn new(py: Python<'_>, shared: Arc<Shared>) -> Result<Bodies> {
        Ok(Bodies { anchor: anchor(py, &shared)?, shared })
    }

    fn all(&self) -> Result<Vec<Found>> {
        self.shared.read(|inner| Ok(body_ids(&inner.world).into_iter().filter_map(|id| found(inner, id)).collect()))
    }

    fn list<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyList>> {
        let handles =
            self.all()?.into_iter().map(|found| handle(py, &self.shared, found)).collect::<Result<Vec<_>>>()?;
        Ok(PyList::new(py, handles)?)
    }
}

/// Returns the handle of the rigid body of that name.
pub fn rigid_body(py: Python<'_>, shared: &Arc<Shared>, name: &str) -> Result<RigidBody> {
    let Found { id, name, robot, .. } = shared.read(|inner| by_name(inner, name))?;
    match robot {
        None => RigidBody::new(py, Place { shared: shared.clone(), id, name }),
        Some(_) => Err(Error::Name(format!(
            "'{name}' is an articulation and not a rigid body; world.articulation('{name}') gives its handle"
        ))),
    }
}

/// Returns the handle of the articulated body of that name.
pub fn articulation(py: Python<'_>, shared: &Arc<Shared>, name: &str) -> Result<Articulation> {
    let Found { id, name, robot, .. } = shared.read(|inner| by_name(inner, name))?;
    match robot {
        Some(robot) => Articulation::placed(py, Place { shared: shared.clone(), id, name }, robot),
        None => Err(Error::Name(format!(
            "'{name}' is a rigid body and not an articulation; world.body('{name}') gives its handle"
        ))),
    }
}

/// Returns the place of any handle.
pub fn place_of(body: &Bound<'_, PyAny>) -> Result<Place> {
    if let Some(place) = body.cast::<Articulation>().ok().and_then(|body| body.get().place().cloned()) {
        return Ok(place);
    }
    match body.cast::<RigidBody>() {
        Ok(body) => Ok(body.get().place.clone()),
        Err(_) => Err(PyTypeError::new_err("expected a handle or the name of an object").into()),
    }
}

#[pymethods]
impl Bodies {
    fn __len__(&self) -> Result<usize> {
        self.shared.read(|inner| Ok(body_ids(&inner.world).len()))
    }

    fn __getitem__(&self, py: Python<'_>, key: &Bound<'_, PyAny>) -> Result<Py<PyAny>> {
        if let Ok(name) = key.extract::<String>() {
            let found = self.shared.read(|inner| by_name(inner, &name))?;
            return handle(py, &self.shared, found);
        }
        if !key.is_instance_of::<PyInt>() && !key.hasattr("__index__")? {
            return Err(PyTypeError::new_err("bodies are indexed by name or by number").into());
        }
        let index: isize = key.extract()?;
        let found = self.shared.read(|inner| {
            let ids = body_ids(&inner.world);
            let at = if index < 0 { index + ids.len() as isize } else { index };
            Ok(usize::try_from(at).ok().and_then(|at| ids.get(at)).and_then(|&id| self::found(inner, id)))
        })?;
        match found {
            Some(found) => handle(py, &self.shared, found),
            None => Err(PyIndexError::new_err(format!("there is no body number {index}")).into()),
        }
    }

    fn __contains__(&self, key: &Bound<'_, PyAny>) -> Result<bool> {
        if let Ok(name) = key.extract::<String>() {
            return self.shared.read(|inner| Ok(by_name(inner, &name).is_ok()));
        }
        let Ok(place) = place_of(key) else { return Ok(false) };
        self.shared.read(|inner| Ok(Arc::ptr_eq(&place.shared, &self.shared) && inner.world.status(place.id).is_some()))
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyIterator>> {
        Ok(self.list(py)?.try_iter()?)
    }

    /// Returns the names of all bodies, in order.
    fn names(&self) -> Result<Vec<String>> {
        Ok(self.all()?.into_iter().map(|found| found.name.to_string()).collect())
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }

    fn __repr__(&self) -> Result<String> {
        Ok(format!("<tumble.Bodies {:?}>", self.names()?))
    }
}

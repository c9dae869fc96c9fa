//! Measuring sensors of a world, and the mapping of their readings.

use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::objects::handle::handle;
use crate::objects::place::Place;
use crate::world::gc::{Anchor, anchor};
use crate::world::sensors;
use crate::world::shared::Shared;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::sync::Arc;
use tumble::dynamics::Sensor as Core;

/// A measuring sensor, made by ``World.add_sensor`` or ``[[sensor]]``.
#[pyclass(frozen, module = "tumble")]
pub struct Sensor {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(Sensor, "Sensor", |sensor| sensor.kind().ok().map(|kind| format!(": {kind}")));

#[pymethods]
impl Sensor {
    /// Quantity that it reads.
    #[getter]
    fn kind(&self) -> Result<&'static str> {
        self.place.read(|inner| inner.world.get::<Core>(self.place.id).map(|sensor| sensor.kind().name()))
    }

    /// Reading at the end of the last step, with its errors: 3 numbers, or 1 or 4 for some kinds, or the present image of a camera. Raises ``RemovedError`` if
    /// the sensor or its body was removed.
    #[getter]
    fn value<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        sensors::value(py, &self.place)
    }

    /// Starts its noise anew from a seed, a whole number of at most 64 bits. The reading and the bias stay.
    #[pyo3(signature = (seed, **unknown), text_signature = "($self, seed)")]
    fn seed(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::seed)] seed: u64,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Sensor.seed")?;
        self.place.write(py, |inner| Ok(inner.world.seed_sensor(self.place.id, seed)?))
    }
}

/// The readings of all measuring sensors of a world by name, in the order of their addition: a mapping to arrays.
#[pyclass(frozen, mapping, module = "tumble")]
pub struct Sensors {
    shared: Arc<Shared>,
    anchor: Py<Anchor>,
}

impl Sensors {
    /// Returns the mapping of a world.
    pub fn new(py: Python<'_>, shared: &Arc<Shared>) -> Result<Sensors> {
        Ok(Sensors { anchor: anchor(py, shared)?, shared: shared.clone() })
    }

    fn names(&self) -> Result<Vec<String>> {
        sensors::names(&self.shared)
    }
}

#[pymethods]
impl Sensors {
    /// Reading of a sensor, as ``Sensor.value``. An unknown name raises ``UnknownNameError``.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> Result<Bound<'py, PyAny>> {
        sensors::value(py, &sensors::place_by_name(&self.shared, name)?)
    }

    fn __contains__(&self, name: &Bound<'_, PyAny>) -> Result<bool> {
        let name = name.extract::<String>();
        Ok(name.is_ok_and(|name| self.names().is_ok_and(|names| names.contains(&name))))
    }

    fn __len__(&self) -> Result<usize> {
        Ok(self.names()?.len())
    }

    fn __iter__(&self, py: Python<'_>) -> Result<Py<PyAny>> {
        Ok(PyList::new(py, self.names()?)?.try_iter()?.into_any().unbind())
    }

    /// Names of all sensors.
    fn keys(&self) -> Result<Vec<String>> {
        self.names()
    }

    /// Readings of all sensors.
    fn values<'py>(&self, py: Python<'py>) -> Result<Vec<Bound<'py, PyAny>>> {
        self.names()?.iter().map(|name| self.__getitem__(py, name)).collect()
    }

    /// Names and readings of all sensors.
    fn items<'py>(&self, py: Python<'py>) -> Result<Vec<(String, Bound<'py, PyAny>)>> {
        self.names()?.into_iter().map(|name| Ok((name.clone(), self.__getitem__(py, &name)?))).collect()
    }

    /// The handle of a sensor, for its kind and its seed.
    #[pyo3(signature = (name, **unknown), text_signature = "($self, name)")]
    fn handle(&self, py: Python<'_>, name: &str, unknown: Option<Unknown<'_, '_>>) -> Result<Sensor> {
        keywords::check(unknown, "Sensors.handle")?;
        Sensor::new(py, sensors::place_by_name(&self.shared, name)?)
    }

    /// All readings but images as one value of a structured dtype, with a field of each sensor's name: ``record["imu"]``.
    fn record<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let (names, numbers) = sensors::all(&self.shared)?;
        if names.is_empty() {
            return Err(Error::value("the world has no measuring sensors"));
        }
        let fields = names.into_iter().map(|(name, length)| (name, "f8", (length,)));
        let numpy = py.import("numpy")?;
        let dtype = numpy.call_method1("dtype", (PyList::new(py, fields)?,))?;
        let options = PyDict::new(py);
        options.set_item("dtype", numpy.getattr("float64")?)?;
        let flat = numpy.call_method("array", (numbers,), Some(&options))?;
        Ok(flat.call_method1("view", (dtype,))?.get_item(0)?)
    }

    fn __repr__(&self) -> Result<String> {
        Ok(format!("<Sensors: {}>", self.names()?.join(", ")))
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.anchor)
    }
}

//! A coupling of two joints of a world: a handle that reads from the world at each use.

use crate::errors::Result;
use crate::objects::bodies::handle as handle_of;
use crate::objects::handle::handle;
use crate::objects::place::{Place, found};
use crate::world::gc::Anchor;
use pyo3::prelude::*;
use pyo3::types::{PyString, PyTuple};
use tumble::dynamics::{ArticulatedBody, JointRef, Mimic as Core};

/// A coupling of two joints, made by ``World.add_mimic`` or ``[[mimic]]``: the position of one is ``multiplier`` times that
/// of the other, plus ``offset``.
#[pyclass(frozen, module = "tumble")]
pub struct Mimic {
    pub place: Place,
    anchor: Py<Anchor>,
}

handle!(Mimic, "Mimic", |mimic| mimic.multiplier().ok().map(|multiplier| format!(": {multiplier}")));

impl Mimic {
    fn constant<T>(&self, get: impl FnOnce(&Core) -> T) -> Result<T> {
        self.place.read(|inner| inner.world.get::<Core>(self.place.id).map(get))
    }

    fn set_ratio(&self, py: Python<'_>, [multiplier, offset]: [f64; 2]) -> Result<()> {
        self.place.write(py, |inner| Ok(inner.world.set_mimic_ratio(self.place.id, multiplier, offset)?))
    }

    fn side(&self, py: Python<'_>, side: usize) -> Result<Option<Py<PyAny>>> {
        let joint = self.constant(|mimic| mimic.joints()[side])?;
        let Some(object) = self.place.read(|inner| Some(found(inner, joint.object())))? else { return Ok(None) };
        let object = handle_of(py, &self.place.shared, object)?;
        let JointRef::Dof(body, dof) = joint else { return Ok(Some(object)) };
        let link = self.place.read(|inner| {
            let links = inner.world.get::<ArticulatedBody>(body)?.model().links();
            links.iter().find(|link| link.v == dof).map(|link| link.name.clone())
        })?;
        let link = PyString::new(py, &link).into_any().unbind();
        Ok(Some(PyTuple::new(py, [object, link])?.into_any().unbind()))
    }
}

#[pymethods]
impl Mimic {
    /// The joint that follows: a ``Joint``, or (articulation, link); None if it was removed.
    #[getter]
    fn joint(&self, py: Python<'_>) -> Result<Option<Py<PyAny>>> {
        self.side(py, 0)
    }

    /// The joint that it follows: a ``Joint``, or (articulation, link); None if it was removed.
    #[getter]
    fn of(&self, py: Python<'_>) -> Result<Option<Py<PyAny>>> {
        self.side(py, 1)
    }

    /// Ratio of the positions, not 0.
    #[getter]
    fn multiplier(&self) -> Result<f64> {
        self.constant(|mimic| mimic.ratio()[0])
    }

    #[setter]
    fn set_multiplier(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set_ratio(py, [value, self.offset()?])
    }

    /// Position of the joint that follows while the other is at 0, rad or m.
    #[getter]
    fn offset(&self) -> Result<f64> {
        self.constant(|mimic| mimic.ratio()[1])
    }

    #[setter]
    fn set_offset(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set_ratio(py, [self.multiplier()?, value])
    }

    /// Force of the coupling along the position of the joint that follows in the last sub-step, N·m or N; on the other
    /// joint acts ``-multiplier`` times as much.
    #[getter]
    fn force(&self) -> Result<f64> {
        self.place.read(|inner| inner.world.mimic_force(self.place.id))
    }

    /// Position of the joint that follows less that which it should have, rad or m; NaN while it does not act.
    #[getter]
    fn error(&self) -> Result<f64> {
        self.constant(Core::clone)
            .and_then(|mimic| self.place.read(|inner| Some(mimic.error(&inner.world.view()).unwrap_or(f64::NAN))))
    }
}

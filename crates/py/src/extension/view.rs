//! The world as seen by a force or a behavior written in Python, and the arrays that receive its
//! forces.
//!
//! There is a row for each body and each link. Rows are copied into numpy arrays for each call,
//! because the world's own memory changes during a step and an array that a callback keeps would
//! refer to it. The arrays of one call are reused by the next, unless Python kept any. After the
//! call the view raises an error, and its force arrays are read once and not again.

use crate::arrays::convert::vec3;
use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::extension::columns::Arrays;
use crate::extension::layout::Layout;
use crate::keywords::{self, Unknown};
use crate::objects::bodies::place_of;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PySlice, PyString};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::collide::Vec3;
use tumble::dynamics::WorldView;

/// The world as a force or a behavior sees it during a call: a row for every rigid body and every
/// link, in world axes.
///
/// The arrays are read-only copies, except ``force`` and ``torque``, which start at zero and to
/// which the callback adds. After the callback has returned the view raises ``RemovedError``.
#[pyclass(frozen, module = "tumble")]
pub struct View {
    arrays: Arc<Arrays>,
    layout: Arc<Layout>,
    moves: Vec<bool>,
    time: f64,
    gravity: Vec3,
    over: AtomicBool,
}

impl View {
    /// Returns a view of filled arrays.
    pub fn new(view: &WorldView, layout: &Arc<Layout>, arrays: &Arc<Arrays>) -> View {
        let mut moves = vec![false; layout.len()];
        for (id, _, rows) in &layout.objects {
            let moving = view.status(*id).is_some_and(|status| status.moves());
            rows.clone().for_each(|row| moves[row] = moving && layout.rows[row].may_move);
        }
        View {
            arrays: arrays.clone(),
            layout: layout.clone(),
            moves,
            time: view.time,
            gravity: view.gravity,
            over: AtomicBool::new(false),
        }
    }

    /// Marks the end of the callback.
    pub fn end(&self) {
        self.over.store(true, Ordering::Relaxed);
    }

    fn open(&self) -> Result<()> {
        match self.over.load(Ordering::Relaxed) {
            true => Err(Error::Removed(
                "this view belonged to a call that has returned; copy data that is needed later during the call".into(),
            )),
            false => Ok(()),
        }
    }

    /// Returns a view of a read-only array, by its index in [`Arrays::shown`].
    fn shown<'py>(&self, py: Python<'py>, which: usize) -> Result<Bound<'py, PyAny>> {
        self.open()?;
        Ok(self.arrays.shown[which].1.bind(py).call_method0("view")?)
    }

    /// Returns a writable view.
    fn open_view<'py>(&self, py: Python<'py>, array: &Py<PyArray2<f64>>) -> Result<Bound<'py, PyAny>> {
        self.open()?;
        Ok(array.bind(py).call_method0("view")?)
    }

    fn set(&self, py: Python<'_>, array: &Py<PyArray2<f64>>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.open()?;
        let own = array.bind(py);
        // `view.force += …` assigns the array that it was given.
        match value.cast::<PyArray2<f64>>() {
            Ok(value) if value.data() == own.data() && value.shape() == own.shape() && value.is_c_contiguous() => {
                Ok(())
            }
            _ => Ok(own.set_item(py.Ellipsis(), value)?),
        }
    }

    fn row_of(&self, body: &Bound<'_, PyAny>) -> Result<Range<usize>> {
        self.open()?;
        let unknown = |name: &str| {
            let names: Vec<&str> = self.layout.objects.iter().take(8).map(|(_, name, _)| &**name).collect();
            Error::Name(format!("the world has no body named '{name}'; there are {}", names.join(", ")))
        };
        if let Ok(name) = body.extract::<String>() {
            let found = self.layout.objects.iter().find(|(_, other, _)| **other == *name);
            return found.map(|(.., rows)| rows.clone()).ok_or_else(|| unknown(&name));
        }
        let place = place_of(body)?;
        let found = self.layout.objects.iter().find(|(id, name, _)| *id == place.id && *name == place.name);
        found.map(|(.., rows)| rows.clone()).ok_or_else(|| unknown(&place.name))
    }
}

#[pymethods]
impl View {
    /// Simulated time of this evaluation, s. Within a step it may be anywhere in it.
    #[getter]
    fn time(&self) -> Result<f64> {
        self.open().map(|()| self.time)
    }

    /// Gravity, shape (3,), m/s².
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.open()?;
        Ok(crate::arrays::convert::vector(py, &self.gravity))
    }

    /// Positions of the centers of mass, shape (n, 3), m.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shown(py, 0)
    }

    /// Orientations, body to world, unit quaternions (x, y, z, w), shape (n, 4).
    #[getter]
    fn orientation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shown(py, 1)
    }

    /// Velocities of the same points, shape (n, 3), m/s.
    #[getter]
    fn velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shown(py, 2)
    }

    /// Angular velocities, shape (n, 3), rad/s.
    #[getter]
    fn angular_velocity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shown(py, 3)
    }

    /// Accelerations of the same points at the last force evaluation, shape (n, 3), m/s².
    #[getter]
    fn acceleration<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shown(py, 4)
    }

    /// Angular accelerations at the same time, shape (n, 3), rad/s².
    #[getter]
    fn angular_acceleration<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shown(py, 5)
    }

    /// Masses, shape (n,), kg; 0 for static geometry and for bases.
    #[getter]
    fn mass<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        self.open()?;
        Ok(crate::arrays::convert::array(py, &self.layout.rows.iter().map(|row| row.mass).collect::<Vec<_>>()))
    }

    /// Whether forces move it: dynamic and enabled. Shape (n,), bool.
    #[getter]
    fn moves<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<bool>>> {
        self.open()?;
        Ok(PyArray1::from_slice(py, &self.moves))
    }

    /// Name of the body of each row.
    #[getter]
    fn names(&self) -> Result<Vec<String>> {
        self.open()?;
        Ok(self.layout.objects.iter().flat_map(|(_, name, rows)| rows.clone().map(|_| name.to_string())).collect())
    }

    /// Forces at the centers of mass (``position``), shape (n, 3), N, world axes. Callbacks add to
    /// it.
    #[getter]
    fn force<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.open_view(py, &self.arrays.force)
    }

    #[setter]
    fn set_force(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set(py, &self.arrays.force, value)
    }

    /// Torques, shape (n, 3), N·m, world axes. Callbacks add to it.
    #[getter]
    fn torque<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.open_view(py, &self.arrays.torque)
    }

    #[setter]
    fn set_torque(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set(py, &self.arrays.torque, value)
    }

    /// Returns the row of a rigid body, given by name or as a handle. For an articulated body
    /// ``part`` is the name of a link or a row number among its rows. A link that is fixed to
    /// another has the row of that one.
    #[pyo3(signature = (body, part=None, **unknown), text_signature = "($self, body, part=None)")]
    fn row(
        &self,
        body: &Bound<'_, PyAny>,
        part: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<usize> {
        keywords::check(unknown, "View.row")?;
        let rows = self.row_of(body)?;
        let part = match (part, self.layout.owner(rows.start)) {
            (None, _) => 0,
            (Some(part), Some((id, ..))) if part.is_instance_of::<PyString>() => {
                self.layout.link(id, &part.extract::<String>()?)?
            }
            (Some(part), _) => whole::part(part)?,
        };
        match part < rows.len() {
            true => Ok(rows.start + part),
            false => Err(Error::value(format!("part is {part}; the body has {} rows", rows.len()))),
        }
    }

    /// Returns the rows of a body as a slice: one for a rigid body; for an articulated body one for
    /// each moving link, parents first, and one for its base at the end.
    #[pyo3(signature = (body, **unknown), text_signature = "($self, body)")]
    fn rows<'py>(
        &self,
        py: Python<'py>,
        body: &Bound<'py, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PySlice>> {
        keywords::check(unknown, "View.rows")?;
        let rows = self.row_of(body)?;
        Ok(PySlice::new(py, rows.start as isize, rows.end as isize, 1))
    }

    /// Adds a force, shape (3,), N, on a row at a point of the world, shape (3,), m: with the
    /// torque ``(point - position) × force``.
    #[pyo3(signature = (row, force, point, **unknown), text_signature = "($self, row, force, point)")]
    fn apply_force(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::row)] row: usize,
        force: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "View.apply_force")?;
        self.open()?;
        let (force, point) = (vec3(force, "force")?, vec3(point, "point")?);
        if row >= self.moves.len() {
            return Err(Error::value(format!("row is {row}; there are {}", self.moves.len())));
        }
        let position = self.arrays.shown[0].0.bind(py).try_readonly().map_err(PyErr::from)?;
        let origin = Vec3::from_column_slice(&position.as_slice().map_err(PyErr::from)?[3 * row..3 * row + 3]);
        let torque = (point - origin).cross(&force);
        for (array, more) in [(&self.arrays.force, force), (&self.arrays.torque, torque)] {
            let mut all = array.bind(py).try_readwrite().map_err(PyErr::from)?;
            let own = &mut all.as_slice_mut().map_err(PyErr::from)?[3 * row..3 * row + 3];
            own.iter_mut().zip(&more).for_each(|(own, more)| *own += more);
        }
        Ok(())
    }

    /// Number of rows.
    fn __len__(&self) -> Result<usize> {
        self.open().map(|()| self.moves.len())
    }
}

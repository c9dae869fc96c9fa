//! `World.linearize`: the derivative of a step.

use crate::errors::{Error, Result};
use crate::world::class::World;
use crate::world::pickling::pickled;
use nalgebra::DMatrix;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyTuple};
use serde::{Deserialize, Serialize};
use tumble::dynamics::archive::open;
use tumble::dynamics::{LinearizedStep as Core, Switch, Switching, World as Dynamics};

/// The first bytes of a pickle. The number is raised with every change of the fields.
const PICKLED: &[u8; 8] = b"tumbleL1";

/// The derivative of a step, see ``World.linearize``. ``A, B = world.linearize()`` unpacks it.
#[pyclass(frozen, module = "tumble")]
#[derive(Serialize, Deserialize)]
pub struct LinearizedStep {
    a: Matrix,
    b: Matrix,
    objects: Vec<(String, usize, usize)>,
    switches: Vec<(String, Option<(String, String)>)>,
    one_sided: Vec<usize>,
    across: Vec<usize>,
    residual: f64,
    indeterminate: bool,
}

impl LinearizedStep {
    fn new(core: Core, world: &Dynamics) -> LinearizedStep {
        let name = |id| world.name(id).unwrap_or_default().to_string();
        let switch = |s: &Switching| (word(s.switch).to_string(), s.objects.map(|[a, b]| (name(a), name(b))));
        let Core { a, b, objects, switches, one_sided, across, residual, indeterminate } = core;
        let objects = objects.into_iter().map(|(id, range)| (name(id), range.start, range.end)).collect();
        let switches = switches.iter().map(switch).collect();
        let [a, b] = [&a, &b].map(Matrix::of);
        LinearizedStep { a, b, objects, switches, one_sided, across, residual, indeterminate }
    }
}

/// Returns the linearized step of a pickle.
#[pyfunction]
pub fn _unpickle_linearized_step(data: PyBackedBytes) -> Result<LinearizedStep> {
    Ok(open(PICKLED, &data)?)
}

fn word(switch: Switch) -> &'static str {
    match switch {
        Switch::Gap => "gap",
        Switch::Overlap => "overlap",
        Switch::Force => "force",
        Switch::Friction => "friction",
        _ => "other",
    }
}

/// A matrix by rows.
#[derive(Serialize, Deserialize)]
struct Matrix {
    shape: [usize; 2],
    numbers: Vec<f64>,
}

impl Matrix {
    fn of(m: &DMatrix<f64>) -> Matrix {
        Matrix { shape: [m.nrows(), m.ncols()], numbers: m.transpose().as_slice().to_vec() }
    }
}

fn matrix<'py>(py: Python<'py>, m: &Matrix) -> Result<Bound<'py, PyArray2<f64>>> {
    Ok(PyArray1::from_slice(py, &m.numbers).reshape(m.shape)?)
}

#[pymethods]
impl LinearizedStep {
    /// The derivative by the state, shape (2n, 2n) for n degrees of freedom.
    #[getter(A)]
    fn a<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.a)
    }

    /// The derivative by generalized forces that are constant over the step, shape (2n, n).
    #[getter(B)]
    fn b<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        matrix(py, &self.b)
    }

    /// Names of the objects that move, and the range (first, end) of each in the n degrees of freedom.
    #[getter]
    fn objects(&self) -> Vec<(String, usize, usize)> {
        self.objects.clone()
    }

    /// Kinks of the step next to its state, at which the derivative is that of one side: ``"gap"`` (a contact or a limit
    /// closes or is open), ``"overlap"`` (is corrected or within the tolerance), ``"force"`` (presses or
    /// separates), ``"friction"`` (sticks or slides, or a motor reaches its bound), each with the names of the two
    /// objects in contact, or None.
    #[getter]
    fn switches(&self) -> Vec<(String, Option<(String, String)>)> {
        self.switches.clone()
    }

    /// Columns of ``[A B]`` that are one-sided, since the number of contacts or impacts is another on the other side.
    #[getter]
    fn one_sided(&self) -> Vec<usize> {
        self.one_sided.clone()
    }

    /// Columns of ``[A B]`` differenced across a jump, since the number of contacts or impacts is another on both sides.
    #[getter]
    fn across(&self) -> Vec<usize> {
        self.across.clone()
    }

    /// Largest error of the contact solutions that are differentiated, m/s.
    #[getter]
    fn residual(&self) -> f64 {
        self.residual
    }

    /// Whether rigid contact leaves velocities open: redundant contacts, as four corners of a box that slides and turns, may share
    /// forces in other ways with other friction. The derivative is that of the nearest solution.
    #[getter]
    fn indeterminate(&self) -> bool {
        self.indeterminate
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let pair = PyTuple::new(py, [matrix(py, &self.a)?, matrix(py, &self.b)?])?;
        Ok(pair.try_iter()?.into_any())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        pickled(py, "_unpickle_linearized_step", PICKLED, self)
    }

    fn __repr__(&self) -> String {
        format!("<tumble.LinearizedStep n={} switches={}>", self.b.shape[1], self.switches.len())
    }
}

#[pymethods]
impl World {
    /// Returns the derivative of the next step by the state and by generalized forces: ``A, B = world.linearize()``,
    /// ``dx' = A @ dx + B @ dtau``. The world stays as it is.
    ///
    /// Coordinates, for n degrees of freedom of the objects that move: n of positions, then n of velocities, object by
    /// object in the order of addition (``objects``). Positions are displacements along generalized velocities: the
    /// angle of a joint; for a rigid body or a floating root a turn in world axes, rad, then a displacement, m; for
    /// a spherical joint a turn in the link's axes. Velocities are ``qd``; of a rigid body ω, then v of its center of mass.
    ///
    /// Contacts are differentiated at their active set (which presses, sticks, slides), exactly; free motion and
    /// forces by differences with an error of about 1e-9 of the largest entry. At a kink the result is the derivative of one side, and ``switches``
    /// names the contact. The stepper must be ``"time_stepping"`` and the solver ``"gauss_seidel"``, and the world
    /// must have no callables of Python in its steps.
    fn linearize(&self, py: Python<'_>) -> Result<LinearizedStep> {
        let mut fork = self.shared.read(|inner| {
            if inner.extension.is_empty() {
                Ok(inner.fork())
            } else {
                Err(Error::value("a world whose steps call Python cannot be linearized"))
            }
        })?;
        py.detach(|| {
            let efforts = std::mem::take(&mut fork.efforts);
            for (id, effort) in efforts {
                fork.world.apply_generalized(id, &effort)?;
            }
            let core = fork.world.linearize()?;
            Ok(LinearizedStep::new(core, &fork.world))
        })
    }
}

//! Poses and velocities of all bodies, and the state, as arrays.

use crate::arrays::convert::{Numbers, numbers};
use crate::errors::Result;
use crate::world::bulk::{self, Bulk};
use crate::world::class::World;
use crate::world::inner::Inner;
use numpy::PyArray2;
use pyo3::prelude::*;

impl World {
    fn bulk<'py>(&self, py: Python<'py>, bulk: Bulk) -> Result<Bound<'py, PyArray2<f64>>> {
        bulk::array(py, bulk, self.shared.read(|inner| bulk::get(inner, bulk))?)
    }

    fn set_bulk(&self, py: Python<'_>, bulk: Bulk, value: &Bound<'_, PyAny>) -> Result<()> {
        let rows = bulk::rows(bulk, value)?;
        self.shared.write(py, |inner| bulk::set(inner, bulk, rows))
    }
}

#[pymethods]
impl World {
    /// Positions of all bodies, as ``body.position``, in the order of ``bodies``: a read-only copy of shape
    /// (n, 3), m; for an articulation that of its first link. Setting it, as in
    /// ``world.positions = world.positions + (0, 0, 1)``, moves the rigid bodies whose
    /// rows change and keeps their velocities; rows of articulations must stay as they are.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::Positions)
    }

    #[setter]
    fn set_positions(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::Positions, value)
    }

    /// Orientations of all bodies, quaternions (x, y, z, w), shape (n, 4); otherwise as ``positions``.
    #[getter]
    fn orientations<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::Orientations)
    }

    #[setter]
    fn set_orientations(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::Orientations, value)
    }

    /// Velocities of the centers of mass of all bodies, for an articulation of the origin of its first
    /// link, shape (n, 3), m/s; otherwise as ``positions``.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::Velocities)
    }

    #[setter]
    fn set_velocities(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::Velocities, value)
    }

    /// Angular velocities of all bodies, world axes, shape (n, 3), rad/s; otherwise as ``positions``.
    #[getter]
    fn angular_velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray2<f64>>> {
        self.bulk(py, Bulk::AngularVelocities)
    }

    #[setter]
    fn set_angular_velocities(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        self.set_bulk(py, Bulk::AngularVelocities, value)
    }

    /// The flat state, shape (n,): a read-only view of the world's own memory until bodies are
    /// added or removed; then it keeps its last numbers.
    ///
    /// A rigid body has 13 numbers: position of the center of mass (``body.world_center_of_mass``),
    /// quaternion (x, y, z, w), linear and angular momentum. An articulated body has its ``q`` and
    /// ``qd``. Nothing is copied, here or by steps. While a view exists, a step keeps the
    /// interpreter, except for turns of other threads between two frames. Setting it writes every
    /// body's numbers.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.shared.write(py, |inner| {
            let Inner { world, shown, .. } = inner;
            Ok(shown.view(py, world)?)
        })
    }

    #[setter]
    fn set_state(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let Numbers { shape, data } = numbers(value, "state")?;
        self.shared.write(py, |inner| inner.write_state(&shape, &data))
    }
}

//! Poses and velocities of all bodies, and the state, as arrays.

use crate::arrays::convert::{Numbers, numbers, path, pose, vec3, vec3_or, vector, whole_number};
use crate::batch::crew;
use crate::behaviors;
use crate::choices::meaning;
use crate::errors::{Error, Result};
use crate::extension::callbacks::{Extensions, Reduced};
use crate::interrupt::interruptible;
use crate::io::picture::Shot;
use crate::io::slow;
use crate::objects::articulation::Articulation;
use crate::objects::bodies;
use crate::objects::bodies::{Bodies, handle, place_of};
use crate::objects::body::{self, RigidBody};
use crate::objects::joint::Joint;
use crate::objects::place::{body_ids, by_name};
use crate::objects::sensor::{Sensor, Sensors};
use crate::objects::shapes::Shape;
use crate::pool;
use crate::world::add::{add, articulated, named_shape, own_place, rigid};
use crate::world::class::World;
use crate::world::bulk::{self, Bulk};
use crate::world::gc::{Anchor, anchor};
use crate::world::inner::Inner;
use crate::world::joints;
use crate::world::load::{Choices, build};
use crate::world::pairs::{self, combine};
use crate::world::query::{self, Selection};
use crate::world::report::StepReport;
use crate::world::rollout::Plan;
use crate::world::shared::Shared;
use crate::world::{contacts, pickling, save_scene, sensors, snapshot};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyBytes, PyDict};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;
use tumble::collide::{ContactMode, Vec3};
use tumble::dynamics::{Material, Mode, PairMaterial, RigidBody as Rigid, SensorNoise, Settings};
use tumble::scene::mjcf::MjcfOptions;
use tumble::scene::{FileKind, LoadOptions, SceneFile, resolve_scene};

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
    /// Positions of all bodies, as ``body.position``, in the order of ``bodies``: a copy of shape
    /// (n, 3), m; for an articulation that of its first link. Setting it moves the rigid bodies whose
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

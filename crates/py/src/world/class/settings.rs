//! Settings of a world, and its clock.

use crate::arrays::convert::{vec3, vector};
use crate::arrays::whole;
use crate::errors::{Error, Result};
use crate::world::class::World;
use crate::world::pairs::combine;
use numpy::PyArray1;
use pyo3::prelude::*;
use tumble::dynamics::Sleep;

#[pymethods]
impl World {
    /// Simulated time, s.
    #[getter]
    fn time(&self) -> Result<f64> {
        self.shared.read(|inner| Ok(inner.world.time()))
    }

    /// Steps taken since the world was made.
    #[getter]
    fn frame(&self) -> Result<u64> {
        self.shared.read(|inner| Ok(inner.world.frame()))
    }

    /// Length of a step, s.
    #[getter]
    fn dt(&self) -> Result<f64> {
        self.settings(|s| s.dt)
    }

    #[setter]
    fn set_dt(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.dt = value)
    }

    /// Gravity, shape (3,), m/s².
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        Ok(vector(py, &self.settings(|s| s.gravity)?))
    }

    #[setter]
    fn set_gravity(&self, py: Python<'_>, value: &Bound<'_, PyAny>) -> Result<()> {
        let gravity = vec3(value, "gravity")?;
        self.set(py, |s| s.gravity = gravity)
    }

    /// Threads of a step, 0 for as many as cores. No number changes the result. Forks have the same
    /// number; an unpickled world has 1.
    #[getter]
    fn threads(&self) -> Result<u32> {
        self.settings(|s| s.threads)
    }

    #[setter]
    fn set_threads(&self, py: Python<'_>, #[pyo3(from_py_with = whole::threads)] value: u32) -> Result<()> {
        self.set(py, |s| s.threads = value)
    }

    /// Largest work of a step in block relaxations (``report.relaxations`` is the work of the last
    /// one), None for no bound. A step that needs more is less accurate, and ``report.residual`` says by
    /// how much. The same budget gives the same result on every machine. It may change between any two
    /// steps, and wakes nothing.
    #[getter]
    fn budget(&self) -> Result<Option<u32>> {
        self.settings(|s| s.solver_settings.budget)
    }

    #[setter]
    fn set_budget(&self, py: Python<'_>, #[pyo3(from_py_with = whole::budget)] value: Option<u32>) -> Result<()> {
        self.set(py, |s| s.solver_settings.budget = value)
    }

    /// Combination rule for restitution: ``"min"``, ``"max"``, ``"average"``, ``"product"`` or
    /// ``"geometric_mean"``.
    #[getter]
    fn combine_restitution(&self) -> Result<&'static str> {
        self.settings(|s| s.combine_restitution.name())
    }

    #[setter]
    fn set_combine_restitution(&self, py: Python<'_>, value: &str) -> Result<()> {
        let rule = combine(value, "combine_restitution")?;
        self.set(py, |s| s.combine_restitution = rule)
    }

    /// Combination rule for friction.
    #[getter]
    fn combine_friction(&self) -> Result<&'static str> {
        self.settings(|s| s.combine_friction.name())
    }

    #[setter]
    fn set_combine_friction(&self, py: Python<'_>, value: &str) -> Result<()> {
        let rule = combine(value, "combine_friction")?;
        self.set(py, |s| s.combine_friction = rule)
    }

    /// Name of the stepper.
    #[getter]
    fn stepper(&self) -> Result<&'static str> {
        self.shared.read(|inner| Ok(inner.world.stepper_name()))
    }

    /// Name of the contact solver.
    #[getter]
    fn solver(&self) -> Result<&'static str> {
        self.shared.read(|inner| Ok(inner.world.solver_name()))
    }

    /// Name of the integrator.
    #[getter]
    fn integrator(&self) -> Result<String> {
        self.shared.read(|inner| Ok(inner.scene.world.integrator.to_string()))
    }

    /// Smallest impulse of a pair in a step with which it counts as in contact, N·s, at least 0:
    /// weaker contacts make no ``events``.
    #[getter]
    fn event_impulse(&self) -> Result<f64> {
        self.settings(|s| s.event_impulse)
    }

    #[setter]
    fn set_event_impulse(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.event_impulse = value)
    }

    /// Largest angle, rad, 0.01 to 1e6, by which forces of joints may turn a part back and forth in a
    /// sub-step. A frame in which a part turns further is taken in sub-steps that are short enough;
    /// chains of light links with a heavy end need it. 1 by default.
    #[getter]
    fn max_turn(&self) -> Result<f64> {
        self.settings(|s| s.max_turn)
    }

    #[setter]
    fn set_max_turn(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.max_turn = value)
    }

    /// Sub-steps of each step.
    #[getter]
    fn substeps(&self) -> Result<u32> {
        self.settings(|s| s.substeps)
    }

    #[setter]
    fn set_substeps(&self, py: Python<'_>, #[pyo3(from_py_with = whole::substeps)] value: u32) -> Result<()> {
        self.set(py, |s| s.substeps = value)
    }

    /// Largest number of solver sweeps.
    #[getter]
    fn iterations(&self) -> Result<u32> {
        self.settings(|s| s.solver_settings.max_sweeps)
    }

    #[setter]
    fn set_iterations(&self, py: Python<'_>, #[pyo3(from_py_with = whole::iterations)] value: u32) -> Result<()> {
        self.set(py, |s| s.solver_settings.max_sweeps = value)
    }

    /// Largest number of block relaxations of a step in sweeps beyond the first 25.
    #[getter]
    fn max_relaxations(&self) -> Result<u32> {
        self.settings(|s| s.solver_settings.max_relaxations)
    }

    #[setter]
    fn set_max_relaxations(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::max_relaxations)] value: u32,
    ) -> Result<()> {
        self.set(py, |s| s.solver_settings.max_relaxations = value)
    }

    /// A sweep that changes no velocity by more than this ends a solve, m/s.
    #[getter]
    fn solver_tolerance(&self) -> Result<f64> {
        self.settings(|s| s.solver_settings.tolerance)
    }

    #[setter]
    fn set_solver_tolerance(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.solver_settings.tolerance = value)
    }

    /// Largest number of sweeps of the correction of overlap.
    #[getter]
    fn projection_sweeps(&self) -> Result<u32> {
        self.settings(|s| s.projection_sweeps)
    }

    #[setter]
    fn set_projection_sweeps(
        &self,
        py: Python<'_>,
        #[pyo3(from_py_with = whole::projection_sweeps)] value: u32,
    ) -> Result<()> {
        self.set(py, |s| s.projection_sweeps = value)
    }

    /// Whether positions of joints are corrected, and not their velocities alone.
    #[getter]
    fn stabilize_positions(&self) -> Result<bool> {
        self.settings(|s| s.stabilize_positions)
    }

    #[setter]
    fn set_stabilize_positions(&self, py: Python<'_>, value: bool) -> Result<()> {
        self.set(py, |s| s.stabilize_positions = value)
    }

    /// Surfaces closer than this are in contact in ``"backtracking"``, m.
    #[getter]
    fn contact_tolerance(&self) -> Result<f64> {
        self.settings(|s| s.contact_tolerance)
    }

    #[setter]
    fn set_contact_tolerance(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.contact_tolerance = value)
    }

    /// Depth that a lasting contact may reach within a sub-step, m, at least ``contact_tolerance``.
    #[getter]
    fn drift_tolerance(&self) -> Result<f64> {
        self.settings(|s| s.drift_tolerance)
    }

    #[setter]
    fn set_drift_tolerance(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.drift_tolerance = value)
    }

    /// Largest speed at which overlap and open joints are corrected, m/s.
    #[getter]
    fn recovery_speed(&self) -> Result<f64> {
        self.settings(|s| s.recovery_speed)
    }

    #[setter]
    fn set_recovery_speed(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.recovery_speed = value)
    }

    /// Error of an inner step of ``"dormand_prince"``, m, rad, m/s and rad/s.
    #[getter]
    fn integrator_tolerance(&self) -> Result<f64> {
        self.settings(|s| s.integrator_tolerance)
    }

    #[setter]
    fn set_integrator_tolerance(&self, py: Python<'_>, value: f64) -> Result<()> {
        self.set(py, |s| s.integrator_tolerance = value)
    }

    /// Seconds after which islands that moved by less than ``sleep_within`` sleep until something touches them; None:
    /// never.
    #[getter]
    fn sleep_after(&self) -> Result<Option<f64>> {
        self.settings(|s| s.sleep.map(|sleep| sleep.after))
    }

    #[setter]
    fn set_sleep_after(&self, py: Python<'_>, value: Option<f64>) -> Result<()> {
        self.set(py, |s| s.sleep = value.map(|after| Sleep { after, ..s.sleep.unwrap_or_default() }))
    }

    /// Largest displacement of any point of an island at rest during ``sleep_after``, m. Settable while that is not None.
    #[getter]
    fn sleep_within(&self) -> Result<f64> {
        self.settings(|s| s.sleep.unwrap_or_default().within)
    }

    #[setter]
    fn set_sleep_within(&self, py: Python<'_>, value: f64) -> Result<()> {
        if self.settings(|s| s.sleep.is_none())? {
            return Err(Error::value("sleep_within: nothing sleeps; set sleep_after first"));
        }
        self.set(py, |s| s.sleep = s.sleep.map(|sleep| Sleep { within: value, ..sleep }))
    }
}

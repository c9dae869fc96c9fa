//! Saved, copied and forked worlds, and rollouts.

use crate::arrays::convert::{Numbers, numbers, path};
use crate::arrays::whole;
use crate::batch::crew;
use crate::errors::{Error, Result};
use crate::extension::callbacks::{Extensions, Reduced};
use crate::interrupt::interruptible;
use crate::keywords::{self, Unknown};
use crate::world::add::own_place;
use crate::world::class::World;
use crate::world::rollout::Plan;
use crate::world::{pickling, save_mjcf, save_scene, snapshot};
use numpy::{PyArray1, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::PyBytes;

#[pymethods]
impl World {
    /// Writes the world as it stands to a scene file (``.toml``), with a folder ``NAME_files`` beside it for
    /// meshes and the exact state: ``World.load`` of the file goes on with the same bits. Once its text is
    /// edited, the text counts.
    ///
    /// Returns notes about things that are not in it, such as generalized forces and visuals that scenes do
    /// not have. Forces and behaviors written in Python, and all else that a scene cannot say, raise
    /// ``ValueError`` with their names, and nothing is written.
    #[pyo3(signature = (path, **unknown), text_signature = "($self, path)")]
    fn save_scene(
        &self,
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Vec<String>> {
        keywords::check(unknown, "World.save_scene")?;
        let path = self::path(path)?;
        self.shared.work(py, |inner| save_scene::write(inner, &path))
    }

    /// Writes the world as it stands to a model of MuJoCo (``.xml`` or ``.mjcf``), with a folder
    /// ``NAME_files`` beside it for meshes. The keyframe ``now`` of the model is the present state.
    ///
    /// Returns notes about everything that MJCF cannot say.
    #[pyo3(signature = (path, **unknown), text_signature = "($self, path)")]
    fn save_mjcf(
        &self,
        py: Python<'_>,
        path: &Bound<'_, PyAny>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Vec<String>> {
        keywords::check(unknown, "World.save_mjcf")?;
        let path = self::path(path)?;
        self.shared.work(py, |inner| save_mjcf::write(inner, &path))
    }

    /// Returns everything that the next step reads as bytes, for ``restore`` in a world of the same
    /// bodies, with the drives that were set since they were added. Shapes, masses and settings are not included.
    fn save<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let bytes = self.shared.read(|inner| Ok(snapshot::write(inner)))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Restores the bytes of ``save``. Invalid bytes, or those of another world, raise
    /// ``SnapshotError`` and change nothing.
    #[pyo3(signature = (snapshot, **unknown), text_signature = "($self, snapshot)")]
    fn restore(&self, py: Python<'_>, snapshot: PyBackedBytes, unknown: Option<Unknown<'_, '_>>) -> Result<()> {
        keywords::check(unknown, "World.restore")?;
        self.shared.write(py, |inner| snapshot::read(inner, &snapshot))
    }

    /// Returns the world as bytes for ``simulate``: shapes, masses, settings, drives and its present
    /// state. Forces and behaviors in Python are no part of them: such a world raises
    /// ``InvalidValueError`` and is pickled instead.
    fn model<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.shared.read(pickling::model)?))
    }

    /// Returns an independent copy with the same state and the same future.
    ///
    /// Forces and behaviors are copied by their own ``fork``.
    fn fork(&self, py: Python<'_>) -> Result<World> {
        let inner = self.shared.read(|inner| Ok(inner.fork()))?;
        inner.take_raised()?;
        World::of(py, inner)
    }

    fn __copy__(&self, py: Python<'_>) -> Result<World> {
        self.fork(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> Result<World> {
        self.fork(py)
    }

    /// Pickles the whole world, with its forces and behaviors.
    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<Reduced<'py>> {
        let (bytes, state) = self.shared.read(|inner| Ok((pickling::write(inner)?, inner.pickled_extensions(py))))?;
        let unpickle = py.import("tumble._native")?.getattr("_unpickle_world")?;
        Ok((unpickle, (PyBytes::new(py, &bytes),), state))
    }

    /// Sets the forces and behaviors of an unpickled world.
    fn __setstate__(&self, py: Python<'_>, state: Extensions) -> Result<()> {
        self.shared.extend(py, |inner| inner.unpickle_extensions(py, state))
    }

    /// Runs many forks, each with its own controls, on all cores with the interpreter released.
    /// This world does not change.
    ///
    /// controls: shape (forks, steps, n): generalized forces of each step, N·m and N, for all
    /// ``articulations`` one after the other (by default all of the world, in order; without any, n
    /// is 0). Without controls generalized forces stay as they are: then steps is the number of steps, and forks that of
    /// forks, by default as many as states, or 1. states: initial states of the forks, shape (len(state),) or (forks, len(state)), by
    /// default the state of the world. every: interval in steps at which the state is kept.
    /// threads: largest number of threads (default: all cores). Returns the states, shape (forks,
    /// steps // every, len(state)): the same bits on any number of threads. A fork that fails
    /// raises ``StepError`` with its number; Ctrl-C stops all of them between two steps.
    #[pyo3(signature = (controls=None, *, steps=None, forks=None, articulations=None, states=None, every=1, threads=None, **unknown), text_signature = "($self, controls=None, *, steps=None, forks=None, articulations=None, states=None, every=1, threads=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn rollout<'py>(
        &self,
        py: Python<'py>,
        controls: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = whole::steps)] steps: Option<usize>,
        #[pyo3(from_py_with = whole::forks)] forks: Option<usize>,
        articulations: Option<Vec<Bound<'py, PyAny>>>,
        states: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = whole::every)] every: usize,
        #[pyo3(from_py_with = whole::threads)] threads: Option<usize>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyArray3<f64>>> {
        keywords::check(unknown, "World.rollout")?;
        let threads = crew::checked(threads)?;
        let asked = articulations
            .map(|all| all.iter().map(|one| Ok(own_place(&self.shared, one)?.id)).collect::<Result<Vec<_>>>())
            .transpose()?;
        let states = states.map(|s| numbers(s, "states")).transpose()?;
        let (controls, asked) = match controls {
            Some(_) if steps.is_some() || forks.is_some() => {
                return Err(Error::value("steps and forks: expected none, since controls have their shape"));
            }
            Some(controls) => (numbers(controls, "controls")?, asked),
            None if asked.is_some() => {
                return Err(Error::value("articulations: expected none, since there are no controls for them"));
            }
            None => {
                let steps = steps.ok_or_else(|| Error::value("steps: expected their number, or controls"))?;
                let many = states.as_ref().and_then(|all| (all.shape.len() == 2).then(|| all.shape[0]));
                let shape = vec![forks.or(many).unwrap_or(1), steps, 0];
                (Numbers { shape, data: vec![] }, Some(vec![]))
            }
        };
        let (plan, fork) =
            self.shared.read(|inner| Ok((Plan::new(inner, asked, controls, states, every)?, inner.fork())))?;
        let shape = [plan.count, plan.frames / plan.every, fork.world.state().len()];
        let out = interruptible(py, |stop| plan.run(fork, threads, stop))?;
        Ok(PyArray1::from_vec(py, out).reshape(shape)?)
    }
}

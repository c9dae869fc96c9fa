//! The class `Batch`.

use crate::arrays::convert::numbers;
use crate::arrays::whole;
use crate::batch::bodies::Constants;
use crate::batch::crew::{Crew, checked};
use crate::batch::drives::{Drives, Setting};
use crate::batch::fields::{Field, Layout, Rows, Table};
use crate::batch::member::{Member, Start, Task, write};
use crate::batch::pickling::{self, Reduced};
use crate::batch::policy::Policy;
use crate::errors::{Error, Result};
use crate::keywords::{self, Unknown};
use crate::world::add::own_place;
use crate::world::bulk::Bulk;
use crate::world::class::World;
use crate::world::sensors;
use crate::world::shared::Shared;
use numpy::{PyArray1, PyArrayLike1, PyUntypedArrayMethods};
use pyo3::exceptions::PyIndexError;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyList, PySlice};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};
use tumble::dynamics::WorkingMemory;

/// Largest number of worlds.
const MOST_WORLDS: usize = 1 << 20;

/// Largest number of steps of one call.
const MOST_STEPS: usize = 1 << 40;

/// ``n`` worlds of one model that are stepped together on all cores, each under controls of its own.
///
/// world: the model; the batch has forks of it and leaves it alone. threads: largest number of
/// threads, by default one for each core; no number changes a bit of any world, and each moves as it
/// would alone. articulations: the articulated bodies that ``controls``, ``q`` and ``v`` are about,
/// by default all, one after the other in the order of ``world.bodies``. configure: called as
/// ``configure(world, i)`` for each world, to change masses, frictions, drives, poses or states; it
/// may not add or remove bodies. What it leaves is what ``reset`` goes back to.
///
/// Arrays have one row for each world. The same array is returned at each access, is read-only, and
/// follows ``step`` and ``reset``; copy what is to be kept. An array costs nothing before its first
/// access.
#[pyclass(frozen, weakref, module = "tumble")]
pub struct Batch {
    pub(super) worlds: Vec<Py<World>>,
    pub(super) shared: Vec<Arc<Shared>>,
    pub(super) layout: Layout,
    pub(super) crew: Crew,
    /// The start of each world, or the one of all.
    pub(super) starts: Vec<Start>,
    /// Whether Python was given a world, and may change it by itself.
    pub(super) given: AtomicBool,
    /// As many as worlds are stepped at once.
    pub(super) memory: Mutex<Vec<WorkingMemory>>,
    pub(super) now: Mutex<Now>,
}

/// The data that a call changes.
#[derive(Default)]
pub(super) struct Now {
    tables: Vec<Table>,
    /// The fields of the tables of each world, one world after the other.
    records: Vec<f64>,
    pub(super) failed: Vec<bool>,
    /// Whether a call that was interrupted left the tables behind.
    stale: bool,
}

impl Now {
    fn fields(&self) -> Vec<Field> {
        self.tables.iter().map(|table| table.field).collect()
    }

    /// Returns the length of one world's record.
    fn record(&self) -> usize {
        self.tables.iter().map(|table| table.width).sum()
    }

    fn fill(&self, py: Python<'_>, of: impl Iterator<Item = usize> + Clone) -> Result<()> {
        let record = self.record();
        self.tables.iter().try_for_each(|table| table.fill(py, &self.records, record, of.clone()))
    }
}

impl Batch {
    pub(super) fn now(&self) -> Result<MutexGuard<'_, Now>> {
        match self.now.try_lock() {
            Ok(now) => Ok(now),
            Err(TryLockError::Poisoned(now)) => Ok(now.into_inner()),
            Err(TryLockError::WouldBlock) => Err(Error::Busy),
        }
    }

    /// Returns which worlds a mask selects; all without one.
    fn selected(&self, mask: Option<&Bound<'_, PyAny>>) -> Result<Vec<bool>> {
        let count = self.shared.len();
        let Some(mask) = mask else { return Ok(vec![true; count]) };
        let wrong = || Error::value(format!("mask: expected booleans, shape ({count},)"));
        let mask: PyArrayLike1<'_, bool> = mask.extract().map_err(|_| wrong())?;
        if mask.len() != count { Err(wrong()) } else { Ok(mask.as_array().iter().copied().collect()) }
    }

    fn rows(&self, name: &str, given: Option<&Bound<'_, PyAny>>, width: usize) -> Result<Option<Rows>> {
        given.map(|given| Rows::new(name, numbers(given, name)?, self.shared.len(), width)).transpose()
    }

    /// Gives each selected world its task, and updates the arrays. The error is that of the first
    /// world that failed.
    fn run<'t>(&self, py: Python<'_>, selected: &[bool], task: impl Fn(usize) -> Task<'t>) -> Result<()> {
        let mut now = self.now()?;
        let (now, count) = (&mut *now, self.shared.len());
        let (fields, record, memory) = (now.fields(), now.record(), &self.memory);
        now.records.resize(count * record, 0.0);
        let mut records = &mut now.records[..];
        let mut members = Vec::with_capacity(count);
        for (number, shared) in self.shared.iter().enumerate() {
            let (own, rest) = std::mem::take(&mut records).split_at_mut(record);
            records = rest;
            if selected[number] {
                members.push(Member { number, shared, task: task(number), memory, record: own, outcome: Ok(()) });
            }
        }
        let ran = self.crew.run(py, &mut members, |_, member, pause| Ok(member.advance(&self.layout, &fields, pause)));
        let numbers: Vec<usize> = members.iter().map(|member| member.number).collect();
        let outcomes: Vec<Result<()>> = members.into_iter().map(|member| member.outcome).collect();
        if self.given.load(Ordering::Relaxed) {
            self.shared.iter().for_each(|shared| shared.show(py));
        }
        now.stale |= ran.is_err();
        ran?;
        now.fill(py, numbers.iter().copied())?;
        now.failed.fill(false);
        let mut first = None;
        for (number, outcome) in numbers.into_iter().zip(outcomes) {
            if let Err(error) = outcome {
                now.failed[number] = true;
                first.get_or_insert((number, error));
            }
        }
        let failed = now.failed.iter().filter(|failed| **failed).count();
        first.map_or(Ok(()), |(world, source)| Err(Error::Member { world, failed, count, source: Box::new(source) }))
    }

    /// Returns the array of a field.
    fn field<'py>(&self, py: Python<'py>, field: Field) -> Result<Bound<'py, PyAny>> {
        let mut now = self.now()?;
        let known = now.tables.iter().position(|table| table.field == field);
        let at = match known {
            Some(at) => at,
            None => {
                let first = now.record();
                now.tables.push(Table::new(py, field, &self.layout, self.shared.len(), first)?);
                now.tables.len() - 1
            }
        };
        if known.is_none() || now.stale || self.given.load(Ordering::Relaxed) {
            self.gather(py, &mut now)?;
        }
        Ok(now.tables[at].view(py))
    }

    /// Reads all fields from the worlds.
    fn gather(&self, py: Python<'_>, now: &mut Now) -> Result<()> {
        let (fields, record, count) = (now.fields(), now.record(), self.shared.len());
        now.records.resize(count * record, 0.0);
        for (k, shared) in self.shared.iter().enumerate() {
            let own = &mut now.records[k * record..(k + 1) * record];
            shared.read(|inner| {
                self.layout.check(inner)?;
                write(&fields, &self.layout, inner, own)
            })?;
        }
        now.fill(py, 0..count)?;
        now.stale = false;
        Ok(())
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (world, n, *, threads=None, articulations=None, configure=None, **unknown), text_signature = "(world, n, *, threads=None, articulations=None, configure=None)")]
    fn new(
        py: Python<'_>,
        world: &Bound<'_, World>,
        #[pyo3(from_py_with = whole::n)] n: usize,
        #[pyo3(from_py_with = whole::threads)] threads: Option<usize>,
        articulations: Option<Vec<Bound<'_, PyAny>>>,
        configure: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Batch> {
        keywords::check(unknown, "Batch")?;
        if n == 0 || n > MOST_WORLDS {
            return Err(Error::value(format!("n is {n}; it must be 1 to {MOST_WORLDS}")));
        }
        let model = &world.get().shared;
        let asked = articulations
            .map(|all| all.iter().map(|one| Ok(own_place(model, one)?.id)).collect::<Result<Vec<_>>>())
            .transpose()?;
        let (layout, crew) = (model.read(|inner| Layout::new(inner, asked))?, Crew::new(checked(threads)?)?);
        let mut worlds = Vec::with_capacity(n);
        let mut memory = WorkingMemory::default();
        for k in 0..n {
            let mut fork = model.read(|inner| Ok(inner.fork()))?;
            fork.take_raised()?;
            let mut settings = *fork.world.settings();
            settings.threads = 1; // they are many already
            fork.world.set_settings(settings)?;
            fork.world.lend_working_memory(&mut memory);
            fork.world.return_working_memory(&mut memory); // what it has of its own is dropped
            let fork = Py::new(py, World::of(py, fork)?)?;
            if let Some(configure) = configure {
                configure.call1((&fork, k))?;
            }
            fork.get().shared.read(|inner| layout.check(inner))?;
            worlds.push(fork);
            py.check_signals()?;
        }
        let different = if configure.is_some() { n } else { 1 };
        let start = |world: &Py<World>| world.get().shared.read(|inner| Ok(Start::of(inner)));
        let starts = worlds[..different].iter().map(start).collect::<Result<Vec<_>>>()?;
        Ok(Batch::of(worlds, layout, crew, starts, configure.is_some(), vec![false; n], memory))
    }

    /// Advances each world by ``substeps`` steps of its ``dt``, from 0 to 2**40, with the interpreter released; Ctrl-C
    /// stops all of them between two steps.
    ///
    /// controls: generalized forces on the degrees of freedom of the articulations, N·m and N, shape
    /// (n, dof), or (dof,) for all worlds; they act in every step until they are set again. None
    /// leaves them. policy: a ``Policy`` instead, evaluated before each step: its inputs are ``q``, then ``v`` of the world, its
    /// outputs the forces, of which the last ones go on acting. targets: of the position drives, rad or m, of the same shapes; numbers for
    /// degrees of freedom without such a drive have no effect. mask: which worlds step, booleans of
    /// shape (n,); None: all.
    ///
    /// A world that fails raises ``StepError`` with its number, after all others have stepped:
    /// ``failed`` says which. It stays as before the step that failed, and ``reset`` serves it as any
    /// other.
    #[pyo3(signature = (controls=None, substeps=1, *, targets=None, policy=None, mask=None, **unknown), text_signature = "($self, controls=None, substeps=1, *, targets=None, policy=None, mask=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn step(
        &self,
        py: Python<'_>,
        controls: Option<&Bound<'_, PyAny>>,
        #[pyo3(from_py_with = whole::steps_of_a_batch)] substeps: usize,
        targets: Option<&Bound<'_, PyAny>>,
        policy: Option<&Bound<'_, Policy>>,
        mask: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Batch.step")?;
        let policy = policy.map(Bound::get);
        if controls.is_some() && policy.is_some() {
            return Err(Error::value("controls and policy: give one of them"));
        }
        policy.map_or(Ok(()), |p| {
            p.check(self.shared.len(), self.layout.positions() + self.layout.dof(), self.layout.dof())
        })?;
        if substeps > MOST_STEPS {
            return Err(Error::value(format!("substeps is {substeps}; expected a whole number from 0 to 2**40")));
        }
        let dof = self.layout.dof();
        let (controls, targets) = (self.rows("controls", controls, dof)?, self.rows("targets", targets, dof)?);
        let selected = self.selected(mask)?;
        self.run(py, &selected, |k| {
            let [efforts, targets] = [&controls, &targets].map(|rows| rows.as_ref().map(|rows| rows.of(k)));
            Task::Step { efforts, targets, policy: policy.map(|policy| (policy, k)), left: substeps }
        })
    }

    /// Takes worlds back to the state in which the batch was made, contacts and the forces of the last
    /// step excepted.
    ///
    /// mask: which worlds, booleans of shape (n,); None: all. state: states instead, as ``state``; q,
    /// v: positions and velocities of the articulations instead, as ``q`` and ``v``; each of them one row
    /// or a row for each world, of which those of other worlds are not used. Masses, drives and other
    /// constants stay as they are.
    ///
    /// A row that is no state raises ``InvalidValueError`` with the number of its world, which is at its
    /// start then.
    #[pyo3(signature = (mask=None, state=None, *, q=None, v=None, **unknown), text_signature = "($self, mask=None, state=None, *, q=None, v=None)")]
    fn reset(
        &self,
        py: Python<'_>,
        mask: Option<&Bound<'_, PyAny>>,
        state: Option<&Bound<'_, PyAny>>,
        q: Option<&Bound<'_, PyAny>>,
        v: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Batch.reset")?;
        let selected = self.selected(mask)?;
        let state = self.rows("state", state, self.layout.state)?;
        let (q, v) = (self.rows("q", q, self.layout.positions())?, self.rows("v", v, self.layout.dof())?);
        self.run(py, &selected, |k| {
            let [state, q, v] = [&state, &q, &v].map(|rows| rows.as_ref().map(|rows| rows.of(k)));
            Task::Reset { start: &self.starts[k.min(self.starts.len() - 1)], state, q, v }
        })
    }

    /// Sets the drives of all degrees of freedom of the articulations in all worlds; those of which all
    /// numbers are 0 or None have none then.
    ///
    /// Arguments as in ``Articulation.set_drive``: one number for all joints, shape (dof,) or (n, dof). A
    /// spherical joint has three columns, and a floating root six, which must be 0. Drives and their
    /// targets are no part of the state, so ``reset`` leaves them.
    #[pyo3(signature = (*, target=None, velocity=None, stiffness=None, damping=None, max_force=None, **unknown), text_signature = "($self, *, target=None, velocity=None, stiffness=None, damping=None, max_force=None)")]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn set_drives(
        &self,
        py: Python<'_>,
        target: Option<&Bound<'_, PyAny>>,
        velocity: Option<&Bound<'_, PyAny>>,
        stiffness: Option<&Bound<'_, PyAny>>,
        damping: Option<&Bound<'_, PyAny>>,
        max_force: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Batch.set_drives")?;
        let setting = |name, given| Setting::new(name, given, self.shared.len(), self.layout.dof());
        let drives = Drives {
            target: setting("target", target)?,
            velocity: setting("velocity", velocity)?,
            stiffness: setting("stiffness", stiffness)?,
            damping: setting("damping", damping)?,
            max_force: setting("max_force", max_force)?,
        };
        let each = |(k, shared): (usize, &Arc<Shared>)| {
            shared.write(py, |inner| {
                self.layout.check(inner)?;
                drives.set(&self.layout, inner, k)
            })
        };
        self.shared.iter().enumerate().try_for_each(each)
    }

    /// Sets constants of the rigid body of that name, each one number for all worlds or one for each, shape (n,); None leaves
    /// them. mass: kg, with the inertia in proportion. friction, restitution: its coefficients. Velocities stay. They are no part
    /// of the state, so ``reset`` leaves them.
    ///
    /// A number out of range raises ``InvalidValueError`` with the number of the world; worlds before it have their new ones.
    #[pyo3(signature = (name, *, mass=None, friction=None, restitution=None, **unknown), text_signature = "($self, name, *, mass=None, friction=None, restitution=None)")]
    fn set_body(
        &self,
        py: Python<'_>,
        name: &str,
        mass: Option<&Bound<'_, PyAny>>,
        friction: Option<&Bound<'_, PyAny>>,
        restitution: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "Batch.set_body")?;
        let count = self.shared.len();
        let constants = Constants::new(count, mass, friction, restitution)?;
        self.shared
            .iter()
            .enumerate()
            .try_for_each(|(k, shared)| shared.write(py, |inner| constants.set(inner, name, k)))
    }

    /// The worlds: a new list. They are the batch's own, and what is changed in them counts from the
    /// next step on. From the first access on, each access to an array reads all worlds.
    #[getter]
    fn worlds<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyList>> {
        let _now = self.now()?; // not while they step
        self.given.store(true, Ordering::Relaxed);
        Ok(PyList::new(py, &self.worlds)?)
    }

    /// Returns the world of a number; negative ones count from the end.
    #[pyo3(signature = (index, **unknown), text_signature = "($self, index)")]
    fn world(&self, py: Python<'_>, index: isize, unknown: Option<Unknown<'_, '_>>) -> Result<Py<World>> {
        keywords::check(unknown, "Batch.world")?;
        let _now = self.now()?;
        let count = self.worlds.len() as isize;
        let at = if index < 0 { index + count } else { index };
        let Some(world) = usize::try_from(at).ok().and_then(|at| self.worlds.get(at)) else {
            return Err(PyIndexError::new_err(format!("world {index} of a batch of {count}")).into());
        };
        self.given.store(true, Ordering::Relaxed);
        Ok(world.clone_ref(py))
    }

    fn __len__(&self) -> usize {
        self.shared.len()
    }

    /// Number of columns of ``controls`` and ``v``.
    #[getter]
    fn dof(&self) -> usize {
        self.layout.dof()
    }

    /// Number of threads that step the worlds.
    #[getter]
    fn threads(&self) -> Result<usize> {
        self.crew.threads()
    }

    /// Which worlds failed in the last ``step`` or ``reset``: a new array of booleans, shape (n,).
    #[getter]
    fn failed<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<bool>>> {
        Ok(PyArray1::from_slice(py, &self.now()?.failed))
    }

    /// Simulated times, s, shape (n,).
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Time)
    }

    /// The states, as ``World.state``, shape (n, len(state)).
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::State)
    }

    /// Readings of the measuring sensor of that name, shape (n, k): a view of ``state``.
    #[pyo3(signature = (name, **unknown), text_signature = "($self, name)")]
    fn sensor<'py>(&self, py: Python<'py>, name: &str, unknown: Option<Unknown<'_, '_>>) -> Result<Bound<'py, PyAny>> {
        keywords::check(unknown, "Batch.sensor")?;
        let columns = sensors::columns(&self.shared[0], name)?;
        let columns = PySlice::new(py, columns.start as isize, columns.end as isize, 1);
        Ok(self.field(py, Field::State)?.get_item((PySlice::full(py), columns))?)
    }

    /// Positions of the articulations, as ``Articulation.q``, one after the other: shape (n, nq).
    #[getter]
    fn q<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Q)
    }

    /// Velocities of the articulations, as ``Articulation.qd``, one after the other: shape (n, dof).
    #[getter]
    fn v<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::V)
    }

    /// Positions of all bodies, as ``World.positions``: shape (n, bodies, 3), m.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Bodies(Bulk::Positions))
    }

    /// Orientations of all bodies, quaternions (x, y, z, w): shape (n, bodies, 4).
    #[getter]
    fn orientations<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Bodies(Bulk::Orientations))
    }

    /// Velocities of all bodies, as ``World.velocities``: shape (n, bodies, 3), m/s.
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Bodies(Bulk::Velocities))
    }

    /// Angular velocities of all bodies, world axes: shape (n, bodies, 3), rad/s.
    #[getter]
    fn angular_velocities<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Bodies(Bulk::AngularVelocities))
    }

    /// Sum of the contact forces on each body, ``force`` of ``World.contacts``: shape (n, bodies, 3),
    /// N, world axes.
    #[getter]
    fn contact_forces<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Forces)
    }

    /// Sum of the contact forces on each link of the articulations, in the order of their
    /// ``link_names``: torque about the world's origin, N·m, then force, N; shape (n, links, 6), world
    /// axes.
    #[getter]
    fn link_contact_forces<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Links)
    }

    /// Number of contacts of the last step: shape (n,), of whole numbers as floats.
    #[getter]
    fn contact_counts<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        self.field(py, Field::Contacts)
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        self.worlds.iter().try_for_each(|world| visit.call(world))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Result<Reduced<'py>> {
        pickling::reduce(self, py)
    }

    fn __repr__(&self) -> String {
        format!("<tumble.Batch {} worlds, {} degrees of freedom>", self.shared.len(), self.layout.dof())
    }
}

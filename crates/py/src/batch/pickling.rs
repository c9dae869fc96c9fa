//! Batches for Python's pickle: their worlds, which pickle by themselves with all that was changed in them, and the starts of `reset` as worlds too.

use crate::batch::class::{Batch, Now};
use crate::batch::crew::{Crew, checked};
use crate::batch::fields::Layout;
use crate::batch::member::Start;
use crate::errors::{Error, Result};
use crate::world::class::World;
use crate::world::shared::Shared;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use tumble::dynamics::WorkingMemory;

/// Worlds, starts, the places of the driven bodies, threads, whether Python was given a world, and which worlds failed.
type Parts = (Vec<Py<World>>, Vec<Py<World>>, Vec<usize>, Option<usize>, bool, Vec<bool>);

/// The function that unpickles a batch, and its arguments.
pub type Reduced<'py> = (Bound<'py, PyAny>, Parts);

impl Batch {
    /// Makes a batch of its parts.
    pub(super) fn of(
        worlds: Vec<Py<World>>,
        layout: Layout,
        crew: Crew,
        starts: Vec<Start>,
        given: bool,
        failed: Vec<bool>,
        memory: WorkingMemory,
    ) -> Batch {
        let shared = worlds.iter().map(|world| world.get().shared.clone()).collect();
        let mut now = Now::default();
        now.failed = failed;
        let now = Mutex::new(now);
        let (given, memory) = (AtomicBool::new(given), Mutex::new(vec![memory]));
        Batch { worlds, shared, layout, crew, starts, given, memory, now }
    }
}

/// Takes a batch apart.
pub fn reduce<'py>(batch: &Batch, py: Python<'py>) -> Result<Reduced<'py>> {
    let failed = batch.now()?.failed.clone();
    let begun = |(start, shared): (&Start, &Arc<Shared>)| {
        let mut fork = shared.read(|inner| Ok(inner.fork()))?;
        fork.take_raised()?;
        start.restore(&mut fork)?;
        Ok(Py::new(py, World::of(py, fork)?)?)
    };
    let starts = batch.starts.iter().zip(&batch.shared).map(begun).collect::<Result<Vec<_>>>()?;
    let worlds = batch.worlds.iter().map(|world| world.clone_ref(py)).collect();
    let given = batch.given.load(Ordering::Relaxed);
    let unpickle = py.import("tumble._native")?.getattr("_unpickle_batch")?;
    Ok((unpickle, (worlds, starts, batch.layout.driven_places(), batch.crew.asked(), given, failed)))
}

/// Returns the batch of a pickle.
#[pyfunction]
pub fn _unpickle_batch(
    worlds: Vec<Py<World>>,
    starts: Vec<Py<World>>,
    driven: Vec<usize>,
    threads: Option<usize>,
    given: bool,
    failed: Vec<bool>,
) -> Result<Batch> {
    let damaged = || Error::value("this is no pickle of a batch");
    if worlds.is_empty() || failed.len() != worlds.len() || (starts.len() != 1 && starts.len() != worlds.len()) {
        return Err(damaged());
    }
    let layout = worlds[0].get().shared.read(|inner| {
        let ids = inner.world.ids().to_vec();
        let ids =
            driven.iter().map(|place| ids.get(*place).copied()).collect::<Option<Vec<_>>>().ok_or_else(damaged)?;
        Layout::new(inner, Some(ids))
    })?;
    let mut memory = WorkingMemory::default();
    for world in &worlds {
        world.get().shared.unseen(|inner| {
            layout.check(inner)?;
            inner.world.lend_working_memory(&mut memory);
            inner.world.return_working_memory(&mut memory); // what it has of its own is dropped
            Ok(())
        })?;
    }
    let start = |world: &Py<World>| {
        world.get().shared.read(|inner| {
            layout.check(inner)?;
            Ok(Start::of(inner))
        })
    };
    let starts = starts.iter().map(start).collect::<Result<Vec<_>>>()?;
    Ok(Batch::of(worlds, layout, Crew::new(checked(threads)?)?, starts, given, failed, memory))
}

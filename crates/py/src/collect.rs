//! Circles through a world: a force that holds the world it acts in, or a handle of it, is found by Python's collector.
//!
//! A world lies behind a lock that many handles share, and Python does not see that. So all of them hold one [`Anchor`], which stands for the world where
//! Python counts references: it alone names the forces and behaviours of the world, each once. They are listed beside the world and not in it: the list is
//! touched only under the interpreter's lock, so that it is the same all through one collection, whoever steps meanwhile.

use crate::shared::Shared;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyWeakrefMethods, PyWeakrefReference};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A force or behaviour: counted by Python once, however many in Rust hold it.
pub type Callable = Arc<Py<PyAny>>;

/// Stands for a world in the eyes of the collector.
#[pyclass(frozen, weakref, module = "tumble", name = "_Anchor")]
pub struct Anchor {
    shared: Arc<Shared>,
}

#[pymethods]
impl Anchor {
    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        let Ok(callables) = self.shared.ground.callables.try_lock() else { return Ok(()) };
        callables.iter().try_for_each(|callable| visit.call(&**callable))
    }

    fn __clear__(&self) {
        self.shared.forsake();
    }
}

/// What the collector needs to know of a world.
#[derive(Default)]
pub struct Ground {
    /// The anchor, if the world has one now.
    anchor: Mutex<Option<Py<PyWeakrefReference>>>,
    /// Its forces and behaviours.
    callables: Mutex<Vec<Callable>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Ground {
    /// Lists the forces and behaviours anew. The interpreter's lock must be held.
    pub fn list(&self, callables: Vec<Callable>) {
        let before = std::mem::replace(&mut *lock(&self.callables), callables);
        drop(before); // not under the lock: it may run Python
    }
}

/// The anchor of a world, for every Python object that holds it.
pub fn anchor(py: Python<'_>, shared: &Arc<Shared>) -> PyResult<Py<Anchor>> {
    let known = lock(&shared.ground.anchor).as_ref().map(|weak| weak.clone_ref(py));
    if let Some(anchor) = known.and_then(|weak| weak.into_bound(py).upgrade_as::<Anchor>().ok().flatten()) {
        return Ok(anchor.unbind());
    }
    let anchor = Bound::new(py, Anchor { shared: shared.clone() })?;
    let weak = PyWeakrefReference::new(&anchor)?.unbind();
    let before = lock(&shared.ground.anchor).replace(weak);
    drop(before);
    Ok(anchor.unbind())
}

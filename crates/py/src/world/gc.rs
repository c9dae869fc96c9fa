//! Reference cycles through a world: Python's garbage collector finds a force that refers to the
//! world it acts in, or to a handle of it.
//!
//! A world is behind a lock that many handles share, which Python cannot see. All of them therefore
//! hold one [`Anchor`], which represents the world in Python's reference counts: it alone refers to
//! the forces and behaviors of the world, each once. They are listed beside the world and not in
//! it. The list changes only under the interpreter's lock, so it is constant during one collection,
//! whichever thread steps meanwhile.

use crate::world::shared::Shared;
use pyo3::gc::{PyTraverseError, PyVisit};
use pyo3::prelude::*;
use pyo3::types::{PyWeakrefMethods, PyWeakrefReference};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A force or behavior. Python counts it once, however many references Rust has.
pub type Callable = Arc<Py<PyAny>>;

/// Represents a world to the garbage collector.
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
        self.shared.drop_callbacks();
    }
}

/// The garbage collector's data about a world.
#[derive(Default)]
pub struct Ground {
    /// The anchor, if the world has one at present.
    anchor: Mutex<Option<Py<PyWeakrefReference>>>,
    /// Its forces and behaviors.
    callables: Mutex<Vec<Callable>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Ground {
    /// Replaces the list of forces and behaviors. The interpreter's lock must be held.
    pub fn list(&self, callables: Vec<Callable>) {
        let before = std::mem::replace(&mut *lock(&self.callables), callables);
        drop(before); // not under the lock: it may run Python
    }
}

/// Returns the anchor of a world, for a Python object that refers to the world.
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

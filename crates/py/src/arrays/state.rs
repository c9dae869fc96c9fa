//! The state as a numpy array over the world's own memory, without a copy. The only `unsafe` of the
//! package is here.
//!
//! An array refers to the memory that the world steps in ([`World::state_memory`]). Making
//! one copies nothing, and stepping under it copies nothing. When a body is added or removed the world moves to
//! new memory once, and old arrays keep the old memory. Why this is sound:
//!
//! - *The memory stays.* The world writes it in place and does not free it while a hold exists;
//!   each array owns a [`Memory`], which has one.
//! - *No write under a reader.* Python reads while it has the interpreter's lock. While an array
//!   exists, every call that changes the world has that lock too: [`Shared`](crate::world::shared::Shared)
//!   releases it while stepping only if there is none. If forces or behaviors in Python run during
//!   a step, the world steps on a copy meanwhile, and readers see the state before the call.
//! - *No write through it.* The arrays are read-only, and numpy cannot make them writable, since
//!   the memory is not a writable buffer.
//!
//! numpy releases the lock inside of large operations. An operation that reads a state in one
//! thread while another thread steps that world may see numbers of two moments, as with any array
//! that another thread writes.

#![allow(unsafe_code, reason = "an array over memory that is not numpy's")]

use numpy::PyArray1;
use numpy::ndarray::ArrayView1;
use pyo3::prelude::*;
use pyo3::types::{PyWeakrefMethods, PyWeakrefReference};
use std::sync::Arc;
use tumble::dynamics::{StateMemoryHold, World};

/// Holds the memory of an array.
#[pyclass(frozen, module = "tumble", name = "_Memory")]
struct Memory {
    _hold: Arc<StateMemoryHold>,
}

/// The array that views refer to, while any exists, and its address.
#[derive(Default)]
pub struct Shown(Option<(Py<PyWeakrefReference>, usize)>);

impl Shown {
    /// Returns a read-only view that follows the world.
    pub fn view<'py>(&mut self, py: Python<'py>, world: &mut World) -> PyResult<Bound<'py, PyAny>> {
        let now = world.state_memory().address().0.addr();
        let base = match self.array(py).filter(|(_, address)| *address == now) {
            Some((base, _)) => base,
            None => {
                let base = over(py, world)?;
                base.call_method1("setflags", (false,))?;
                self.0 = Some((PyWeakrefReference::new(&base)?.unbind(), now));
                base
            }
        };
        base.call_method0("view")
    }

    /// Returns whether Python has a view.
    pub fn alive(&self, py: Python<'_>) -> bool {
        self.array(py).is_some()
    }

    fn array<'py>(&self, py: Python<'py>) -> Option<(Bound<'py, PyAny>, usize)> {
        let (weak, address) = self.0.as_ref()?;
        Some((weak.bind(py).upgrade()?, *address))
    }
}

/// Returns an array over the memory of a world's state.
fn over<'py>(py: Python<'py>, world: &mut World) -> PyResult<Bound<'py, PyAny>> {
    let keeper = Bound::new(py, Memory { _hold: world.state_memory().hold() })?.into_any();
    let (start, len) = world.state_memory().address();
    // SAFETY: `start` is the start of `len` initialized numbers that stay there while `keeper`
    // lives; the module's comment says when they are written. No reference to them is made: the
    // view is taken apart into pointer, length and stride.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from_shape_ptr(len, start), keeper) };
    Ok(array.into_any())
}

/// Returns the reference count of an object.
pub fn holders<T>(object: &Py<T>, _py: Python<'_>) -> isize {
    // SAFETY: the pointer is to a live object, and the interpreter is held.
    unsafe { pyo3::ffi::Py_REFCNT(object.as_ptr()) }
}

//! The state as numpy sees it: the world's own memory, not a copy. The only `unsafe` of the package is here.
//!
//! An array looks straight into the memory that the world steps in ([`World::hold_state_memory`]); making one, and stepping under it, copies nothing. When a body
//! comes or goes the world moves to new memory once, and old arrays keep the old. Why this is sound:
//!
//! - *The memory stays.* The world writes it in place and never gives it back while a hold lives; each array keeps a [`Memory`] alive, which has one.
//! - *Nobody writes under a reader.* Python reads while it has the interpreter's lock. Every call that changes the world has that lock too, for as long as an
//!   array lives: [`Shared`](crate::shared::Shared) lets go of it while stepping only when there is none. Where forces or behaviours in Python run in the
//!   middle of a step, the world steps on a copy meanwhile, and readers see the state as it was before the call.
//! - *Nobody writes through it.* The arrays are read-only, and numpy cannot be talked out of that: what they look into is no buffer that can be written.
//!
//! numpy lets go of the lock inside of a large operation. One that reads a state in one thread, while another thread steps that world, may see numbers of two
//! moments, as with any array that another thread writes.

#![allow(unsafe_code, reason = "an array over memory that is not numpy's")]

use numpy::PyArray1;
use numpy::ndarray::ArrayView1;
use pyo3::prelude::*;
use pyo3::types::{PyWeakrefMethods, PyWeakrefReference};
use std::sync::Arc;
use tumble::dynamics::{StateMemoryHold, World};

/// Keeps alive what an array looks into.
#[pyclass(frozen, module = "tumble", name = "_Memory")]
struct Memory {
    _hold: Arc<StateMemoryHold>,
}

/// The array that views look at, while anybody holds one, and where it looks.
#[derive(Default)]
pub struct Shown(Option<(Py<PyWeakrefReference>, usize)>);

impl Shown {
    /// A read-only view that follows the world.
    pub fn view<'py>(&mut self, py: Python<'py>, world: &mut World) -> PyResult<Bound<'py, PyAny>> {
        let now = world.state_address().0.addr();
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

    /// Whether Python holds a view.
    pub fn alive(&self, py: Python<'_>) -> bool {
        self.array(py).is_some()
    }

    fn array<'py>(&self, py: Python<'py>) -> Option<(Bound<'py, PyAny>, usize)> {
        let (weak, address) = self.0.as_ref()?;
        Some((weak.bind(py).upgrade()?, *address))
    }
}

/// An array over the memory of a world's state.
fn over<'py>(py: Python<'py>, world: &mut World) -> PyResult<Bound<'py, PyAny>> {
    let keeper = Bound::new(py, Memory { _hold: world.hold_state_memory() })?.into_any();
    let (start, len) = world.state_address();
    // SAFETY: `start` is the start of `len` initialized numbers that stay there while `keeper` lives; when they are written is told above. No
    // reference to them is made: the view is taken apart into pointer, length and stride.
    let array = unsafe { PyArray1::borrow_from_array(&ArrayView1::from_shape_ptr(len, start), keeper) };
    Ok(array.into_any())
}

/// How many hold an object: its references as Python counts them.
pub fn holders<T>(object: &Py<T>, _py: Python<'_>) -> isize {
    // SAFETY: the pointer is to an object that is alive, and the interpreter is held.
    unsafe { pyo3::ffi::Py_REFCNT(object.as_ptr()) }
}

//! The state as numpy sees it.
//!
//! Arrays that Python holds cannot look into the world's own memory: a step in another thread would change it under a reader. So the state has a
//! mirror: one numpy array, written under the interpreter's lock after every call that changes the world, and only while Python holds a view of it
//! (some 0.1 µs per kilobyte). Views of it are read-only, cost nothing to make, and follow the world until a body is added or removed; the mirror is
//! then made anew and old views keep the old one. No `unsafe` is needed for that.

use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyWeakrefMethods, PyWeakrefReference};

/// The array that views look at, while anybody holds one.
#[derive(Default)]
pub struct Mirror(Option<Py<PyWeakrefReference>>);

impl Mirror {
    /// A read-only view that follows the world; `x` is the state now.
    pub fn view<'py>(&mut self, py: Python<'py>, x: &[f64]) -> PyResult<Bound<'py, PyAny>> {
        let base = match self.array(py) {
            Some(base) => base,
            None => {
                let base = PyArray1::from_slice(py, x);
                self.0 = Some(PyWeakrefReference::new(&base)?.unbind());
                base
            }
        };
        let view = base.call_method0("view")?;
        view.call_method1("setflags", (false,))?;
        Ok(view)
    }

    /// Writes the state to the views that are still held; forgets the mirror where there are none.
    pub fn follow(&mut self, py: Python<'_>, x: &[f64]) {
        if self.0.is_none() {
            return;
        }
        let written = self.array(py).is_some_and(|base| {
            base.try_readwrite().is_ok_and(|mut all| match all.as_slice_mut() {
                Ok(all) if all.len() == x.len() => {
                    all.copy_from_slice(x);
                    true
                }
                _ => false,
            })
        });
        if !written {
            self.0 = None;
        }
    }

    /// Leaves the array to those who hold views of it: bodies came or went.
    pub fn renew(&mut self) {
        self.0 = None;
    }

    fn array<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        self.0.as_ref()?.bind(py).upgrade()?.cast_into().ok()
    }
}

//! A Python object that a world calls: with a view of the world, and with an exception that is kept.

use crate::errors::{Error, Result};
use crate::extension::columns::Arrays;
use crate::extension::layout::Layout;
use crate::extension::view::View;
use crate::world::gc::Callable;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard};
use tumble::dynamics::{WorldView, Wrench};

/// A Python object that is called, the layout of its rows, and its pending exception.
pub struct Code {
    pub name: String,
    pub object: Callable,
    layout: Mutex<Option<Arc<Layout>>>,
    /// From the previous call.
    arrays: Mutex<Option<Arc<Arrays>>>,
    pub raised: Mutex<Option<PyErr>>,
}

/// Locks what only one thread uses at a time.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Code {
    /// Returns an object under the name of its object of the world.
    pub fn new(name: &str, object: &Bound<'_, PyAny>) -> Code {
        Code::of(name, Arc::new(object.clone().unbind()))
    }

    /// Returns the same for a shared object.
    pub fn of(name: &str, object: Callable) -> Code {
        Code { name: name.into(), object, layout: Mutex::default(), arrays: Mutex::default(), raised: Mutex::default() }
    }

    /// Returns the copy of a callable for a fork of the world: of the object's own `fork` if it has one.
    pub fn fork_callable(&self) -> Code {
        let has_fork = Python::attach(|py| self.object.bind(py).hasattr("fork").unwrap_or(false));
        if has_fork { self.fork("__call__") } else { Code::of(&self.name, self.object.clone()) }
    }

    /// Returns the copy for a fork of the world, from the object's own `fork`. An exception there
    /// is kept like that of a call.
    pub fn fork(&self, method: &str) -> Code {
        let fork = |py: Python<'_>| {
            let object = self.object.call_method0(py, "fork")?;
            match object.getattr(py, method).is_ok() && object.getattr(py, "fork").is_ok() {
                true => Ok(object),
                false => Err(PyErr::from(Error::value(format!(
                    "'{}': `fork` must return an object with `{method}` and `fork`",
                    self.name
                )))),
            }
        };
        Python::attach(|py| match fork(py) {
            Ok(object) => Code::of(&self.name, Arc::new(object)),
            Err(error) => Code { raised: Mutex::new(Some(error)), ..Code::of(&self.name, self.object.clone()) },
        })
    }

    /// Returns the rows of a world, which are kept until its objects change.
    pub fn layout(&self, world: &WorldView) -> Arc<Layout> {
        let mut kept = lock(&self.layout);
        match &*kept {
            Some(layout) if layout.fits(world) => layout.clone(),
            _ => kept.insert(Arc::new(Layout::of(world))).clone(),
        }
    }

    /// Returns the Python object.
    pub fn object<'py>(&self, py: Python<'py>) -> &Bound<'py, PyAny> {
        self.object.bind(py)
    }

    /// Calls a method with a view. `each` receives the added forces by part.
    pub fn call(
        &self,
        world: &WorldView,
        method: &str,
        rows: Option<&[i64]>,
        mut each: impl FnMut(usize, Wrench),
    ) -> Result<()> {
        let called = |py: Python<'_>, view: &Bound<'_, View>| {
            let object = self.object.bind(py);
            let returned = match rows {
                Some(rows) => object.call_method1(method, (view, numpy::PyArray1::from_slice(py, rows))),
                None => object.call_method1(method, (view,)),
            };
            match returned?.is_none() {
                true => Ok(()),
                false => Err(Error::value(format!(
                    "'{}': `{method}` must return None; add what it does to view.force and view.torque",
                    self.name
                ))),
            }
        };
        self.viewed(world, called, |part_index, wrench| {
            each(part_index, wrench);
            Ok(())
        })
    }

    /// Makes a call with a view. `each` receives the added forces by part.
    pub fn viewed<T>(
        &self,
        world: &WorldView,
        call: impl FnOnce(Python<'_>, &Bound<'_, View>) -> Result<T>,
        mut each: impl FnMut(usize, Wrench) -> Result<()>,
    ) -> Result<T> {
        let layout = self.layout(world);
        Python::attach(|py| {
            let arrays = match lock(&self.arrays).take().filter(|arrays| arrays.free(py, layout.len())) {
                Some(arrays) => arrays,
                None => Arc::new(Arrays::new(py, layout.len())?),
            };
            arrays.fill(py, &layout.shown(world.part_states))?;
            let view = Bound::new(py, View::new(world, &layout, &arrays))?;
            let outcome = call(py, &view);
            view.get().end();
            drop(view);
            let outcome = outcome?;
            let mut wrong = Ok(());
            arrays.take(py, &layout, &self.name, |row, wrench| {
                let (part_index, wrench) = layout.at_part(row, world.part_states, wrench);
                wrong = std::mem::replace(&mut wrong, Ok(())).and_then(|()| each(part_index, wrench));
            })?;
            wrong?;
            *lock(&self.arrays) = Some(arrays);
            Ok(outcome)
        })
    }
}

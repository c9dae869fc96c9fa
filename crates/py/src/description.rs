//! Descriptions of articulated bodies that come from elsewhere than `Articulation.from_urdf`: paths, and pickles.

use crate::articulation::Articulation;
use crate::convert::{array, path};
use crate::errors::{Error, Result};
use crate::spot::Which;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What a pickled description becomes: its file is read anew.
#[pyfunction]
pub fn _unpickle_articulation(
    py: Python<'_>,
    file: PathBuf,
    floating: bool,
    packages: BTreeMap<String, PathBuf>,
    words: [String; 2],
    numbers: [Vec<f64>; 4],
) -> Result<Articulation> {
    let file = file.into_pyobject(py).map_err(PyErr::from)?.into_any();
    let [missing, collision] = words;
    let description = Articulation::from_urdf(py, &file, floating, Some(packages), &missing, &collision)?;
    let [gravity, q, qd, tau] = numbers.map(|row| array(py, &row).into_any());
    description.set_gravity(&gravity)?;
    for (which, row) in [(Which::Q, q), (Which::Qd, qd), (Which::Tau, tau)] {
        description.spot.set(py, which, &description.robot, &row)?;
    }
    Ok(description)
}

/// The error of a handle that is pickled.
pub fn alone(name: &str) -> Error {
    PyTypeError::new_err(format!(
        "cannot pickle a handle of '{name}' by itself; pickle its world, and ask that for the body by name"
    ))
    .into()
}

/// A description of a URDF, from a path.
pub fn described<'py>(value: &Bound<'py, PyAny>) -> Result<Bound<'py, Articulation>> {
    if let Ok(own) = value.cast::<Articulation>() {
        return Ok(own.clone());
    }
    path(value)?;
    Ok(Bound::new(value.py(), Articulation::from_urdf(value.py(), value, false, None, "error", "exact")?)?)
}

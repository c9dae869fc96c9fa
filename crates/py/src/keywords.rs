//! Unknown keyword arguments: a `TypeError` that names the nearest known one.

use crate::errors::Result;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Keyword arguments that a function does not know.
pub type Unknown<'a, 'py> = &'a Bound<'py, PyDict>;

/// Refuses unknown keyword arguments. function: ``CLASS`` for a constructor, or ``CLASS.METHOD``.
pub fn check(unknown: Option<Unknown<'_, '_>>, function: &str) -> Result<()> {
    let Some(unknown) = unknown.filter(|unknown| !unknown.is_empty()) else { return Ok(()) };
    let word: String = unknown.keys().get_item(0)?.extract()?;
    Err(refusal(unknown.py(), function, &word, &[])?.into())
}

/// Returns the error for an unknown keyword argument of a function that also takes the words `more`.
pub fn refusal(py: Python<'_>, function: &str, word: &str, more: &[&str]) -> PyResult<PyErr> {
    let known = known(py, function, more)?;
    let near: Vec<String> =
        py.import("difflib")?.call_method1("get_close_matches", (word, &known, 1, 0.6))?.extract()?;
    let hint = match near.first() {
        Some(near) => format!("did you mean '{near}'?"),
        None => format!("there are {}", known.join(", ")),
    };
    Ok(PyTypeError::new_err(format!("{function}() got an unexpected keyword argument '{word}'; {hint}")))
}

/// Returns the names of the arguments of a function, as its signature has them.
fn known(py: Python<'_>, function: &str, more: &[&str]) -> PyResult<Vec<String>> {
    let mut found = py.import("tumble._native")?.into_any();
    for name in function.split('.') {
        found = found.getattr(name)?;
    }
    let signature = py.import("inspect")?.call_method1("signature", (found,))?;
    let mut names = Vec::new();
    for parameter in signature.getattr("parameters")?.call_method0("values")?.try_iter()? {
        let parameter = parameter?;
        let (name, kind): (String, u8) = (parameter.getattr("name")?.extract()?, parameter.getattr("kind")?.extract()?);
        // 1: also by position, 3: by keyword alone
        if matches!(kind, 1 | 3) && name != "self" {
            names.push(name);
        }
    }
    names.extend(more.iter().map(|&word| word.to_owned()));
    Ok(names)
}

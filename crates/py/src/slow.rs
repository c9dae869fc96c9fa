//! Loading that takes long, as a Python warning.

use crate::errors::Result;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::sync::{Mutex, PoisonError};
use tumble::scene::set_slow_load_listener;

/// What took long since the last warning.
static TOLD: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Takes note of what takes long from now on.
pub fn listen() {
    set_slow_load_listener(|line| TOLD.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned()));
}

/// Warns of what took long, once of each.
pub fn warn(py: Python<'_>) -> Result<()> {
    let told = std::mem::take(&mut *TOLD.lock().unwrap_or_else(PoisonError::into_inner));
    for line in told {
        let text = format!("{line} took longer than 2 s; the cache keeps it for the next time");
        // names of files hold no zero byte
        let text = CString::new(text.replace('\0', "")).unwrap_or_default();
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(())
}

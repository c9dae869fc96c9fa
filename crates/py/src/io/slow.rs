//! Slow loading, as a Python warning.

use crate::errors::Result;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;
use std::ffi::CString;
use std::sync::{Mutex, PoisonError};
use tumble::scene::set_slow_load_listener;

/// Loads that took long since the last warning.
static SLOW_LOADS: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Starts to collect slow loads.
pub fn listen() {
    set_slow_load_listener(|line| SLOW_LOADS.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned()));
}

/// Warns about slow loads, once each.
pub fn warn(py: Python<'_>) -> Result<()> {
    let lines = std::mem::take(&mut *SLOW_LOADS.lock().unwrap_or_else(PoisonError::into_inner));
    for line in lines {
        let text = format!("{line} took longer than 2 s; the cache keeps it for the next time");
        // File names have no zero byte.
        let text = CString::new(text.replace('\0', "")).unwrap_or_default();
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
    }
    Ok(())
}

//! Deliberate faults, with which tests check the effect of a panic inside of tumble on a Python
//! program.

use crate::errors::{Error, Result};
use crate::world::class::World;
use pyo3::prelude::*;

/// Panics within a call on a world that is ``"read"``, ``"changed"`` or ``"stepped"``.
#[pyfunction]
pub fn _panic(py: Python<'_>, world: &Bound<'_, World>, while_: &str) -> Result<()> {
    let shared = &world.get().shared;
    let past_the_end = |numbers: &[f64]| numbers[numbers.len()];
    match while_ {
        "read" => shared.read(|inner| Ok(past_the_end(inner.world.state()))).map(drop),
        "changed" => shared.write(py, |inner| Ok(past_the_end(inner.world.state()))).map(drop),
        "stepped" => shared.work(py, |inner| Ok(past_the_end(inner.world.state()))).map(drop),
        other => Err(Error::value(format!("`{other}` is not a kind of call"))),
    }
}

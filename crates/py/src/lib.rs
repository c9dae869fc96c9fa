//! The Python module `tumble._native`: conversion between Python and the crates, and no physics.

use pyo3::prelude::*;

/// The compiled part of the package `tumble`.
#[pymodule]
mod _native {
    use super::*;

    /// Adds what is not a class or a function.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}

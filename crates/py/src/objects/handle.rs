//! The common part of the handles of objects: name, existence, switch, equality, hash, text, and garbage collection.

/// Gives a class with the fields `place: Place` and `anchor: Py<Anchor>` what handles have, and a constructor. `$shown` returns what its text
/// says behind the name, `None` if the object was removed.
macro_rules! handle {
    ($handle:ident, $name:literal, $shown:expr) => {
        impl $handle {
            /// Returns a handle.
            pub fn new(py: pyo3::Python<'_>, place: crate::objects::place::Place) -> crate::errors::Result<$handle> {
                let anchor = crate::world::gc::anchor(py, &place.shared)?;
                Ok(Self { anchor, place })
            }
        }

        #[pyo3::pymethods]
        impl $handle {
            /// Name, unique in its world.
            #[getter]
            fn name(&self) -> &str {
                &self.place.name
            }

            /// Whether its world still has it.
            #[getter]
            fn exists(&self) -> crate::errors::Result<bool> {
                self.place.exists()
            }

            /// Whether it takes part in the simulation. A disabled object keeps its state and has no effect: an event does not
            /// fire, a sensor is not read. A joint that broke is disabled; setting True mends it.
            #[getter]
            fn enabled(&self) -> crate::errors::Result<bool> {
                Ok(self.place.status()?.enabled)
            }

            #[setter]
            fn set_enabled(&self, py: pyo3::Python<'_>, value: bool) -> crate::errors::Result<()> {
                self.place.write(py, |inner| Ok(inner.world.set_enabled(self.place.id, value)?))
            }

            fn __repr__(&self) -> String {
                let shown: fn(&$handle) -> Option<String> = $shown;
                let shown = shown(self).filter(|_| self.exists().unwrap_or(true));
                format!("<tumble.{} '{}'{}>", $name, self.place.name, shown.as_deref().unwrap_or(", removed"))
            }

            fn __eq__(&self, other: &pyo3::Bound<'_, pyo3::PyAny>) -> bool {
                other.cast::<$handle>().is_ok_and(|other| self.place.same(&other.get().place))
            }

            fn __hash__(&self) -> u64 {
                crate::objects::place::hash(&self.place)
            }

            fn __traverse__(&self, visit: pyo3::gc::PyVisit<'_>) -> std::result::Result<(), pyo3::gc::PyTraverseError> {
                visit.call(&self.anchor)
            }
        }
    };
}
pub(crate) use handle;

//! Pictures, windows and plots of a world.

use crate::arrays::whole;
use crate::errors::Result;
use crate::io::picture::Shot;
use crate::world::class::World;
use numpy::PyArray3;
use pyo3::prelude::*;
use pyo3::types::PyDict;

#[pymethods]
impl World {
    /// Renders the world: sRGB and alpha, shape (height, width, 4), uint8, rows from the top. No
    /// window is needed.
    ///
    /// width, height: pixels, by default 640 x 480. The view is one of: camera, ``tumble.Camera``
    /// or ``(eye, target)`` in meters; facet, ``"cube4:front"``: a facet of a cave, given by path
    /// or name, at the size in the cave file; cave: all its facets unfolded into at most width x
    /// height; else the scene's camera, or one that shows everything. overlays: names of ``tumble
    /// run --debug-draw``, such as ``"contacts,forces"``. Without a graphics adapter it raises
    /// ``PictureError``.
    #[pyo3(signature = (width=None, height=None, *, camera=None, facet=None, cave=None, overlays=None))]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = whole::width)] width: Option<u32>,
        #[pyo3(from_py_with = whole::height)] height: Option<u32>,
        camera: Option<&Bound<'py, PyAny>>,
        facet: Option<&str>,
        cave: Option<&str>,
        overlays: Option<&str>,
    ) -> Result<Bound<'py, PyArray3<u8>>> {
        Shot::new([width, height], camera, facet, cave, overlays)?.take(py, &self.shared)
    }

    /// Opens a window on the world and returns it: ``tumble.Window``. A process of its own draws the world as
    /// it stands, 60 times a second, while the program steps and changes it. The window closes with the
    /// program.
    ///
    /// block: step the world in real time until the window is closed. title, width, height (pixels): of the
    /// window. Without a desktop or a graphics adapter, ``block=True`` and later calls of ``is_open`` raise
    /// ``PictureError``.
    #[pyo3(signature = (*, block=false, title=None, width=1280, height=720))]
    fn view(
        slf: &Bound<'_, Self>,
        block: bool,
        title: Option<&str>,
        #[pyo3(from_py_with = whole::width)] width: u32,
        #[pyo3(from_py_with = whole::height)] height: u32,
    ) -> Result<Py<PyAny>> {
        let options = PyDict::new(slf.py());
        options.set_item("block", block)?;
        options.set_item("title", title)?;
        options.set_item("width", width)?;
        options.set_item("height", height)?;
        Ok(slf.py().import("tumble._window")?.call_method("view", (slf,), Some(&options))?.unbind())
    }

    /// Returns a PNG for notebooks, or None without a graphics adapter.
    fn _repr_png_(slf: &Bound<'_, Self>) -> Result<Py<PyAny>> {
        Ok(slf.py().import("tumble._pictures")?.call_method1("repr_png", (slf,))?.unbind())
    }

    /// Steps a fork for ``duration`` seconds and plots its energy over time. The world does not
    /// change. Requires matplotlib, the extra ``plot``.
    ///
    /// ax: the axes to plot on, by default new ones. Returns the axes.
    #[pyo3(signature = (duration=5.0, *, ax=None))]
    fn plot_energy(slf: &Bound<'_, Self>, duration: f64, ax: Option<&Bound<'_, PyAny>>) -> Result<Py<PyAny>> {
        Ok(slf.py().import("tumble._plots")?.call_method1("energy", (slf, duration, ax))?.unbind())
    }

    /// Steps a fork for ``duration`` seconds and plots the paths of bodies (default: all dynamic
    /// bodies) as seen along an axis, ``"x"``, ``"y"`` or ``"z"``.
    ///
    /// Otherwise as ``plot_energy``.
    #[pyo3(signature = (duration=5.0, *, bodies=None, along="y", ax=None))]
    fn plot_paths(
        slf: &Bound<'_, Self>,
        duration: f64,
        bodies: Option<&Bound<'_, PyAny>>,
        along: &str,
        ax: Option<&Bound<'_, PyAny>>,
    ) -> Result<Py<PyAny>> {
        Ok(slf.py().import("tumble._plots")?.call_method1("paths", (slf, duration, bodies, along, ax))?.unbind())
    }
}

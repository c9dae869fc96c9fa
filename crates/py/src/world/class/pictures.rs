//! Pictures, windows and plots of a world.

use crate::arrays::whole;
use crate::errors::Result;
use crate::io::picture::Shot;
use crate::keywords::{self, Unknown};
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
    #[pyo3(signature = (width=None, height=None, *, camera=None, facet=None, cave=None, overlays=None, **unknown), text_signature = "($self, width=None, height=None, *, camera=None, facet=None, cave=None, overlays=None)")]
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
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Bound<'py, PyArray3<u8>>> {
        keywords::check(unknown, "World.render")?;
        Shot::new([width, height], camera, facet, cave, overlays)?.take(py, &self.shared)
    }

    /// Opens a window on the world and returns it once it is open: ``tumble.Window``. A process of its own draws the world as
    /// it stands, 60 times a second, while the program steps and changes it. The window closes with the
    /// program.
    ///
    /// block: step the world in real time until the window is closed. title, width, height (pixels): of the
    /// window. Without a desktop or a graphics adapter it raises ``PictureError`` with the reason.
    #[pyo3(signature = (*, block=false, title=None, width=1280, height=720, **unknown), text_signature = "($self, *, block=False, title=None, width=1280, height=720)")]
    fn view(
        slf: &Bound<'_, Self>,
        block: bool,
        title: Option<&str>,
        #[pyo3(from_py_with = whole::width)] width: u32,
        #[pyo3(from_py_with = whole::height)] height: u32,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Py<PyAny>> {
        keywords::check(unknown, "World.view")?;
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
    #[pyo3(signature = (duration=5.0, *, ax=None, **unknown), text_signature = "($self, duration=5.0, *, ax=None)")]
    fn plot_energy(
        slf: &Bound<'_, Self>,
        duration: f64,
        ax: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Py<PyAny>> {
        keywords::check(unknown, "World.plot_energy")?;
        Ok(slf.py().import("tumble._plots")?.call_method1("energy", (slf, duration, ax))?.unbind())
    }

    /// Steps a fork for ``duration`` seconds and returns an ``Animation`` of it for notebooks, which plays without a kernel and without
    /// a network; ``save`` writes it. This world does not change.
    ///
    /// width, height: pixels. fps: images per second. speed: times real time. camera: as in ``render``. control: a function that
    /// is called with the fork before each step.
    #[pyo3(
        signature = (duration=5.0, *, width=480, height=320, fps=15.0, speed=1.0, camera=None, control=None, **unknown),
        text_signature = "($self, duration=5.0, *, width=480, height=320, fps=15.0, speed=1.0, camera=None, control=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn animation(
        slf: &Bound<'_, Self>,
        duration: f64,
        #[pyo3(from_py_with = whole::width)] width: u32,
        #[pyo3(from_py_with = whole::height)] height: u32,
        fps: f64,
        speed: f64,
        camera: Option<&Bound<'_, PyAny>>,
        control: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Py<PyAny>> {
        keywords::check(unknown, "World.animation")?;
        let given = (slf, duration, (width, height), fps, speed, camera, control);
        Ok(slf.py().import("tumble._animations")?.call_method1("of_world", given)?.unbind())
    }

    /// Steps a fork for ``duration`` seconds and writes a video of it (``.mp4`` and all that ffmpeg knows), or without ffmpeg an animated
    /// PNG (``.png``, ``.apng``). This world does not change. Arguments as in ``animation``. Without ffmpeg or a graphics adapter:
    /// ``PictureError``.
    #[pyo3(
        signature = (path, duration=5.0, *, width=1280, height=720, fps=30.0, speed=1.0, camera=None, control=None, **unknown),
        text_signature = "($self, path, duration=5.0, *, width=1280, height=720, fps=30.0, speed=1.0, camera=None, control=None)"
    )]
    #[allow(clippy::too_many_arguments, reason = "Python's keyword arguments")]
    fn video(
        slf: &Bound<'_, Self>,
        path: &Bound<'_, PyAny>,
        duration: f64,
        #[pyo3(from_py_with = whole::width)] width: u32,
        #[pyo3(from_py_with = whole::height)] height: u32,
        fps: f64,
        speed: f64,
        camera: Option<&Bound<'_, PyAny>>,
        control: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<()> {
        keywords::check(unknown, "World.video")?;
        let given = (slf, path, duration, (width, height), fps, speed, camera, control);
        slf.py().import("tumble._animations")?.call_method1("video_of_world", given)?;
        Ok(())
    }

    /// Steps a fork for ``duration`` seconds and plots the paths of bodies (default: all dynamic
    /// bodies) as seen along an axis, ``"x"``, ``"y"`` or ``"z"``.
    ///
    /// Otherwise as ``plot_energy``.
    #[pyo3(signature = (duration=5.0, *, bodies=None, along="y", ax=None, **unknown), text_signature = "($self, duration=5.0, *, bodies=None, along='y', ax=None)")]
    fn plot_paths(
        slf: &Bound<'_, Self>,
        duration: f64,
        bodies: Option<&Bound<'_, PyAny>>,
        along: &str,
        ax: Option<&Bound<'_, PyAny>>,
        unknown: Option<Unknown<'_, '_>>,
    ) -> Result<Py<PyAny>> {
        keywords::check(unknown, "World.plot_paths")?;
        Ok(slf.py().import("tumble._plots")?.call_method1("paths", (slf, duration, bodies, along, ax))?.unbind())
    }
}

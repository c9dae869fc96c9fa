//! The painter of a facet whose window, if it has one, belongs to another thread: a thread of this process,
//! also for several facets, the main thread with several windows, or web browsers.

use super::pictures::Pictures;
use super::render_thread::{RenderThread, Wanted};
use super::wall::WindowPainter;
use crate::cave::endpoints::FacetEndpoint;
use crate::cave::web::WebScreen;
use crate::failure::Failure;
use std::time::Duration;
use tumble::dynamics::World;
use tumble::net::sync::{Facet, Viewer};
use tumble::render::Image;

/// The painter of a facet.
pub enum Painter {
    /// Into memory.
    Memory(Box<RenderThread>),
    /// By the painter of another facet of this process, into memory.
    Other {
        /// Its pictures.
        pictures: Pictures,
        /// The graphics adapter.
        adapter: String,
    },
    /// In one of several windows of this process.
    Window(Box<WindowPainter>),
    /// On the screens of browsers, which keep their pictures.
    Browsers(Box<WebScreen>),
}

impl Painter {
    /// Prepares the first picture. Returns `false` if the facet must stop.
    pub fn prepare(&mut self, world: &World, viewer: &Viewer, stop: impl Fn() -> bool) -> Result<bool, Failure> {
        match self {
            Painter::Window(window) => window.prepare(world, viewer, stop),
            Painter::Memory(_) | Painter::Other { .. } | Painter::Browsers(_) => Ok(true),
        }
    }

    /// Returns whether a software driver draws in this process, for its first facet.
    pub fn is_software(&self) -> bool {
        match self {
            Painter::Memory(thread) => thread.is_software(),
            Painter::Window(window) => window.is_software(),
            Painter::Other { .. } | Painter::Browsers(_) => false,
        }
    }

    /// Returns the graphics adapter of this process; empty if browsers draw.
    pub fn adapter(&self) -> &str {
        match self {
            Painter::Memory(thread) => thread.adapter(),
            Painter::Other { adapter, .. } => adapter,
            Painter::Window(window) => window.adapter(),
            Painter::Browsers(_) => "",
        }
    }

    /// Starts a picture of the world, or of a calibration pattern. Browsers go on with the scene: patterns are
    /// for projectors.
    pub fn begin(&mut self, world: &World, viewer: &Viewer, wanted: &Wanted) -> Result<(), Failure> {
        match self {
            Painter::Memory(thread) => thread.begin(world, viewer, wanted),
            Painter::Other { pictures, .. } => {
                pictures.want(wanted.frame);
                Ok(())
            }
            Painter::Window(window) => window.begin(world, viewer, wanted),
            Painter::Browsers(screen) => screen.begin(world, viewer, wanted.frame),
        }
    }

    /// Returns whether the picture is finished within `timeout`, and the picture if it is in memory.
    pub fn finished(&mut self, timeout: Duration) -> Result<Option<Option<Image>>, Failure> {
        match self {
            Painter::Memory(thread) => thread.finished(timeout),
            Painter::Other { pictures, .. } => pictures.take(timeout),
            Painter::Window(window) => window.finished(timeout),
            Painter::Browsers(screen) => Ok(screen.is_finished(timeout)?.then_some(None)),
        }
    }

    /// Shows the finished picture of the frame.
    pub fn present(&mut self, frame: u64) -> Result<(), Failure> {
        match self {
            Painter::Browsers(screen) => screen.present(frame),
            Painter::Window(window) => return window.present(frame),
            Painter::Memory(_) | Painter::Other { .. } => {}
        }
        Ok(())
    }

    /// Sends the input of a window, and warns there of a lost server.
    pub fn attend(&mut self, session: &mut Facet<FacetEndpoint>, without_server_s: u64) -> Result<(), Failure> {
        let Painter::Window(window) = self else { return Ok(()) };
        window.warn(without_server_s)?;
        window.send(session)
    }
}

//! The painter of a facet without a window: a thread of this process, also for several facets, or web
//! browsers.

use super::pictures::Pictures;
use super::render_thread::RenderThread;
use crate::cave::web::WebScreen;
use crate::failure::Failure;
use std::time::Duration;
use tumble::dynamics::World;
use tumble::net::sync::Viewer;
use tumble::render::{CalibrationPattern, Image};

/// The painter of a facet without a window.
pub enum Painter {
    /// Into memory.
    Memory(Box<RenderThread>),
    /// By the painter of another facet of this process.
    Other {
        /// Its pictures.
        pictures: Pictures,
        /// The graphics adapter.
        adapter: String,
    },
    /// On the screens of browsers, which keep their pictures.
    Browsers(Box<WebScreen>),
}

impl Painter {
    /// Returns whether a software driver draws in this process.
    pub fn is_software(&self) -> bool {
        match self {
            Painter::Memory(thread) => thread.is_software(),
            Painter::Other { .. } | Painter::Browsers(_) => false,
        }
    }

    /// Returns the graphics adapter of this process; empty if browsers draw.
    pub fn adapter(&self) -> &str {
        match self {
            Painter::Memory(thread) => thread.adapter(),
            Painter::Other { adapter, .. } => adapter,
            Painter::Browsers(_) => "",
        }
    }

    /// Starts a picture of the world, or of a calibration pattern, with the frame number in it for
    /// `burn_in`. Browsers go on with the scene: patterns are for projectors.
    pub fn begin(
        &mut self,
        world: &World,
        viewer: &Viewer,
        frame: u64,
        burn_in: bool,
        pattern: Option<CalibrationPattern>,
    ) -> Result<(), Failure> {
        match self {
            Painter::Memory(thread) => thread.begin(world, viewer, frame, burn_in, pattern),
            Painter::Other { pictures, .. } => {
                pictures.want(frame);
                Ok(())
            }
            Painter::Browsers(screen) => screen.begin(world, viewer, frame),
        }
    }

    /// Returns whether the picture is finished within `timeout`, and the picture if it is in memory.
    pub fn finished(&mut self, timeout: Duration) -> Result<Option<Option<Image>>, Failure> {
        match self {
            Painter::Memory(thread) => Ok(thread.finished(timeout)?.map(Some)),
            Painter::Other { pictures, .. } => Ok(pictures.take(timeout)?.map(Some)),
            Painter::Browsers(screen) => Ok(screen.is_finished(timeout).then_some(None)),
        }
    }

    /// Shows the finished picture of the frame.
    pub fn present(&mut self, frame: u64) {
        if let Painter::Browsers(screen) = self {
            screen.present(frame);
        }
    }
}

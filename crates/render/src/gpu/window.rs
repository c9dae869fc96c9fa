//! A window's surface as a target: shows the renderer's last picture directly from the device.
//! Nothing is read back.
//!
//! Drawing and showing are two steps, so that several machines can show their pictures at the same
//! moment: [`Screen::renderer`] draws, [`Screen::show`] presents. A [`Wall`] does so for several windows.

mod pane;
mod wall;

use super::Renderer;
use crate::{Image, RenderError};
use pane::{Opened, Pane, replace};
use std::sync::Arc;
pub use wall::Wall;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Whether a picture was presented.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// It was.
    Yes,
    /// The window is hidden, empty or busy; it can be tried again later.
    NotNow,
}

/// A window with a renderer.
pub struct Screen {
    instance: wgpu::Instance,
    renderer: Renderer,
    pane: Pane,
}

impl Screen {
    /// Opens a surface on an open window, on the first adapter that can present there: of Vulkan,
    /// otherwise of OpenGL. With a `name`, on the first one whose name, kind or interface contains it.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] if none can, [`RenderError::NoSuchAdapter`] if none has the name,
    /// [`RenderError::Device`] if one fails.
    pub(crate) fn new(
        event_loop: &ActiveEventLoop,
        window: Arc<Window>,
        wanted_name: Option<&str>,
    ) -> Result<Screen, RenderError> {
        let Opened { instance, renderer, mut panes } = Opened::new(event_loop, &[window], wanted_name)?;
        let pane = panes.remove(0); // one for each window
        Ok(Screen { instance, renderer, pane })
    }

    /// The window.
    pub fn window(&self) -> &Window {
        &self.pane.window
    }

    /// The adapter in use: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        self.renderer.adapter()
    }

    /// Whether the adapter is a software driver; [`Quality::fast`](crate::Quality::fast) is made
    /// for these.
    pub fn is_software(&self) -> bool {
        self.renderer.is_software()
    }

    /// Destroys the device, as if a driver crashed: the next call to it fails.
    #[doc(hidden)]
    pub fn lose_device(&self) {
        self.renderer.gpu.device.destroy();
    }

    /// The renderer; [`Renderer::draw`] and similar calls leave a picture on the device, which
    /// [`show`](Self::show) presents.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Ends a full screen, so that the video mode that it has set is replaced by the desktop's own.
    pub(crate) fn leave_full_screen(&self) {
        self.pane.leave_full_screen();
    }

    /// Width and height, pixels; for an empty window the last ones.
    pub fn size_px(&self) -> [u32; 2] {
        self.pane.size_px()
    }

    /// Adapts to a new size of the window.
    ///
    /// # Errors
    /// [`RenderError::BadSize`] for a window larger than can be drawn.
    pub fn resize(&mut self, size_px: [u32; 2]) -> Result<(), RenderError> {
        self.pane.resize(&self.renderer, size_px)
    }

    /// Sets an image in the upper left corner, blended over the picture by its alpha.
    pub fn set_caption(&mut self, caption: Option<Image>) {
        replace(&self.renderer.gpu, &mut self.pane.caption, caption);
    }

    /// Sets an image in the upper right corner, blended over the picture and the caption by its
    /// alpha.
    pub fn set_panel(&mut self, panel: Option<Image>) {
        replace(&self.renderer.gpu, &mut self.pane.panel, panel);
    }

    /// Presents the last picture with caption and panel, its upper left corner in that of the
    /// window. Pixels outside the window are cut off. Waits until the device is at most one picture
    /// behind. A lost surface is created again.
    ///
    /// # Errors
    /// [`RenderError::Device`] if the device fails, or the surface is lost repeatedly.
    pub fn show(&mut self) -> Result<Shown, RenderError> {
        let shown = self.pane.show(&self.instance, &self.renderer.gpu, self.renderer.picture())?;
        if shown == Shown::Yes {
            self.renderer.end_frame(1)?;
        }
        Ok(shown)
    }
}

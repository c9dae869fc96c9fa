//! Several windows of one process on one device.

use super::Shown;
use super::pane::{Opened, Pane, replace};
use crate::gpu::Renderer;
use crate::{Image, RenderError};
use std::collections::VecDeque;
use std::sync::Arc;
use wgpu::TextureUsages;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Pictures of a window that are drawn and not shown yet: one, and the next one while others are shown late.
const MAX_DRAWN: usize = 2;

/// Several windows with one renderer. Each keeps pictures of its own on the device, so that all can be drawn
/// before any is shown.
pub struct Wall {
    instance: wgpu::Instance,
    renderer: Renderer,
    windows: Vec<Kept>,
}

/// A window with its pictures.
struct Kept {
    pane: Pane,
    /// The picture that it shows.
    shown: Option<wgpu::Texture>,
    /// The pictures that it shows next, by frame.
    drawn: VecDeque<(u64, wgpu::Texture)>,
    spare: Vec<wgpu::Texture>,
}

impl Kept {
    /// Removes the pictures of these frames, whose textures are used again.
    fn discard(&mut self, which: impl Fn(u64) -> bool) {
        let (gone, left) = std::mem::take(&mut self.drawn).into_iter().partition(|(frame, _)| which(*frame));
        self.drawn = left;
        let gone: VecDeque<(u64, wgpu::Texture)> = gone;
        self.spare.extend(gone.into_iter().map(|(_, texture)| texture));
    }

    /// Makes the picture of a frame the one that is shown, if it is there.
    fn turn(&mut self, frame: u64) {
        self.discard(|other| other < frame);
        if let Some((_, next)) = self.drawn.pop_front_if(|(first, _)| *first == frame) {
            self.spare.extend(self.shown.replace(next));
        }
    }
}

impl Wall {
    /// Opens surfaces on open windows, on the first adapter that can present in all of them, as for one
    /// window.
    pub(crate) fn new(
        event_loop: &ActiveEventLoop,
        windows: &[Arc<Window>],
        wanted_name: Option<&str>,
    ) -> Result<Wall, RenderError> {
        let Opened { instance, renderer, panes } = Opened::new(event_loop, windows, wanted_name)?;
        let kept = |pane| Kept { pane, shown: None, drawn: VecDeque::new(), spare: Vec::new() };
        let windows = panes.into_iter().map(kept).collect();
        Ok(Wall { instance, renderer, windows })
    }

    /// Number of windows.
    pub fn len(&self) -> usize {
        self.windows.len()
    }

    /// Whether there is no window.
    pub fn is_empty(&self) -> bool {
        self.windows.is_empty()
    }

    /// The renderer; [`Renderer::draw`] and similar calls leave a picture on the device, which
    /// [`keep`](Self::keep) copies for a window.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Width and height of the window with this index, pixels.
    ///
    /// # Panics
    /// Without such a window, as all methods that take an index.
    pub fn size_px(&self, window: usize) -> [u32; 2] {
        self.windows[window].pane.size_px()
    }

    /// Keeps the renderer's last picture for a window, until the frame is shown there. The oldest of more than two is
    /// discarded, and so are those of this frame and of later ones. Does not wait for the device.
    ///
    /// # Errors
    /// [`RenderError::Device`] if there is no picture yet, or the device fails.
    pub fn keep(&mut self, window: usize, frame: u64) -> Result<(), RenderError> {
        let gpu = &self.renderer.gpu;
        let drawn = self.renderer.picture().ok_or_else(|| gpu.failed("no picture was drawn yet".into()))?;
        let fits = |kept: &wgpu::Texture| (kept.size(), kept.format()) == (drawn.size(), drawn.format());
        let make = || {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: Some("picture of a window"),
                size: drawn.size(),
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: drawn.format(),
                usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
                view_formats: &[],
            })
        };
        let place = &mut self.windows[window];
        place.discard(|other| other >= frame);
        while place.drawn.len() >= MAX_DRAWN {
            place.spare.extend(place.drawn.pop_front().map(|(_, texture)| texture));
        }
        let kept = place.spare.pop().filter(fits).unwrap_or_else(make);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_texture(drawn.as_image_copy(), kept.as_image_copy(), drawn.size());
        gpu.record(encoder.finish());
        place.drawn.push_back((frame, kept));
        self.renderer.submit()
    }

    /// Sets an image in the upper left corner of a window, blended over the picture by its alpha.
    pub fn set_caption(&mut self, window: usize, caption: Option<Image>) {
        replace(&self.renderer.gpu, &mut self.windows[window].pane.caption, caption);
    }

    /// Presents the picture of a frame in its window, or the present one again if that frame is not kept, as
    /// [`Screen::show`](super::Screen::show) does. Waits until the device is at most one picture of each window
    /// behind.
    ///
    /// # Errors
    /// [`RenderError::Device`] if the device fails, or the surface is lost repeatedly.
    pub fn show(&mut self, window: usize, frame: u64) -> Result<Shown, RenderError> {
        self.windows[window].turn(frame);
        self.show_again(window)
    }

    /// Presents the present picture of a window again.
    ///
    /// # Errors
    /// As [`Wall::show`].
    pub fn show_again(&mut self, window: usize) -> Result<Shown, RenderError> {
        let Kept { pane, shown, .. } = &mut self.windows[window];
        let shown = pane.show(&self.instance, &self.renderer.gpu, shown.as_ref())?;
        if shown == Shown::Yes {
            self.renderer.end_frame(self.windows.len())?;
        }
        Ok(shown)
    }

    /// Adapts to a new size of a window.
    pub(crate) fn resize(&mut self, window: usize, size_px: [u32; 2]) -> Result<(), RenderError> {
        self.windows[window].pane.resize(&self.renderer, size_px)
    }

    /// Returns the index of a window.
    pub(crate) fn index(&self, id: winit::window::WindowId) -> Option<usize> {
        self.windows.iter().position(|kept| kept.pane.window.id() == id)
    }

    /// Ends full screens, so that the video modes that they have set are replaced by the desktop's own.
    pub(crate) fn leave_full_screen(&self) {
        self.windows.iter().for_each(|kept| kept.pane.leave_full_screen());
    }
}

//! The renderer: a device without a window, and the order of its passes.

mod data;
mod pipelines;
mod scene;
mod shadow;
mod targets;
mod upload;
mod window;

pub use window::{Picture, Screen, Shown};

use crate::facet::cut;
use crate::{DrawList, Image, Lens, MAX_PIXELS, MAX_SIDE, Part, RenderError, Viewpoint};
use pipelines::Pipelines;
use std::sync::{Arc, Mutex, PoisonError};
use targets::Targets;
use upload::{Frame, MeshCache};

/// A graphics device that draws into memory. Making one takes a moment; keep it for all pictures of a run.
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
    meshes: MeshCache,
    targets: Option<Targets>,
}

/// The device, its queue, and the last thing it complained about.
pub(crate) struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    adapter: String,
    sample_masks: bool,
    complaint: Arc<Mutex<Option<String>>>,
}

impl Renderer {
    /// Finds an adapter (a graphics card, or a software driver) and prepares it. Nothing global is changed.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] where the machine has none: the caller goes on without pictures. [`RenderError::Device`] where it has one that fails.
    pub fn new() -> Result<Self, RenderError> {
        Renderer::on(pollster::block_on(first_adapter())?)
    }

    /// On an adapter that was chosen.
    fn on(adapter: wgpu::Adapter) -> Result<Self, RenderError> {
        let gpu = pollster::block_on(Gpu::open(adapter))?;
        let pipelines = Pipelines::new(&gpu.device, gpu.sample_masks);
        gpu.complaint()?;
        Ok(Renderer { gpu, pipelines, meshes: MeshCache::default(), targets: None })
    }

    /// The adapter in use: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        &self.gpu.adapter
    }

    /// Draws the list into a picture of `width` x `height` pixels.
    ///
    /// # Errors
    /// A size or a list that cannot be drawn, or a device that fails. The renderer stays usable.
    pub fn render(&mut self, list: &DrawList, width: u32, height: u32) -> Result<Image, RenderError> {
        self.render_from(&list.camera, list, width, height)
    }

    /// The same, seen from elsewhere than the list's camera.
    ///
    /// # Errors
    /// As [`Renderer::render`], or a point of view that is none.
    pub fn render_from(&mut self, from: &dyn Viewpoint, list: &DrawList, width: u32, height: u32) -> Result<Image, RenderError> {
        let (lens, rim) = self.lens(from, list, width, height)?;
        let image = self.draw(list, &lens, width + 2 * rim, height + 2 * rim)?;
        Ok(if rim == 0 { image } else { cut(&image, rim) })
    }

    /// Checks everything; the view in numbers, and the pixels that it is drawn wider on each side.
    fn lens(&self, from: &dyn Viewpoint, list: &DrawList, width: u32, height: u32) -> Result<(Lens, u32), RenderError> {
        self.check_size(width, height)?;
        list.validate()?;
        let mut lens = from.lens(width as f32 / height as f32)?;
        // only occlusion looks beyond the edge
        let rim = lens.part.map_or(0, |part| if list.settings.occlusion_m == Some(0.0) { 0 } else { part.rim_px });
        lens.part = lens.part.map(|part| Part { rim_px: rim, ..part });
        if rim == 0 {
            return Ok((lens, 0));
        }
        self.check_size(width + 2 * rim, height + 2 * rim)?;
        Ok((lens.widened(width, height, rim), rim))
    }

    /// Draws all pixels of a view into memory.
    fn draw(&mut self, list: &DrawList, lens: &Lens, width: u32, height: u32) -> Result<Image, RenderError> {
        self.paint(list, lens, width, height, |encoder, targets| targets.copy_out(encoder))?;
        let image = self.targets.as_ref().map(|targets| targets.read(&self.gpu));
        self.gpu.complaint()?;
        image.unwrap_or_else(|| Err(self.gpu.failed("no targets".into())))
    }

    /// Draws all pixels of a view and lets `after` make something of them, on the device.
    fn paint(&mut self, list: &DrawList, lens: &Lens, width: u32, height: u32, after: impl FnOnce(&mut wgpu::CommandEncoder, &Targets)) -> Result<(), RenderError> {
        let fits = self.targets.as_ref().is_some_and(|t| t.fits(width, height, list.settings.shadow_map_size));
        if !fits {
            self.targets = None; // frees the old ones first
        }
        let targets = self.targets.get_or_insert_with(|| Targets::new(&self.gpu.device, width, height, list.settings.shadow_map_size));
        let frame = Frame::new(&self.gpu, &self.pipelines, &mut self.meshes, targets, list, lens)?;
        self.gpu.complaint()?;
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        frame.draw_shadows(&mut encoder, &self.pipelines, targets);
        if frame.occlusion {
            frame.draw_occlusion(&mut encoder, &self.pipelines, targets);
        }
        frame.draw_picture(&mut encoder, &self.pipelines, targets);
        after(&mut encoder, targets);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.complaint()
    }

    fn check_size(&self, width: u32, height: u32) -> Result<(), RenderError> {
        let limits = self.gpu.device.limits();
        let max_side = MAX_SIDE.min(limits.max_texture_dimension_2d);
        let max_pixels = MAX_PIXELS.min(limits.max_buffer_size / 4);
        let sides = 1..=max_side;
        if sides.contains(&width) && sides.contains(&height) && u64::from(width.next_multiple_of(64)) * u64::from(height) <= max_pixels {
            return Ok(());
        }
        Err(RenderError::BadSize { width, height, max_side, max_pixels })
    }
}

impl Gpu {
    async fn open(adapter: wgpu::Adapter) -> Result<Gpu, RenderError> {
        let info = adapter.get_info();
        let name = format!("{} ({:?}, {:?})", info.name, info.device_type, info.backend);
        let mut limits = wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits());
        limits.max_buffer_size = adapter.limits().max_buffer_size;
        let sample_masks = info.backend != wgpu::Backend::Gl;
        let asked = adapter
            .request_device(&wgpu::DeviceDescriptor { label: Some("tumble"), required_limits: limits, ..Default::default() })
            .await
            .map_err(|e| RenderError::Device { adapter: name.clone(), reason: e.to_string() })?;
        let complaint = Arc::new(Mutex::new(None));
        let note = complaint.clone();
        asked.0.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            note.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(|| error.to_string());
        }));
        Ok(Gpu { device: asked.0, queue: asked.1, adapter: name, sample_masks, complaint })
    }

    /// What went wrong on the device since the last call.
    fn complaint(&self) -> Result<(), RenderError> {
        match self.complaint.lock().unwrap_or_else(PoisonError::into_inner).take() {
            Some(reason) => Err(self.failed(reason)),
            None => Ok(()),
        }
    }

    pub(crate) fn failed(&self, reason: String) -> RenderError {
        RenderError::Device { adapter: self.adapter.clone(), reason }
    }
}

/// A Vulkan adapter, else one of OpenGL. Asked one after the other, so that OpenGL's libraries are loaded only where needed.
async fn first_adapter() -> Result<wgpu::Adapter, RenderError> {
    let mut reasons = Vec::new();
    for (name, backends) in [("Vulkan", wgpu::Backends::VULKAN), ("OpenGL", wgpu::Backends::GL)] {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = backends;
        match wgpu::Instance::new(descriptor).request_adapter(&Default::default()).await {
            Ok(adapter) => return Ok(adapter),
            Err(wgpu::RequestAdapterError::NotFound { .. }) => reasons.push(format!("no {name} driver")),
            Err(e) => reasons.push(e.to_string()),
        }
    }
    Err(RenderError::NoAdapter { reason: reasons.join(", ") })
}

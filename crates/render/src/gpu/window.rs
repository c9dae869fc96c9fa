//! A window's surface as a target: shows the renderer's last picture directly from the device.
//! Nothing is read back.
//!
//! Drawing and showing are two steps, so that several machines can show their pictures at the same
//! moment: [`Screen::renderer`] draws, [`Screen::show`] presents.

use super::meshes::uniform_buffer;
use super::pipelines::COLOR;
use super::{Gpu, Renderer, choose, no_such_adapter};
use crate::{Image, RenderError};
use std::sync::Arc;
use wgpu::util::DeviceExt;
use wgpu::{CommandEncoder, CurrentSurfaceTexture, TextureFormat, TextureUsages, TextureView};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Number of consecutive losses of a surface after which the window fails.
const MAX_LOSSES: u32 = 8;

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
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    renderer: Renderer,
    copies: Copies,
    caption: Option<(Image, wgpu::Texture)>,
    panel: Option<(Image, wgpu::Texture)>,
    losses: u32,
    software: bool,
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
        let (mut reasons, mut present) = (Vec::new(), Vec::new());
        for (name, backends) in [("Vulkan", wgpu::Backends::VULKAN), ("OpenGL", wgpu::Backends::GL)] {
            let mut descriptor =
                wgpu::InstanceDescriptor::new_with_display_handle(Box::new(event_loop.owned_display_handle()));
            descriptor.backends = backends;
            let instance = wgpu::Instance::new(descriptor);
            let surface = match instance.create_surface(window.clone()) {
                Ok(surface) => surface,
                Err(e) => {
                    reasons.push(format!("{name}: {e}"));
                    continue;
                }
            };
            if let Some(wanted_name) = wanted_name {
                let mut all = pollster::block_on(instance.enumerate_adapters(backends));
                all.retain(|adapter| adapter.is_surface_supported(&surface));
                match choose(all, wanted_name, &mut present) {
                    Some(adapter) => return Screen::on(adapter, instance, surface, window),
                    None => continue,
                }
            }
            let wanted = wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
            match pollster::block_on(instance.request_adapter(&wanted)) {
                Ok(adapter) => return Screen::on(adapter, instance, surface, window),
                Err(wgpu::RequestAdapterError::NotFound { .. }) => {
                    reasons.push(format!("no {name} driver for this window"))
                }
                Err(e) => reasons.push(e.to_string()),
            }
        }
        match wanted_name {
            Some(wanted) => Err(no_such_adapter(wanted, present)),
            None => Err(RenderError::NoAdapter { reason: reasons.join(", ") }),
        }
    }

    fn on(
        adapter: wgpu::Adapter,
        instance: wgpu::Instance,
        surface: wgpu::Surface<'static>,
        window: Arc<Window>,
    ) -> Result<Screen, RenderError> {
        let size = window.inner_size();
        let (width, height) = (size.width.max(1), size.height.max(1));
        let default = surface.get_default_config(&adapter, width, height);
        let format = surface.get_capabilities(&adapter).formats.iter().copied().find(TextureFormat::is_srgb);
        let software = adapter.get_info().device_type == wgpu::DeviceType::Cpu;
        let renderer = Renderer::on(adapter)?;
        let mut config = default.ok_or_else(|| renderer.gpu.failed("it cannot show pictures in this window".into()))?;
        config.format = format.unwrap_or(config.format);
        config.present_mode = wgpu::PresentMode::Fifo;
        renderer.check_size(width, height)?;
        surface.configure(&renderer.gpu.device, &config);
        let copies = Copies::new(&renderer.gpu.device, config.format);
        renderer.gpu.complaint()?;
        Ok(Screen {
            window,
            instance,
            surface,
            config,
            renderer,
            copies,
            caption: None,
            panel: None,
            losses: 0,
            software,
        })
    }

    /// The window.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// The adapter in use: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        self.renderer.adapter()
    }

    /// Whether the adapter is a software driver; [`Quality::fast`](crate::Quality::fast) is made
    /// for these.
    pub fn is_software(&self) -> bool {
        self.software
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
        if matches!(self.window.fullscreen(), Some(winit::window::Fullscreen::Exclusive(_))) {
            self.window.set_fullscreen(None);
        }
    }

    /// Width and height, pixels; for an empty window the last ones.
    pub fn size_px(&self) -> [u32; 2] {
        [self.config.width, self.config.height]
    }

    /// Adapts to a new size of the window.
    ///
    /// # Errors
    /// [`RenderError::BadSize`] for a window larger than can be drawn.
    pub fn resize(&mut self, [width, height]: [u32; 2]) -> Result<(), RenderError> {
        if width == 0 || height == 0 || [width, height] == self.size_px() {
            return Ok(());
        }
        self.renderer.check_size(width, height)?;
        (self.config.width, self.config.height) = (width, height);
        self.surface.configure(&self.renderer.gpu.device, &self.config);
        self.renderer.gpu.complaint()
    }

    /// Sets an image in the upper left corner, blended over the picture by its alpha.
    pub fn set_caption(&mut self, caption: Option<Image>) {
        replace(&self.renderer.gpu, &mut self.caption, caption);
    }

    /// Sets an image in the upper right corner, blended over the picture and the caption by its
    /// alpha.
    pub fn set_panel(&mut self, panel: Option<Image>) {
        replace(&self.renderer.gpu, &mut self.panel, panel);
    }

    /// Presents the last picture with caption and panel, its upper left corner in that of the
    /// window. Pixels outside the window are cut off. Waits until the device is at most one picture
    /// behind. A lost surface is created again.
    ///
    /// # Errors
    /// [`RenderError::Device`] if the device fails, or the surface is lost repeatedly.
    pub fn show(&mut self) -> Result<Shown, RenderError> {
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) | CurrentSurfaceTexture::Suboptimal(frame) => frame,
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => return Ok(Shown::NotNow),
            CurrentSurfaceTexture::Outdated => return self.mend(false),
            CurrentSurfaceTexture::Lost => return self.mend(true),
            CurrentSurfaceTexture::Validation => {
                self.renderer.gpu.complaint()?;
                return self.mend(false);
            }
        };
        self.losses = 0;
        let gpu = &self.renderer.gpu;
        let target = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let encode = !self.config.format.is_srgb();
        drop(pass(&mut encoder, &target, wgpu::LoadOp::Clear(wgpu::Color::BLACK)));
        let right = |image: &Image| frame.texture.width().saturating_sub(image.width);
        let picture = self.renderer.picture().map(|texture| (texture, &self.copies.show, 0));
        let caption = self.caption.as_ref().map(|(_, texture)| (texture, &self.copies.blend, 0));
        let panel = self.panel.as_ref().map(|(image, texture)| (texture, &self.copies.blend, right(image)));
        for (texture, pipeline, left) in picture.into_iter().chain(caption).chain(panel) {
            self.copies.copy(gpu, &mut encoder, pipeline, (texture, left), (&target, frame.texture.size()), encode)?;
        }
        gpu.record(encoder.finish());
        gpu.submit();
        self.window.pre_present_notify();
        gpu.queue.present(frame);
        self.renderer.end_frame(1)?;
        Ok(Shown::Yes)
    }

    /// Configures a surface that no longer fits, or creates a lost one again.
    fn mend(&mut self, lost: bool) -> Result<Shown, RenderError> {
        self.losses += 1;
        if self.losses > MAX_LOSSES {
            return Err(self.renderer.gpu.failed("the window's surface is lost repeatedly".into()));
        }
        if lost {
            self.surface = self
                .instance
                .create_surface(self.window.clone())
                .map_err(|e| self.renderer.gpu.failed(e.to_string()))?;
        }
        self.surface.configure(&self.renderer.gpu.device, &self.config);
        self.renderer.gpu.complaint()?;
        Ok(Shown::NotNow)
    }
}

/// Pipelines that copy.
struct Copies {
    layout: wgpu::BindGroupLayout,
    show: wgpu::RenderPipeline,
    blend: wgpu::RenderPipeline,
}

impl Copies {
    fn new(device: &wgpu::Device, surface: TextureFormat) -> Copies {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let uniform = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let sample_type = wgpu::TextureSampleType::Float { filterable: false };
        let picture = wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let entries = [entry(0, uniform), entry(1, picture)];
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("copy"), entries: &entries });
        let source = wgpu::ShaderSource::Wgsl(include_str!("../shaders/window.wgsl").into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("copy"), source });
        let make = |blend| {
            let bind_group_layouts = &[Some(&layout)];
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some("copy"),
                bind_group_layouts,
                immediate_size: 0,
            });
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("copy"),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some("vs_place"),
                    compilation_options: Default::default(),
                    buffers: &[],
                },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fs_place"),
                    compilation_options: Default::default(),
                    targets: &[Some(wgpu::ColorTargetState {
                        format: surface,
                        blend,
                        write_mask: wgpu::ColorWrites::ALL,
                    })],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        Copies { show: make(None), blend: make(Some(wgpu::BlendState::ALPHA_BLENDING)), layout }
    }

    /// Copies a texture to the upper edge of a target, `left` pixels from its left edge.
    fn copy(
        &self,
        gpu: &Gpu,
        encoder: &mut CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        (source, left): (&wgpu::Texture, u32),
        (target, bounds): (&TextureView, wgpu::Extent3d),
        encode: bool,
    ) -> Result<(), RenderError> {
        let (w, h) = (source.width().min(bounds.width - left), source.height().min(bounds.height));
        let source = source.create_view(&wgpu::TextureViewDescriptor::default());
        let contents = [f32::from(u8::from(encode)), left as f32, 0.0, 0.0];
        let uniform = uniform_buffer(gpu, &contents, "place")?;
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&source) },
        ];
        let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("copy"),
            layout: &self.layout,
            entries: &entries,
        });
        let mut pass = pass(encoder, target, wgpu::LoadOp::Load);
        pass.set_scissor_rect(left, 0, w, h);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
        Ok(())
    }
}

fn pass<'e>(
    encoder: &'e mut CommandEncoder,
    target: &TextureView,
    load: wgpu::LoadOp<wgpu::Color>,
) -> wgpu::RenderPass<'e> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("copy"),
        color_attachments: &[Some(attachment)],
        ..Default::default()
    })
}

/// Uploads a picture if it differs from the present one.
fn replace(gpu: &Gpu, there: &mut Option<(Image, wgpu::Texture)>, image: Option<Image>) {
    if there.as_ref().map(|(image, _)| image) != image.as_ref() {
        *there = image.map(|image| {
            let texture = upload(gpu, &image);
            (image, texture)
        });
    }
}

fn upload(gpu: &Gpu, image: &Image) -> wgpu::Texture {
    let descriptor = wgpu::TextureDescriptor {
        label: Some("caption"),
        size: wgpu::Extent3d { width: image.width, height: image.height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: COLOR,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    gpu.device.create_texture_with_data(&gpu.queue, &descriptor, wgpu::util::TextureDataOrder::LayerMajor, &image.rgba)
}

//! A window with its surface: shows a picture of the device, with caption and panel over it.

use super::super::meshes::uniform_buffer;
use super::super::pipelines::COLOR;
use super::super::{Gpu, Renderer, choose, no_such_adapter};
use super::Shown;
use crate::{Image, RenderError};
use std::sync::Arc;
use wgpu::util::DeviceExt;
use wgpu::{CommandEncoder, CurrentSurfaceTexture, TextureFormat, TextureUsages, TextureView};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// Number of consecutive losses of a surface after which the window fails.
const MAX_LOSSES: u32 = 8;

/// A window with its surface.
pub(super) struct Pane {
    pub window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    copies: Copies,
    pub caption: Covering,
    pub panel: Covering,
    losses: u32,
}

/// An image over the picture, with its copy on the device.
pub(super) type Covering = Option<(Image, wgpu::Texture)>;

/// Surfaces of windows, with the device that presents in all of them.
pub(super) struct Opened {
    pub instance: wgpu::Instance,
    pub renderer: Renderer,
    pub panes: Vec<Pane>,
}

impl Opened {
    /// Opens surfaces on open windows, on the first adapter that can present in all of them: of Vulkan,
    /// otherwise of OpenGL. With a name, on the first one whose name, kind or interface contains it.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] if none can, [`RenderError::NoSuchAdapter`] if none has the name,
    /// [`RenderError::Device`] if one fails.
    pub fn new(
        event_loop: &ActiveEventLoop,
        windows: &[Arc<Window>],
        wanted_name: Option<&str>,
    ) -> Result<Opened, RenderError> {
        let (mut reasons, mut present) = (Vec::new(), Vec::new());
        for (name, backends) in [("Vulkan", wgpu::Backends::VULKAN), ("OpenGL", wgpu::Backends::GL)] {
            let mut descriptor =
                wgpu::InstanceDescriptor::new_with_display_handle(Box::new(event_loop.owned_display_handle()));
            descriptor.backends = backends;
            let instance = wgpu::Instance::new(descriptor);
            let surfaces: Result<Vec<_>, _> =
                windows.iter().map(|window| instance.create_surface(window.clone())).collect();
            let surfaces = match surfaces {
                Ok(surfaces) => surfaces,
                Err(e) => {
                    reasons.push(format!("{name}: {e}"));
                    continue;
                }
            };
            let shows = |adapter: &wgpu::Adapter| surfaces.iter().all(|surface| adapter.is_surface_supported(surface));
            if let Some(wanted_name) = wanted_name {
                let mut all = pollster::block_on(instance.enumerate_adapters(backends));
                all.retain(shows);
                match choose(all, wanted_name, &mut present) {
                    Some(adapter) => return Opened::on(adapter, instance, surfaces, windows),
                    None => continue,
                }
            }
            let wanted = wgpu::RequestAdapterOptions { compatible_surface: surfaces.first(), ..Default::default() };
            match pollster::block_on(instance.request_adapter(&wanted)) {
                Ok(adapter) if shows(&adapter) => return Opened::on(adapter, instance, surfaces, windows),
                Ok(_) => reasons.push(format!("no {name} adapter for all windows")),
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
        surfaces: Vec<wgpu::Surface<'static>>,
        windows: &[Arc<Window>],
    ) -> Result<Opened, RenderError> {
        let configured = |(surface, window): (wgpu::Surface<'static>, &Arc<Window>)| {
            let size = window.inner_size();
            let default = surface.get_default_config(&adapter, size.width.max(1), size.height.max(1));
            let format = surface.get_capabilities(&adapter).formats.iter().copied().find(TextureFormat::is_srgb);
            let config = default.map(|default| wgpu::SurfaceConfiguration {
                format: format.unwrap_or(default.format),
                present_mode: wgpu::PresentMode::Fifo,
                ..default
            });
            (surface, window.clone(), config)
        };
        let configured: Vec<_> = surfaces.into_iter().zip(windows).map(configured).collect();
        let renderer = Renderer::on(adapter)?;
        let pane = |(surface, window, config): (_, _, Option<wgpu::SurfaceConfiguration>)| {
            let config = config.ok_or_else(|| renderer.gpu.failed("it cannot show pictures in this window".into()))?;
            Pane::new(&renderer, window, surface, config)
        };
        let panes = configured.into_iter().map(pane).collect::<Result<_, _>>()?;
        Ok(Opened { instance, renderer, panes })
    }
}

impl Pane {
    fn new(
        renderer: &Renderer,
        window: Arc<Window>,
        surface: wgpu::Surface<'static>,
        config: wgpu::SurfaceConfiguration,
    ) -> Result<Pane, RenderError> {
        renderer.check_size(config.width, config.height)?;
        surface.configure(&renderer.gpu.device, &config);
        let copies = Copies::new(&renderer.gpu.device, config.format);
        renderer.gpu.complaint()?;
        Ok(Pane { window, surface, config, copies, caption: None, panel: None, losses: 0 })
    }

    /// Ends a full screen, so that the video mode that it has set is replaced by the desktop's own.
    pub fn leave_full_screen(&self) {
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
    pub fn resize(&mut self, renderer: &Renderer, [width, height]: [u32; 2]) -> Result<(), RenderError> {
        if width == 0 || height == 0 || [width, height] == self.size_px() {
            return Ok(());
        }
        renderer.check_size(width, height)?;
        (self.config.width, self.config.height) = (width, height);
        self.surface.configure(&renderer.gpu.device, &self.config);
        renderer.gpu.complaint()
    }

    /// Presents a picture with caption and panel, its upper left corner in that of the window. Pixels
    /// outside the window are cut off. A lost surface is created again.
    ///
    /// # Errors
    /// [`RenderError::Device`] if the device fails, or the surface is lost repeatedly.
    pub fn show(
        &mut self,
        instance: &wgpu::Instance,
        gpu: &Gpu,
        picture: Option<&wgpu::Texture>,
    ) -> Result<Shown, RenderError> {
        let frame = match self.surface.get_current_texture() {
            CurrentSurfaceTexture::Success(frame) | CurrentSurfaceTexture::Suboptimal(frame) => frame,
            CurrentSurfaceTexture::Timeout | CurrentSurfaceTexture::Occluded => return Ok(Shown::NotNow),
            CurrentSurfaceTexture::Outdated => return self.mend(instance, gpu, false),
            CurrentSurfaceTexture::Lost => return self.mend(instance, gpu, true),
            CurrentSurfaceTexture::Validation => {
                gpu.complaint()?;
                return self.mend(instance, gpu, false);
            }
        };
        self.losses = 0;
        let target = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let encode = !self.config.format.is_srgb();
        drop(pass(&mut encoder, &target, wgpu::LoadOp::Clear(wgpu::Color::BLACK)));
        let right = |image: &Image| frame.texture.width().saturating_sub(image.width);
        let picture = picture.map(|texture| (texture, &self.copies.show, 0));
        let caption = self.caption.as_ref().map(|(_, texture)| (texture, &self.copies.blend, 0));
        let panel = self.panel.as_ref().map(|(image, texture)| (texture, &self.copies.blend, right(image)));
        for (texture, pipeline, left) in picture.into_iter().chain(caption).chain(panel) {
            self.copies.copy(gpu, &mut encoder, pipeline, (texture, left), (&target, frame.texture.size()), encode)?;
        }
        gpu.record(encoder.finish());
        gpu.submit();
        self.window.pre_present_notify();
        gpu.queue.present(frame);
        Ok(Shown::Yes)
    }

    /// Configures a surface that no longer fits, or creates a lost one again.
    fn mend(&mut self, instance: &wgpu::Instance, gpu: &Gpu, lost: bool) -> Result<Shown, RenderError> {
        self.losses += 1;
        if self.losses > MAX_LOSSES {
            return Err(gpu.failed("the window's surface is lost repeatedly".into()));
        }
        if lost {
            self.surface = instance.create_surface(self.window.clone()).map_err(|e| gpu.failed(e.to_string()))?;
        }
        self.surface.configure(&gpu.device, &self.config);
        gpu.complaint()?;
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
        let source = wgpu::ShaderSource::Wgsl(include_str!("../../shaders/window.wgsl").into());
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
pub(super) fn replace(gpu: &Gpu, there: &mut Covering, image: Option<Image>) {
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

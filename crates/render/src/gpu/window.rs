//! A window's surface as a target: pictures are drawn into a canvas on the device, and the canvas is shown. Nothing is read back.
//!
//! Two steps, so that several machines can show their pictures at one moment: [`Screen::draw`] makes the picture, [`Screen::show`] brings it to the eye.

use super::pipelines::COLOR;
use super::{Gpu, Renderer};
use crate::{DrawList, Image, RenderError, Viewpoint};
use std::sync::Arc;
use wgpu::util::DeviceExt;
use wgpu::{CommandEncoder, CurrentSurfaceTexture, TextureFormat, TextureUsages, TextureView};
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// How often in a row a surface may be lost before the window is given up.
const MOST_LOSSES: u32 = 8;

/// One view in a rectangle of the window.
pub struct Picture<'a> {
    /// What it is seen from.
    pub from: &'a dyn Viewpoint,
    /// The rectangle's upper left corner, pixels.
    pub position_px: [u32; 2],
    /// Its width and height, pixels.
    pub size_px: [u32; 2],
    /// Mirrored left and right, top and bottom.
    pub flip: [bool; 2],
    /// Which of red, green and blue it writes: all, or one eye's share of an anaglyph.
    pub channels: [bool; 3],
}

impl<'a> Picture<'a> {
    /// A view that fills a window of this size.
    pub fn whole(from: &'a dyn Viewpoint, size_px: [u32; 2]) -> Picture<'a> {
        Picture { from, position_px: [0; 2], size_px, flip: [false; 2], channels: [true; 3] }
    }
}

/// Whether a picture came to the eye.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shown {
    /// It did.
    Yes,
    /// The window is hidden, empty or busy: try again later.
    NotNow,
}

/// A window with a renderer and a canvas of its size.
pub struct Screen {
    window: Arc<Window>,
    instance: wgpu::Instance,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    renderer: Renderer,
    copies: Copies,
    canvas: wgpu::Texture,
    caption: Option<(Image, wgpu::Texture)>,
    losses: u32,
}

impl Screen {
    /// A surface on a window that is open, on the first adapter that can show there: of Vulkan, else of OpenGL.
    ///
    /// # Errors
    /// [`RenderError::NoAdapter`] where none can, [`RenderError::Device`] where one fails.
    pub(crate) fn new(event_loop: &ActiveEventLoop, window: Arc<Window>) -> Result<Screen, RenderError> {
        let mut reasons = Vec::new();
        for (name, backends) in [("Vulkan", wgpu::Backends::VULKAN), ("OpenGL", wgpu::Backends::GL)] {
            let mut descriptor = wgpu::InstanceDescriptor::new_with_display_handle(Box::new(event_loop.owned_display_handle()));
            descriptor.backends = backends;
            let instance = wgpu::Instance::new(descriptor);
            let surface = match instance.create_surface(window.clone()) {
                Ok(surface) => surface,
                Err(e) => {
                    reasons.push(format!("{name}: {e}"));
                    continue;
                }
            };
            let wanted = wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
            match pollster::block_on(instance.request_adapter(&wanted)) {
                Ok(adapter) => return Screen::on(adapter, instance, surface, window),
                Err(wgpu::RequestAdapterError::NotFound { .. }) => reasons.push(format!("no {name} driver for this window")),
                Err(e) => reasons.push(e.to_string()),
            }
        }
        Err(RenderError::NoAdapter { reason: reasons.join(", ") })
    }

    fn on(adapter: wgpu::Adapter, instance: wgpu::Instance, surface: wgpu::Surface<'static>, window: Arc<Window>) -> Result<Screen, RenderError> {
        let size = window.inner_size();
        let (width, height) = (size.width.max(1), size.height.max(1));
        let usual = surface.get_default_config(&adapter, width, height);
        let format = surface.get_capabilities(&adapter).formats.iter().copied().find(TextureFormat::is_srgb);
        let renderer = Renderer::on(adapter)?;
        let mut config = usual.ok_or_else(|| renderer.gpu.failed("it cannot show pictures in this window".into()))?;
        config.format = format.unwrap_or(config.format);
        config.present_mode = wgpu::PresentMode::Fifo;
        renderer.check_size(width, height)?;
        surface.configure(&renderer.gpu.device, &config);
        let copies = Copies::new(&renderer.gpu.device, config.format);
        let canvas = canvas(&renderer.gpu.device, width, height);
        renderer.gpu.complaint()?;
        Ok(Screen { window, instance, surface, config, renderer, copies, canvas, caption: None, losses: 0 })
    }

    /// The window.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// The adapter in use: its name, kind and interface.
    pub fn adapter(&self) -> &str {
        self.renderer.adapter()
    }

    /// Draws into memory instead, on the same device.
    pub fn renderer(&mut self) -> &mut Renderer {
        &mut self.renderer
    }

    /// Width and height of the canvas, pixels.
    pub fn size_px(&self) -> [u32; 2] {
        [self.canvas.width(), self.canvas.height()]
    }

    /// The window has a new size; the canvas is black until the next [`draw`](Self::draw). An empty window keeps its canvas.
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
        self.canvas = canvas(&self.renderer.gpu.device, width, height);
        self.renderer.gpu.complaint()
    }

    /// Draws pictures of a list into the canvas, over `background` (sRGB).
    ///
    /// # Errors
    /// As [`Renderer::render_from`].
    pub fn draw(&mut self, list: &DrawList, pictures: &[Picture<'_>], background: [u8; 3]) -> Result<(), RenderError> {
        let canvas = self.canvas.create_view(&wgpu::TextureViewDescriptor::default());
        self.fill(&canvas, background);
        for picture in pictures {
            let [w, h] = picture.size_px;
            let (lens, rim) = self.renderer.lens(picture.from, list, w, h)?;
            let place = Place { to: picture.position_px, size: picture.size_px, from: [rim; 2], flip: picture.flip, encode: false };
            let device = self.renderer.gpu.device.clone();
            let (copies, bounds) = (&self.copies, self.canvas.size());
            self.renderer.paint(list, &lens, w + 2 * rim, h + 2 * rim, |encoder, targets| {
                let pipeline = copies.pipeline(picture.channels);
                copies.copy(&device, encoder, pipeline, &targets.picture, &canvas, bounds, &place);
            })?;
        }
        Ok(())
    }

    /// Puts a finished picture on the canvas, its upper left corner in that of the window; what is larger is cut off.
    ///
    /// # Errors
    /// [`RenderError::Device`].
    pub fn draw_image(&mut self, image: &Image) -> Result<(), RenderError> {
        let gpu = &self.renderer.gpu;
        let source = upload(gpu, image);
        let canvas = self.canvas.create_view(&wgpu::TextureViewDescriptor::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let place = Place { to: [0; 2], size: [image.width, image.height], from: [0; 2], flip: [false; 2], encode: false };
        let view = source.create_view(&wgpu::TextureViewDescriptor::default());
        self.copies.copy(&gpu.device, &mut encoder, self.copies.pipeline([true; 3]), &view, &canvas, self.canvas.size(), &place);
        gpu.queue.submit([encoder.finish()]);
        gpu.complaint()
    }

    /// Writing in the upper left corner of what is shown, blended over it by its alpha; not part of the canvas.
    pub fn set_caption(&mut self, caption: Option<Image>) {
        let same = self.caption.as_ref().map(|(image, _)| image) == caption.as_ref();
        if !same {
            self.caption = caption.map(|image| {
                let texture = upload(&self.renderer.gpu, &image);
                (image, texture)
            });
        }
    }

    /// Shows the canvas with the caption. Where the surface is lost it is made anew.
    ///
    /// # Errors
    /// [`RenderError::Device`] where the device fails, or the surface is lost again and again.
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
        let whole = |texture: &wgpu::Texture| Place { to: [0; 2], size: [texture.width(), texture.height()], from: [0; 2], flip: [false; 2], encode };
        let parts = [Some((&self.canvas, &self.copies.show)), self.caption.as_ref().map(|(_, texture)| (texture, &self.copies.blend))];
        for (texture, pipeline) in parts.into_iter().flatten() {
            let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
            self.copies.copy(&gpu.device, &mut encoder, pipeline, &view, &target, frame.texture.size(), &whole(texture));
        }
        gpu.queue.submit([encoder.finish()]);
        self.window.pre_present_notify();
        gpu.queue.present(frame);
        gpu.complaint()?;
        Ok(Shown::Yes)
    }

    /// A surface that no longer fits is configured again; one that is lost is made anew.
    fn mend(&mut self, lost: bool) -> Result<Shown, RenderError> {
        self.losses += 1;
        if self.losses > MOST_LOSSES {
            return Err(self.renderer.gpu.failed("the window's surface is lost again and again".into()));
        }
        if lost {
            self.surface = self.instance.create_surface(self.window.clone()).map_err(|e| self.renderer.gpu.failed(e.to_string()))?;
        }
        self.surface.configure(&self.renderer.gpu.device, &self.config);
        self.renderer.gpu.complaint()?;
        Ok(Shown::NotNow)
    }

    fn fill(&self, canvas: &TextureView, background: [u8; 3]) {
        let [r, g, b] = crate::material::linear3(background.map(|c| f32::from(c) / 255.0)).map(f64::from);
        let gpu = &self.renderer.gpu;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        drop(pass(&mut encoder, canvas, wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 })));
        gpu.queue.submit([encoder.finish()]);
    }
}

/// A rectangle of a source in a target.
struct Place {
    to: [u32; 2],
    size: [u32; 2],
    from: [u32; 2],
    flip: [bool; 2],
    encode: bool,
}

impl Place {
    /// As `struct Place` of the shader.
    fn floats(&self) -> [f32; 12] {
        let flag = |on: bool| f32::from(u8::from(on));
        let [x, y] = self.to.map(|v| v as f32);
        let [w, h] = self.size.map(|v| v as f32);
        let [u, v] = self.from.map(|v| v as f32);
        [x, y, w, h, u, v, flag(self.flip[0]), flag(self.flip[1]), flag(self.encode), 0.0, 0.0, 0.0]
    }
}

/// Pipelines that copy.
struct Copies {
    layout: wgpu::BindGroupLayout,
    all: wgpu::RenderPipeline,
    red: wgpu::RenderPipeline,
    cyan: wgpu::RenderPipeline,
    show: wgpu::RenderPipeline,
    blend: wgpu::RenderPipeline,
}

impl Copies {
    fn new(device: &wgpu::Device, surface: TextureFormat) -> Copies {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None };
        let uniform = wgpu::BindingType::Buffer { ty: wgpu::BufferBindingType::Uniform, has_dynamic_offset: false, min_binding_size: None };
        let sample_type = wgpu::TextureSampleType::Float { filterable: false };
        let picture = wgpu::BindingType::Texture { sample_type, view_dimension: wgpu::TextureViewDimension::D2, multisampled: false };
        let entries = [entry(0, uniform), entry(1, picture)];
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("copy"), entries: &entries });
        let source = wgpu::ShaderSource::Wgsl(include_str!("../shaders/window.wgsl").into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("copy"), source });
        let make = |format, blend, write_mask| {
            let bind_group_layouts = &[Some(&layout)];
            let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor { label: Some("copy"), bind_group_layouts, immediate_size: 0 });
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some("copy"),
                layout: Some(&pipeline_layout),
                vertex: wgpu::VertexState { module: &module, entry_point: Some("vs_place"), compilation_options: Default::default(), buffers: &[] },
                primitive: Default::default(),
                depth_stencil: None,
                multisample: Default::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some("fs_place"),
                    compilation_options: Default::default(),
                    targets: &[Some(wgpu::ColorTargetState { format, blend, write_mask })],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let all = wgpu::ColorWrites::ALL;
        Copies {
            all: make(COLOR, None, all),
            red: make(COLOR, None, wgpu::ColorWrites::RED),
            cyan: make(COLOR, None, wgpu::ColorWrites::GREEN | wgpu::ColorWrites::BLUE),
            show: make(surface, None, all),
            blend: make(surface, Some(wgpu::BlendState::ALPHA_BLENDING), all),
            layout,
        }
    }

    /// For the channels of an eye.
    fn pipeline(&self, channels: [bool; 3]) -> &wgpu::RenderPipeline {
        match channels {
            [true, false, false] => &self.red,
            [false, true, true] => &self.cyan,
            _ => &self.all,
        }
    }

    fn copy(
        &self,
        device: &wgpu::Device,
        encoder: &mut CommandEncoder,
        pipeline: &wgpu::RenderPipeline,
        source: &TextureView,
        target: &TextureView,
        bounds: wgpu::Extent3d,
        place: &Place,
    ) {
        let (room_x, room_y) = (bounds.width.saturating_sub(place.to[0]), bounds.height.saturating_sub(place.to[1]));
        let (w, h) = (place.size[0].min(room_x), place.size[1].min(room_y));
        if w == 0 || h == 0 {
            return;
        }
        let contents = place.floats();
        let usage = wgpu::BufferUsages::UNIFORM;
        let uniform = device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("place"), contents: bytemuck::cast_slice(&contents), usage });
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(source) },
        ];
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor { label: Some("copy"), layout: &self.layout, entries: &entries });
        let mut pass = pass(encoder, target, wgpu::LoadOp::Load);
        pass.set_scissor_rect(place.to[0], place.to[1], w, h);
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.draw(0..3, 0..1);
    }
}

fn pass<'e>(encoder: &'e mut CommandEncoder, target: &TextureView, load: wgpu::LoadOp<wgpu::Color>) -> wgpu::RenderPass<'e> {
    let ops = wgpu::Operations { load, store: wgpu::StoreOp::Store };
    let attachment = wgpu::RenderPassColorAttachment { view: target, depth_slice: None, resolve_target: None, ops };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor { label: Some("copy"), color_attachments: &[Some(attachment)], ..Default::default() })
}

fn canvas(device: &wgpu::Device, width: u32, height: u32) -> wgpu::Texture {
    device.create_texture(&described(width, height, TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING))
}

fn upload(gpu: &Gpu, image: &Image) -> wgpu::Texture {
    let descriptor = described(image.width, image.height, TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST);
    gpu.device.create_texture_with_data(&gpu.queue, &descriptor, wgpu::util::TextureDataOrder::LayerMajor, &image.rgba)
}

fn described(width: u32, height: u32, usage: TextureUsages) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: Some("canvas"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: COLOR,
        usage,
        view_formats: &[],
    }
}

//! Finishing pictures on the device: removes the rim, places both eyes in one picture, and warps,
//! darkens and mirrors for projectors.
//!
//! If a picture only changes its place, its bytes are copied. Otherwise one pass per eye gives the
//! result of [`crate::Warp::apply`], [`crate::Blend::apply`] and [`crate::ProjectorColor::apply`] to
//! within one level: these round to bytes in between, the pass does not. Pictures on curved screens are
//! taken from the faces of a cube of pictures in the same pass.

use super::Gpu;
use super::enlarge::Drawn;
use super::frame::bind;
use super::meshes::uniform_buffer;
use super::pipelines::COLOR;
use super::targets::finished_texture;
use crate::RenderError;
use crate::facet::{NumberFormat, Parity, PortableNumbers, ProjectorColor};
use std::sync::{Arc, OnceLock};
use tumble_scene::cave::Flip;
use wgpu::util::{DeviceExt, TextureDataOrder};
use wgpu::{
    BindGroupLayout, BindingResource, ColorWrites, RenderPipeline, Texture, TextureFormat, TextureView,
    TextureViewDescriptor,
};

pub(super) const FINISH_WGSL: &str = include_str!("../shaders/finish.wgsl");
/// Largest number of finishes whose textures are kept.
const MAX_KEPT: usize = 64;
/// Marks a pixel without a source in the texture of a warp.
const NOWHERE: f32 = -1e9;
/// Number of textures of a finish: warp or surface, shares, table of colors.
const TEXTURES: usize = 3;

/// Warp, blend and color of every picture of one size, as numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Finish {
    pub size: [u32; 2],
    pub bend: Bend,
    /// For each pixel the fraction of light that it keeps, per color, and that of the lift; 0 to 1.
    pub shares: Option<Vec<[f32; 4]>>,
    pub color: Option<ProjectorColor>,
}

impl Finish {
    /// Returns which of the textures have an effect.
    pub fn used(&self) -> [bool; TEXTURES] {
        let has_table = self.color.as_ref().is_some_and(|color| color.table.is_some());
        [self.bend != Bend::None, self.shares.is_some(), has_table]
    }

    /// Returns the textures of the shader: warp or surface, shares, table of colors; `None` for those
    /// without effect.
    pub fn textures(&self) -> [Option<PortableNumbers>; TEXTURES] {
        let floats = |format, size_px, floats: &[f32]| PortableNumbers {
            size_px,
            format,
            bytes: floats.iter().flat_map(|x| x.to_le_bytes()).collect(),
        };
        let bend = match &self.bend {
            Bend::None => None,
            Bend::Warp(warp) => {
                let places: Vec<f32> = warp.iter().flat_map(|from| from.unwrap_or([NOWHERE; 2])).collect();
                Some(floats(NumberFormat::Rg32Float, self.size, &places))
            }
            Bend::Surface(shown) => Some(floats(NumberFormat::Rgba32Float, self.size, shown.as_flattened())),
        };
        let shares = self.shares.as_ref().map(|shares| PortableNumbers {
            size_px: self.size,
            format: NumberFormat::Rgba16Float,
            bytes: shares.iter().flatten().flat_map(|share| half(*share).to_le_bytes()).collect(),
        });
        let table = self.color.as_ref().and_then(|color| color.table.as_ref()).map(|table| {
            let (n, colors) = table.nodes();
            let nodes: Vec<f32> = colors.iter().flat_map(|[r, g, b]| [*r, *g, *b, 1.0]).collect();
            floats(NumberFormat::Rgba32Float, [n, n * n], &nodes)
        });
        [bend, shares, table]
    }
}

/// The content of each pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Bend {
    /// The same pixel of the picture.
    #[default]
    None,
    /// The place of the picture that appears there, in pixels, centers at whole numbers; `None` stays
    /// black.
    Warp(Vec<Option<[f32; 2]>>),
    /// A point (`x y z 1`) or a direction (`x y z 0`) in the cave; `w = -1` stays black.
    Surface(Vec<[f32; 4]>),
}

/// A cube of pictures around an eye, the source of pictures on curved screens.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Around {
    /// The eye, cave axes, m.
    pub eye: [f32; 3],
    /// Pixels of 90 degrees, and beyond each edge of a face.
    pub side_px: u32,
    pub border_px: u32,
}

/// How an eye's picture is placed in the whole.
pub(crate) struct Placed {
    /// Size of the whole, pixels.
    pub whole_px: [u32; 2],
    /// Top left corner in the whole.
    pub at_px: [u32; 2],
    /// If set, the whole is first cleared to this color.
    pub begin: Option<[u8; 4]>,
    pub flip: Flip,
    /// Which of red, green and blue are written.
    pub channels: [bool; 3],
    /// Which pixels are written.
    pub parity: Parity,
    pub finish: Option<Arc<Finish>>,
}

impl Placed {
    /// Returns whether the picture only changes its place.
    fn is_plain(&self) -> bool {
        let everything = self.channels == [true; 3] && self.parity == Parity::default();
        self.finish.is_none() && self.flip == Flip::None && everything
    }
}

/// The pass, its pictures and its textures.
pub(crate) struct Finisher {
    layout: BindGroupLayout,
    /// All colors; red; green and blue. Made when they are first needed.
    pipelines: OnceLock<[RenderPipeline; 3]>,
    /// The same from a cube of pictures.
    surfaces: OnceLock<[RenderPipeline; 3]>,
    nothing: [TextureView; TEXTURES],
    known: Vec<(Arc<Finish>, [TextureView; TEXTURES])>,
    whole: Option<Texture>,
    /// The faces of a cube of pictures.
    faces: Option<Texture>,
}

const CHANNELS: [[bool; 3]; 3] = [[true; 3], [true, false, false], [false, true, true]];

impl Finisher {
    pub fn new(gpu: &Gpu) -> Self {
        let device = &gpu.device;
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let numbers = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let place = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let entries = [entry(0, place), entry(1, numbers), entry(2, numbers), entry(3, numbers), entry(4, numbers)];
        let layout = device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("finish"), entries: &entries });
        // no warp, a mask that keeps all light, no table
        let nothing = [
            upload(gpu, [1, 1], TextureFormat::Rg32Float, &[0; 8]),
            upload(gpu, [1, 1], TextureFormat::Rgba8Unorm, &[255; 4]),
            upload(gpu, [1, 1], TextureFormat::Rgba8Unorm, &[0; 4]),
        ];
        let (pipelines, surfaces) = Default::default();
        Finisher { layout, pipelines, surfaces, nothing, known: Vec::new(), whole: None, faces: None }
    }

    /// Returns the pipelines that place pictures, or take them from a cube of pictures.
    fn pipelines(&self, gpu: &Gpu, around: bool) -> &[RenderPipeline; 3] {
        let (kept, entry_point) = if around { (&self.surfaces, "fs_surface") } else { (&self.pipelines, "fs_place") };
        kept.get_or_init(|| {
            let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some("finish"),
                source: wgpu::ShaderSource::Wgsl(FINISH_WGSL.into()),
            });
            CHANNELS.map(|channels| pipeline(&gpu.device, &self.layout, &module, entry_point, channels))
        })
    }

    /// Copies the middle of a picture, without `rim` pixels on each side.
    pub fn cut(&mut self, gpu: &Gpu, from: &Texture, rim: u32) -> Texture {
        let size = [from.width() - 2 * rim, from.height() - 2 * rim];
        let whole = self.whole(gpu, size);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("cut") });
        copy(&mut encoder, from, rim, size, &whole, [0, 0]);
        gpu.record(encoder.finish());
        whole
    }

    /// Places a picture and returns the whole: the picture itself if that is all of it.
    pub fn place(
        &mut self,
        gpu: &Gpu,
        from: &Drawn,
        rim: u32,
        size: [u32; 2],
        placed: &Placed,
    ) -> Result<Texture, RenderError> {
        let plain = placed.is_plain();
        let covers = plain && (placed.at_px, size) == ([0, 0], placed.whole_px);
        if covers && rim == 0 {
            return Ok(from.texture.clone());
        }
        let whole = self.whole(gpu, placed.whole_px);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("finish") });
        if placed.begin.is_some() && !covers || !plain {
            self.pass(gpu, &mut encoder, (&from.view, &whole), (rim, size, placed), None)?;
        }
        if plain {
            copy(&mut encoder, &from.texture, rim, size, &whole, placed.at_px);
        }
        gpu.record(encoder.finish());
        Ok(whole)
    }

    /// Copies a picture, without its rim, to a face of the cube of pictures, which
    /// has this size.
    pub fn place_face(&mut self, gpu: &Gpu, from: &Drawn, rim: u32, side: u32, [whole, at]: [[u32; 2]; 2]) {
        let faces = match &self.faces {
            Some(faces) if [faces.width(), faces.height()] == whole => faces,
            _ => self.faces.insert(finished_texture(&gpu.device, "faces", whole[0], whole[1])),
        };
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("face") });
        copy(&mut encoder, &from.texture, rim, [side; 2], faces, at);
        gpu.record(encoder.finish());
    }

    /// Places a picture on a curved screen, taken from the faces, and returns the whole.
    pub fn place_surface(
        &mut self,
        gpu: &Gpu,
        around: Around,
        size: [u32; 2],
        placed: &Placed,
    ) -> Result<Texture, RenderError> {
        let whole = self.whole(gpu, placed.whole_px);
        let faces = self.faces.as_ref().ok_or_else(|| gpu.failed("no face was drawn yet".into()))?;
        let faces = faces.create_view(&TextureViewDescriptor::default());
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("finish") });
        self.pass(gpu, &mut encoder, (&faces, &whole), (0, size, placed), Some(around))?;
        gpu.record(encoder.finish());
        Ok(whole)
    }

    /// Records the pass that clears the whole if asked for, and draws unless the picture is copied.
    fn pass(
        &mut self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (from, whole): (&TextureView, &Texture),
        (rim, size, placed): (u32, [u32; 2], &Placed),
        around: Option<Around>,
    ) -> Result<(), RenderError> {
        let target = whole.create_view(&TextureViewDescriptor::default());
        let plain = around.is_none() && placed.is_plain();
        let load = placed.begin.map_or(wgpu::LoadOp::Load, |color| wgpu::LoadOp::Clear(linear_color(color)));
        let uniform = uniform_buffer(gpu, &place_floats(rim, size, placed, around), "place")?;
        let views = self.views(gpu, placed.finish.as_ref());
        let entries = [
            uniform.as_entire_binding(),
            BindingResource::TextureView(from),
            BindingResource::TextureView(&views[0]),
            BindingResource::TextureView(&views[1]),
            BindingResource::TextureView(&views[2]),
        ];
        let inputs = bind(gpu, &self.layout, &entries);
        let attachment = wgpu::RenderPassColorAttachment {
            view: &target,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("finish"),
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        if !plain {
            let which = CHANNELS.iter().position(|c| *c == placed.channels).unwrap_or(0);
            pass.set_pipeline(&self.pipelines(gpu, around.is_some())[which]);
            pass.set_bind_group(0, &inputs, &[]);
            pass.set_scissor_rect(placed.at_px[0], placed.at_px[1], size[0], size[1]);
            pass.draw(0..3, 0..1);
        }
        Ok(())
    }

    /// The texture of finished pictures of this size; its content persists between calls.
    fn whole(&mut self, gpu: &Gpu, [width, height]: [u32; 2]) -> Texture {
        match &self.whole {
            Some(whole) if (whole.width(), whole.height()) == (width, height) => whole.clone(),
            _ => self.whole.insert(finished_texture(&gpu.device, "finished", width, height)).clone(),
        }
    }

    fn views(&mut self, gpu: &Gpu, finish: Option<&Arc<Finish>>) -> [TextureView; TEXTURES] {
        let Some(finish) = finish else { return self.nothing.clone() };
        if let Some((_, views)) = self.known.iter().find(|(known, _)| Arc::ptr_eq(known, finish)) {
            return views.clone();
        }
        let mut views = self.nothing.clone();
        for (view, numbers) in views.iter_mut().zip(finish.textures()) {
            let Some(PortableNumbers { size_px, format, bytes }) = numbers else { continue };
            let format = match format {
                NumberFormat::Rg32Float => TextureFormat::Rg32Float,
                NumberFormat::Rgba16Float => TextureFormat::Rgba16Float,
                NumberFormat::Rgba32Float => TextureFormat::Rgba32Float,
            };
            *view = upload(gpu, size_px, format, &bytes);
        }
        if self.known.len() >= MAX_KEPT {
            self.known.remove(0);
        }
        self.known.push((finish.clone(), views.clone()));
        views
    }
}

/// Returns a number from 0 to 1 as a float of 16 bits.
fn half(x: f32) -> u16 {
    let x = x.clamp(0.0, 1.0);
    if x < 6.103_515_6e-5 {
        // no leading one, in units of 2^-24
        return (x * 16_777_216.0).round() as u16;
    }
    // exponents are biased by 127 and by 15; 13 bits of the mantissa are rounded off
    (((x.to_bits() + 0x1000) >> 13) - (112 << 10)) as u16
}

/// The uniform of the shader.
pub(crate) fn place_floats(rim: u32, [w, h]: [u32; 2], placed: &Placed, around: Option<Around>) -> [f32; 24] {
    let flag = |on: bool| f32::from(u8::from(on));
    let across = flag(matches!(placed.flip, Flip::Horizontal | Flip::Both));
    let upward = flag(matches!(placed.flip, Flip::Vertical | Flip::Both));
    let (finish, parity) = (placed.finish.as_deref(), placed.parity);
    let warped = flag(finish.is_some_and(|f| matches!(f.bend, Bend::Warp(_))));
    let ([x, y, z], side, border) = around.map_or(([0.0; 3], 0, 0), |a| (a.eye, a.side_px, a.border_px));
    let color = finish.and_then(|f| f.color.as_ref());
    let ([r, g, b], [lr, lg, lb]) = color.map_or(([1.0; 3], [0.0; 3]), |c| (c.gain, c.lift));
    let inverse_gamma = color.map_or(0.0, |c| c.inverse_gamma);
    let nodes = color.and_then(|c| c.table.as_ref()).map_or(0, |table| table.nodes().0);
    #[rustfmt::skip]
    let floats = [
        placed.at_px[0] as f32, placed.at_px[1] as f32, across, upward,
        w as f32, h as f32, rim as f32, warped,
        x, y, z, side as f32,
        border as f32, parity.across as f32, parity.down as f32, parity.phase as f32,
        r, g, b, inverse_gamma,
        lr, lg, lb, nodes as f32,
    ];
    floats
}

/// Converts a color of bytes for clearing an sRGB texture.
fn linear_color([r, g, b, a]: [u8; 4]) -> wgpu::Color {
    let linear = |c: u8| f64::from(crate::material::linear(f32::from(c) / 255.0));
    wgpu::Color { r: linear(r), g: linear(g), b: linear(b), a: f64::from(a) / 255.0 }
}

/// Copies the middle of a picture to a place in another; pixels outside are cut off.
fn copy(
    encoder: &mut wgpu::CommandEncoder,
    from: &Texture,
    rim: u32,
    [w, h]: [u32; 2],
    into: &Texture,
    [x, y]: [u32; 2],
) {
    let size = wgpu::Extent3d {
        width: w.min(into.width().saturating_sub(x)),
        height: h.min(into.height().saturating_sub(y)),
        depth_or_array_layers: 1,
    };
    let source = wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x: rim, y: rim, z: 0 }, ..from.as_image_copy() };
    let target = wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x, y, z: 0 }, ..into.as_image_copy() };
    encoder.copy_texture_to_texture(source, target, size);
}

/// Creates a texture with these bytes.
pub(super) fn upload(gpu: &Gpu, [width, height]: [u32; 2], format: TextureFormat, bytes: &[u8]) -> TextureView {
    let descriptor = wgpu::TextureDescriptor {
        label: Some("finish"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    gpu.device
        .create_texture_with_data(&gpu.queue, &descriptor, TextureDataOrder::LayerMajor, bytes)
        .create_view(&TextureViewDescriptor::default())
}

fn pipeline(
    device: &wgpu::Device,
    layout: &BindGroupLayout,
    module: &wgpu::ShaderModule,
    entry_point: &str,
    [red, green, blue]: [bool; 3],
) -> RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("finish"),
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let mut write_mask = ColorWrites::empty();
    write_mask.set(ColorWrites::RED, red);
    write_mask.set(ColorWrites::GREEN, green);
    write_mask.set(ColorWrites::BLUE, blue);
    write_mask.set(ColorWrites::ALPHA, red && green && blue);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("finish"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some("vs_place"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState { format: COLOR, blend: None, write_mask })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
